"""Motion of particles along the aisles: each is on an edge, at an offset, with a velocity along it.

A particle walks on for ``|v| dt`` [1]_. At a node it takes a new edge at random, all of the node's
edges equally likely, and walks the rest of its way on it, through as many nodes as it takes. At a
dead end it turns round. Velocity counts positive from the edge's first node to its second, so that
its sign may change from edge to edge; its size never does.

The digest leaves open whether the edge a particle came along is among the equally likely ones:
``turn_back``. Both keep a uniform cloud uniform on any graph whose edges all go both ways: every
edge at a node brings as many particles as every other, and takes as many away.

References
----------
.. [1] The aisle-graph particle filter in a wholesale store, 2016, Eq 7;
   digest "aisle-graph-particle-filter".
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel
from blesim.rng import philox, uniform
from blesim.venue.graph import AisleGraph, read_only

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# Draws that one counter gives.
_WORDS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class GraphArrays:
    """An aisle graph as plain arrays for kernels.

    Attributes
    ----------
    length_m : ndarray of float64, (edges,)
        [m]
    ends : ndarray of int64, (edges, 2)
        First and second node of each edge.
    one_way : ndarray of bool, (edges,)
        Whether an edge is walked from first to second node only.
    first : ndarray of int64, (nodes + 1,)
        Doors of node k are `door` from ``first[k]`` to ``first[k + 1]``.
    door : ndarray of int64, (2 edges,)
        Edges that meet in a node: ``2 edge`` where they begin there, ``2 edge + 1`` where they end.
    """

    length_m: Array
    ends: Rows
    one_way: NDArray[np.bool_]
    first: Rows
    door: Rows

    @classmethod
    def of(cls, graph: AisleGraph, *, one_way_signs: bool = True) -> Self:
        """Arrays of a graph.

        Parameters
        ----------
        graph : AisleGraph
            The aisles.
        one_way_signs : bool
            Whether people keep to them; if not, every edge goes both ways.
        """
        node = graph.ends.reshape(-1)
        meeting = np.bincount(node, minlength=len(graph.nodes))
        signs = np.array([edge.one_way and one_way_signs for edge in graph.edges])
        return cls(
            length_m=graph.length_m,
            ends=graph.ends,
            one_way=read_only(signs),
            first=read_only(np.concatenate([[0], np.cumsum(meeting)]).astype(np.int64)),
            door=read_only(np.argsort(node, kind="stable").astype(np.int64)),
        )

    def uniform_places(
        self, uniforms: Array, among: NDArray[np.bool_] | None = None
    ) -> tuple[Rows, Array]:
        """Places anywhere on the graph, every metre equally likely.

        Parameters
        ----------
        uniforms : ndarray of float64, (n,)
            In [0, 1). [-]
        among : ndarray of bool, (edges,), optional
            Edges to choose from, at least one; all unless given.

        Returns
        -------
        edge : ndarray of int64, (n,)
        offset_m : ndarray of float64, (n,)
            [m]
        """
        rows = np.arange(len(self.length_m)) if among is None else np.flatnonzero(among)
        ends_m = np.cumsum(self.length_m[rows])
        along_m = uniforms * ends_m[-1]
        place = np.minimum(np.searchsorted(ends_m, along_m, side="right"), len(ends_m) - 1)
        edge = rows[place].astype(np.int64)
        before_m = ends_m[place] - self.length_m[edge]
        return edge, np.clip(along_m - before_m, 0.0, self.length_m[edge])

    def advance(
        self,
        edge: Rows,
        offset_m: Array,
        velocity_m_s: Array,
        duration_s: float,
        *,
        turn_back: bool,
        key: NDArray[np.uint64],
        ordinal: int,
    ) -> None:
        """Move particles in place; see `advance_on_graph`."""
        advance_on_graph(
            edge,
            offset_m,
            velocity_m_s,
            duration_s,
            self.length_m,
            self.ends,
            self.one_way,
            self.first,
            self.door,
            turn_back,
            key,
            ordinal,
        )


def motion_key(rng: np.random.Generator) -> NDArray[np.uint64]:
    """Key of the draws of one cloud, (2,): what a tracker takes from its generator at the start."""
    return rng.integers(0, 2**64, size=2, dtype=np.uint64)


@kernel
def advance_on_graph(
    edge: Rows,
    offset_m: Array,
    velocity_m_s: Array,
    duration_s: float,
    length_m: Array,
    ends: Rows,
    one_way: NDArray[np.bool_],
    first: Rows,
    door: Rows,
    turn_back: bool,
    key: NDArray[np.uint64],
    ordinal: int,
) -> None:
    """Move particles in place for a while (kernel).

    On a one-way edge a particle walks in the edge's direction whatever its velocity's sign, which
    is set right; where no edge may be taken from the node at its end, it waits there.

    The edge taken at the k-th node is drawn from the counter (key, ordinal, particle, k): how many
    nodes others come across changes no draw.

    Parameters
    ----------
    edge, offset_m, velocity_m_s : ndarray of int64, float64 and float64, (n,)
        The particles; changed. [m] [m/s]
    duration_s : float
        Not negative. [s]
    length_m, ends, one_way, first, door
        See `GraphArrays`.
    turn_back : bool
        Whether the edge a particle came along is among those it draws from.
    key : ndarray of uint64, (2,)
        See `motion_key`.
    ordinal : int
        Number of this update, each once.

    Raises
    ------
    ValueError
        If arrays are not of one length, an edge is unknown, or a way is not finite.
    """
    if len(offset_m) != len(edge) or len(velocity_m_s) != len(edge) or len(key) != 2:
        raise ValueError("give one edge, offset and velocity for each particle, and a key of two")
    address = np.array([key[0], key[1], np.uint64(ordinal), np.uint64(0)])
    for i in range(len(edge)):
        way_m = abs(velocity_m_s[i]) * duration_s
        if not (0 <= edge[i] < len(length_m) and 0.0 <= way_m < np.inf):
            raise ValueError("a particle is on no edge of the graph, or its way is not finite")
        forward = velocity_m_s[i] >= 0.0 or one_way[edge[i]]
        rest_m = length_m[edge[i]] - offset_m[i] if forward else offset_m[i]
        # Most stay on their edge, and a call with many arrays takes longer than all this.
        if way_m <= rest_m:
            offset_m[i] = _along(offset_m[i], way_m, forward, length_m[edge[i]])
            velocity_m_s[i] = abs(velocity_m_s[i]) if forward else -abs(velocity_m_s[i])
            continue
        address[3] = np.uint64(i)
        edge[i], offset_m[i], forward = _walk(
            edge[i],
            offset_m[i],
            forward,
            way_m,
            length_m,
            ends,
            one_way,
            first,
            door,
            turn_back,
            address,
        )
        velocity_m_s[i] = abs(velocity_m_s[i]) if forward else -abs(velocity_m_s[i])


@kernel
def _along(offset_m: float, way_m: float, forward: bool, length_m: float) -> float:
    """Offset after a way on one edge, never beyond it by rounding (kernel)."""
    return min(offset_m + way_m, length_m) if forward else max(offset_m - way_m, 0.0)


@kernel
def _walk(
    edge: int,
    offset_m: float,
    forward: bool,
    way_m: float,
    length_m: Array,
    ends: Rows,
    one_way: NDArray[np.bool_],
    first: Rows,
    door: Rows,
    turn_back: bool,
    address: NDArray[np.uint64],
) -> tuple[int, float, bool]:
    """Edge, offset and direction of one particle after a way (kernel)."""
    nodes = 0
    while True:
        rest_m = length_m[edge] - offset_m if forward else offset_m
        if way_m <= rest_m:
            return edge, _along(offset_m, way_m, forward, length_m[edge]), forward
        way_m -= rest_m
        here = 2 * edge + 1 if forward else 2 * edge
        node = ends[edge, 1] if forward else ends[edge, 0]
        taken = _door_taken(here, node, one_way, first, door, turn_back, address, nodes)
        if taken < 0:
            return edge, length_m[edge] if forward else 0.0, forward
        nodes += 1
        edge, forward = taken // 2, taken % 2 == 0
        offset_m = 0.0 if forward else length_m[edge]


@kernel
def _door_taken(
    here: int,
    node: int,
    one_way: NDArray[np.bool_],
    first: Rows,
    door: Rows,
    turn_back: bool,
    address: NDArray[np.uint64],
    nodes: int,
) -> int:
    """Door by which a particle that came through `here` leaves a node, -1 for none (kernel)."""
    open_doors = 0
    for k in range(first[node], first[node + 1]):
        if _may_leave(door[k], here, one_way, turn_back):
            open_doors += 1
    if open_doors == 0:
        # A dead end, or every other edge comes in one way.
        return -1 if one_way[here // 2] else here
    words = philox(address, np.uint64(nodes // _WORDS))
    place = int(uniform(words[nodes % _WORDS]) * open_doors)
    for k in range(first[node], first[node + 1]):
        if _may_leave(door[k], here, one_way, turn_back):
            if place == 0:
                return int(door[k])
            place -= 1
    return -1


@kernel
def _may_leave(door: int, here: int, one_way: NDArray[np.bool_], turn_back: bool) -> bool:
    """Whether a particle that came through `here` may take a door (kernel)."""
    against_sign = door % 2 == 1 and one_way[door // 2]
    return not against_sign and (turn_back or door != here)
