"""What a step does to walls: passes by, crosses, touches; and where (kernels).

A wall is a row of four numbers, x and y of both ends. [m]
"""

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel

Array = NDArray[np.float64]

# Closer to a wall than this is on it.
ON_WALL_M = 1e-9
# What a wall does to a step besides crossing it at a share in [0, 1].
PASSES, TOUCHES = -1.0, -2.0


@kernel
def on_wall(x: float, y: float, walls: Array, w: int) -> bool:
    """Whether a place is on a wall (kernel)."""
    along_x, along_y = walls[w, 2] - walls[w, 0], walls[w, 3] - walls[w, 1]
    to_x, to_y = x - walls[w, 0], y - walls[w, 1]
    part = (to_x * along_x + to_y * along_y) / (along_x * along_x + along_y * along_y)
    part = min(max(part, 0.0), 1.0)
    off_x, off_y = to_x - part * along_x, to_y - part * along_y
    return bool(off_x * off_x + off_y * off_y <= ON_WALL_M * ON_WALL_M)


@kernel
def contact(
    x0: float, y0: float, x1: float, y1: float, ax: float, ay: float, bx: float, by: float
) -> float:
    """Share of a step at which it crosses the wall a to b, or `PASSES`, or `TOUCHES` (kernel)."""
    along_x, along_y = x1 - x0, y1 - y0
    side_a = along_x * (ay - y0) - along_y * (ax - x0)
    side_b = along_x * (by - y0) - along_y * (bx - x0)
    near = ON_WALL_M * (abs(along_x) + abs(along_y))
    if min(side_a, side_b) > near or max(side_a, side_b) < -near:
        return PASSES
    wall_x, wall_y = bx - ax, by - ay
    start = wall_x * (y0 - ay) - wall_y * (x0 - ax)
    end = wall_x * (y1 - ay) - wall_y * (x1 - ax)
    close = ON_WALL_M * (abs(wall_x) + abs(wall_y))
    if min(start, end) > close or max(start, end) < -close:
        return PASSES
    if min(abs(side_a), abs(side_b)) <= near or min(abs(start), abs(end)) <= close:
        return TOUCHES
    return float(start / (start - end))


@kernel
def fill_cuts(
    x0: float, y0: float, x1: float, y1: float, length: float, walls: Array, cuts: Array
) -> int:
    """Number of shares put, sorted, into `cuts`: a step's ends, crossings and touches (kernel).

    `cuts` must have room for three a wall and two more.
    """
    cuts[0], cuts[1] = 0.0, 1.0
    count = 2
    for w in range(len(walls)):
        share = contact(x0, y0, x1, y1, walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3])
        if share >= 0.0:
            cuts[count] = share
            count += 1
        elif share == TOUCHES:
            for end in range(2):
                to_x, to_y = walls[w, 2 * end] - x0, walls[w, 2 * end + 1] - y0
                foot = (to_x * (x1 - x0) + to_y * (y1 - y0)) / (length * length)
                cuts[count] = min(max(foot, 0.0), 1.0)
                count += 1
    cuts[:count].sort()
    return count
