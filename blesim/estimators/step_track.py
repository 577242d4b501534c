"""The track of a tracker whose position changes with steps and beacon fixes.

It tells a position after every step and every reading: the latest, held in between.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from blesim.estimators.base import make_track
from blesim.estimators.beacon_fixes import BeaconFixes
from blesim.estimators.walked_steps import StepWatch
from blesim.recording import Observations
from blesim.tables import IntArray, Track

# x, y, variance of x, variance of y, covariance. [m], [m2]
State = tuple[float, float, float, float, float]


class Motion(Protocol):
    """The live position of one walker, moved step by step and fix by fix."""

    @property
    def state(self) -> State:
        """Position and its covariance."""
        ...

    def step(self, length_m: float, heading_rad: float, turning: bool) -> None:
        """Take a step. [m], [rad]."""
        ...

    def fix(self, beacon: int) -> None:
        """Take the news of being at a beacon, by its row in the venue."""
        ...


class StepTracker:
    """Tracker with one estimate after every step and every reading.

    Parameters
    ----------
    steps : StepWatch
        The walker's steps.
    motion : Motion
        What moves with them.
    level : int
        Level of the start; it stays.
    fixes : BeaconFixes or None
        Fixes in the readings, if the motion takes any.
    """

    def __init__(
        self, steps: StepWatch, motion: Motion, *, level: int, fixes: BeaconFixes | None = None
    ) -> None:
        self._steps = steps
        self._motion = motion
        self._level = level
        self._fixes = fixes

    def advance(self, block: Observations) -> Track:
        """Estimates after each step and each reading of the block."""
        walked = self._steps.advance(block)
        row, beacon = _NO_FIXES if self._fixes is None else self._fixes.advance(block.readings)
        time_us, step_at, reading_at = merged(walked.time_us, block.readings.time_us)
        states = HeldStates(len(time_us), self._motion.state, self._level)
        at = np.concatenate([step_at, reading_at[row]])
        for event in np.argsort(at, kind="stable").tolist():
            if event < len(walked):
                self._motion.step(
                    float(walked.length_m[event]),
                    float(walked.heading_rad[event]),
                    bool(walked.turning[event]),
                )
            else:
                self._motion.fix(int(beacon[event - len(walked)]))
            states.put(int(at[event]), self._motion.state, self._level)
        return states.track(time_us)


_NO_FIXES = (np.empty(0, np.int64), np.empty(0, np.int64))


class HeldStates:
    """States at n moments, of which those not put are held from the one before.

    Parameters
    ----------
    count : int
        n.
    before, level : State, int
        Held until the first that is put; NaN where nothing is known yet.
    """

    def __init__(self, count: int, before: State, level: int) -> None:
        self._values = np.empty((count + 1, 6))
        self._values[0] = (*before, level)
        self._put = np.zeros(count + 1, np.int64)

    def put(self, row: int, state: State, level: int) -> None:
        """Set the state from a moment on."""
        self._values[row + 1] = (*state, level)
        self._put[row + 1] = row + 1

    def track(self, time_us: IntArray) -> Track:
        """Track of the moments at which the position is known."""
        values = self._values[np.maximum.accumulate(self._put)][1:]
        known = ~np.isnan(values[:, 0])
        x_m, y_m, variance_x_m2, variance_y_m2, covariance_xy_m2, level = values[known].T
        return make_track(
            time_us=time_us[known],
            x_m=x_m,
            y_m=y_m,
            variance_x_m2=variance_x_m2,
            variance_y_m2=variance_y_m2,
            covariance_xy_m2=covariance_xy_m2,
            level=level.astype(np.int64),
        )


def merged(
    step_us: IntArray, reading_us: IntArray
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Times of steps and readings together, and the rows of each; steps first at one moment.

    Returns
    -------
    time_us : ndarray of int64, (m + n,)
        [us]
    step_at, reading_at : ndarray of int64, (m,) and (n,)
        Their rows in it.
    """
    times = np.concatenate([step_us, reading_us]).astype(np.int64)
    order = np.argsort(times, kind="stable")
    at = np.empty(len(order), np.int64)
    at[order] = np.arange(len(order))
    return times[order], at[: len(step_us)], at[len(step_us) :]
