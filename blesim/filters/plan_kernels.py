"""The compiled questions to a grid of walls; see `plan_grid` and `plan_motion`.

A step that properly crosses a wall is blocked. One that only touches walls, at corners or along
them, is cut where it touches, and the middle of each piece tells whether the piece is enterable:
exact, and so rare that it may be slow.
"""

import numpy as np
from numpy.typing import NDArray

from blesim.filters.plan_grid import INSIDE, MIXED, REACH_M, Box
from blesim.filters.walls import ON_WALL_M, TOUCHES, contact, fill_cuts, on_wall
from blesim.kernels import kernel

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Rows = NDArray[np.int64]
States = NDArray[np.int8]

# Where a row of cells is left too flatly to tell at which column, all columns are looked at.
_FLAT_M = 1e-3


@kernel
def fill_enterable(
    x: Array,
    y: Array,
    walls: Array,
    box: Box,
    state: States,
    first_in_cell: Rows,
    in_cell: Rows,
    first_in_row: Rows,
    in_row: Rows,
    out: Flags,
) -> None:
    """Fill whether each place is enterable (kernel)."""
    for i in range(len(x)):
        c = _cell(x[i], y[i], box)
        if c >= 0 and state[c] != MIXED:
            out[i] = state[c] == INSIDE
        else:
            out[i] = c >= 0 and _among_walls(
                x[i], y[i], c, walls, box, first_in_cell, in_cell, first_in_row, in_row
            )


@kernel
def fill_free_share(
    x0: Array,
    y0: Array,
    x1: Array,
    y1: Array,
    walls: Array,
    box: Box,
    state: States,
    first_in_cell: Rows,
    in_cell: Rows,
    first_in_row: Rows,
    in_row: Rows,
    any_will_do: bool,
    out: Array,
) -> None:
    """Fill the share of each step before it leaves the area, infinite if it does not (kernel).

    With ``any_will_do`` the first place that is found outside will do, wherever on the step it is.
    """
    cuts = np.empty(3 * len(walls) + 2)
    for i in range(len(x0)):
        around = _state_around(x0[i], y0[i], x1[i], y1[i], box, state)
        if around != MIXED:
            out[i] = np.inf if around == INSIDE else 0.0
            continue
        out[i] = _free_share(
            x0[i], y0[i], x1[i], y1[i], any_will_do, walls, box, state,
            first_in_cell, in_cell, first_in_row, in_row, cuts,
        )  # fmt: skip


@kernel
def _cell(x: float, y: float, box: Box) -> int:
    """Cell of a place, -1 beyond the grid and for NaN (kernel)."""
    along, up = (x - box.west) / box.cell, (y - box.south) / box.cell
    if not (0.0 <= along < box.columns and 0.0 <= up < box.rows):
        return -1
    return int(up) * box.columns + int(along)


@kernel
def _state_around(x0: float, y0: float, x1: float, y1: float, box: Box, state: States) -> int:
    """State of all cells around a short step; mixed if there are walls or it is long (kernel)."""
    a, b = _cell(x0, y0, box), _cell(x1, y1, box)
    if a < 0 or b < 0:
        return MIXED
    right, up = b % box.columns - a % box.columns, b // box.columns - a // box.columns
    if abs(right) > 1 or abs(up) > 1 or state[a] == MIXED or state[b] == MIXED:
        return MIXED
    # The two cells beside a diagonal step.
    if state[a + right] == MIXED or state[b - right] == MIXED:
        return MIXED
    return int(state[a])


@kernel
def _among_walls(
    x: float,
    y: float,
    cell: int,
    walls: Array,
    box: Box,
    first_in_cell: Rows,
    in_cell: Rows,
    first_in_row: Rows,
    in_row: Rows,
) -> bool:
    """Whether a place in a cell with walls is enterable: on a wall, or by crossings (kernel)."""
    for k in range(first_in_cell[cell], first_in_cell[cell + 1]):
        if on_wall(x, y, walls, in_cell[k]):
            return True
    row, odd = cell // box.columns, False
    for k in range(first_in_row[row], first_in_row[row + 1]):
        w = in_row[k]
        low, high = walls[w, 1] - y, walls[w, 3] - y
        # A corner level with the place counts as below it, on both its walls.
        if (low > 0.0) != (high > 0.0):
            part = low / (low - high)
            odd ^= walls[w, 0] + part * (walls[w, 2] - walls[w, 0]) > x
    return odd


