import numpy as np

from blesim.filters.graph_lines import GraphLines, fill_xy
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.venue import Venue


def test_the_nearest_places_are_those_of_the_graph(store: Venue) -> None:
    graph = store.graph
    assert graph is not None
    rng = np.random.default_rng(31)
    x_m, y_m = rng.uniform(-5, 110, 3000), rng.uniform(-5, 110, 3000)
    # And nodes themselves, where several edges are equally near.
    x_m = np.concatenate([x_m, graph.node_xy_m[:, 0]])
    y_m = np.concatenate([y_m, graph.node_xy_m[:, 1]])
    level = np.zeros(len(x_m), np.int64)
    edge, offset_m = GraphLines.of(graph).nearest(x_m, y_m, level)
    their_edge, their_offset_m, _ = graph.nearest(x_m, y_m, level)
    np.testing.assert_array_equal(edge, their_edge)
    np.testing.assert_allclose(offset_m, their_offset_m, rtol=0, atol=1e-9)
    alone = GraphLines.of(graph).nearest(x_m[7:8], y_m[7:8], level[:1])
    assert (alone[0][0], alone[1][0]) == (edge[7], offset_m[7])


def test_a_level_without_edges_has_no_place() -> None:
    nodes = (Node(id="a", x_m=0, y_m=0, level=2), Node(id="b", x_m=4, y_m=0, level=2))
    graph = AisleGraph(nodes=nodes, edges=(Edge(first="a", second="b", branch="x"),))
    edge, offset_m = GraphLines.of(graph).nearest(
        np.array([1.0, 1.0, 9.0]), np.zeros(3), np.array([2, 0, 2])
    )
    assert edge.tolist() == [0, -1, 0]
    np.testing.assert_array_equal(offset_m, [1.0, np.nan, 4.0])


def test_places_on_the_map_are_those_of_the_graph(section: Venue) -> None:
    graph = section.graph
    assert graph is not None
    lines, rng = GraphLines.of(graph), np.random.default_rng(32)
    edge = rng.integers(0, len(graph.edges), 500)
    offset_m = rng.random(500) * graph.length_m[edge]
    x_m, y_m = np.empty(500), np.empty(500)
    fill_xy(
        edge,
        offset_m,
        lines.start_x_m,
        lines.start_y_m,
        lines.along_x,
        lines.along_y,
        x_m,
        y_m,
    )
    np.testing.assert_allclose(np.stack([x_m, y_m], axis=1), graph.xy_m(edge, offset_m), atol=1e-12)
