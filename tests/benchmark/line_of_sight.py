"""Links through the shelves of the whole store: the compiled kernel against shapely."""

from functools import cache

import numpy as np
import shapely
from measure import Row, speed_ratio
from numpy.typing import NDArray

from blesim.venue.layouts import wholesale_store
from blesim.venue.line_of_sight import LineOfSight

_LINKS = 2_000
_HEIGHT_M = 1.0


class _Store:
    """The outlines of the store and random links in its bounds, for either side."""

    def __init__(self) -> None:
        plan = wholesale_store().floor_plan
        west, south, east, north = plan.levels[0].bounds.bounds
        rng = np.random.default_rng(1)
        ends = rng.uniform((west, south), (east, north), (_LINKS, 2, 2))
        height = np.full((_LINKS, 1), _HEIGHT_M)
        self.start = np.hstack([ends[:, 0], height])
        self.end = np.hstack([ends[:, 1], height])
        self.lines = shapely.linestrings(ends)
        self.outlines = np.array([obstacle.outline for obstacle in plan.obstacles])
        self.tree = shapely.STRtree(self.outlines)
        self.sight = LineOfSight.through(plan.obstacles)

    def kernel(self) -> NDArray[np.float64]:
        return self.sight.lengths_m(self.start, self.end)

    def vectorised(self) -> NDArray[np.float64]:
        inside = shapely.intersection(self.outlines[None, :], self.lines[:, None])
        return np.asarray(shapely.length(inside))

    def indexed(self) -> NDArray[np.float64]:
        lengths = np.zeros((len(self.lines), len(self.outlines)))
        line, outline = self.tree.query(self.lines, predicate="intersects")
        inside = shapely.intersection(self.outlines[outline], self.lines[line])
        lengths[line, outline] = shapely.length(inside)
        return lengths


@cache
def _store() -> _Store:
    store = _Store()
    for theirs in (store.vectorised(), store.indexed()):
        np.testing.assert_allclose(store.kernel(), theirs, rtol=0, atol=1e-6)
    return store


def over_vectorised() -> float:
    """Kernel against the intersections of all outlines with all lines, built beforehand."""
    store = _store()
    return speed_ratio(store.kernel, store.vectorised, rounds=7, our_repeats=50)


def over_indexed() -> float:
    """Kernel against a spatial index that leaves only the outlines in question."""
    store = _store()
    return speed_ratio(store.kernel, store.indexed, rounds=7, our_repeats=50)


ROWS = [
    Row(
        name="line of sight / shapely vectorised",
        unit="x",
        goal=">= 100",
        measure=over_vectorised,
    ),
    Row(name="line of sight / shapely STRtree", unit="x", measure=over_indexed),
]
