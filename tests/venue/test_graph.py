import itertools
import pickle

import networkx as nx
import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from blesim.errors import VenueError
from blesim.venue import graph as graph_module
from blesim.venue.graph import AisleGraph, Edge, GraphPosition, Leg, Node

SAME_PLACE_M = graph_module.SAME_PLACE_M


def ladder(*, one_way: bool = False) -> AisleGraph:
    """Three aisles of 20 m, 5 m apart, joined at both ends; a slanted short cut; a level above."""
    nodes = [
        Node(id=f"{side}{row}", x_m=x_m, y_m=5.0 * row)
        for row in range(3)
        for side, x_m in (("w", 0.0), ("m", 8.0), ("e", 20.0))
    ]
    edges = []
    for row in range(3):
        edges.append(Edge(first=f"w{row}", second=f"m{row}", branch=f"aisle {row}"))
        edges.append(
            Edge(first=f"m{row}", second=f"e{row}", branch=f"aisle {row}", one_way=one_way)
        )
    for side in "we":
        edges += [Edge(first=f"{side}{r}", second=f"{side}{r + 1}", branch=side) for r in (0, 1)]
    edges.append(Edge(first="m0", second="e1", branch="slant"))
    nodes += [Node(id="up0", x_m=0, y_m=0, level=1), Node(id="up1", x_m=9, y_m=0, level=1)]
    edges.append(Edge(first="up1", second="up0", branch="upper"))
    return AisleGraph(nodes=tuple(nodes), edges=tuple(edges))


GRAPH = ladder()
ONE_WAY = ladder(one_way=True)
GROUND = np.flatnonzero(GRAPH.level == 0)


def random_places(count: int, seed: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    rng = np.random.default_rng(seed)
    edge = rng.choice(GROUND, count)
    share = np.where(rng.random(count) < 0.1, rng.integers(0, 2, count), rng.random(count))
    return edge, share * GRAPH.length_m[edge]


def test_arrays_of_the_edges() -> None:
    assert GRAPH.length_m[:2].tolist() == [8.0, 12.0]
    np.testing.assert_allclose(GRAPH.length_m[10], 13.0)
    np.testing.assert_allclose(GRAPH.direction[10], [12 / 13, 5 / 13])
    assert GRAPH.branches == ("aisle 0", "aisle 1", "aisle 2", "w", "e", "slant", "upper")
    assert GRAPH.branch.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 6]
    assert GRAPH.level.tolist() == [0] * 11 + [1]


@pytest.mark.parametrize(
    "name", ["node_xy_m", "ends", "level", "length_m", "direction", "branch", "node_distance_m"]
)
def test_arrays_are_read_only(name: str) -> None:
    with pytest.raises(ValueError, match="read-only"):
        getattr(GRAPH, name)[0] = 1


def test_nearest_agrees_with_shapely() -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform((-5, -5), (25, 15), (3_000, 2))
    edge, offset_m, distance_m = GRAPH.nearest(points[:, 0], points[:, 1], 0)
    lines = shapely.linestrings(GRAPH.node_xy_m[GRAPH.ends[GROUND]])
    far = shapely.distance(lines[None, :], shapely.points(points)[:, None])
    np.testing.assert_allclose(distance_m, far.min(axis=1), rtol=0, atol=2 * SAME_PLACE_M)
    np.testing.assert_allclose(distance_m, far[np.arange(len(points)), edge], rtol=0, atol=1e-12)
    projected = shapely.line_locate_point(lines[edge], shapely.points(points))
    np.testing.assert_allclose(offset_m, projected, rtol=0, atol=1e-9)


def test_the_way_to_a_place_and_back() -> None:
    edge, offset_m = random_places(1_000, seed=2)
    x_m, y_m = GRAPH.xy_m(edge, offset_m).T
    found, found_m, distance_m = GRAPH.nearest(x_m, y_m, 0)
    assert distance_m.max() < 2 * SAME_PLACE_M
    again = GRAPH.xy_m(found, found_m)
    np.testing.assert_allclose(again, np.column_stack([x_m, y_m]), atol=2 * SAME_PLACE_M)


def test_equally_near_edges_give_the_lowest_row() -> None:
    # e1 is the end of aisle 1, of both halves of the eastern connection and of the slant.
    edge, offset_m, distance_m = GRAPH.nearest([20.0, 21.0], [5.0, 5.0], 0)
    assert edge.tolist() == [3, 3]
    assert offset_m.tolist() == [12.0, 12.0]
    assert distance_m.tolist() == [0.0, 1.0]


def test_nearest_keeps_to_the_level() -> None:
    edge, offset_m, _ = GRAPH.nearest([4.0, 4.0], [0.0, 0.0], [0, 1])
    assert edge.tolist() == [0, 11]
    assert offset_m.tolist() == [4.0, 5.0]
    with pytest.raises(VenueError, match="no edge on level 3"):
        GRAPH.nearest([4.0], [0.0], [3])


