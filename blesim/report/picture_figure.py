"""A picture of an experiment, drawn."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from blesim.report.colours import COLOURS, TRUTH
from blesim.report.printable import printable
from blesim.report.venue_drawing import draw_beacons, draw_level
from blesim.reruns.base import Picture


def draw(picture: Picture) -> Figure:
    """A figure of one picture."""
    figure = Figure(figsize=_size_in(picture), layout="constrained")
    axes = figure.subplots()
    if picture.venue is not None:
        draw_level(axes, picture.venue, picture.venue.floor_plan.levels[0])
        draw_beacons(axes, picture.venue)
    _draw_curves(axes, picture)
    axes.set_title(printable(picture.title), loc="left", parse_math=False)
    axes.set_xlabel(picture.x_label)
    axes.set_ylabel(picture.y_label)
    if picture.x_names:
        axes.set_xticks(picture.curves[0].x, picture.x_names)
    axes.spines[["top", "right"]].set_visible(False)
    if len(picture.curves) > 1 or picture.curves[0].label:
        legend = figure.legend(
            *axes.get_legend_handles_labels(),
            loc="outside lower center",
            ncols=3,
            frameon=False,
            fontsize="small",
        )
        for text in legend.get_texts():
            text.set_parse_math(False)
    return figure


def _size_in(picture: Picture) -> tuple[float, float]:
    """Of the figure; a map is as high as what it shows. [inch]."""
    if picture.kind != "map":
        return 7.0, 4.4
    shown = [np.concatenate([getattr(curve, axis) for curve in picture.curves]) for axis in "xy"]
    if picture.venue is not None:
        west, south, east, north = picture.venue.floor_plan.levels[0].bounds.bounds
        shown = [np.append(shown[0], [west, east]), np.append(shown[1], [south, north])]
    wide_m, high_m = (float(np.nanmax(each) - np.nanmin(each)) for each in shown)
    # Whatever the shape, with room for the title, the axis and the legend.
    scale = min(9.0 / wide_m, 5.5 / high_m)
    return max(scale * wide_m + 1.0, 7.0), scale * high_m + 1.5


def _draw_curves(axes: Axes, picture: Picture) -> None:
    count = len(picture.curves)
    colours = _colours(picture)
    for number, (curve, colour) in enumerate(zip(picture.curves, colours, strict=True)):
        label = printable(curve.label)
        if picture.kind == "step":
            axes.step(curve.x, curve.y, where="post", color=colour, linewidth=1.6, label=label)
        elif picture.kind == "bars":
            width = _bar_width(curve.x) / count
            offset = (number - (count - 1) / 2) * width
            bars = axes.bar(curve.x + offset, curve.y, width, color=colour, label=label)
            if curve.published:
                for bar in bars:
                    bar.set(facecolor="none", edgecolor=colour, linewidth=1.2)
        elif picture.kind == "map" and number == 0:
            axes.plot(curve.x, curve.y, color=TRUTH, linewidth=2.0, label=label, zorder=5)
        else:
            style = "--" if curve.published else "-"
            style = f"o{style}" if len(curve.x) <= 30 and picture.kind == "line" else style
            axes.plot(
                curve.x, curve.y, style, color=colour, linewidth=1.3, markersize=4, label=label
            )


def _colours(picture: Picture) -> list[str]:
    """Of each curve; published numbers have that of ours before them."""
    ours = np.cumsum([not curve.published for curve in picture.curves]) - 1
    return [COLOURS[max(row, 0) % len(COLOURS)] for row in ours.tolist()]


def _bar_width(x: np.ndarray) -> float:
    return 0.85 * float(np.min(np.diff(x))) if len(x) > 1 else 0.85
