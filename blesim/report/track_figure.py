"""The picture of a scored recording: tracks over the floor plan, error distributions beside it."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.patches import Patch
from numpy.typing import NDArray

from blesim.report.colours import COLOURS, SHELF, TRUTH
from blesim.report.printable import printable
from blesim.report.venue_drawing import draw_beacons, draw_level
from blesim.tables import Track, Trajectory
from blesim.venue.venue import Venue

_ERROR_SHARE = 0.99
# More tracks than this are drawn with smaller dots.
_FEW = 3
_STYLES = (("-", "."), ("--", "x"), (":", "+"), ("-.", "1"))


def draw_tracks(
    venue: Venue,
    walk: str,
    trajectory: Trajectory,
    tracks: Mapping[str, Track],
    errors_m: Mapping[str, NDArray[np.float64]],
) -> Figure:
    """A figure of one walk over the floor plan, and the error distribution of each estimator.

    Parameters
    ----------
    venue : Venue
        As built.
    walk : str
        Name of the walk that is drawn.
    trajectory : Trajectory
        Its truth.
    tracks : mapping of str to Track
        Estimates of that walk by estimator.
    errors_m : mapping of str to ndarray of float64, (n,)
        Position errors over all walks by estimator. [m]

    Returns
    -------
    matplotlib.figure.Figure
    """
    west, south, east, north = venue.floor_plan.levels[0].bounds.bounds
    map_width = float(np.clip(4.6 * (east - west) / (north - south), 5.0, 11.0))
    figure = Figure(figsize=(map_width + 4.6, 5.2), layout="constrained")
    plan, distribution = figure.subplots(1, 2, width_ratios=(map_width, 4.4))
    draw_level(plan, venue, venue.floor_plan.levels[0])
    draw_beacons(plan, venue)
    _draw_walk(plan, trajectory, tracks, shelves=bool(venue.floor_plan.obstacles))
    plan.set_title(printable(f"{venue.name}: {walk}"), loc="left", parse_math=False)
    _draw_errors(distribution, errors_m)
    return figure


def _draw_walk(
    axes: Axes, trajectory: Trajectory, tracks: Mapping[str, Track], *, shelves: bool
) -> None:
    axes.plot(trajectory.x_m, trajectory.y_m, color=TRUTH, linewidth=2.2, zorder=3)
    axes.plot(trajectory.x_m[0], trajectory.y_m[0], "o", color=TRUTH, markersize=7, zorder=6)
    labels = [
        *([Patch(facecolor=SHELF, label="shelf")] if shelves else []),
        *axes.plot([], [], "^", color=COLOURS[2], linestyle="none", label="beacon"),
        *axes.plot([], [], "o-", color=TRUTH, linewidth=2.2, label="true track, dot at the start"),
    ]
    size = 6.0 if len(tracks) <= _FEW else 3.0
    for look, (label, track) in zip(_looks(len(tracks)), tracks.items(), strict=True):
        poses = trajectory.at(track.time_us)
        estimates = np.stack([track.x_m, track.y_m], axis=1)
        ends = np.stack([np.stack([poses.x_m, poses.y_m], axis=1), estimates], axis=1)
        axes.add_collection(
            LineCollection(list(ends), colors=look.colour, linewidths=0.4, alpha=0.35)
        )
        labels += axes.plot(
            *estimates.T,
            look.marker,
            markersize=size,
            color=look.colour,
            zorder=5,
            label=f"estimates: {printable(label)}",
        )
    legend = axes.legend(
        handles=labels,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.16),
        ncols=2 if len(labels) > 3 else 3,
        frameon=False,
        fontsize=9,
    )
    _take_literally(legend)


def _draw_errors(axes: Axes, errors_m: Mapping[str, NDArray[np.float64]]) -> None:
    widest_m = 1.0
    for look, (label, errors) in zip(_looks(len(errors_m)), errors_m.items(), strict=True):
        ordered = np.sort(errors)
        share = np.arange(1, len(ordered) + 1) / max(len(ordered), 1)
        (line,) = axes.step(ordered, share, where="post", color=look.colour, linewidth=1.8)
        line.set(linestyle=look.line, label=printable(label))
        if len(ordered):
            widest_m = max(widest_m, float(np.quantile(ordered, _ERROR_SHARE)))
    for level, name in ((0.5, "50 %"), (0.9, "90 %")):
        axes.axhline(level, color="#bbbbbb", linewidth=0.8, linestyle=":")
        axes.annotate(name, (widest_m, level), ha="right", va="bottom", fontsize=8, color="#777777")
    axes.set_xlim(0, widest_m)
    axes.set_ylim(0, 1.005)
    axes.set_xlabel("position error [m]")
    axes.set_ylabel("share of readings with a smaller error [-]")
    axes.set_title("all walks", loc="left")
    axes.spines[["top", "right"]].set_visible(False)
    _take_literally(axes.legend(loc="lower right", frameon=False, fontsize=9))


def _take_literally(legend: Legend) -> None:
    """Let a dollar sign in a name be one, not the beginning of a formula."""
    for text in legend.get_texts():
        text.set_parse_math(False)


class _Look(NamedTuple):
    """How one of several estimators is drawn."""

    colour: str
    line: str
    marker: str


def _looks(count: int) -> list[_Look]:
    """Looks of so many estimators: another line and marker each time the colours begin anew."""
    looks = [_Look(colour, *style) for style in _STYLES for colour in COLOURS]
    return [looks[number % len(looks)] for number in range(count)]
