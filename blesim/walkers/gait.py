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
# Who is faster runs: where people change over by themselves lies about 2 m/s.
RUNNING_FROM_M_S = 2.0
# Strides with an acceleration are looked at in pieces of this length.
_PIECE_S = 0.05


class Gait(Settings):
    """How somebody steps.

    Attributes
    ----------
    length_at_rest_m, length_per_speed_s : float
        Step length L = a + b v. Measured with the phone in hand: 0.61 m at 1.0 m/s (1.65 Hz) and
        0.69 m at 1.25 m/s (1.82 Hz), which gives a = 0.29 m and b = 0.32 s. [m], [s]
    interval_variation : float
        Coefficient of variation of the step interval; 0.085 measured in hand. [-]
    running_length_at_rest_m, running_length_per_speed_s : float
        The same relation from 2 m/s on. Runners choose 77, 79 and 80 strides a minute at 2.4, 2.6
        and 2.9 m/s [1]_, which gives a = 0.20 m and b = 0.305 s. [m], [s]
    running_interval_variation : float
        Coefficient of variation of the step interval of runners; assumed. [-]

    References
    ----------
    .. [1] B. T. van Oeveren et al., "Optimal stride frequencies in running at different speeds",
       PLoS ONE 12, 2017. doi:10.1371/journal.pone.0184273
    """

    length_at_rest_m: float = Field(default=0.29, ge=0, le=1)
    length_per_speed_s: float = Field(default=0.32, ge=0, le=1)
    interval_variation: float = Field(default=0.085, ge=0, lt=0.3)
    running_length_at_rest_m: float = Field(default=0.2, ge=0, le=1)
    running_length_per_speed_s: float = Field(default=0.305, ge=0, le=1)
    running_interval_variation: float = Field(default=0.03, ge=0, lt=0.3)

    def step_length_m(self, speed_m_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean step length at a speed, any shape. [m]."""
        walking_m = self.length_at_rest_m + self.length_per_speed_s * speed_m_s
        running_m = self.running_length_at_rest_m + self.running_length_per_speed_s * speed_m_s
        return np.where(speed_m_s < RUNNING_FROM_M_S, walking_m, running_m)

    def variation(self, speed_m_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Coefficient of variation of the step interval at a speed, any shape. [-]."""
        runs = speed_m_s >= RUNNING_FROM_M_S
        return np.where(runs, self.running_interval_variation, self.interval_variation)

    def longest_step_m(self, speed_m_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Length that no step at a steady speed exceeds, any shape. [m]."""
        most = 1.0 + _LARGEST_DEVIATION * self.variation(speed_m_s)
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
    time_us, speed_m_s = _pieces(trajectory)
    span_s = np.diff(time_us) / MICROSECONDS_PER_SECOND
    distance_m = np.concatenate([[0.0], np.cumsum(speed_m_s * span_s)])
    cadence_hz = speed_m_s / np.maximum(gait.step_length_m(speed_m_s), 1e-3)
    phase = np.concatenate([[0.0], np.cumsum(cadence_hz * span_s)])
    marks = _phase_marks(phase, gait.variation(speed_m_s), seed, walker)
    if len(marks) == 0:
        return StepTruth.empty()
    # Where the phase stands still, between two equal knots, no mark can fall.
    step_us = np.interp(marks, phase, time_us).astype(np.int64)
    walked_m = np.interp(step_us, time_us, distance_m)
    return StepTruth(
        time_us=step_us,
        length_m=np.diff(walked_m, prepend=0.0),
        heading_rad=trajectory.at(step_us).heading_rad,
        foot=np.arange(len(step_us)) % 2,
    )


def _pieces(trajectory: Trajectory) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times that divide a walk (n + 1,) [us], and the mean speed of each piece (n,) [m/s].

    A steady stretch is one piece; others are cut so finely that the mean speed of a piece tells
    its cadence, and its length exactly.
    """
    knots_us = trajectory.time_us.astype(np.float64)
    span_us = np.diff(knots_us)
    walks = trajectory.state[:-1] == _WALKING
    speed_m_s = np.where(walks, trajectory.speed_m_s[:-1], 0.0)
    rate_m_s2 = np.where(walks, trajectory.acceleration_m_s2[:-1], 0.0)
    if not rate_m_s2.any():
        return knots_us, speed_m_s
    cuts = np.where(rate_m_s2 != 0, np.ceil(span_us / (_PIECE_S * 1e6)), 1).astype(np.int64)
    cuts = np.maximum(cuts, 1)
    row = np.repeat(np.arange(len(cuts)), cuts)
    number = np.arange(len(row)) - np.repeat(np.cumsum(cuts) - cuts, cuts)
    piece_us = (span_us / cuts)[row]
    since_us = number * piece_us
    middle_s = (since_us + 0.5 * piece_us) / MICROSECONDS_PER_SECOND
    mean_m_s = np.maximum(speed_m_s[row] + rate_m_s2[row] * middle_s, 0.0)
    return np.append(knots_us[:-1][row] + since_us, knots_us[-1]), mean_m_s


def _phase_marks(
    phase: NDArray[np.float64], variation: NDArray[np.float64], seed: int, walker: str
) -> NDArray[np.float64]:
    """Phases at which a foot is set down, up to the last; intervals vary as at their phase."""
    last = phase[-1]
    enough = int(2 * last) + 10
    draws = Draws(seed=seed, purpose="step interval", walker=walker)
    deviation = draws.normals(np.arange(enough))[:, 0]
    deviation = np.clip(deviation, -_LARGEST_DEVIATION, _LARGEST_DEVIATION)
    if len(variation) == 0:
        return np.empty(0)
    # A step more or less does not matter: the n-th is taken about phase n.
    piece = np.searchsorted(phase[1:], np.arange(enough) + 0.5)
    spread = variation[np.minimum(piece, len(variation) - 1)]
    marks = np.cumsum(1.0 + spread * deviation)
    return np.asarray(marks[marks <= last], np.float64)
