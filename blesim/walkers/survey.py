"""A survey on the spot: a tester stands at one place after the other and looks several ways."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim import columns
from blesim.columns import NO_EDGE
from blesim.tables import Marks, Trajectory
from blesim.units import MICROSECONDS_PER_SECOND, to_us, wrap_angle
from blesim.venue.floor_plan import FloorPlan

Place = tuple[float, float] | NDArray[np.float64]

_STATE = dict(columns.STATES)
# Nobody stands with half a shoulder in a shelf.
_CLEARANCE_M = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class SpotSurvey:
    """What a tester was told to survey.

    Attributes
    ----------
    spots_m : ndarray of float64, (n, 2)
        Where to stand, in this order. [m]
    corners_m : mapping of int to ndarray of float64, (k, 2)
        Corners to go round on the way to a spot, by its row; without any the way is straight. [m]
    level : int
        Level of all of them.
    headings_rad : tuple of float
        Which ways to look at each spot. [rad]
    stand_s : float
        How long to look each way. [s]
    speed_m_s : float
        Pace from spot to spot. [m/s]
    turn_rate_rad_s : float
        How fast the tester turns. [rad/s]
    start_s : float
        When it begins. [s]
    """

    spots_m: NDArray[np.float64]
    corners_m: Mapping[int, NDArray[np.float64]] = field(default_factory=dict)
    level: int
    headings_rad: tuple[float, ...]
    stand_s: float
    speed_m_s: float
    turn_rate_rad_s: float
    start_s: float


def grid_spots_m(
    plan: FloorPlan,
    level: int,
    spacing_m: float,
    area_m: tuple[float, float, float, float] | None = None,
) -> NDArray[np.float64]:
    """Crossings of a square grid where somebody can stand, row by row and back, (n, 2). [m].

    Parameters
    ----------
    plan : FloorPlan
        Of the venue.
    level : int
        Which level.
    spacing_m : float
        Of the grid, whose first crossing is half a spacing off the corner of the level. [m]
    area_m : tuple of four float, optional
        West, south, east and north of the grid instead of the bounds of the level. [m]
    """
    free = shapely.buffer(plan.walkable[level], -_CLEARANCE_M)
    shapely.prepare(free)
    west, south, east, north = area_m or plan.bounds(level, "the survey").bounds
    columns_m = np.arange(west + spacing_m / 2, east, spacing_m)
    rows_m = np.arange(south + spacing_m / 2, north, spacing_m)
    lines = [
        np.stack([columns_m if row % 2 == 0 else columns_m[::-1], np.full_like(columns_m, y_m)], 1)
        for row, y_m in enumerate(rows_m)
    ]
    spots_m = np.round(np.concatenate([np.empty((0, 2)), *lines]), 6)
    return spots_m[shapely.covers(free, shapely.points(spots_m))]


def survey_walk(survey: SpotSurvey) -> tuple[Trajectory, Marks]:
    """The walk of a survey, and the marks its tester pressed: as each stand begins and ends.

    The marks tell the way the tester looks, from the map and a look at it.
    """
    knots: list[tuple[float, ...]] = []
    marks: list[tuple[float, ...]] = []
    now_us, heading_rad = to_us(survey.start_s), survey.headings_rad[0]
    before_m: Place = survey.spots_m[0]
    for row, (x_m, y_m) in enumerate(survey.spots_m.tolist()):
        for place_m in (*survey.corners_m.get(row, ()), (x_m, y_m)):
            now_us, heading_rad = _go(knots, now_us, (before_m, place_m), heading_rad, survey)
            before_m = place_m
        for look_rad in survey.headings_rad:
            now_us = _turn(knots, now_us, before_m, (heading_rad, look_rad), survey)
            heading_rad = look_rad
            knots.append((now_us, x_m, y_m, look_rad, 0.0, _STATE["standing"]))
            marks.append((now_us, x_m, y_m, look_rad))
            now_us += to_us(survey.stand_s)
            marks.append((now_us, x_m, y_m, look_rad))
    knots.append((now_us, *before_m, heading_rad, 0.0, _STATE["standing"]))
    return _trajectory(knots, survey.level), _marks(marks, survey.level)


def _go(
    knots: list[tuple[float, ...]],
    now_us: int,
    ends_m: tuple[Place, Place],
    heading_rad: float,
    survey: SpotSurvey,
) -> tuple[int, float]:
    """Time [us] and heading [rad] after a straight way from one place to another."""
    start_m, end_m = ends_m
    way_m = float(np.hypot(end_m[0] - start_m[0], end_m[1] - start_m[1]))
    if way_m == 0:
        return now_us, heading_rad
    along_rad = float(np.arctan2(end_m[1] - start_m[1], end_m[0] - start_m[0]))
    now_us = _turn(knots, now_us, start_m, (heading_rad, along_rad), survey)
    duration_us = max(1, to_us(way_m / survey.speed_m_s))
    speed_m_s = way_m / duration_us * MICROSECONDS_PER_SECOND
    knots.append((now_us, *start_m, along_rad, speed_m_s, _STATE["walking"]))
    return now_us + duration_us, along_rad


def _turn(
    knots: list[tuple[float, ...]],
    now_us: int,
    place_m: Place,
    headings_rad: tuple[float, float],
    survey: SpotSurvey,
) -> int:
    """Time after a turn on the spot from one heading to another. [us]."""
    old_rad, new_rad = headings_rad
    angle_rad = abs(float(wrap_angle(new_rad - old_rad)))
    if angle_rad == 0.0:
        return now_us
    knots.append((now_us, *place_m, old_rad, 0.0, _STATE["turning"]))
    return now_us + max(1, to_us(angle_rad / survey.turn_rate_rad_s))


def _trajectory(knots: list[tuple[float, ...]], level: int) -> Trajectory:
    time_us, x_m, y_m, heading_rad, speed_m_s, state = (
        np.array(column) for column in zip(*knots, strict=True)
    )
    nowhere = np.full(len(time_us), np.nan)
    return Trajectory(
        time_us=time_us,
        x_m=x_m,
        y_m=y_m,
        level=np.full(len(time_us), level),
        heading_rad=wrap_angle(heading_rad),
        speed_m_s=speed_m_s,
        edge=np.full(len(time_us), NO_EDGE),
        offset_m=nowhere,
        edge_speed_m_s=nowhere,
        state=state,
    )


def _marks(marks: list[tuple[float, ...]], level: int) -> Marks:
    time_us, x_m, y_m, heading_rad = (np.array(column) for column in zip(*marks, strict=True))
    return Marks(
        time_us=time_us,
        x_m=x_m,
        y_m=y_m,
        level=np.full(len(time_us), level),
        heading_rad=wrap_angle(heading_rad),
    )
