"""The enterable area of a level as plain arrays: its walls, and a grid that tells which are near.

A wall is one straight piece of the area's outline: of the level's bounds, or of an obstacle. A cell
of the grid without walls lies wholly inside or outside the area, so that most questions need no
wall at all; the others need the walls of a few cells.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from blesim.errors import UsageError
from blesim.venue.graph import read_only

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

OUTSIDE, INSIDE, MIXED = 0, 1, 2
# Cells know walls this far beyond them, so that rounding never hides a wall.
REACH_M = 1e-6
# About as long as a step: measured to be faster than twice or half of it.
_CELL_M = 0.5
_MOST_CELLS = 250_000


class Box(NamedTuple):
    """Where a grid lies: lower left corner and length of a cell [m], columns and rows of cells."""

    west: float
    south: float
    cell: float
    columns: int
    rows: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanGrid:
    """Walls and cells; cell (column, row) is number ``row * columns + column``.

    Attributes
    ----------
    walls : ndarray of float64, (walls, 4)
        x and y of both ends. [m]
    box : Box
        Where the grid lies.
    state : ndarray of int8, (cells,)
        `OUTSIDE` or `INSIDE` where that holds for the whole cell, `MIXED` where it has walls.
    first_in_cell, in_cell : ndarray of int64, (cells + 1,) and (k,)
        Walls near cell c are ``in_cell[first_in_cell[c] : first_in_cell[c + 1]]``.
    first_in_row, in_row : ndarray of int64, (rows + 1,) and (k,)
        The same for whole rows of cells.
    """

    walls: Array
    box: Box
    state: NDArray[np.int8]
    first_in_cell: Rows
    in_cell: Rows
    first_in_row: Rows
    in_row: Rows

    @property
    def arrays(self) -> tuple[Array, Box, NDArray[np.int8], Rows, Rows, Rows, Rows]:
        """All attributes in order, for the kernels."""
        cells, rows = (self.first_in_cell, self.in_cell), (self.first_in_row, self.in_row)
        return self.walls, self.box, self.state, *cells, *rows


def plan_grid(area: BaseGeometry) -> PlanGrid:
    """Grid of an enterable area.

    Parameters
    ----------
    area : shapely.Polygon or shapely.MultiPolygon
        May have holes and need not be convex; see `FloorPlan.walkable`. [m]

    Raises
    ------
    UsageError
        If the area is empty, or not a valid polygon.
    """
    if area.is_empty or not area.is_valid or not area.area > 0:
        raise UsageError("enterable area: no valid polygon; give the walkable area of one level")
    walls = _walls(area)
    box = _box(area)
    tree = shapely.STRtree(np.asarray(shapely.linestrings(walls.reshape(-1, 2, 2))))
    row, column = np.divmod(np.arange(box.columns * box.rows), box.columns)
    west, south = box.west + box.cell * column, box.south + box.cell * row
    cells = shapely.box(west, south, west + box.cell, south + box.cell)
    first_in_cell, in_cell = _near(tree, cells)
    west, south = west[:: box.columns], south[:: box.columns]
    rows = shapely.box(west, south, west + box.columns * box.cell, south + box.cell)
    first_in_row, in_row = _near(tree, rows)
    shapely.prepare(area)
    inside = shapely.contains_properly(area, shapely.centroid(cells))
    walled = np.diff(first_in_cell) > 0
    return PlanGrid(
        walls=read_only(walls),
        box=box,
        state=read_only(np.where(walled, MIXED, np.where(inside, INSIDE, OUTSIDE)).astype(np.int8)),
        first_in_cell=first_in_cell,
        in_cell=in_cell,
        first_in_row=first_in_row,
        in_row=in_row,
    )


def _walls(area: BaseGeometry) -> Array:
    """Straight pieces of the outline, (walls, 4). [m]."""
    rings = shapely.get_rings(shapely.get_parts(area))
    pieces = [
        np.hstack([corners[:-1], corners[1:]]) for corners in map(shapely.get_coordinates, rings)
    ]
    walls = np.concatenate(pieces)
    return walls[np.any(walls[:, :2] != walls[:, 2:], axis=1)]


def _box(area: BaseGeometry) -> Box:
    """Grid around an area, with at least a cell's width to spare on the upper sides."""
    west, south, east, north = area.bounds
    cell = max(_CELL_M, float(np.sqrt((east - west) * (north - south) / _MOST_CELLS)))
    west, south = west - 0.5 * cell, south - 0.5 * cell
    columns, rows = int((east - west) / cell) + 2, int((north - south) / cell) + 2
    return Box(west, south, cell, columns, rows)


def _near(tree: shapely.STRtree, places: NDArray[Any]) -> tuple[Rows, Rows]:
    """First entry of each place, (places + 1,), and the walls near each, (k,)."""
    place, wall = tree.query(places, predicate="dwithin", distance=REACH_M)
    order = np.lexsort((wall, place))
    meeting = np.bincount(place, minlength=len(places))
    first = np.concatenate([[0], np.cumsum(meeting)]).astype(np.int64)
    return read_only(first), read_only(wall[order].astype(np.int64))
