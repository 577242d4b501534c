"""Steps of particles along the aisles: the way is the step's length, the direction its heading.

On its edge a particle walks to the side that the heading points to. At a node it takes the edge
that leads most nearly along the heading, and waits there where none leads forward. It is what the
aisle-graph paper [1]_ wished for in the place of its random velocities; how is ours.

References
----------
.. [1] The aisle-graph particle filter in a wholesale store, 2016;
   digest "aisle-graph-particle-filter".
"""

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel

Array = NDArray[np.float64]
Rows = NDArray[np.int64]


@kernel
def step_on_graph(
    edge: Rows,
    offset_m: Array,
    way_m: Array,
    heading_rad: Array,
    length_m: Array,
    ends: Rows,
    one_way: NDArray[np.bool_],
    first: Rows,
    door: Rows,
    along_x: Array,
    along_y: Array,
) -> None:
    """Move particles in place by one step each (kernel).

    Against the direction of a one-way edge nobody walks: there a particle stays.

    Parameters
    ----------
    edge, offset_m : ndarray of int64 and float64, (n,)
        The particles; changed. [m]
    way_m, heading_rad : ndarray of float64, (n,)
        Length, not negative, and heading of each one's step. [m] [rad]
    length_m, ends, one_way, first, door
        See `blesim.filters.graph_motion.GraphArrays`.
    along_x, along_y
        See `blesim.filters.graph_lines.GraphLines`.

    Raises
    ------
    ValueError
        If arrays are not of one length, or a step is not finite.
    """
    if not len(edge) == len(offset_m) == len(way_m) == len(heading_rad):
        raise ValueError("give one edge, offset, way and heading for each particle")
    for i in range(len(edge)):
        if not (0.0 <= way_m[i] < np.inf and np.isfinite(heading_rad[i])):
            raise ValueError("the length or heading of a step is not finite, or a length negative")
        ahead_x, ahead_y = np.cos(heading_rad[i]), np.sin(heading_rad[i])
        forward = ahead_x * along_x[edge[i]] + ahead_y * along_y[edge[i]] >= 0.0
        rest_m = way_m[i]
        while forward or not one_way[edge[i]]:
            free_m = length_m[edge[i]] - offset_m[i] if forward else offset_m[i]
            if rest_m <= free_m:
                offset_m[i] += rest_m if forward else -rest_m
                break
            rest_m -= free_m
            offset_m[i] = length_m[edge[i]] if forward else 0.0
            node = ends[edge[i], 1] if forward else ends[edge[i], 0]
            taken = _door_ahead(node, ahead_x, ahead_y, one_way, first, door, along_x, along_y)
            if taken < 0:
                break
            edge[i], forward = taken // 2, taken % 2 == 0
            offset_m[i] = 0.0 if forward else length_m[edge[i]]


@kernel
def _door_ahead(
    node: int,
    ahead_x: float,
    ahead_y: float,
    one_way: NDArray[np.bool_],
    first: Rows,
    door: Rows,
    along_x: Array,
    along_y: Array,
) -> int:
    """Door of a node that leads most nearly along a heading, -1 if none leads forward (kernel)."""
    best, best_cosine = -1, 0.0
    for k in range(first[node], first[node + 1]):
        edge, against = door[k] // 2, door[k] % 2 == 1
        cosine = ahead_x * along_x[edge] + ahead_y * along_y[edge]
        if against:
            cosine = -cosine
        if cosine > best_cosine and not (against and one_way[edge]):
            best, best_cosine = door[k], cosine
    return best
