"""How much of which obstacle lies between two points.

Shapely builds and checks the outlines; a compiled loop evaluates the links. The line through both
ends of a link enters and leaves an outline an even number of times; between entry and exit it is
inside. Clipping those intervals to the link and to the obstacle's height gives the crossed length,
without special cases for an end that lies on an outline (a beacon on a shelf face). A link that
runs along a face is outside; an exactly vertical link crosses nothing.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from blesim.kernels import kernel
from blesim.venue.floor_plan import Obstacle

# A shorter stretch inside an outline is a touch, not a crossing.
TOUCH_M = 1e-6
# A corner closer to the line than this is on it.
_ON_LINE_M = 1e-10


class _Walls(NamedTuple):
    """Outlines as flat arrays: corners of obstacle k are rows first[k] to first[k + 1].

    Every ring is closed, its first corner repeated at its end; ``opens`` marks its beginning.
    """

    corners: NDArray[np.float64]
    opens: NDArray[np.bool_]
    first: NDArray[np.int64]
    box: NDArray[np.float64]
    height_m: NDArray[np.float64]
    crossing_db: NDArray[np.float64]
    metre_db: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class LineOfSight:
    """The obstacles of one level, ready to be asked about many links at once."""

    walls: _Walls
    longest_outline: int

    @classmethod
    def through(cls, obstacles: Sequence[Obstacle]) -> Self:
        """Build from obstacles that stand on the same level.

        Parameters
        ----------
        obstacles : sequence of Obstacle
            Outlines may have holes and need not be convex.
        """
        rings = [_rings(obstacle) for obstacle in obstacles]
        counts = np.array([sum(map(len, outline)) for outline in rings], dtype=np.int64)
        boxes = [shapely.bounds(obstacle.outline) for obstacle in obstacles]
        flat = [ring for outline in rings for ring in outline]
        walls = _Walls(
            corners=np.concatenate([np.empty((0, 2)), *flat]),
            opens=np.concatenate(
                [np.empty(0, bool), *(np.arange(len(ring)) == 0 for ring in flat)]
            ),
            first=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            box=np.array(boxes, dtype=np.float64).reshape(-1, 4),
            height_m=np.array([obstacle.height_m for obstacle in obstacles], dtype=np.float64),
            crossing_db=np.array([o.loss.crossing_db for o in obstacles], dtype=np.float64),
            metre_db=np.array([o.loss.metre_db for o in obstacles], dtype=np.float64),
        )
        return cls(walls=walls, longest_outline=int(counts.max(initial=0)))

    def lengths_m(
        self, start_m: NDArray[np.float64], end_m: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Length of each link inside each obstacle.

        Parameters
        ----------
        start_m, end_m : ndarray of float64, (n, 3)
            Ends of the links: x, y and height above the floor. [m]

        Returns
        -------
        ndarray of float64, (n, number of obstacles)
            [m]
        """
        _refuse_bad_ends(start_m, end_m)
        out = np.zeros((len(start_m), len(self.walls.height_m)))
        full = np.ones((len(self.walls.height_m), 1))
        _fill(start_m, end_m, self.walls, self.longest_outline, full, 1.0, out, np.empty(0))
        return out

    def loss_db(
        self,
        start_m: NDArray[np.float64],
        end_m: NDArray[np.float64],
        stock: NDArray[np.float64] | None = None,
        bay_m: float = 1.0,
    ) -> NDArray[np.float64]:
        """Loss of each link through all obstacles: per crossing plus per metre; see `Material`.

        Parameters
        ----------
        start_m, end_m : ndarray of float64, (n, 3)
            Ends of the links: x, y and height above the floor. [m]
        stock : ndarray of float64, (number of obstacles, bays), optional
            Factor of the loss of each bay, counted along the longer side of the outline's box; a
            link has the factor of the bay where it first crosses. [-]
        bay_m : float
            Length of a bay. [m]

        Returns
        -------
        ndarray of float64, (n,)
            [dB]
        """
        _refuse_bad_ends(start_m, end_m)
        if stock is None:
            stock = np.ones((len(self.walls.height_m), 1))
        out, nothing = np.zeros(len(start_m)), np.empty((0, 0))
        _fill(start_m, end_m, self.walls, self.longest_outline, stock, bay_m, nothing, out)
        return out


