"""The aisle graph: where people walk, reduced from two dimensions to edge and offset."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import isfinite
from typing import Any, TypeVar

import networkx as nx
import numpy as np
from numpy.typing import ArrayLike, NDArray

from blesim.errors import VenueError
from blesim.venue.floor_plan import refuse_bad_level, refuse_repeated

Array = TypeVar("Array", bound=NDArray[Any])

# Two positions closer than this are the same place.
SAME_PLACE_M = 1e-6
# Points looked at together: few enough to stay in the cache.
_CHUNK = 2048


def read_only(array: Array) -> Array:
    """The same array, protected: what a frozen value hands out must not change."""
    array.flags.writeable = False
    return array


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A point of the graph: beside a beacon, at a junction or at an end. [m]."""

    id: str
    x_m: float
    y_m: float
    level: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Edge:
    """A straight piece of an aisle between two nodes, named by their ids.

    Attributes
    ----------
    first, second : str
        Nodes; offsets count from the first.
    branch : str
        Aisle or connecting aisle the edge belongs to.
    one_way : bool
        Whether it may be walked from first to second only.
    """

    first: str
    second: str
    branch: str
    one_way: bool = False


@dataclass(frozen=True, slots=True, order=True)
class GraphPosition:
    """A place on the graph: row of the edge, and distance from the edge's first node. [m]."""

    edge: int
    offset_m: float


@dataclass(frozen=True, slots=True)
class Leg:
    """One edge of a route: walked from one offset to another. [m]."""

    edge: int
    start_m: float
    end_m: float

    @property
    def length_m(self) -> float:
        """Walked distance. [m]."""
        return abs(self.end_m - self.start_m)


