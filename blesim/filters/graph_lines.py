"""Places on the aisle graph as map positions and back, for clouds of particles and for tracks.

The same as `AisleGraph.xy_m` and `AisleGraph.nearest`, one place at a time in kernels: for one
place it is a hundred times as fast, and a place has the same bytes alone and among others.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel
from blesim.venue.graph import SAME_PLACE_M, AisleGraph, read_only

Array = NDArray[np.float64]
Rows = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GraphLines:
    """The edges of an aisle graph as plain arrays for kernels, all (edges,).

    Attributes
    ----------
    start_x_m, start_y_m : ndarray of float64
        First nodes. [m]
    along_x, along_y : ndarray of float64
        Unit vectors from first to second node. [-]
    length_m : ndarray of float64
        [m]
    level, branch : ndarray of int64
        As in `AisleGraph`.
    """

    start_x_m: Array
    start_y_m: Array
    along_x: Array
    along_y: Array
    length_m: Array
    level: Rows
    branch: Rows

    @classmethod
    def of(cls, graph: AisleGraph) -> Self:
        """Arrays of a graph."""
        start_m = graph.node_xy_m[graph.ends[:, 0]]
        return cls(
            start_x_m=read_only(start_m[:, 0].copy()),
            start_y_m=read_only(start_m[:, 1].copy()),
            along_x=read_only(graph.direction[:, 0].copy()),
            along_y=read_only(graph.direction[:, 1].copy()),
            length_m=graph.length_m,
            level=read_only(graph.level.astype(np.int64)),
            branch=graph.branch,
        )

    def nearest(self, x_m: Array, y_m: Array, level: Rows) -> tuple[Rows, Array]:
        """Nearest place on the graph for each map position, on the same level.

        Parameters
        ----------
        x_m, y_m : ndarray of float64, (n,)
            [m]
        level : ndarray of int64, (n,)
            Of the venue.

        Returns
        -------
        edge : ndarray of int64, (n,)
            The lowest row, where edges are equally near; -1 where the level has none.
        offset_m : ndarray of float64, (n,)
            NaN where the level has no edge. [m]
        """
        edge, offset_m = np.empty(len(x_m), np.int64), np.empty(len(x_m))
        _fill_nearest(
            x_m,
            y_m,
            level,
            self.start_x_m,
            self.start_y_m,
            self.along_x,
            self.along_y,
            self.length_m,
            self.level,
            edge,
            offset_m,
        )
        return edge, offset_m


@kernel
def nearest_place(
    x_m: float,
    y_m: float,
    level: int,
    start_x_m: Array,
    start_y_m: Array,
    along_x: Array,
    along_y: Array,
    length_m: Array,
    edge_level: Rows,
) -> tuple[int, float]:
    """Edge and offset of the place on a level that is nearest to a map position (kernel).

    Edge -1 and offset NaN where the level has no edge.
    """
    best, best_m, best_offset_m = -1, np.inf, np.nan
    for edge in range(len(length_m)):
        if edge_level[edge] != level:
            continue
        across_x_m, across_y_m = x_m - start_x_m[edge], y_m - start_y_m[edge]
        offset_m = across_x_m * along_x[edge] + across_y_m * along_y[edge]
        offset_m = min(max(offset_m, 0.0), length_m[edge])
        across_x_m -= offset_m * along_x[edge]
        across_y_m -= offset_m * along_y[edge]
        distance_m = np.sqrt(across_x_m * across_x_m + across_y_m * across_y_m)
        # Edges that meet in a node are equally near it but for rounding: the first is kept.
        if distance_m < best_m - SAME_PLACE_M:
            best, best_m, best_offset_m = edge, distance_m, offset_m
    return best, best_offset_m


@kernel
def _fill_nearest(
    x_m: Array,
    y_m: Array,
    level: Rows,
    start_x_m: Array,
    start_y_m: Array,
    along_x: Array,
    along_y: Array,
    length_m: Array,
    edge_level: Rows,
    edge: Rows,
    offset_m: Array,
) -> None:
    for row in range(len(x_m)):
        edge[row], offset_m[row] = nearest_place(
            x_m[row],
            y_m[row],
            level[row],
            start_x_m,
            start_y_m,
            along_x,
            along_y,
            length_m,
            edge_level,
        )


@kernel
def fill_xy(
    edge: Rows,
    offset_m: Array,
    start_x_m: Array,
    start_y_m: Array,
    along_x: Array,
    along_y: Array,
    x_m: Array,
    y_m: Array,
) -> None:
    """Fill the map positions of places on the graph, x and y (n,) (kernel). [m]."""
    for i in range(len(edge)):
        e = edge[i]
        x_m[i] = start_x_m[e] + offset_m[i] * along_x[e]
        y_m[i] = start_y_m[e] + offset_m[i] * along_y[e]