def test_nearest_of_nothing() -> None:
    assert [len(part) for part in GRAPH.nearest([], [], [])] == [0, 0, 0]


def test_chunks_do_not_change_the_result(monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.random.default_rng(3).uniform(-5, 25, (1_001, 2))
    levels = np.arange(1_001) % 2
    whole = GRAPH.nearest(points[:, 0], points[:, 1], levels)
    monkeypatch.setattr(graph_module, "_CHUNK", 100)
    for one, other in zip(whole, GRAPH.nearest(points[:, 0], points[:, 1], levels), strict=True):
        np.testing.assert_array_equal(one, other)


def with_places(graph: AisleGraph, *places: GraphPosition) -> "nx.DiGraph[object]":
    """Plain directed graph in which given places are nodes too: an independent router."""
    network: nx.DiGraph[object] = nx.DiGraph()
    for row, edge in enumerate(graph.edges):
        stops: list[tuple[float, object]] = [
            (0.0, edge.first),
            (float(graph.length_m[row]), edge.second),
        ]
        stops += [(p.offset_m, n) for n, p in enumerate(places) if p.edge == row]
        stops.sort(key=lambda stop: stop[0])
        for (start_m, start), (end_m, end) in itertools.pairwise(stops):
            network.add_edge(start, end, length_m=end_m - start_m)
            if not edge.one_way:
                network.add_edge(end, start, length_m=end_m - start_m)
    return network


@pytest.mark.parametrize("graph", [GRAPH, ONE_WAY], ids=["both ways", "one way"])
def test_routes_agree_with_networkx(graph: AisleGraph) -> None:
    edge, _ = random_places(600, seed=4)
    rng = np.random.default_rng(5)
    inner = rng.uniform(0.01, 0.99, 600) * graph.length_m[edge]
    for a, b in rng.integers(0, 600, (300, 2)):
        start = GraphPosition(int(edge[a]), float(inner[a]))
        end = GraphPosition(int(edge[b]), float(inner[b]))
        legs = graph.route(start, end)
        expected = nx.dijkstra_path_length(with_places(graph, start, end), 0, 1, "length_m")
        assert sum(leg.length_m for leg in legs) == pytest.approx(expected, abs=1e-5)
        assert_walkable(graph, start, end, legs)


def assert_walkable(
    graph: AisleGraph, start: GraphPosition, end: GraphPosition, legs: tuple[Leg, ...]
) -> None:
    """Each leg begins where the last one ended, and no one-way edge is walked backwards."""
    here = graph.xy_m([start.edge], [start.offset_m])[0]
    for leg in legs:
        begin, finish = graph.xy_m([leg.edge, leg.edge], [leg.start_m, leg.end_m])
        np.testing.assert_allclose(begin, here, atol=2 * SAME_PLACE_M)
        assert min(leg.start_m, leg.end_m) >= 0.0
        assert max(leg.start_m, leg.end_m) <= graph.length_m[leg.edge] + SAME_PLACE_M
        assert leg.end_m > leg.start_m or not graph.edges[leg.edge].one_way
        here = finish
    np.testing.assert_allclose(here, graph.xy_m([end.edge], [end.offset_m])[0], atol=1e-5)


def test_against_a_one_way_edge_the_route_goes_around() -> None:
    start, end = GraphPosition(1, 9.0), GraphPosition(1, 2.0)
    assert GRAPH.route(start, end) == (Leg(1, 9.0, 2.0),)
    legs = ONE_WAY.route(start, end)
    assert [leg.edge for leg in legs] == [1, 8, 10, 1]
    assert sum(leg.length_m for leg in legs) == pytest.approx(3.0 + 5.0 + 13.0 + 2.0)


def test_a_route_to_the_same_place_is_empty() -> None:
    for place in (GraphPosition(0, 3.0), GraphPosition(1, 0.0), GraphPosition(1, 12.0)):
        assert ONE_WAY.route(place, place) == ()
    # The same node as the end of one edge and the beginning of another.
    assert GRAPH.route(GraphPosition(0, 8.0), GraphPosition(1, 0.0)) == ()


def test_of_two_parallel_edges_the_shorter_is_taken() -> None:
    nodes = (
        Node(id="a", x_m=0, y_m=0),
        Node(id="b", x_m=4, y_m=0),
        Node(id="c", x_m=2, y_m=1),
    )
    edges = (
        Edge(first="a", second="c", branch="bow"),
        Edge(first="c", second="b", branch="bow"),
        Edge(first="b", second="a", branch="back", one_way=True),
        Edge(first="a", second="b", branch="straight"),
    )
    graph = AisleGraph(nodes=nodes, edges=edges)
    assert graph.route(graph.at_node("a"), graph.at_node("b")) == (Leg(3, 0.0, 4.0),)
    assert graph.route(graph.at_node("b"), graph.at_node("a"))[0].length_m == 4.0
    assert graph.node_distance_m[0, 1] == 4.0


def test_a_route_that_does_not_connect() -> None:
    with pytest.raises(VenueError, match="no way leads from node 'w0' to node 'up1'"):
        GRAPH.route(GRAPH.at_node("w0"), GRAPH.at_node("up1"))
    street = AisleGraph(
        nodes=(Node(id="a", x_m=0, y_m=0), Node(id="b", x_m=6, y_m=0)),
        edges=(Edge(first="a", second="b", branch="street", one_way=True),),
    )
    message = r"from 4\.00 m from 'a' towards 'b' to 2\.50 m from 'a' towards 'b'"
    with pytest.raises(VenueError, match=message):
        street.route(GraphPosition(0, 4.0), GraphPosition(0, 2.5))


def test_distance_is_the_length_of_the_route() -> None:
    edge, offset_m = random_places(400, seed=6)
    distance_m = GRAPH.distance_m(edge[:200], offset_m[:200], edge[200:], offset_m[200:])
    for row in range(200):
        legs = GRAPH.route(
            GraphPosition(int(edge[row]), float(offset_m[row])),
            GraphPosition(int(edge[200 + row]), float(offset_m[200 + row])),
        )
        assert sum(leg.length_m for leg in legs) == pytest.approx(distance_m[row], abs=1e-5)


def test_no_way_is_infinitely_long() -> None:
    one, upper = np.array([0]), np.array([11])
    assert np.isinf(GRAPH.distance_m(one, np.array([1.0]), upper, np.array([1.0])))[0]


def test_branches_at_a_junction_and_between() -> None:
    assert GRAPH.branches_at(GraphPosition(0, 4.0)) == {"aisle 0"}
    for place in (GraphPosition(3, 12.0), GraphPosition(10, 13.0), GraphPosition(9, 0.0)):
        assert GRAPH.branches_at(place) == {"aisle 1", "e", "slant"}
    assert GRAPH.branches_at(GraphPosition(3, 12.0 - 0.5 * SAME_PLACE_M)) == {
        "aisle 1",
        "e",
        "slant",
    }
    assert GRAPH.branches_at(GraphPosition(3, 11.9)) == {"aisle 1"}


def test_nodes_as_places() -> None:
    assert GRAPH.at_node("m1") == GraphPosition(2, 8.0)
    assert GRAPH.node_at(GraphPosition(2, 8.0)) == GRAPH.node_at(GraphPosition(3, 0.0)) == "m1"
    assert GRAPH.node_at(GraphPosition(2, 4.0)) is None
    with pytest.raises(VenueError, match="no node 'x9' on the map"):
        GRAPH.at_node("x9")


A, B = Node(id="a", x_m=0, y_m=0), Node(id="b", x_m=1, y_m=0)
STREET = Edge(first="a", second="b", branch="street")


@pytest.mark.parametrize(
    ("nodes", "edges", "message"),
    [
        ((A, B), (), "at least one edge"),
        ((A, A, B), (STREET,), "node 'a' is there twice"),
        ((A,), (STREET,), "edge a - b: there is no node 'b'"),
        ((A, Node(id="b", x_m=1, y_m=0, level=2)), (STREET,), "joins level 0 to level 2"),
        ((A, Node(id="b", x_m=0, y_m=1e-7)), (STREET,), "edge a - b has no length"),
        ((A, B), (Edge(first="a", second="a", branch="s"),), "edge a - a has no length"),
        ((A, B), (Edge(first="a", second="b", branch=""),), "give the name of its aisle"),
        ((A, Node(id="b", x_m=float("nan"), y_m=0)), (STREET,), r"node 'b': \(nan, 0\)"),
        ((A, Node(id="b", x_m=1, y_m=float("inf"))), (STREET,), r"node 'b': \(1, inf\)"),
        ((A, Node(id="b", x_m=1, y_m=0, level=70_000)), (STREET,), "node 'b': level 70000"),
    ],
)
def test_what_is_refused(nodes: tuple[Node, ...], edges: tuple[Edge, ...], message: str) -> None:
    with pytest.raises(VenueError, match=message):
        AisleGraph(nodes=nodes, edges=edges)


def test_a_node_without_an_edge() -> None:
    graph = AisleGraph(nodes=(A, B, Node(id="alone", x_m=5, y_m=5)), edges=(STREET,))
    with pytest.raises(VenueError, match="node 'alone' has no edge"):
        graph.at_node("alone")
    assert np.isinf(graph.node_distance_m[0, 2])


def test_a_graph_travels_to_another_process() -> None:
    graph = ladder()
    graph.nearest([1.0], [1.0], 0)
    graph.branches_at(GraphPosition(0, 0.0))
    assert pickle.loads(pickle.dumps(graph)) == graph  # noqa: S301
