"""The picture of a day: how full the venue was, and where in it people spent their time."""

from collections.abc import Collection, Iterable, Mapping

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from blesim.columns import NO_EDGE
from blesim.metrics.presence import most_present, occupancy, presence_h
from blesim.recording import Crowd, Person, Role
from blesim.report.colours import COLOURS
from blesim.report.page_layout import Page, page_of
from blesim.report.venue_drawing import draw_level
from blesim.settings import shortened
from blesim.tables import Trajectory
from blesim.venue.floor_plan import Level
from blesim.venue.section_places import SectionPlaces
from blesim.venue.venue import Venue

# From the bottom of the chart to its top.
_ROLES = (
    (Role.STAFF, "staff", COLOURS[4]),
    (Role.TESTER, "testers", COLOURS[3]),
    (Role.SHOPPER, "shoppers", COLOURS[0]),
)
# From hardly more than the floor to dark; told apart by people with any colour vision (Brewer and
# Harrower, colorbrewer2.org).
_HEAT = "YlGnBu"
# Strips leave a rim of floor along the shelves, and are neither hair-thin nor squares.
_STRIP_SHARE, _STRIP_M = 0.8, (0.2, 1.5)
_STEPS = 720
_US_PER_HOUR = 3.6e9


def draw_day(venue: Venue, crowd: Crowd) -> Figure:
    """A figure of the number of people over the day, and of presence by section.

    Parameters
    ----------
    venue : Venue
        As built.
    crowd : Crowd
        Everybody who was there.

    Returns
    -------
    matplotlib.figure.Figure
        One floor plan for each level that has sections or people.
    """
    figure, plans = _drawn_plans(venue, crowd, with_chart=True)
    title = "presence by section" if _shows_presence(venue, crowd) else "floor plan"
    plans[0].set_title(title if venue.sections else "floor plan, without sections", loc="left")
    return figure


def draw_walks(venue: Venue, walks: Mapping[str, Trajectory]) -> Figure:
    """A figure of recorded walks over the floor plan, and of presence by section.

    Walks that tell no edge, such as surveys, are drawn, but not counted; the title says so.

    Parameters
    ----------
    venue : Venue
        As built.
    walks : mapping of str to Trajectory
        Truth of each walk by its name.

    Returns
    -------
    matplotlib.figure.Figure
        One floor plan for each level that has sections or walks.
    """
    people = [Person(name=name, role=Role.TESTER, trajectory=way) for name, way in walks.items()]
    figure, plans = _drawn_plans(venue, Crowd(people=tuple(people)), with_chart=False)
    for axes, level in zip(plans, _levels(venue, walks.values()), strict=True):
        _draw_ways(axes, walks.values(), level)
    plans[0].set_title(_walks_title(venue, walks.values()), loc="left")
    return figure


def _walks_title(venue: Venue, walked: Collection[Trajectory]) -> str:
    title = f"{len(walked)} recorded walks" if len(walked) != 1 else "1 recorded walk"
    counted = sum(_tells_edges(way) for way in walked)
    if not venue.sections or not counted:
        return title
    of_some = f" of the {counted} on aisles" if counted < len(walked) else ""
    return f"{title} and presence by section{of_some}"


def _shows_presence(venue: Venue, crowd: Crowd) -> bool:
    """Whether presence can be told: there are sections, and not all people are off the aisles."""
    ways = [person.trajectory for person in crowd.people]
    return bool(venue.sections) and (not ways or any(map(_tells_edges, ways)))


def _tells_edges(way: Trajectory) -> bool:
    return bool(np.any(way.edge != NO_EDGE))


def _drawn_plans(venue: Venue, crowd: Crowd, *, with_chart: bool) -> tuple[Figure, list[Axes]]:
    """A figure with its plans, heat map and, if wanted, chart; and the axes of the plans."""
    levels = _levels(venue, [person.trajectory for person in crowd.people])
    page = page_of([_size_m(level) for level in levels], with_chart=with_chart)
    figure = page.figure()
    figure.text(
        page.plans[0].left / page.width,
        1 - 0.32 / page.height,
        shortened(venue.name),
        fontsize=13,
        va="center",
        parse_math=False,
    )
    if page.chart is not None:
        _draw_occupancy(page.chart.axes(figure), crowd)
    plans = [box.axes(figure) for box in page.plans]
    for axes, level in zip(plans, levels, strict=True):
        draw_level(axes, venue, level)
        axes.margins(0.01)
        if len(levels) > 1:
            axes.set_title(f"level {level.level}", loc="right", fontsize=9)
    _draw_heat(figure, page, plans, levels, venue, crowd)
    return figure, plans


