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
    wide = picture.kind == "map"
    figure = Figure(figsize=(10.0, 6.0) if wide else (7.0, 4.4), layout="constrained")
    axes = figure.subplots()
    if picture.venue is not None:
        draw_level(axes, picture.venue, picture.venue.floor_plan.levels[0])
        draw_beacons(axes, picture.venue)
    _draw_curves(axes, picture)
    axes.set_title(printable(picture.title), loc="left", parse_math=False)
    axes.set_xlabel(picture.x_label)
    axes.set_ylabel(picture.y_label)
    axes.spines[["top", "right"]].set_visible(False)
    if len(picture.curves) > 1 or picture.curves[0].label:
        legend = figure.legend(
            *axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False
        )
        for text in legend.get_texts():
            text.set_parse_math(False)
    return figure


def _draw_curves(axes: Axes, picture: Picture) -> None:
    count = len(picture.curves)
    for number, curve in enumerate(picture.curves):
        colour = COLOURS[number % len(COLOURS)]
        label = printable(curve.label)
        if picture.kind == "step":
            axes.step(curve.x, curve.y, where="post", color=colour, linewidth=1.6, label=label)
        elif picture.kind == "bars":
            width = _bar_width(curve.x) / count
            offset = (number - (count - 1) / 2) * width
            axes.bar(curve.x + offset, curve.y, width=width, color=colour, label=label)
        elif picture.kind == "map" and number == 0:
            axes.plot(curve.x, curve.y, color=TRUTH, linewidth=2.0, label=label, zorder=5)
        else:
            style = "o-" if len(curve.x) <= 30 and picture.kind == "line" else "-"
            axes.plot(
                curve.x, curve.y, style, color=colour, linewidth=1.3, markersize=4, label=label
            )


def _bar_width(x: np.ndarray) -> float:
    return 0.85 * float(np.min(np.diff(x))) if len(x) > 1 else 0.85
