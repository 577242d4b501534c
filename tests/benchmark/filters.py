"""Steps of filters: Kalman updates against filterpy, particles on a plan against shapely."""

from collections.abc import Callable
from functools import cache

import numpy as np
import shapely
from filterpy.kalman import KalmanFilter
from measure import Row, seconds, speed_ratio
from numpy.typing import NDArray

from blesim.filters import kalman
from blesim.filters.graph_motion import GraphArrays
from blesim.filters.plan_motion import PlanMotion
from blesim.venue.layouts import wholesale_store

_OBSTACLES = 50
_STEPS = 100_000
_STEP_M = 0.65
_PARTICLES = 500


class _Hall:
    """A hall with fifty shelves, and steps of particles in it, for either side."""

    def __init__(self) -> None:
        column, row = np.divmod(np.arange(_OBSTACLES), 5)
        shelves = shapely.box(2.0 + 5 * column, 2.0 + 6 * row, 5.5 + 5 * column, 3.5 + 6 * row)
        self.area = shapely.box(0, 0, 52, 33) - shapely.union_all(shelves)
        shapely.prepare(self.area)
        self.motion = PlanMotion.on(self.area)
        rng = np.random.default_rng(1)
        self.x0_m, self.y0_m = self.motion.uniform_places(_STEPS, rng)
        heading_rad = rng.uniform(-np.pi, np.pi, _STEPS)
        self.x1_m = self.x0_m + _STEP_M * np.cos(heading_rad)
        self.y1_m = self.y0_m + _STEP_M * np.sin(heading_rad)
        ends = np.stack([self.x0_m, self.y0_m, self.x1_m, self.y1_m], axis=1)
        self.lines = shapely.linestrings(ends.reshape(-1, 2, 2))

    def kernel(self) -> NDArray[np.bool_]:
        return self.motion.blocked(self.x0_m, self.y0_m, self.x1_m, self.y1_m)

    def vectorised(self) -> NDArray[np.bool_]:
        return ~np.asarray(shapely.covers(self.area, self.lines))


@cache
def _hall() -> _Hall:
    hall = _Hall()
    np.testing.assert_array_equal(hall.kernel(), hall.vectorised())
    return hall


def plan_over_shapely() -> float:
    """Steps against a prepared area with fifty holes, lines built beforehand."""
    hall = _hall()
    return speed_ratio(hall.kernel, hall.vectorised, rounds=7, our_repeats=5)


def plan_steps() -> float:
    """Steps a second, the best of several turns. [millions]."""
    hall = _hall()
    return _STEPS / 1e6 / min(seconds(hall.kernel) for _ in range(20))


def _range_updates() -> tuple[Callable[[], object], Callable[[], object]]:
    """An update of four states by three ranges: ours and filterpy's."""
    rng = np.random.default_rng(2)
    mean, covariance, noise = np.zeros(4), np.eye(4), np.eye(3)
    model, measured = rng.normal(0, 1, (3, 4)), rng.normal(0, 1, 3)
    theirs = KalmanFilter(dim_x=4, dim_z=3)
    theirs.x, theirs.P, theirs.H, theirs.R = mean.copy(), covariance, model, noise
    return (
        lambda: kalman.update_linear(mean, covariance, measured, model, noise),
        lambda: theirs.update(measured),
    )


def kalman_over_filterpy() -> float:
    """One update, called from Python on either side."""
    ours, theirs = _range_updates()
    return speed_ratio(ours, theirs, rounds=7, our_repeats=1000, their_repeats=200)


def graph_update() -> float:
    """Motion of 500 particles on the graph of the whole store for a tenth of a second. [us]."""
    graph = wholesale_store().graph
    assert graph is not None
    arrays, rng = GraphArrays.of(graph), np.random.default_rng(3)
    edge, offset_m = arrays.uniform_places(rng.random(_PARTICLES))
    velocity_m_s = rng.uniform(-2, 2, _PARTICLES)
    key = np.array([1, 2], dtype=np.uint64)

    def update() -> None:
        arrays.advance(edge, offset_m, velocity_m_s, 0.1, turn_back=True, key=key, ordinal=0)

    update()
    return 1e6 * min(seconds(update, 200) for _ in range(10))


ROWS = [
    Row(
        name="steps on a plan / shapely vectorised",
        unit="x",
        goal=">= 4",
        measure=plan_over_shapely,
    ),
    Row(name="steps on a plan, 50 obstacles", unit="M/s", goal=">= 5", measure=plan_steps),
    Row(name="Kalman update / filterpy", unit="x", goal=">= 2", measure=kalman_over_filterpy),
    Row(name="motion of 500 particles on a graph", unit="us", measure=graph_update),
]
