"""Surveys of a scenario as they will be walked: where to stand, and how to get from spot to spot.

Whatever is too much is refused before it is computed.
"""

from collections.abc import Iterable, Iterator, Mapping
from math import ceil

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim.errors import VenueError
from blesim.scenario.reading import ScenarioFile
from blesim.scenario.survey_plan import SurveyPlan
from blesim.units import wrap_angle
from blesim.venue.free_ways import FreeWays
from blesim.venue.venue import Venue
from blesim.walkers.survey import SpotSurvey, grid_spots_m

Fault = tuple[tuple[str | int, ...], str]

LATEST_END_S = 31 * 86400.0
# Of a grid, shelves included; and at which somebody looks one way.
_MOST_CROSSINGS = 1_000_000
_MOST_STANDS = 100_000


def planned_surveys(file: ScenarioFile, built: Venue, faults: list[str]) -> tuple[SpotSurvey, ...]:
    """Surveys of a scenario without fault; adds what is wrong with the others to `faults`.

    Parameters
    ----------
    file : ScenarioFile
        The scenario.
    built : Venue
        Where they are walked.
    faults : list of str
        Gets a line for every fault: a spot inside a shelf, no way to a spot, too long a survey.
    """
    surveys = []
    for row, plan in enumerate(file.scenario.surveys):
        try:
            surveys.append(_planned(plan, built))
        except _RefusedError as refused:
            faults += [file.fault(["surveys", row, *where], why) for where, why in refused.faults]
    return tuple(surveys)


class _RefusedError(Exception):
    """A survey that cannot be walked, and every reason."""

    def __init__(self, faults: list[Fault]) -> None:
        super().__init__()
        self.faults = faults


def _planned(plan: SurveyPlan, built: Venue) -> SpotSurvey:
    _refuse(_size_faults(plan, built))
    spots_m = _spots_m(plan, built)
    _refuse(_spot_faults(plan, spots_m, built))
    _refuse(_length_faults(plan, spots_m, {}))
    corners_m = _corners_m(plan, spots_m, built)
    _refuse(_length_faults(plan, spots_m, corners_m))
    return _survey(plan, spots_m, corners_m)


def _refuse(faults: Iterable[Fault]) -> None:
    found = list(faults)
    if found:
        raise _RefusedError(found)


def _survey(
    plan: SurveyPlan, spots_m: NDArray[np.float64], corners_m: Mapping[int, NDArray[np.float64]]
) -> SpotSurvey:
    return SpotSurvey(
        spots_m=spots_m,
        corners_m=corners_m,
        level=plan.level,
        headings_rad=tuple(float(wrap_angle(np.radians(deg))) for deg in plan.directions_deg),
        stand_s=plan.stand_s,
        speed_m_s=plan.speed_m_s,
        turn_rate_rad_s=float(np.radians(plan.turn_rate_deg_s)),
        start_s=plan.start_s,
    )


def _area_m(plan: SurveyPlan, built: Venue) -> tuple[float, float, float, float]:
    """West, south, east and north of the grid. [m]."""
    if plan.area is not None:
        return plan.area.box_m
    west, south, east, north = built.floor_plan.bounds(plan.level, "the survey").bounds
    return west, south, east, north


def _spots_m(plan: SurveyPlan, built: Venue) -> NDArray[np.float64]:
    if plan.grid_m is None:
        return np.array([(spot.x_m, spot.y_m) for spot in plan.spots]).reshape(-1, 2)
    area_m = _area_m(plan, built)
    return grid_spots_m(built.floor_plan, plan.level, plan.grid_m, area_m)


def _size_faults(plan: SurveyPlan, built: Venue) -> Iterator[Fault]:
    """What can be told without looking for the spots."""
    if plan.level not in built.floor_plan.walkable:
        yield (), f"the map has no level {plan.level}"
    elif plan.grid_m is not None:
        west, south, east, north = _area_m(plan, built)
        crossings = ceil((east - west) / plan.grid_m) * ceil((north - south) / plan.grid_m)
        if crossings > _MOST_CROSSINGS:
            yield (
                ("grid_m",),
                f"a grid of {plan.grid_m:g} m has {crossings} crossings, and {_MOST_CROSSINGS} is"
                " the most; make it wider, or give a smaller 'area'",
            )


def _spot_faults(plan: SurveyPlan, spots_m: NDArray[np.float64], built: Venue) -> Iterator[Fault]:
    if not len(spots_m):
        yield (), f"no crossing of a grid of {plan.grid_m:g} m is walkable; make it narrower"
        return
    # A grid stands free by itself.
    free = built.floor_plan.walkable[plan.level]
    spots = [shapely.Point(spot.x_m, spot.y_m) for spot in plan.spots]
    for spot in (spot for spot in spots if not shapely.covers(free, spot)):
        yield (), f"({spot.x:g}, {spot.y:g}) is not walkable: inside a shelf, or out of bounds"


def _length_faults(
    plan: SurveyPlan, spots_m: NDArray[np.float64], corners_m: Mapping[int, NDArray[np.float64]]
) -> Iterator[Fault]:
    stands = len(spots_m) * len(plan.directions_deg)
    if stands > _MOST_STANDS:
        yield (
            (),
            f"{len(spots_m)} spots with {len(plan.directions_deg)} directions each are {stands}"
            f" stands, and {_MOST_STANDS} is the most; take fewer",
        )
        return
    ends_s = _latest_end_s(plan, spots_m, corners_m)
    if ends_s > LATEST_END_S:
        yield (
            (),
            f"may go on until {ends_s:.0f} s, and {LATEST_END_S:.0f} s (31 days) is the most;"
            " cut it into surveys",
        )


def _latest_end_s(
    plan: SurveyPlan, spots_m: NDArray[np.float64], corners_m: Mapping[int, NDArray[np.float64]]
) -> float:
    """When a survey is over even if the tester turns round for every stand and way. [s]."""
    places_m = [(*corners_m.get(row, ()), spot_m) for row, spot_m in enumerate(spots_m)]
    way_m = np.array([place_m for places in places_m for place_m in places])
    length_m = float(np.hypot(*np.diff(way_m, axis=0).T).sum())
    stands = len(spots_m) * len(plan.directions_deg)
    turns_s = (stands + len(way_m)) * 180.0 / plan.turn_rate_deg_s
    return plan.start_s + stands * plan.stand_s + turns_s + length_m / plan.speed_m_s


def _corners_m(
    plan: SurveyPlan, spots_m: NDArray[np.float64], built: Venue
) -> dict[int, NDArray[np.float64]]:
    """Corners on the way to each spot that cannot be reached straight, by its row. [m]."""
    ways = FreeWays(plan=built.floor_plan, level=plan.level, graph=built.graph)
    blocked = np.flatnonzero(~ways.are_free(spots_m[:-1], spots_m[1:])) + 1
    corners_m = {}
    for row in blocked.tolist():
        try:
            corners_m[row] = ways.bends_m(spots_m[row - 1], spots_m[row])
        except VenueError as fault:
            where = ("spots", row) if plan.spots else ("grid_m",)
            raise _RefusedError([(where, f"{fault}; make it two surveys")]) from fault
    return corners_m
