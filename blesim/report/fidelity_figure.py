"""The picture of a recording and its twin: the same curve from both, panel by panel."""

from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from blesim.fidelity.comparison import Comparison, Panel
from blesim.fidelity.scorecard import inside_count
from blesim.report.colours import COLOURS

_COLUMNS = 3
_REAL, _SIMULATED = "#222222", COLOURS[1]
# Beyond these shares a few odd readings would stretch the axis.
_SHOWN = (0.002, 0.998)


def draw_comparison(comparison: Comparison) -> Figure:
    """A figure of all panels of a comparison.

    Parameters
    ----------
    comparison : Comparison
        Of a recording and its twin.

    Returns
    -------
    matplotlib.figure.Figure
    """
    rows = ceil(len(comparison.panels) / _COLUMNS)
    figure = Figure(figsize=(4.3 * _COLUMNS, 3.3 * rows + 0.7), layout="constrained")
    inside, total = inside_count(comparison.scores), len(comparison.scores)
    figure.suptitle(f"{comparison.title}: {inside} of {total} statistics inside", fontsize=12)
    places = figure.subplots(rows, _COLUMNS, squeeze=False).reshape(-1)
    for axes, panel in zip(places, comparison.panels, strict=False):
        _draw_panel(axes, panel)
    for axes in places[len(comparison.panels) :]:
        axes.set_axis_off()
    places[0].legend(loc="lower right", frameon=False, fontsize=9)
    return figure


def _draw_panel(axes: Axes, panel: Panel) -> None:
    if panel.kind == "curve":
        axes.axhline(0.0, color="#cccccc", linewidth=0.8)
    for side, colour, label, width in (
        (panel.real, _REAL, "recorded", 2.4),
        (panel.simulated, _SIMULATED, "simulated", 1.6),
    ):
        if panel.kind == "distribution":
            _draw_distribution(axes, side, colour, label, width)
        else:
            axes.plot(
                side[0], side[1], "o-", color=colour, linewidth=width, markersize=3.5, label=label
            )
    axes.set_title(panel.title, loc="left", fontsize=10)
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    axes.spines[["top", "right"]].set_visible(False)


def _draw_distribution(
    axes: Axes, samples: NDArray[np.float64], colour: str, label: str, width: float
) -> None:
    if not len(samples):
        return
    ordered = np.sort(samples)
    share = np.arange(1, len(ordered) + 1) / len(ordered)
    shown = (share >= _SHOWN[0]) & (share - 1.0 / len(ordered) <= _SHOWN[1])
    axes.step(
        ordered[shown], share[shown], where="post", color=colour, linewidth=width, label=label
    )
    axes.set_ylim(0.0, 1.005)
