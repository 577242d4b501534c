"""What contradicts the venue in the settings of a day, told before anybody walks."""

from collections.abc import Iterator

import numpy as np

from blesim.venue.graph import AisleGraph, GraphPosition
from blesim.venue.routes import Routes
from blesim.venue.venue import Venue
from blesim.walkers.assortment import Assortment
from blesim.walkers.clearance import Clearance
from blesim.walkers.trading_day import TradingDay
from blesim.walkers.trip import Ground

Fault = tuple[tuple[str | int, ...], str]


def faults(day: TradingDay, venue: Venue) -> list[Fault]:
    """Faults of a day in a venue, each with its path in the settings; empty without any.

    Parameters
    ----------
    day : TradingDay
        The settings.
    venue : Venue
        Where it should happen.
    """
    graph = venue.graph
    if graph is None:
        return [((), f"venue '{venue.name}' has no aisle graph for people to walk on")]
    if not venue.sections:
        return [((), f"venue '{venue.name}' has no product section to shop at")]
    found = [*_unknown_nodes(day, graph), *_unknown_names(day, venue), *_repeated(day)]
    return found or list(_unreachable(day, venue, graph))


def _nodes(day: TradingDay) -> Iterator[tuple[tuple[str | int, ...], str]]:
    yield ("entrance",), day.entrance
    if day.exit is not None:
        yield ("exit",), day.exit
    for row, node in enumerate(day.tills.nodes):
        yield ("tills", "nodes", row), node


def _unknown_nodes(day: TradingDay, graph: AisleGraph) -> Iterator[Fault]:
    joined = {end for edge in graph.edges for end in (edge.first, edge.second)}
    for path, node in _nodes(day):
        if node not in graph.node_row:
            yield path, f"there is no node '{node}' on the map"
        elif node not in joined:
            yield path, f"node '{node}' has no edge; nobody can walk there"


def _unknown_names(day: TradingDay, venue: Venue) -> Iterator[Fault]:
    sections = {section.id for section in venue.sections}
    categories = {section.category for section in venue.sections}
    nodes = venue.graph.node_row if venue.graph is not None else {}
    path: tuple[str | int, ...]
    for category in day.basket.popularity.weights:
        if category not in categories:
            known = ", ".join(sorted(categories))
            path = ("basket", "popularity", "weights", category)
            yield path, f"no section sells '{category}'; there are {known}"
    if day.basket.popularity.kind == "categories" and not day.lists:
        weights = day.basket.popularity.weights
        if not any(weights.get(category, 1.0) for category in categories):
            yield ("basket", "popularity", "weights"), "every weight is 0; raise one"
    for row, dealt in enumerate(day.lists):
        for item, name in enumerate(dealt.sections):
            if name not in sections:
                path = ("lists", row, "sections", item)
                yield path, f"list of '{dealt.shopper}': there is no section '{name}' on the map"
    for row, route in enumerate(day.routes):
        for item, point in enumerate(route.points):
            path = ("routes", row, "points", item, "place")
            if point.place not in sections and point.place not in nodes:
                reason = f"there is neither a node nor a section '{point.place}' on the map"
                yield path, f"route of '{route.shopper}': {reason}"


def _repeated(day: TradingDay) -> Iterator[Fault]:
    seen: dict[str, set[str]] = {"tills": set(), "routes": set()}
    for row, node in enumerate(day.tills.nodes):
        if node in seen["tills"]:
            yield ("tills", "nodes", row), f"till '{node}' is there twice; raise 'servers' instead"
        seen["tills"].add(node)
    for row, route in enumerate(day.routes):
        if route.shopper in seen["routes"]:
            yield ("routes", row, "shopper"), f"there are two routes of '{route.shopper}'"
        seen["routes"].add(route.shopper)
        if route.points[0].time_s * 1e6 >= day.open_us:
            yield (
                ("routes", row, "points", 0, "time_s"),
                (f"route of '{route.shopper}': begins only after closing"),
            )


def _unreachable(day: TradingDay, venue: Venue, graph: AisleGraph) -> Iterator[Fault]:
    """Places that are on the map, but cannot be reached or left."""
    routes = Routes.of(graph)
    ground = Ground(routes=routes, clearance=Clearance.of(venue))
    assortment = Assortment.of(venue, ground)
    entrance, way_out = graph.at_node(day.entrance), graph.at_node(day.way_out)
    reached = np.isfinite(assortment.from_place_m(entrance))
    for row in np.flatnonzero(~reached)[:3]:
        name = assortment.sections[row].id
        yield ("entrance",), f"no way leads from '{day.entrance}' to section '{name}'"
    for row, node in enumerate(day.tills.nodes):
        till = graph.at_node(node)
        back = np.isfinite(assortment.to_place_m(till)) | ~reached
        path: tuple[str | int, ...] = ("tills", "nodes", row)
        for section in np.flatnonzero(~back)[:1]:
            name = assortment.sections[section].id
            yield path, f"no way leads from section '{name}' to till '{node}'"
        if not _leads(routes, till, way_out):
            yield path, f"no way leads from till '{node}' to '{day.way_out}', the way out"
        if not _leads(routes, entrance, till):
            yield path, f"no way leads from '{day.entrance}' to till '{node}'"
    if not _leads(routes, entrance, way_out):
        yield ("exit",), f"no way leads from '{day.entrance}' to '{day.way_out}'"
    yield from _unreachable_points(day, graph, routes)


def _unreachable_points(day: TradingDay, graph: AisleGraph, routes: Routes) -> Iterator[Fault]:
    """Nodes of recorded routes that cannot be reached or left, the first of each route."""
    entrance = graph.at_node(day.entrance)
    tills = [graph.at_node(node) for node in day.tills.nodes]
    named = {point.place for route in day.routes for point in route.points}
    lost = set()
    for node in named & graph.node_row.keys():
        place = graph.at_node(node)
        leaves = all(_leads(routes, place, till) for till in tills)
        if not (_leads(routes, entrance, place) and leaves):
            lost.add(node)
    for row, route in enumerate(day.routes):
        for item in [k for k, point in enumerate(route.points) if point.place in lost][:1]:
            reason = f"node '{route.points[item].place}' cannot be reached, or not left for a till"
            yield ("routes", row, "points", item, "place"), f"route of '{route.shopper}': {reason}"


def _leads(routes: Routes, start: GraphPosition, end: GraphPosition) -> bool:
    ends = ((np.array(place.edge), np.array(place.offset_m)) for place in (start, end))
    (edge_a, offset_a_m), (edge_b, offset_b_m) = ends
    return bool(np.isfinite(routes.length_m(edge_a, offset_a_m, edge_b, offset_b_m)))
