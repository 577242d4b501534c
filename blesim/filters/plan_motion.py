"""Motion of particles on a floor plan: where they may stand, and what stands in their way.

The enterable area counts with its outline: a particle may stand at a wall and walk along it, or
touch a corner. A step is blocked if any of it lies outside the area, however thin the obstacle it
crosses. Lengths below a nanometre are rounding.

References
----------
.. [1] Particle filter on beacon proximity and a floor map, about 2017, section III-C; digest
   "proximity-particle-filter": a particle that would enter an un-enterable area is moved to just
   before it.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from blesim.filters.plan_grid import PlanGrid, plan_grid
from blesim.filters.plan_kernels import fill_enterable, fill_free_share
from blesim.filters.walls import ON_WALL_M

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanMotion:
    """The enterable area of one level, ready to be asked about many particles at once."""

    grid: PlanGrid

    @classmethod
    def on(cls, area: BaseGeometry) -> Self:
        """Motion on an area.

        Parameters
        ----------
        area : shapely.Polygon or shapely.MultiPolygon
            May have holes and need not be convex; see `FloorPlan.walkable`. [m]

        Raises
        ------
        UsageError
            If the area is empty, or not a valid polygon.
        """
        return cls(grid=plan_grid(area))

    def enterable(self, x_m: Array, y_m: Array) -> Flags:
        """Whether a particle may stand at each place.

        Parameters
        ----------
        x_m, y_m : ndarray of float64, (n,)
            [m]

        Returns
        -------
        ndarray of bool, (n,)
            False for NaN.
        """
        _refuse_unequal(x_m, y_m)
        out = np.empty(len(x_m), np.bool_)
        fill_enterable(x_m, y_m, *self.grid.arrays, out)
        return out

    def blocked(self, x0_m: Array, y0_m: Array, x1_m: Array, y1_m: Array) -> Flags:
        """Whether any of each straight step lies outside the enterable area.

        Parameters
        ----------
        x0_m, y0_m, x1_m, y1_m : ndarray of float64, (n,)
            Start and end. [m]

        Returns
        -------
        ndarray of bool, (n,)
            True for NaN.
        """
        _refuse_unequal(x0_m, y0_m, x1_m, y1_m)
        share = np.empty(len(x0_m))
        fill_free_share(x0_m, y0_m, x1_m, y1_m, *self.grid.arrays, True, share)
        blocked: Flags = share < np.inf
        return blocked

    def stopped(
        self, x0_m: Array, y0_m: Array, x1_m: Array, y1_m: Array, margin_m: float = 0.01
    ) -> tuple[Array, Array, Flags]:
        """Where each step ends if it must not leave the area: at most just before a wall [1]_.

        Parameters
        ----------
        x0_m, y0_m, x1_m, y1_m : ndarray of float64, (n,)
            Start and wished end. [m]
        margin_m : float
            Way left before the wall; where the start is nearer, the particle stays. [m]

        Returns
        -------
        x_m, y_m : ndarray of float64, (n,)
            Enterable wherever the start is. [m]
        blocked : ndarray of bool, (n,)
            Whether the step was cut short.
        """
        _refuse_unequal(x0_m, y0_m, x1_m, y1_m)
        free = np.empty(len(x0_m))
        fill_free_share(x0_m, y0_m, x1_m, y1_m, *self.grid.arrays, False, free)
        blocked = free < np.inf
        length_m = np.hypot(x1_m - x0_m, y1_m - y0_m)
        left = max(margin_m, ON_WALL_M) / np.maximum(length_m, ON_WALL_M)
        share = np.clip(free - left, 0.0, 1.0)
        x_m = np.where(blocked, x0_m + share * (x1_m - x0_m), x1_m)
        y_m = np.where(blocked, y0_m + share * (y1_m - y0_m), y1_m)
        return x_m, y_m, blocked

    def uniform_places(self, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Places anywhere on the area, every square metre equally likely, (count,) each. [m]."""
        west, south = self.grid.walls[:, 0].min(), self.grid.walls[:, 1].min()
        east, north = self.grid.walls[:, 0].max(), self.grid.walls[:, 1].max()
        found = np.empty((0, 2))
        while len(found) < count:
            tried = rng.uniform((west, south), (east, north), (max(count, 64), 2))
            x_m, y_m = np.ascontiguousarray(tried.T)
            found = np.concatenate([found, tried[self.enterable(x_m, y_m)]])
        return found[:count, 0].copy(), found[:count, 1].copy()


def _refuse_unequal(*arrays: Array) -> None:
    """Raise before a kernel, which checks no bounds, would read beyond an array."""
    if any(array.shape != arrays[0].shape or array.ndim != 1 for array in arrays):
        raise ValueError("give coordinates as arrays (n,) of one length")