def _levels(venue: Venue, walked: Iterable[Trajectory]) -> list[Level]:
    """Levels that have something to draw; the first of the plan if none has."""
    used = {section.level for section in venue.sections}
    used |= {int(level) for way in walked for level in np.unique(way.level)}
    levels = [level for level in venue.floor_plan.levels if level.level in used]
    return levels or [venue.floor_plan.levels[0]]


def _size_m(level: Level) -> tuple[float, float]:
    west, south, east, north = level.bounds.bounds
    return east - west, north - south


def _draw_occupancy(axes: Axes, crowd: Crowd) -> None:
    curve = occupancy(crowd, _step_s(crowd))
    shown = [row for row in _ROLES if row[0] in curve.inside]
    if shown:
        axes.stackplot(
            curve.time_us / _US_PER_HOUR,
            *(curve.inside[role] for role, _, _ in shown),
            step="post",
            colors=[colour for _, _, colour in shown],
            labels=[f"{name} ({_count(crowd, role)})" for role, name, colour in shown],
            linewidth=0,
        )
        axes.legend(loc="upper left", ncols=3, frameon=False, fontsize=9, reverse=True)
        first_us, last_us = min(curve.time_us[0], 0), curve.time_us[-1]
        axes.set_xlim(first_us / _US_PER_HOUR, last_us / _US_PER_HOUR)
    most, _ = most_present(crowd)
    axes.set_title(f"at most {most} people at once", loc="left")
    axes.set_xlabel("time since opening [h]")
    axes.set_ylabel("people in the venue")
    # Room for the legend above the highest curve.
    axes.set_ylim(0, 1.18 * max(most, 1))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    axes.spines[["top", "right"]].set_visible(False)


def _step_s(crowd: Crowd) -> float:
    """A step that shows the curve in full: a minute for a day. [s]."""
    times_us = [way.time_us[[0, -1]] for person in crowd.people if len(way := person.trajectory)]
    span_us = float(np.ptp(times_us)) if times_us else 0.0
    return max(1.0, round(span_us * 1e-6 / _STEPS))


def _count(crowd: Crowd, role: Role) -> int:
    return sum(person.role == role for person in crowd.people)


def _draw_heat(
    figure: Figure,
    page: Page,
    plans: list[Axes],
    levels: list[Level],
    venue: Venue,
    crowd: Crowd,
) -> None:
    """Draw each section as a strip along its aisle in the colour of its presence."""
    if venue.graph is None or not _shows_presence(venue, crowd):
        return
    spent_h = presence_h(crowd, venue)
    places = SectionPlaces.of(venue.graph, venue.sections)
    unit, per_hour = ("person-hours", 1.0) if spent_h.max() >= 1.0 else ("person-minutes", 60.0)
    shown = spent_h * per_hour
    shades = ScalarMappable(Normalize(0.0, float(shown.max()) or 1.0), _HEAT)
    for axes, level in zip(plans, levels, strict=True):
        here = np.flatnonzero(venue.graph.level[places.edge] == level.level)
        strips = PolyCollection(
            list(_strips_m(venue.floor_plan.walkable[level.level], places, here)),
            facecolors=shades.to_rgba(shown[places.section[here]]),
            edgecolors="#cccccc",
            linewidths=0.3,
            zorder=2,
        )
        axes.add_collection(strips)
    bar = figure.colorbar(shades, cax=page.bar.axes(figure))
    bar.set_label(f"presence [{unit}]")
    bar.outline.set_visible(False)


def _strips_m(
    walkable: BaseGeometry, places: SectionPlaces, rows: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Corners of the strip of each of n stretches of sections, (n, 4, 2). [m]."""
    edge = places.edge[rows]
    start = places.graph.xy_m(edge, places.start_m[rows])
    end = places.graph.xy_m(edge, places.end_m[rows])
    lines = shapely.linestrings(np.stack([start, end], axis=1))
    clearance_m = shapely.distance(lines, walkable.boundary)
    half_m = np.clip(_STRIP_SHARE * clearance_m, *_STRIP_M)[:, None]
    across = half_m * places.graph.direction[edge][:, ::-1] * (-1.0, 1.0)
    return np.stack([start - across, end - across, end + across, start + across], axis=1)


def _draw_ways(axes: Axes, walked: Iterable[Trajectory], level: Level) -> None:
    """Draw the ways of walks on one level, and a dot where somebody stayed in one place."""
    for way in walked:
        here = way.level == level.level
        x_m, y_m = way.x_m[here], way.y_m[here]
        if not len(x_m):
            continue
        axes.plot(x_m, y_m, color=COLOURS[1], linewidth=1.2, zorder=3)
        if np.ptp(x_m) == 0 and np.ptp(y_m) == 0:
            axes.plot(x_m[:1], y_m[:1], "o", color=COLOURS[1], markersize=3, zorder=3)
