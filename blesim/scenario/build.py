"""From what a scenario says to what walks: venues, itineraries, and whether it all connects."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely.ops import nearest_points

from blesim.errors import BlesimError, ScenarioError, VenueError
from blesim.rng import Draws
from blesim.scenario.model import RouteStop, VenueSource, WalkPlan
from blesim.scenario.reading import ScenarioFile
from blesim.venue.beacons import Beacon
from blesim.venue.geojson import from_geojson
from blesim.venue.graph import AisleGraph, GraphPosition
from blesim.venue.layouts import wholesale_section, wholesale_store
from blesim.venue.venue import Venue
from blesim.walkers.itinerary import Itinerary, Stop, way_points_m

_LAYOUTS = {"wholesale-section": wholesale_section, "wholesale-store": wholesale_store}
_OFF_AISLE_M = 0.5


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
    faults: list[str] = [*_name_faults(file), *_phone_faults(file)]
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
        return from_geojson(map_path.read_text(encoding="utf-8"), str(map_path))
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
    """The venue with its beacons where the installer believes them to be."""
    if source.survey_error_m == 0:
        return built
    return built.with_beacons(
        tuple(_written_down(beacon, built, source.survey_error_m, seed) for beacon in built.beacons)
    )


def _written_down(beacon: Beacon, built: Venue, error_m: float, seed: int) -> Beacon:
    """The beacon where the installer believes it to be: off, but never inside a shelf or wall."""
    draws = Draws(seed=seed, purpose="survey error", beacon=beacon.id)
    east_m, north_m = error_m * draws.normals(np.zeros(1, int))[0, :2]
    believed = shapely.Point(beacon.x_m + east_m, beacon.y_m + north_m)
    free, _ = nearest_points(built.floor_plan.walkable[beacon.level], believed)
    return beacon.model_copy(update={"x_m": round(free.x, 6), "y_m": round(free.y, 6)})


def _name_faults(file: ScenarioFile) -> list[str]:
    seen: set[str] = set()
    faults = []
    for row, plan in enumerate(file.scenario.walks):
        if plan.name in seen:
            message = f"walk '{plan.name}' is there twice; give each its own name"
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
    faults = []
    for number, (a, b) in enumerate(pairwise(stops), start=1):
        try:
            graph.route(a.place, b.place)
        except VenueError as error:
            faults.append(file.fault(["walks", row, "route", number], str(error)))
    return faults


def _itinerary(plan: WalkPlan, stops: tuple[Stop, ...], venue: Venue) -> Itinerary:
    return Itinerary(
        walker=plan.name,
        stops=stops,
        start_s=plan.start_s,
        speed_m_s=plan.speed_m_s,
        turn_rate_rad_s=float(np.radians(plan.turn_rate_deg_s)),
        marks_m=way_points_m(venue) if plan.marks == "way-points" else np.empty((0, 2)),
    )
