"""From what a scenario says to what happens: who walks and surveys, and whether it connects."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from blesim.errors import BlesimError, ScenarioError, VenueError
from blesim.radio.beacon_events import Moves, impossible_events, in_order
from blesim.recording import ALL_WALKS
from blesim.scenario.reading import ScenarioFile
from blesim.scenario.shop_day import ShopDay
from blesim.scenario.survey_built import LATEST_END_S, planned_surveys
from blesim.scenario.survey_plan import SurveyPlan
from blesim.scenario.venue_built import built_venue, surveyed_venue
from blesim.scenario.walk_plan import RouteStop, WalkPlan
from blesim.venue.graph import AisleGraph, GraphPosition, Leg
from blesim.venue.venue import Venue
from blesim.walkers.faults import faults as day_faults
from blesim.walkers.itinerary import Itinerary, Stop, WayPoints, way_points
from blesim.walkers.shopping_files import read_lists, read_routes
from blesim.walkers.survey import SpotSurvey
from blesim.walkers.trading_day import TradingDay

_OFF_AISLE_M = 0.5
# What simulated people are called.
_TAKEN = ("shopper-", "replayed-", "staff-")


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """A scenario ready to run: the venue, as built and as surveyed, and who walks in it."""

    built: Venue
    surveyed: Venue
    graph: AisleGraph | None
    itineraries: tuple[Itinerary, ...]
    surveys: tuple[SpotSurvey, ...] = field(default=())
    day: TradingDay | None = None


def set_stage(file: ScenarioFile, seed: int) -> Stage:
    """The venue and who walks in it.

    Parameters
    ----------
    file : ScenarioFile
        The scenario, and where to look for its map.
    seed : int
        Of the simulation; decides the surveying errors.

    Returns
    -------
    Stage

    Raises
    ------
    ScenarioError
        With a line for every fault: a wrong map, an unknown phone or node, a route that does not
        connect.
    """
    built, scenario = built_venue(file), file.scenario
    graph = built.graph
    if graph is None and (scenario.walks or scenario.trading_day is not None):
        raise ScenarioError(file.fault(["venue"], "the map has no aisle graph to walk on"))
    faults = [*_name_faults(file), *_phone_faults(file), *_event_faults(file, built)]
    day = _day(file, built, faults)
    itineraries: list[Itinerary] = []
    if graph is not None:
        itineraries = _itineraries(file, built, graph, faults)
    surveys = planned_surveys(file, built, faults)
    if faults:
        raise ScenarioError("\n".join(faults))
    return Stage(
        built=built,
        surveyed=surveyed_venue(built, scenario.venue, seed),
        graph=graph,
        itineraries=tuple(itineraries),
        surveys=surveys,
        day=day,
    )


def _itineraries(
    file: ScenarioFile, built: Venue, graph: AisleGraph, faults: list[str]
) -> list[Itinerary]:
    """Who was told to walk where; adds what is wrong with it to `faults`."""
    itineraries = []
    for row, plan in enumerate(file.scenario.walks):
        stops, walk_faults = _stops(file, row, plan, graph)
        walk_faults = walk_faults or _way_faults(file, row, stops, graph)
        if not walk_faults:
            itineraries.append(_itinerary(plan, stops, built))
        faults += walk_faults
    return itineraries


def _day(file: ScenarioFile, built: Venue, faults: list[str]) -> TradingDay | None:
    """The trading day with the content of its files; adds what is wrong with it to `faults`."""
    told = file.scenario.trading_day
    if told is None:
        return None
    content: dict[str, Any] = {}
    for key, name, read in (
        ("lists", told.lists_file, read_lists),
        ("routes", told.routes_file, read_routes),
    ):
        if name is None:
            continue
        try:
            content[key] = (*getattr(told, key), *read(Path(file.path.parent, name)))
        except BlesimError as error:
            faults.append(file.fault(["trading_day", f"{key}_file"], str(error)))
    day = told.model_copy(update=content)
    found = day_faults(day, built) if built.graph is not None else []
    faults += [
        file.fault(["trading_day", *_where_told(location, told)], message)
        for location, message in found
    ]
    return day


def _where_told(location: tuple[str | int, ...], told: ShopDay) -> tuple[str | int, ...]:
    """Where a part of the day stands: lists and routes after the scenario's own are in its file."""
    for key, own in (("lists", told.lists), ("routes", told.routes)):
        if location[:1] == (key,) and len(location) > 1 and int(location[1]) >= len(own):
            return (f"{key}_file",)
    return location


def _name_faults(file: ScenarioFile) -> list[str]:
    seen: set[str] = set()
    faults = []
    for where, plan in _plans(file):
        if plan.name in seen:
            message = f"walk '{plan.name}' is there twice; give each its own name"
            faults.append(file.fault([*where, "name"], message))
        if plan.name == ALL_WALKS:
            message = f"'{ALL_WALKS}' stands for all walks in error tables; give another name"
            faults.append(file.fault([*where, "name"], message))
        if file.scenario.trading_day is not None and plan.name.startswith(_TAKEN):
            message = f"'{plan.name}' may be a simulated person's name; give another"
            faults.append(file.fault([*where, "name"], message))
        seen.add(plan.name)
    return faults


