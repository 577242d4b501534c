import numpy as np
import pytest

from blesim.errors import VenueError
from blesim.venue.graph import AisleGraph, Edge, GraphPosition, Node
from blesim.venue.routes import END, PLACE, START, Routes

# A square with a one-way side, a diagonal that is two edges side by side, and an island.
NODES = {"A": (0, 0), "B": (10, 0), "C": (10, 8), "D": (0, 8), "E": (50, 0), "F": (53, 4)}
GRAPH = AisleGraph(
    nodes=tuple(Node(id=name, x_m=x, y_m=y) for name, (x, y) in NODES.items()),
    edges=(
        Edge(first="A", second="B", branch="south", one_way=True),
        Edge(first="B", second="C", branch="east"),
        Edge(first="C", second="D", branch="north", one_way=True),
        Edge(first="D", second="A", branch="west"),
        Edge(first="A", second="C", branch="diagonal", one_way=True),
        Edge(first="E", second="F", branch="island"),
    ),
)


def length_m(legs) -> float:
    return float(np.abs(legs[:, END] - legs[:, START]).sum())


def random_places(graph: AisleGraph, edges: int, count: int, seed: int) -> list[GraphPosition]:
    rng = np.random.default_rng(seed)
    rows = rng.integers(0, edges, count)
    # Every third place is a node.
    shares = np.where(rng.random(count) < 0.33, rng.integers(0, 2, count), rng.random(count))
    return [
        GraphPosition(int(r), float(s * graph.length_m[r]))
        for r, s in zip(rows, shares, strict=True)
    ]


@pytest.mark.parametrize("which", ["square", "store"])
def test_routes_are_as_long_as_those_of_the_graph(which, store):
    graph, edges = (GRAPH, 5) if which == "square" else (store.graph, len(store.graph.edges))
    routes = Routes.of(graph)
    places = random_places(graph, edges, 120, 3)
    for start, end in zip(places[::2], places[1::2], strict=True):
        expected_m = sum(leg.length_m for leg in graph.route(start, end))
        edge = np.array([start.edge, end.edge])
        offset_m = np.array([start.offset_m, end.offset_m])
        legs = routes.legs(edge, offset_m)
        assert length_m(legs) == pytest.approx(expected_m, abs=1e-5)
        between_m = routes.length_m(edge[:1], offset_m[:1], edge[1:], offset_m[1:])
        assert between_m[0] == pytest.approx(expected_m, abs=1e-5)


def test_legs_join_and_respect_one_way_edges():
    routes = Routes.of(GRAPH)
    places = random_places(GRAPH, 5, 60, 8)
    legs = routes.legs(
        np.array([place.edge for place in places]), np.array([place.offset_m for place in places])
    )
    ends_m = [GRAPH.xy_m(legs[:, 0].astype(int), legs[:, column]) for column in (START, END)]
    assert ends_m[0][1:] == pytest.approx(ends_m[1][:-1], abs=1e-5)
    one_way = np.array([edge.one_way for edge in GRAPH.edges])[legs[:, 0].astype(int)]
    assert np.all(legs[one_way, END] >= legs[one_way, START])
    assert legs[legs[:, PLACE] >= 0, PLACE].tolist() == list(range(1, 60))


def test_going_nowhere_is_one_leg_without_length():
    legs = Routes.of(GRAPH).legs(np.array([1, 1]), np.array([2.0, 2.0]))
    assert legs.tolist() == [[1, 2.0, 2.0, 1]]


def test_an_island_cannot_be_reached():
    routes = Routes.of(GRAPH)
    with pytest.raises(VenueError, match="no way leads from node 'A' to node 'E'"):
        routes.legs(np.array([0, 5]), np.array([0.0, 0.0]))
    assert np.isinf(routes.length_m(np.array(0), np.array(0.0), np.array(5), np.array(0.0)))
