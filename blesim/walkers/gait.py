"""The steps of a walk: when, how long, which way, with which foot."""

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim import columns
from blesim.rng import Draws
from blesim.settings import Settings
from blesim.tables import StepTruth, Trajectory
from blesim.units import MICROSECONDS_PER_SECOND

_WALKING = dict(columns.STATES)["walking"]
# The variation is below 0.3, so three standard deviations leave every interval positive.
_LARGEST_DEVIATION = 3.0


class Gait(Settings):
    """How somebody steps.

    Attributes
    ----------
    length_at_rest_m, length_per_speed_s : float
        Step length L = a + b v. Measured with the phone in hand: 0.61 m at 1.0 m/s (1.65 Hz) and
        0.69 m at 1.25 m/s (1.82 Hz), which gives a = 0.29 m and b = 0.32 s. [m], [s]
    interval_variation : float
        Coefficient of variation of the step interval; 0.085 measured in hand. [-]
    """

    length_at_rest_m: float = Field(default=0.29, ge=0, le=1)
    length_per_speed_s: float = Field(default=0.32, ge=0, le=1)
    interval_variation: float = Field(default=0.085, ge=0, lt=0.3)

    def step_length_m(self, speed_m_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean step length at a speed, any shape. [m]."""
        return self.length_at_rest_m + self.length_per_speed_s * speed_m_s

    def longest_step_m(self, speed_m_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Length that no step at a steady speed exceeds, any shape. [m]."""
        most = 1.0 + _LARGEST_DEVIATION * self.interval_variation
        return most * self.step_length_m(speed_m_s)


def steps_of(trajectory: Trajectory, gait: Gait, seed: int, walker: str) -> StepTruth:
    """Steps that carry a walker along a trajectory.

    The gait's phase grows by speed over step length; a step is set down whenever it passes the
    next of a row of marks that are one apart on average and vary as step intervals do.

    Parameters
    ----------
    trajectory : Trajectory
        The walk.
    gait : Gait
        How the walker steps.
    seed, walker : int, str
        Address of the draws.

    Returns
    -------
    StepTruth
        In order of time; no steps while the walker stands or turns.
    """
    speed_m_s = np.where(trajectory.state == _WALKING, trajectory.speed_m_s, 0.0)[:-1]
    span_s = np.diff(trajectory.time_us) / MICROSECONDS_PER_SECOND
    distance_m = np.concatenate([[0.0], np.cumsum(speed_m_s * span_s)])
    cadence_hz = speed_m_s / np.maximum(gait.step_length_m(speed_m_s), 1e-3)
    phase = np.concatenate([[0.0], np.cumsum(cadence_hz * span_s)])
    marks = _phase_marks(phase[-1], gait, seed, walker)
    if len(marks) == 0:
        return StepTruth.empty()
    # Where the phase stands still, between two equal knots, no mark can fall.
    time_us = np.interp(marks, phase, trajectory.time_us).astype(np.int64)
    walked_m = np.interp(time_us, trajectory.time_us, distance_m)
    return StepTruth(
        time_us=time_us,
        length_m=np.diff(walked_m, prepend=0.0),
        heading_rad=trajectory.at(time_us).heading_rad,
        foot=np.arange(len(time_us)) % 2,
    )


def _phase_marks(last: float, gait: Gait, seed: int, walker: str) -> NDArray[np.float64]:
    """Phases at which a foot is set down, up to `last`."""
    enough = int(2 * last) + 10
    draws = Draws(seed=seed, purpose="step interval", walker=walker)
    deviation = draws.normals(np.arange(enough))[:, 0]
    deviation = np.clip(deviation, -_LARGEST_DEVIATION, _LARGEST_DEVIATION)
    marks = np.cumsum(1.0 + gait.interval_variation * deviation)
    return marks[marks <= last]