def bays_of(outline: Polygon, bay_m: float) -> int:
    """Number of bays along the longer side of an outline's box; see `LineOfSight.loss_db`."""
    west, south, east, north = outline.bounds
    return max(1, math.ceil(max(east - west, north - south) / bay_m - 1e-9))


def _refuse_bad_ends(start_m: NDArray[np.float64], end_m: NDArray[np.float64]) -> None:
    """Raise before a kernel, which checks no bounds, would read beyond an array."""
    if start_m.shape != end_m.shape or start_m.shape[1:] != (3,):
        raise ValueError(f"links need two (n, 3) arrays, not {start_m.shape} and {end_m.shape}")


def _rings(obstacle: Obstacle) -> list[NDArray[np.float64]]:
    """Closed rings of an outline, each (n, 2). [m]."""
    rings = [obstacle.outline.exterior, *obstacle.outline.interiors]
    return [shapely.get_coordinates(ring) for ring in rings]


class _Link(NamedTuple):
    """One link: start, way to the end, length. [m]."""

    x: float
    y: float
    z: float
    along_x: float
    along_y: float
    along_z: float
    length: float


@kernel
def _link(start: NDArray[np.float64], end: NDArray[np.float64], row: int) -> _Link:
    along_x, along_y = end[row, 0] - start[row, 0], end[row, 1] - start[row, 1]
    along_z = end[row, 2] - start[row, 2]
    length = np.sqrt(along_x * along_x + along_y * along_y + along_z * along_z)
    return _Link(start[row, 0], start[row, 1], start[row, 2], along_x, along_y, along_z, length)


@kernel
def _misses_box(link: _Link, west: float, south: float, east: float, north: float) -> bool:
    """Whether the link passes by an upright box for certain: separating axes (kernel)."""
    to_x, to_y = west + east - 2.0 * link.x, south + north - 2.0 * link.y
    wide, high = east - west, north - south
    if abs(to_x - link.along_x) > abs(link.along_x) + wide:
        return True
    if abs(to_y - link.along_y) > abs(link.along_y) + high:
        return True
    # A little longer than exact, so that rounding never hides a crossing.
    reach = (abs(link.along_x) * high + abs(link.along_y) * wide) * (1.0 + 1e-12)
    return bool(abs(link.along_x * to_y - link.along_y * to_x) > reach)


@kernel
def _crossings(
    link: _Link,
    corners: NDArray[np.float64],
    opens: NDArray[np.bool_],
    first: int,
    beyond: int,
    strict: bool,
    shares: NDArray[np.float64],
) -> tuple[int, bool]:
    """Sort into `shares` where the line enters and leaves, 0 at start and 1 at end (kernel).

    A corner on the line counts to its left, or to its right if `strict`. Also returned: whether
    there is such a corner.
    """
    square = link.along_x * link.along_x + link.along_y * link.along_y
    per_square, on_line = 1.0 / square, _ON_LINE_M * np.sqrt(square)
    count, touches = 0, False
    old_x, old_y, old_side, old_left = 0.0, 0.0, 0.0, False
    for row in range(first, beyond):
        x, y = corners[row, 0] - link.x, corners[row, 1] - link.y
        side = link.along_x * y - link.along_y * x
        if abs(side) <= on_line:
            side, touches = 0.0, True
        left = side > 0.0 or (side == 0.0 and not strict)
        if not opens[row] and left != old_left:
            part = old_side / (old_side - side)
            cut_x, cut_y = old_x + part * (x - old_x), old_y + part * (y - old_y)
            _insert(shares, count, (cut_x * link.along_x + cut_y * link.along_y) * per_square)
            count += 1
        old_x, old_y, old_side, old_left = x, y, side, left
    return count, touches