@kernel
def _free_share(
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    any_will_do: bool,
    walls: Array,
    box: Box,
    state: States,
    first_in_cell: Rows,
    in_cell: Rows,
    first_in_row: Rows,
    in_row: Rows,
    cuts: Array,
) -> float:
    """Share of a step before it leaves the area, infinite if it does not (kernel).

    If any place outside will do, a blocked step may be given any share.
    """
    c = _cell(x0, y0, box)
    length = np.sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))
    if c < 0 or not length < np.inf:
        return 0.0
    if length > ON_WALL_M:
        first, touches = _first_crossing(
            x0, y0, x1, y1, any_will_do, walls, box, first_in_cell, in_cell
        )
        if any_will_do and first < np.inf:
            return first
        if touches:
            return _free_share_touching(
                x0, y0, x1, y1, length, walls, box, state,
                first_in_cell, in_cell, first_in_row, in_row, cuts,
            )  # fmt: skip
    else:
        first = np.inf
    # Without a crossing, both ends are on the same side: take the one that is easier to tell.
    last = _cell(x1, y1, box) if first == np.inf else c
    for end in (c, last):
        if end >= 0 and state[end] != MIXED:
            return first if state[end] == INSIDE else 0.0
    starts_inside = _among_walls(
        x0, y0, c, walls, box, first_in_cell, in_cell, first_in_row, in_row
    )
    return first if starts_inside else 0.0


@kernel
def _first_crossing(
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    any_will_do: bool,
    walls: Array,
    box: Box,
    first_in_cell: Rows,
    in_cell: Rows,
) -> tuple[float, bool]:
    """Least share at which a step crosses a wall, and whether it touches one (kernel)."""
    first, touches = np.inf, False
    low, high = min(y0, y1), max(y0, y1)
    begin = _limited((low - REACH_M - box.south) / box.cell, box.rows)
    beyond = _limited((high + REACH_M - box.south) / box.cell, box.rows)
    for row in range(max(begin, 0), min(beyond + 1, box.rows)):
        left, right = _columns(x0, y0, x1, y1, row, box)
        for c in range(row * box.columns + left, row * box.columns + right + 1):
            for k in range(first_in_cell[c], first_in_cell[c + 1]):
                w = in_cell[k]
                share = contact(x0, y0, x1, y1, walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3])
                if share >= 0.0:
                    first = min(first, share)
                    if any_will_do:
                        return first, touches
                touches = touches or share == TOUCHES
    return first, touches


@kernel
def _columns(x0: float, y0: float, x1: float, y1: float, row: int, box: Box) -> tuple[int, int]:
    """First and last column that a step meets in a row of cells (kernel)."""
    from_x, to_x = x0, x1
    if abs(y1 - y0) > _FLAT_M:
        south = box.south + row * box.cell
        slope = (x1 - x0) / (y1 - y0)
        low, high = min(y0, y1), max(y0, y1)
        from_x = x0 + (min(max(south, low), high) - y0) * slope
        to_x = x0 + (min(max(south + box.cell, low), high) - y0) * slope
    left = _limited((min(from_x, to_x) - REACH_M - box.west) / box.cell, box.columns)
    right = _limited((max(from_x, to_x) + REACH_M - box.west) / box.cell, box.columns)
    return max(left, 0), min(right, box.columns - 1)


@kernel
def _limited(number: float, count: int) -> int:
    """Whole number below a number; -1 and `count` stand for all beyond the grid (kernel)."""
    # Limited first: a whole number cannot hold every float.
    return int(np.floor(min(max(number, -1.0), float(count))))


@kernel
def _free_share_touching(
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    length: float,
    walls: Array,
    box: Box,
    state: States,
    first_in_cell: Rows,
    in_cell: Rows,
    first_in_row: Rows,
    in_row: Rows,
    cuts: Array,
) -> float:
    """The same as `_free_share` for a step that touches a wall: piece by piece (kernel)."""
    count = fill_cuts(x0, y0, x1, y1, length, walls, cuts)
    middle_x, middle_y, enterable = np.empty(1), np.empty(1), np.empty(1, np.bool_)
    for k in range(count - 1):
        if (cuts[k + 1] - cuts[k]) * length <= ON_WALL_M:
            continue
        middle = 0.5 * (cuts[k] + cuts[k + 1])
        middle_x[0], middle_y[0] = x0 + middle * (x1 - x0), y0 + middle * (y1 - y0)
        fill_enterable(
            middle_x, middle_y, walls, box, state,
            first_in_cell, in_cell, first_in_row, in_row, enterable,
        )  # fmt: skip
        if not enterable[0]:
            return float(cuts[k])
    return np.inf