@dataclass(frozen=True, kw_only=True)
class AisleGraph:
    """Nodes and straight edges along the centres of the aisles.

    Raises
    ------
    VenueError
        If a node repeats or is nowhere, an edge names an unknown node, joins two levels, or has no
        length.
    """

    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]

    def __post_init__(self) -> None:
        if not self.edges:
            raise VenueError("an aisle graph needs at least one edge")
        refuse_repeated("node", [node.id for node in self.nodes])
        for node in self.nodes:
            refuse_bad_level(f"node '{node.id}'", node.level)
            if not (isfinite(node.x_m) and isfinite(node.y_m)):
                raise VenueError(f"node '{node.id}': ({node.x_m:g}, {node.y_m:g}) is no position")
        for edge in self.edges:
            self._refuse_bad_edge(edge)

    def _refuse_bad_edge(self, edge: Edge) -> None:
        name = f"edge {edge.first} - {edge.second}"
        for end in (edge.first, edge.second):
            if end not in self.node_row:
                raise VenueError(f"{name}: there is no node '{end}'")
        first, second = (self.nodes[self.node_row[end]] for end in (edge.first, edge.second))
        if first.level != second.level:
            raise VenueError(f"{name} joins level {first.level} to level {second.level}")
        if not edge.branch:
            raise VenueError(f"{name}: give the name of its aisle as 'branch'")
        if np.hypot(second.x_m - first.x_m, second.y_m - first.y_m) <= SAME_PLACE_M:
            raise VenueError(f"{name} has no length")

    @cached_property
    def node_row(self) -> Mapping[str, int]:
        """Row of each node by its id."""
        return {node.id: row for row, node in enumerate(self.nodes)}

    @cached_property
    def node_xy_m(self) -> NDArray[np.float64]:
        """Positions of the nodes, (number of nodes, 2). [m]."""
        return read_only(np.array([(node.x_m, node.y_m) for node in self.nodes], np.float64))

    @cached_property
    def ends(self) -> NDArray[np.int64]:
        """Rows of the first and second node of each edge, (number of edges, 2)."""
        rows = [(self.node_row[edge.first], self.node_row[edge.second]) for edge in self.edges]
        return read_only(np.array(rows, dtype=np.int64))

    @cached_property
    def level(self) -> NDArray[np.int16]:
        """Level of each edge, (number of edges,)."""
        return read_only(np.array([self.nodes[row].level for row in self.ends[:, 0]], np.int16))

    @cached_property
    def length_m(self) -> NDArray[np.float64]:
        """Length of each edge, (number of edges,). [m]."""
        along = self.node_xy_m[self.ends[:, 1]] - self.node_xy_m[self.ends[:, 0]]
        return read_only(np.hypot(along[:, 0], along[:, 1]))

    @cached_property
    def direction(self) -> NDArray[np.float64]:
        """Unit vector of each edge from first to second node, (number of edges, 2). [-]."""
        along = self.node_xy_m[self.ends[:, 1]] - self.node_xy_m[self.ends[:, 0]]
        return read_only(along / self.length_m[:, None])

    @cached_property
    def branches(self) -> tuple[str, ...]:
        """Names of all branches, in the order in which the edges bring them up."""
        return tuple(dict.fromkeys(edge.branch for edge in self.edges))

    @cached_property
    def branch(self) -> NDArray[np.int64]:
        """Branch of each edge as a row of `branches`, (number of edges,)."""
        row = {name: number for number, name in enumerate(self.branches)}
        return read_only(np.array([row[edge.branch] for edge in self.edges], np.int64))

    @cached_property
    def network(self) -> "nx.MultiDiGraph[str]":
        """The graph for networkx: node ids, and ``edge`` (row) and ``length_m`` on each arc."""
        network: nx.MultiDiGraph[str] = nx.MultiDiGraph()
        network.add_nodes_from(node.id for node in self.nodes)
        for row, edge in enumerate(self.edges):
            length_m = float(self.length_m[row])
            network.add_edge(edge.first, edge.second, edge=row, length_m=length_m)
            if not edge.one_way:
                network.add_edge(edge.second, edge.first, edge=row, length_m=length_m)
        return network

    @cached_property
    def node_distance_m(self) -> NDArray[np.float64]:
        """Shortest way between any two nodes, one-way signs ignored, (nodes, nodes). [m]."""
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import dijkstra

        count = len(self.nodes)
        shortest: dict[tuple[int, int], float] = {}
        for (first, second), length_m in zip(self.ends.tolist(), self.length_m, strict=True):
            pair = (min(first, second), max(first, second))
            shortest[pair] = min(float(length_m), shortest.get(pair, np.inf))
        rows, columns = np.array(list(shortest)).T
        matrix = coo_matrix((list(shortest.values()), (rows, columns)), shape=(count, count))
        return read_only(dijkstra(matrix.tocsr(), directed=False))

    def xy_m(self, edge: ArrayLike, offset_m: ArrayLike) -> NDArray[np.float64]:
        """Map position of places on the graph.

        Parameters
        ----------
        edge : array_like of int, (n,)
            Rows of edges.
        offset_m : array_like of float, (n,)
            Distances from their first nodes. [m]

        Returns
        -------
        ndarray of float64, (n, 2)
            [m]
        """
        row = np.asarray(edge)
        start = self.node_xy_m[self.ends[row, 0]]
        places: NDArray[np.float64] = start + np.asarray(offset_m)[..., None] * self.direction[row]
        return places

    def nearest(
        self, x_m: ArrayLike, y_m: ArrayLike, level: ArrayLike
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Nearest place on the graph for each map position, on the same level.

        Parameters
        ----------
        x_m, y_m : array_like of float, (n,)
            [m]
        level : array_like of int, (n,)
            Each must be a level that the graph has.

        Returns
        -------
        edge : ndarray of int64, (n,)
            The lowest row, where edges are equally near.
        offset_m : ndarray of float64, (n,)
            [m]
        distance_m : ndarray of float64, (n,)
            How far off the graph the position is. [m]

        Raises
        ------
        VenueError
            If the graph has no edge on a level.
        """
        points = np.stack([np.asarray(x_m, np.float64), np.asarray(y_m, np.float64)], axis=-1)
        levels = np.broadcast_to(np.asarray(level), points.shape[:1])
        parts = [
            self._nearest(points[first : first + _CHUNK], levels[first : first + _CHUNK])
            for first in range(0, max(len(points), 1), _CHUNK)
        ]
        edge, offset_m, distance_m = zip(*parts, strict=True)
        return np.concatenate(edge), np.concatenate(offset_m), np.concatenate(distance_m)

    def _nearest(
        self, points: NDArray[np.float64], levels: NDArray[Any]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        start = self.node_xy_m[self.ends[:, 0]]
        relative = points[:, None, :] - start[None, :, :]
        along = np.clip(np.einsum("nek,ek->ne", relative, self.direction), 0.0, self.length_m)
        foot = along[..., None] * self.direction[None]
        distance = np.hypot(relative[..., 0] - foot[..., 0], relative[..., 1] - foot[..., 1])
        distance[levels[:, None] != self.level[None, :]] = np.inf
        # Edges that meet in a node are equally near it but for rounding: take the first of them.
        edge = np.argmax(distance <= distance.min(axis=1, keepdims=True) + SAME_PLACE_M, axis=1)
        row = np.arange(len(points))
        if np.any(np.isinf(distance[row, edge])):
            lost = levels[np.isinf(distance[row, edge])][0]
            raise VenueError(f"the aisle graph has no edge on level {lost}")
        return edge, along[row, edge], distance[row, edge]

    def at_node(self, node: str) -> GraphPosition:
        """Place of a node: an edge that begins or ends there.

        Raises
        ------
        VenueError
            If there is no such node, or it has no edge.
        """
        if node not in self.node_row:
            raise VenueError(f"there is no node '{node}' on the map")
        for row, edge in enumerate(self.edges):
            if node == edge.first:
                return GraphPosition(row, 0.0)
            if node == edge.second:
                return GraphPosition(row, float(self.length_m[row]))
        raise VenueError(f"node '{node}' has no edge")

    def node_at(self, place: GraphPosition) -> str | None:
        """Node that a place coincides with, if it does."""
        edge = self.edges[place.edge]
        if place.offset_m <= SAME_PLACE_M:
            return edge.first
        if place.offset_m >= self.length_m[place.edge] - SAME_PLACE_M:
            return edge.second
        return None

    def branches_at(self, place: GraphPosition) -> frozenset[str]:
        """Branches that a place belongs to: those of all its edges where it is a node."""
        node = self.node_at(place)
        if node is None:
            return frozenset({self.edges[place.edge].branch})
        return self.branches_of_node[node]

    @cached_property
    def branches_of_node(self) -> Mapping[str, frozenset[str]]:
        """Branches that meet in each node."""
        found: dict[str, set[str]] = {node.id: set() for node in self.nodes}
        for edge in self.edges:
            found[edge.first].add(edge.branch)
            found[edge.second].add(edge.branch)
        return {node: frozenset(names) for node, names in found.items()}

    def distance_m(
        self,
        edge_a: NDArray[np.integer[Any]],
        offset_a_m: NDArray[np.floating[Any]],
        edge_b: NDArray[np.integer[Any]],
        offset_b_m: NDArray[np.floating[Any]],
    ) -> NDArray[np.float64]:
        """Shortest way along the aisles between pairs of places, one-way signs ignored.

        Parameters
        ----------
        edge_a, edge_b : ndarray of int, (n,)
            Rows of edges.
        offset_a_m, offset_b_m : ndarray of float, (n,)
            Distances from their first nodes. [m]

        Returns
        -------
        ndarray of float64, (n,)
            Infinite where no way leads from one to the other. [m]
        """
        to_end_a = np.stack([offset_a_m, self.length_m[edge_a] - offset_a_m])
        to_end_b = np.stack([offset_b_m, self.length_m[edge_b] - offset_b_m])
        between = self.node_distance_m
        ways = [
            to_end_a[i] + between[self.ends[edge_a, i], self.ends[edge_b, j]] + to_end_b[j]
            for i in range(2)
            for j in range(2)
        ]
        straight = np.where(edge_a == edge_b, np.abs(offset_a_m - offset_b_m), np.inf)
        shortest: NDArray[np.float64] = np.minimum(np.min(ways, axis=0), straight)
        return shortest

    def route(self, start: GraphPosition, end: GraphPosition) -> tuple[Leg, ...]:
        """Shortest way from one place to another that respects one-way edges.

        Returns
        -------
        tuple of Leg
            Empty where both are the same place.

        Raises
        ------
        VenueError
            If no way leads there.
        """
        candidates = [legs for legs in self._ways(start, end) if legs is not None]
        if not candidates:
            raise VenueError(f"no way leads from {self.describe(start)} to {self.describe(end)}")
        best = min(candidates, key=lambda legs: sum(leg.length_m for leg in legs))
        return tuple(leg for leg in best if leg.length_m > SAME_PLACE_M)

    def _ways(self, start: GraphPosition, end: GraphPosition) -> Sequence[list[Leg] | None]:
        direct = Leg(start.edge, start.offset_m, end.offset_m)
        one_way = self.edges[start.edge].one_way
        backwards = end.offset_m < start.offset_m - SAME_PLACE_M
        stays = start.edge == end.edge and not (one_way and backwards)
        through_nodes = [
            self._way_through(start, end, leave, enter) for leave in (0, 1) for enter in (0, 1)
        ]
        return [[direct] if stays else None, *through_nodes]

    def _way_through(
        self, start: GraphPosition, end: GraphPosition, leave: int, enter: int
    ) -> list[Leg] | None:
        """Way that leaves the first edge by its node `leave`, reaches the last by `enter`."""
        last_length_m = float(self.length_m[end.edge])
        out = Leg(start.edge, start.offset_m, leave * float(self.length_m[start.edge]))
        into = Leg(end.edge, enter * last_length_m, end.offset_m)
        if not (self._allowed(out) and self._allowed(into)):
            return None
        leaves = self.nodes[self.ends[start.edge, leave]].id
        enters = self.nodes[self.ends[end.edge, enter]].id
        nodes = self._nodes_from(leaves).get(enters)
        if nodes is None:
            return None
        return [out, *(self._leg(a, b) for a, b in pairwise(nodes)), into]

    def _nodes_from(self, node: str) -> Mapping[str, Sequence[str]]:
        """Nodes on the shortest way from one to each other that can be reached, found once."""
        if node not in self._ways_found:
            self._ways_found[node] = nx.single_source_dijkstra_path(
                self.network, node, weight="length_m"
            )
        return self._ways_found[node]

    @cached_property
    def _ways_found(self) -> dict[str, Mapping[str, Sequence[str]]]:
        return {}

    def _allowed(self, leg: Leg) -> bool:
        return not self.edges[leg.edge].one_way or leg.end_m >= leg.start_m - SAME_PLACE_M

    def _leg(self, first: str, second: str) -> Leg:
        return self._legs_between[first, second]

    @cached_property
    def _legs_between(self) -> Mapping[tuple[str, str], Leg]:
        """The shortest edge from one node to another, walked from end to end."""
        found: dict[tuple[str, str], Leg] = {}
        for first, second, arc in self.network.edges(data=True):
            row, length_m = arc["edge"], float(arc["length_m"])
            forwards = self.edges[row].first == first
            leg = Leg(row, 0.0, length_m) if forwards else Leg(row, length_m, 0.0)
            if (first, second) not in found or length_m < found[first, second].length_m:
                found[first, second] = leg
        return found

    def describe(self, place: GraphPosition) -> str:
        """Words for a place: its node, or its distance along its edge."""
        node = self.node_at(place)
        if node is not None:
            return f"node '{node}'"
        edge = self.edges[place.edge]
        return f"{place.offset_m:.2f} m from '{edge.first}' towards '{edge.second}'"