@kernel
def _insert(shares: NDArray[np.float64], count: int, share: float) -> None:
    """Put a number in its place among the first `count`, which are sorted (kernel)."""
    place = count
    while place > 0 and shares[place - 1] > share:
        shares[place] = shares[place - 1]
        place -= 1
    shares[place] = share


@kernel
def _overlap(
    a: NDArray[np.float64],
    count_a: int,
    b: NDArray[np.float64],
    count_b: int,
    both: NDArray[np.float64],
) -> int:
    """Put into `both` the entries and exits of what lies in the intervals of a and b (kernel)."""
    count = 0
    for i in range(0, count_a, 2):
        for j in range(0, count_b, 2):
            enter, leave = max(a[i], b[j]), min(a[i + 1], b[j + 1])
            if leave > enter:
                both[count], both[count + 1] = enter, leave
                count += 2
    return count


@kernel
def _below(link: _Link, height: float) -> tuple[float, float]:
    """Part of the link, as shares, that runs below a height (kernel)."""
    end_z = link.z + link.along_z
    if link.z <= height and end_z <= height:
        return 0.0, 1.0
    if link.z > height and end_z > height:
        return 1.0, 0.0
    level_with_top = (height - link.z) / link.along_z
    return (0.0, level_with_top) if link.z <= height else (level_with_top, 1.0)


@kernel
def _inside(
    link: _Link, shares: NDArray[np.float64], count: int, low: float, high: float
) -> tuple[float, int]:
    """Length inside one obstacle between two shares of the link, and the number of crossings."""
    length, crossings = 0.0, 0
    for entry in range(0, count, 2):
        inside = link.length * (min(shares[entry + 1], high) - max(shares[entry], low))
        if inside > TOUCH_M:
            length += inside
            crossings += 1
    return length, crossings


@kernel
def _bay(
    link: _Link, box: NDArray[np.float64], row: int, share: float, bay_m: float, bays: int
) -> int:
    """Bay of an obstacle that a link enters at a share of its way (kernel)."""
    if box[row, 2] - box[row, 0] >= box[row, 3] - box[row, 1]:
        along_m = link.x + share * link.along_x - box[row, 0]
    else:
        along_m = link.y + share * link.along_y - box[row, 1]
    return min(max(int(along_m / bay_m), 0), bays - 1)


@kernel
def _fill(
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    walls: _Walls,
    longest_outline: int,
    stock: NDArray[np.float64],
    bay_m: float,
    lengths: NDArray[np.float64],
    losses: NDArray[np.float64],
) -> None:
    """Fill the lengths (n, obstacles) and the losses (n,); an empty array is left out (kernel)."""
    # Taken out of the tuple once: in the loop each access would count references.
    corners, opens, first, box = walls.corners, walls.opens, walls.first, walls.box
    height, crossing_db, metre_db = walls.height_m, walls.crossing_db, walls.metre_db
    shares, strict = np.empty(longest_outline), np.empty(longest_outline)
    both = np.empty(2 * longest_outline)
    for row in range(len(start)):
        link = _link(start, end, row)
        for k in range(len(height)):
            if _misses_box(link, box[k, 0], box[k, 1], box[k, 2], box[k, 3]):
                continue
            low, high = _below(link, height[k])
            begin, beyond = first[k], first[k + 1]
            count, touches = _crossings(link, corners, opens, begin, beyond, False, shares)
            length, crossings = _inside(link, shares, count, low, high)
            if touches:
                # Inside is what is inside on both sides of a line that runs along a face.
                other, _ = _crossings(link, corners, opens, begin, beyond, True, strict)
                count = _overlap(shares, count, strict, other, both)
                length, crossings = _inside(link, both, count, low, high)
            if len(lengths):
                lengths[row, k] = length
            if len(losses) and crossings:
                full_db = crossings * crossing_db[k] + length * metre_db[k]
                bay = _bay(link, box, k, max(shares[0], low), bay_m, stock.shape[1])
                losses[row] += full_db * stock[k, bay]
