"""Shortest routes between any places of an aisle graph, all prepared beforehand."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from blesim.errors import VenueError
from blesim.kernels import kernel
from blesim.venue.graph import SAME_PLACE_M, AisleGraph, GraphPosition, read_only

Ints = NDArray[np.integer[Any]]
Floats = NDArray[np.floating[Any]]

# Columns of the legs of a route.
EDGE, START, END, PLACE = range(4)
_MIDWAY = -1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Routes:
    """All shortest ways of a graph from node to node; one-way edges are respected.

    Attributes
    ----------
    graph : AisleGraph
        The graph.
    way_m : ndarray of float64, (nodes, nodes)
        Length of the way from the row's node to the column's; infinite where there is none. [m]
    before : ndarray of int32, (nodes, nodes)
        Node just before the column's on the way from the row's; negative where there is none.
    last_edge : ndarray of int32, (nodes, nodes)
        Edge between that node and the column's.
    one_way : ndarray of bool, (edges,)
        Whether an edge may be walked from its first node to its second only.
    """

    graph: AisleGraph
    way_m: NDArray[np.float64]
    before: NDArray[np.int32]
    last_edge: NDArray[np.int32]
    one_way: NDArray[np.bool_]

    @classmethod
    def of(cls, graph: AisleGraph) -> Self:
        """Routes of a graph."""
        count = len(graph.nodes)
        arcs = _shortest_arcs(graph)
        first, second = np.array(list(arcs), dtype=np.int64).T
        edge = np.array(list(arcs.values()), dtype=np.int32)
        matrix = coo_matrix((graph.length_m[edge], (first, second)), shape=(count, count)).tocsr()
        way_m, before = dijkstra(matrix, return_predecessors=True)
        edge_of_arc = np.full((count, count), -1, np.int32)
        edge_of_arc[first, second] = edge
        columns = np.broadcast_to(np.arange(count), before.shape)
        return cls(
            graph=graph,
            way_m=read_only(way_m),
            before=read_only(before.astype(np.int32)),
            last_edge=read_only(edge_of_arc[np.maximum(before, 0), columns]),
            one_way=read_only(np.array([each.one_way for each in graph.edges])),
        )

    def length_m(
        self, edge_a: Ints, offset_a_m: Floats, edge_b: Ints, offset_b_m: Floats
    ) -> NDArray[np.float64]:
        """Lengths of the ways from places a to places b.

        Parameters
        ----------
        edge_a, edge_b : ndarray of int
            Rows of edges; all four arrays have shapes that fit together.
        offset_a_m, offset_b_m : ndarray of float
            Distances from their first nodes. [m]

        Returns
        -------
        ndarray of float64
            Infinite where no way leads there. [m]
        """
        ends, length_m = self.graph.ends, self.graph.length_m
        closed_a = self.one_way[edge_a] & (offset_a_m > SAME_PLACE_M)
        closed_b = self.one_way[edge_b] & (offset_b_m < length_m[edge_b] - SAME_PLACE_M)
        out = (np.where(closed_a, np.inf, offset_a_m), length_m[edge_a] - offset_a_m)
        into = (offset_b_m, np.where(closed_b, np.inf, length_m[edge_b] - offset_b_m))
        ahead = ~self.one_way[edge_a] | (offset_b_m >= offset_a_m - SAME_PLACE_M)
        best = np.where(
            (np.asarray(edge_a) == edge_b) & ahead, np.abs(offset_b_m - offset_a_m), np.inf
        )
        for leave in (0, 1):
            for enter in (0, 1):
                between = self.way_m[ends[edge_a, leave], ends[edge_b, enter]]
                best = np.minimum(best, out[leave] + between + into[enter])
        return np.asarray(best, dtype=np.float64)

    def legs(self, edge: Ints, offset_m: Floats) -> NDArray[np.float64]:
        """Legs of the shortest ways from each of several places to the next.

        Parameters
        ----------
        edge : ndarray of int, (n,)
            Rows of edges.
        offset_m : ndarray of float, (n,)
            Distances from their first nodes. [m]

        Returns
        -------
        ndarray of float64, (legs, 4)
            Edge, offset where it is entered and left [m], and the place that the leg leads to: its
            number, or -1 on the way. Every place but the first is led to by one leg, which has no
            length where the place before is the same.

        Raises
        ------
        VenueError
            If no way leads from one place to the next.
        """
        edges, offsets_m = np.asarray(edge, np.int64), np.asarray(offset_m, np.float64)
        rows, lost = _legs(
            edges, offsets_m, self.graph.ends, self.graph.length_m, self.one_way,
            self.way_m, self.before, self.last_edge,
        )  # fmt: skip
        if lost:
            pair = (GraphPosition(int(edges[k]), float(offsets_m[k])) for k in (lost - 1, lost))
            start, end = (self.graph.describe(place) for place in pair)
            raise VenueError(f"no way leads from {start} to {end}")
        return rows


def _shortest_arcs(graph: AisleGraph) -> dict[tuple[int, int], int]:
    """The shortest edge that may be walked from one node to another, by the pair of nodes."""
    arcs: dict[tuple[int, int], int] = {}
    for row, (first, second) in enumerate(graph.ends.tolist()):
        pairs = (
            [(first, second)] if graph.edges[row].one_way else [(first, second), (second, first)]
        )
        for pair in pairs:
            if pair not in arcs or graph.length_m[row] < graph.length_m[arcs[pair]]:
                arcs[pair] = row
    return arcs


@kernel
def _choice(
    edges: NDArray[np.int64],
    offsets_m: NDArray[np.float64],
    row: int,
    ends: NDArray[np.int64],
    length_m: NDArray[np.float64],
    one_way: NDArray[np.bool_],
    way_m: NDArray[np.float64],
) -> int:
    """How to go to place `row`: 0 straight, 1 + 2 leave + enter by nodes, -1 not (kernel)."""
    a, b = edges[row - 1], edges[row]
    from_m, to_m = offsets_m[row - 1], offsets_m[row]
    best_m, choice = np.inf, -1
    if a == b and (not one_way[a] or to_m >= from_m - SAME_PLACE_M):
        best_m, choice = abs(to_m - from_m), 0
    for leave in range(2):
        if one_way[a] and leave == 0 and from_m > SAME_PLACE_M:
            continue
        for enter in range(2):
            if one_way[b] and enter == 1 and to_m < length_m[b] - SAME_PLACE_M:
                continue
            total_m = abs(leave * length_m[a] - from_m) + abs(to_m - enter * length_m[b])
            total_m += way_m[ends[a, leave], ends[b, enter]]
            if total_m < best_m:
                best_m, choice = total_m, 1 + 2 * leave + enter
    return choice


@kernel
def _legs(
    edges: NDArray[np.int64],
    offsets_m: NDArray[np.float64],
    ends: NDArray[np.int64],
    length_m: NDArray[np.float64],
    one_way: NDArray[np.bool_],
    way_m: NDArray[np.float64],
    before: NDArray[np.int32],
    last_edge: NDArray[np.int32],
) -> tuple[NDArray[np.float64], int]:
    """Legs of all ways, and the first place that cannot be reached, 0 without one (kernel)."""
    legs = np.empty((16 * len(edges) + len(way_m), 4))
    count = 0
    for row in range(1, len(edges)):
        # At most every node, the first and the last stretch.
        if count + len(way_m) + 2 > len(legs):
            longer = np.empty((2 * len(legs) + len(way_m), 4))
            longer[:count] = legs[:count]
            legs = longer
        choice = _choice(edges, offsets_m, row, ends, length_m, one_way, way_m)
        if choice < 0:
            return legs[:count], row
        began = count
        from_edge, to_edge, from_m = edges[row - 1], edges[row], offsets_m[row - 1]
        if choice > 0:
            leave, enter = (choice - 1) // 2, (choice - 1) % 2
            out_m = leave * length_m[from_edge]
            if abs(out_m - from_m) > SAME_PLACE_M:
                legs[count] = np.array([from_edge, from_m, out_m, _MIDWAY])
                count += 1
            first, node = ends[from_edge, leave], ends[to_edge, enter]
            hops = 0
            while node != first:
                hops += 1
                node = before[first, node]
            node = ends[to_edge, enter]
            for hop in range(hops):
                edge = last_edge[first, node]
                forwards = ends[edge, 1] == node
                start_m = 0.0 if forwards else length_m[edge]
                legs[count + hops - 1 - hop] = np.array(
                    [edge, start_m, length_m[edge] - start_m, _MIDWAY]
                )
                node = before[first, node]
            count += hops
            from_m = enter * length_m[to_edge]
        if abs(offsets_m[row] - from_m) > SAME_PLACE_M or count == began:
            legs[count] = np.array([to_edge, from_m, offsets_m[row], _MIDWAY])
            count += 1
        legs[count - 1, PLACE] = row
    return legs[:count].copy(), 0
