"""Where the parts of a figure lie, in inches: floor plans to one scale, a chart above or beside."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# As large as a plan gets. [inch]
_WIDEST, _HIGHEST = 10.0, 6.4
# Plans wider than this have the chart above, others have it beside. [inch]
_STACKED_FROM = 6.5
_LEFT, _RIGHT, _BOTTOM, _TOP = 0.75, 0.3, 0.6, 0.85
_BETWEEN, _ABOVE = 0.8, 1.0
_BAR_GAP, _BAR, _BAR_ROOM, _BAR_HEIGHT = 0.18, 0.16, 1.15, 1.9
_CHART_WIDTH, _CHART_HEIGHT = 5.6, 2.4
_NARROWEST, _LOWEST = 6.0, 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A rectangle on the page. [inch]."""

    left: float
    bottom: float
    width: float
    height: float

    def axes(self, figure: Figure) -> Axes:
        """New axes that fill the box."""
        width, height = figure.get_size_inches()
        return figure.add_axes(
            (self.left / width, self.bottom / height, self.width / width, self.height / height)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """Boxes of a figure: plans from left to right, a colour bar beside the last, a chart.

    Attributes
    ----------
    width, height : float
        Of the whole figure. [inch]
    plans : tuple of Box
        One for each plan, all to the same scale.
    bar : Box
        Colour bar.
    chart : Box or None
        Chart, if one is wanted.
    """

    width: float
    height: float
    plans: tuple[Box, ...]
    bar: Box
    chart: Box | None

    def figure(self) -> Figure:
        """An empty figure of that size."""
        return Figure(figsize=(self.width, self.height))


def page_of(sizes_m: Sequence[tuple[float, float]], *, with_chart: bool) -> Page:
    """A page for plans of some widths and heights, whatever their shape.

    Parameters
    ----------
    sizes_m : sequence of tuple of float
        Width and height of each plan; at least one. [m]
    with_chart : bool
        Whether there is a chart above or beside them.

    Returns
    -------
    Page
    """
    widths_m, heights_m = np.array(sizes_m, np.float64).T
    scale = min(_WIDEST / widths_m.sum(), _HIGHEST / heights_m.max())
    plans = _side_by_side(widths_m * scale, heights_m * scale)
    end = plans[-1].left + plans[-1].width
    # Beside a low plan the label of the bar needs more height than the plan.
    bar_height = max(plans[-1].height, _BAR_HEIGHT)
    bar = Box(left=end + _BAR_GAP, bottom=_BOTTOM, width=_BAR, height=bar_height)
    tallest = max(bar_height, *(plan.height for plan in plans))
    right, top = end + _BAR_ROOM, _BOTTOM + tallest
    chart = _chart(right, tallest) if with_chart else None
    if chart is not None:
        right, top = max(right, chart.left + chart.width), max(top, chart.bottom + chart.height)
    return Page(
        width=max(right + _RIGHT, _NARROWEST), height=top + _TOP, plans=plans, bar=bar, chart=chart
    )


def _side_by_side(widths: Sequence[float], heights: Sequence[float]) -> tuple[Box, ...]:
    boxes, left = [], _LEFT
    for width, height in zip(widths, heights, strict=True):
        boxes.append(Box(left=left, bottom=_BOTTOM, width=float(width), height=float(height)))
        left += float(width) + _BETWEEN
    return tuple(boxes)


def _chart(plans_end: float, tallest: float) -> Box:
    """Chart above plans that are wide, beside plans that are narrow."""
    if plans_end - _LEFT - _BAR_ROOM > _STACKED_FROM:
        bottom = _BOTTOM + tallest + _ABOVE
        return Box(left=_LEFT, bottom=bottom, width=plans_end - _LEFT, height=_CHART_HEIGHT)
    height = max(tallest, _LOWEST)
    return Box(left=plans_end + _LEFT, bottom=_BOTTOM, width=_CHART_WIDTH, height=height)
