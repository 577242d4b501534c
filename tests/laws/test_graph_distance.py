"""Distance along the aisles is a metric, and never shorter than the straight line."""

import networkx as nx
import numpy as np
import pytest
from numpy.typing import NDArray

from blesim.venue.graph import AisleGraph, Edge, Node

Places = tuple[NDArray[np.int64], NDArray[np.float64]]


def random_store(seed: int) -> AisleGraph:
    """Thirty random nodes, a spanning tree and some more edges, in random directions."""
    rng = np.random.default_rng(seed)
    xy_m = rng.uniform(0, 50, (30, 2))
    nodes = tuple(Node(id=str(k), x_m=float(x), y_m=float(y)) for k, (x, y) in enumerate(xy_m))
    tree = [(int(rng.integers(0, k)), k) for k in range(1, 30)]
    more = [(int(a), int(b)) for a, b in rng.integers(0, 30, (20, 2)) if a != b]
    edges = tuple(
        Edge(first=str(a), second=str(b), branch=f"{a}-{b}", one_way=bool(rng.random() < 0.3))
        for a, b in (rng.permutation(pair) for pair in tree + more)
    )
    return AisleGraph(nodes=nodes, edges=edges)


@pytest.fixture(params=[1, 2, 3])
def graph(request: pytest.FixtureRequest) -> AisleGraph:
    return random_store(request.param)


def places(graph: AisleGraph, seed: int) -> Places:
    rng = np.random.default_rng(seed)
    edge = rng.integers(0, len(graph.edges), 2_000)
    return edge, rng.random(2_000) * graph.length_m[edge]


def test_node_distances_are_those_of_networkx(graph: AisleGraph) -> None:
    plain = nx.Graph()
    for row, (a, b) in enumerate(graph.ends.tolist()):
        length_m = min(graph.length_m[row], plain.get_edge_data(a, b, {"w": np.inf})["w"])
        plain.add_edge(a, b, w=length_m)
    for start, lengths in nx.all_pairs_dijkstra_path_length(plain, weight="w"):
        expected = [lengths[node] for node in range(30)]
        np.testing.assert_allclose(graph.node_distance_m[start], expected, rtol=1e-12)


def test_symmetric(graph: AisleGraph) -> None:
    a, b = places(graph, 1), places(graph, 2)
    np.testing.assert_allclose(graph.distance_m(*a, *b), graph.distance_m(*b, *a), rtol=1e-12)


def test_zero_to_itself(graph: AisleGraph) -> None:
    a = places(graph, 1)
    assert not graph.distance_m(*a, *a).any()


def test_triangle_inequality(graph: AisleGraph) -> None:
    a, b, c = places(graph, 1), places(graph, 2), places(graph, 3)
    direct = graph.distance_m(*a, *c)
    assert np.all(direct <= graph.distance_m(*a, *b) + graph.distance_m(*b, *c) + 1e-9)


def test_never_shorter_than_the_straight_line(graph: AisleGraph) -> None:
    a, b = places(graph, 1), places(graph, 2)
    straight = np.linalg.norm(graph.xy_m(*a) - graph.xy_m(*b), axis=1)
    assert np.all(graph.distance_m(*a, *b) >= straight - 1e-9)
