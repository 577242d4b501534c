import numpy as np
import pytest

from blesim.filters.graph_lines import GraphLines
from blesim.filters.graph_motion import GraphArrays
from blesim.filters.graph_steps import step_on_graph
from blesim.venue.graph import AisleGraph, Edge, Node

EAST, NORTH, WEST = 0.0, np.pi / 2, np.pi
# A line of 3 and 4 m to the east, the second edge drawn from its far end, and 5 m to the north.
PLACES = {"a": (0.0, 0.0), "b": (3.0, 0.0), "c": (7.0, 0.0), "d": (3.0, 5.0)}


def graph(one_way: bool = False) -> AisleGraph:
    ends = (("a", "b"), ("c", "b"), ("b", "d"))
    return AisleGraph(
        nodes=tuple(Node(id=name, x_m=x, y_m=y) for name, (x, y) in PLACES.items()),
        edges=tuple(Edge(first=a, second=b, branch=a + b, one_way=one_way) for a, b in ends),
    )


def stepped(
    edge: list[int], offset_m: list[float], way_m: float, heading_rad: float, one_way: bool = False
) -> list[tuple[int, float]]:
    arrays, lines = GraphArrays.of(graph(one_way)), GraphLines.of(graph(one_way))
    edges, offsets_m = np.array(edge), np.array(offset_m)
    step_on_graph(
        edges,
        offsets_m,
        np.full(len(edge), way_m),
        np.full(len(edge), heading_rad),
        arrays.length_m,
        arrays.ends,
        arrays.one_way,
        arrays.first,
        arrays.door,
        lines.along_x,
        lines.along_y,
    )
    return list(zip(edges.tolist(), np.round(offsets_m, 9).tolist(), strict=True))


def test_a_step_goes_to_the_side_of_its_heading() -> None:
    # Edge 1 counts from the far end: to the east its offset falls.
    assert stepped([0, 1], [1.0, 2.0], 0.7, EAST) == [(0, 1.7), (1, 1.3)]
    assert stepped([0, 1], [1.0, 2.0], 0.7, WEST) == [(0, 0.3), (1, 2.7)]
    # The whole length counts, however the aisle lies to the heading.
    assert stepped([0], [1.0], 0.7, np.pi / 3) == [(0, 1.7)]


def test_at_a_node_it_takes_the_edge_nearest_to_the_heading() -> None:
    # 0.5 m to the node, 0.2 m beyond it.
    assert stepped([0], [2.5], 0.7, EAST + 0.7) == [(1, 3.8)]
    assert stepped([0], [2.5], 0.7, EAST + 0.9) == [(2, 0.2)]
    assert stepped([2], [0.5], 0.7, -NORTH - 0.1) == [(0, 2.8)]


def test_where_no_edge_leads_on_it_waits_at_the_node() -> None:
    assert stepped([0], [0.2], 0.7, WEST) == [(0, 0.0)]
    assert stepped([2], [4.8], 0.7, NORTH + 0.2) == [(2, 5.0)]
    assert stepped([0], [0.0], 0.7, EAST) == [(0, 0.7)]


def test_a_long_step_passes_several_nodes() -> None:
    assert stepped([0], [1.0], 5.0, EAST) == [(1, 1.0)]


def test_nobody_walks_against_a_one_way_sign() -> None:
    assert stepped([0, 0], [1.0, 2.9], 0.7, WEST, one_way=True) == [(0, 1.0), (0, 2.9)]
    # To the east the second edge leads back: wait at the node; to the north one may go.
    assert stepped([0], [2.5], 0.7, EAST, one_way=True) == [(0, 3.0)]
    assert stepped([0], [2.5], 0.7, NORTH - 0.3, one_way=True) == [(2, 0.2)]


@pytest.mark.parametrize(("way_m", "heading_rad"), [(-0.1, 0.0), (np.inf, 0.0), (0.5, np.nan)])
def test_bad_steps_are_refused(way_m: float, heading_rad: float) -> None:
    with pytest.raises(ValueError, match="not finite"):
        stepped([0], [1.0], way_m, heading_rad)