def _plans(file: ScenarioFile) -> list[tuple[tuple[str, int], WalkPlan | SurveyPlan]]:
    """Walks and surveys, each with where it stands in the scenario."""
    walks, surveys = file.scenario.walks, file.scenario.surveys
    return [
        *((("walks", row), walk) for row, walk in enumerate(walks)),
        *((("surveys", row), survey) for row, survey in enumerate(surveys)),
    ]


def _phone_faults(file: ScenarioFile) -> list[str]:
    known = ", ".join(file.scenario.phones)
    shoppers = ((("shopper_phones", n), e) for n, e in enumerate(file.scenario.shopper_phones))
    return [
        file.fault([*where, "phone"], f"unknown phone '{plan.phone}'; there is {known}")
        for where, plan in (*_plans(file), *shoppers)
        if plan.phone not in file.scenario.phones
    ]


def _event_faults(file: ScenarioFile, built: Venue) -> list[str]:
    """Lines of the events that cannot happen to a beacon, or move it where none can hang."""
    events = file.scenario.beacon_events
    reasons = dict(impossible_events(built.beacons, events))
    now = {beacon.id: beacon for beacon in built.beacons}
    for number in in_order(events):
        event = events[number]
        if number in reasons or not isinstance(event, Moves):
            continue
        where = event.model_dump(include={"x_m", "y_m", "z_m", "level"}, exclude_none=True)
        moved = now[event.beacon].model_copy(update=where)
        try:
            built.with_beacons((moved,))
        except VenueError as error:
            reasons[number] = str(error)
        else:
            now[event.beacon] = moved
    return [
        file.fault(["beacon_events", number], reason) for number, reason in sorted(reasons.items())
    ]


def _stops(
    file: ScenarioFile, row: int, plan: WalkPlan, graph: AisleGraph
) -> tuple[tuple[Stop, ...], list[str]]:
    stops, faults = [], []
    for number, stop in enumerate(plan.route):
        try:
            stops.append(Stop(place=_place(stop, graph), pause_s=stop.pause_s))
        except VenueError as error:
            faults.append(file.fault(["walks", row, "route", number], str(error)))
    return tuple(stops), faults


def _place(stop: RouteStop, graph: AisleGraph) -> GraphPosition:
    if stop.node is not None:
        return graph.at_node(stop.node)
    position_m = np.array([[stop.x_m, stop.y_m]], dtype=np.float64)
    edge, offset_m, distance_m = graph.nearest(position_m[:, 0], position_m[:, 1], [stop.level])
    if distance_m[0] > _OFF_AISLE_M:
        raise VenueError(
            f"({stop.x_m:g}, {stop.y_m:g}) is {distance_m[0]:.2f} m off the nearest aisle"
        )
    return GraphPosition(int(edge[0]), float(offset_m[0]))


def _way_faults(
    file: ScenarioFile, row: int, stops: tuple[Stop, ...], graph: AisleGraph
) -> list[str]:
    legs: list[Leg] = []
    faults = []
    for number, (a, b) in enumerate(pairwise(stops), start=1):
        try:
            legs += graph.route(a.place, b.place)
        except VenueError as error:
            faults.append(file.fault(["walks", row, "route", number], str(error)))
    ends_s = _latest_end_s(file.scenario.walks[row], legs)
    if ends_s > LATEST_END_S:
        reason = (
            f"may go on until {ends_s:.0f} s, and {LATEST_END_S:.0f} s (31 days) is the most;"
            " cut it into walks"
        )
        faults.append(file.fault(["walks", row], reason))
    return faults


def _latest_end_s(plan: WalkPlan, legs: Sequence[Leg]) -> float:
    """When a walk is over even if it turns round before every leg. [s]."""
    pauses_s = sum(stop.pause_s for stop in plan.route)
    turns_s = len(legs) * 180.0 / plan.turn_rate_deg_s
    return plan.start_s + pauses_s + turns_s + sum(leg.length_m for leg in legs) / plan.speed_m_s


def _itinerary(plan: WalkPlan, stops: tuple[Stop, ...], venue: Venue) -> Itinerary:
    return Itinerary(
        walker=plan.name,
        stops=stops,
        start_s=plan.start_s,
        speed_m_s=plan.speed_m_s,
        turn_rate_rad_s=float(np.radians(plan.turn_rate_deg_s)),
        way_points=_way_points(plan, stops, venue),
    )


def _way_points(plan: WalkPlan, stops: tuple[Stop, ...], venue: Venue) -> WayPoints:
    if plan.marks == "none":
        return WayPoints()
    return way_points(venue, stops if plan.marks == "stops" else ())
