"""From what a scenario says to what walks: venues, itineraries, and whether it all connects."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely.ops import nearest_points

from blesim.errors import BlesimError, ScenarioError, VenueError
from blesim.radio.beacon_events import Moves, impossible_events, in_order
from blesim.recording import ALL_WALKS
from blesim.rng import Draws
from blesim.scenario.model import RouteStop, VenueSource, WalkPlan
from blesim.scenario.reading import ScenarioFile
from blesim.venue.beacons import Beacon
from blesim.venue.geojson import from_geojson
from blesim.venue.graph import AisleGraph, GraphPosition, Leg
from blesim.venue.layouts import wholesale_section, wholesale_store
from blesim.venue.venue import Venue
from blesim.walkers.itinerary import Itinerary, Stop, WayPoints, way_points

_LAYOUTS = {"wholesale-section": wholesale_section, "wholesale-store": wholesale_store}
_OFF_AISLE_M = 0.5
_LATEST_END_S = 31 * 86400.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """A scenario ready to run: the venue, as built and as surveyed, and who walks in it."""

    built: Venue
    surveyed: Venue
    graph: AisleGraph
    itineraries: tuple[Itinerary, ...]


def set_stage(file: ScenarioFile, seed: int) -> Stage:
    """The venue and the itineraries of a scenario.

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
    built = _built(file)
    graph = built.graph
    if graph is None:
        raise ScenarioError(file.fault(["venue"], "the map has no aisle graph to walk on"))
    faults = [*_name_faults(file), *_phone_faults(file), *_event_faults(file, built)]
    itineraries = []
    for row, plan in enumerate(file.scenario.walks):
        stops, walk_faults = _stops(file, row, plan, graph)
        faults += walk_faults or _way_faults(file, row, stops, graph)
        if not faults:
            itineraries.append(_itinerary(plan, stops, built))
    if faults:
        raise ScenarioError("\n".join(faults))
    return Stage(
        built=built,
        surveyed=_surveyed(built, file.scenario.venue, seed),
        graph=graph,
        itineraries=tuple(itineraries),
    )


def _built(file: ScenarioFile) -> Venue:
    source = file.scenario.venue
    if source.layout is not None:
        return _LAYOUTS[source.layout]()
    map_path = file.path.parent / str(source.map)
    try:
        return from_geojson(map_path.read_text(encoding="utf-8-sig"), str(map_path))
    except OSError as error:
        reason = f"{map_path}: {error.strerror}"
    except UnicodeDecodeError as error:
        reason = f"{map_path}: not UTF-8 text at byte {error.start}"
    except BlesimError as error:
        reason = str(error)
    raise ScenarioError(
        "\n".join(file.fault(["venue", "map"], line) for line in reason.split("\n"))
    )


def _surveyed(built: Venue, source: VenueSource, seed: int) -> Venue:
    """The venue as the installer knows it: beacons where believed to be, gains unknown."""
    return built.with_beacons(
        tuple(_written_down(beacon, built, source.survey_error_m, seed) for beacon in built.beacons)
    )


def _written_down(beacon: Beacon, built: Venue, error_m: float, seed: int) -> Beacon:
    """The beacon as the installer knows it: without what only its hardware knows."""
    unknown = {"channel_gain_db": Beacon.model_fields["channel_gain_db"].default}
    place = _believed_place(beacon, built, error_m, seed) if error_m > 0 else {}
    return beacon.model_copy(update=unknown | place)


def _believed_place(beacon: Beacon, built: Venue, error_m: float, seed: int) -> dict[str, float]:
    """Where the installer believes the beacon to be: off, but never inside a shelf or wall."""
    free = built.floor_plan.walkable[beacon.level]
    if free.is_empty:
        return {}
    draws = Draws(seed=seed, purpose="survey error", beacon=beacon.id)
    east_m, north_m = error_m * draws.normals(np.zeros(1, int))[0, :2]
    believed = shapely.Point(beacon.x_m + east_m, beacon.y_m + north_m)
    nearest, _ = nearest_points(free, believed)
    return {"x_m": round(nearest.x, 6), "y_m": round(nearest.y, 6)}


def _name_faults(file: ScenarioFile) -> list[str]:
    seen: set[str] = set()
    faults = []
    for row, plan in enumerate(file.scenario.walks):
        if plan.name in seen:
            message = f"walk '{plan.name}' is there twice; give each its own name"
            faults.append(file.fault(["walks", row, "name"], message))
        if plan.name == ALL_WALKS:
            message = f"'{ALL_WALKS}' stands for all walks in error tables; give another name"
            faults.append(file.fault(["walks", row, "name"], message))
        seen.add(plan.name)
    return faults


def _phone_faults(file: ScenarioFile) -> list[str]:
    known = ", ".join(file.scenario.phones)
    return [
        file.fault(["walks", row, "phone"], f"unknown phone '{plan.phone}'; there is {known}")
        for row, plan in enumerate(file.scenario.walks)
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
    if ends_s > _LATEST_END_S:
        reason = (
            f"may go on until {ends_s:.0f} s, and {_LATEST_END_S:.0f} s (31 days) is the most;"
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
        way_points=way_points(venue) if plan.marks == "way-points" else WayPoints(),
    )
