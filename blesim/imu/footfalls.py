"""What each step does to the body: how hard it falls, how far the limbs swing, what it joins."""

import numpy as np
from numpy.typing import NDArray

from blesim.imu.carriage import FLAT_CONSTANT
from blesim.imu.drift import drift
from blesim.rng import Draws
from blesim.tables import StepTruth
from blesim.units import MICROSECONDS_PER_SECOND

# Columns of a step: its time; whether the next belongs to the same bout of walking; the gait period
# before and after; peak-to-peak acceleration of a phone held flat; deviation of its peak; how far
# limbs swing; whether it is the right foot.
TIME, JOINED, BEFORE, AFTER, FALL, DEVIATION, SWING, FOOT = range(8)
# Steps further apart are the end and the beginning of a bout: cadences below 0.7 Hz are no gait.
LONGEST_STEP_S = 1.5
# Outside its bout, a step's waveform goes on for this share of its period, and fades from half of
# the period on: it swings back once, and does not peak again.
TAIL = 0.8
FADES_FROM = 0.5
_LONGEST_TAIL_S = 0.9
_LONE_STEP_S = 0.6
# Steps on either side whose mean length says how hard the walker walks at present.
_NEIGHBOURS = 2
_USUAL_LENGTH_M = 0.65
# Limbs swing by no more than this times the usual, however long the steps; assumed.
_LARGEST_SWING = 1.6
# Correlation of the heights of consecutive peaks: with what differs between the feet it gives the
# 0.38 measured.
_PEAK_MEMORY = 0.4
_FEET_DIFFER = 0.2
_LARGEST_DEVIATION = 2.2
# Spread between walkers of how hard they fall, assumed; means of walks measured 3.1 to 6.6 about
# 4.7.
_WALKER_VARIATION = 0.2


def footfalls(steps: StepTruth, start_us: int, seed: int, walker: str) -> NDArray[np.float64]:
    """What each step does to the body.

    A peak-to-peak acceleration ``(L / K)^4`` goes with steps of length L [1]_; L is the mean of a
    few steps, and peak heights vary about this, correlated from one step to the next.

    Parameters
    ----------
    steps : StepTruth
        The steps taken.
    start_us : int
        Time from which times are counted. [us]
    seed, walker : int, str
        Address of the draws.

    Returns
    -------
    ndarray of float64, (n, 8)
        See the names of the columns. [s], [-], [s], [s], [m/s2], [-], [-], [-]

    References
    ----------
    .. [1] H. Weinberg, "Using the ADXL202 in pedometer and personal navigation applications",
       Analog Devices AN-602, 2002.
    """
    rows = np.zeros((len(steps), 8))
    if len(steps) == 0:
        return rows
    rows[:, TIME] = (steps.time_us - start_us) / MICROSECONDS_PER_SECOND
    rows[:, FOOT] = steps.foot
    interval_s = np.diff(rows[:, TIME])
    joined = interval_s <= LONGEST_STEP_S
    rows[:-1, JOINED] = joined
    rows[:, BEFORE], rows[:, AFTER] = _periods(interval_s, joined)
    length_m = _typical_length_m(steps.length_m, joined)
    once = Draws(seed=seed, purpose="gait strength", walker=walker).normals(np.zeros(1, int))[0]
    strength = np.exp(_WALKER_VARIATION * _within(once[0]))
    rows[:, FALL] = strength * (length_m / FLAT_CONSTANT) ** 4
    heavier = np.where(steps.foot == (once[1] > 0), _FEET_DIFFER, -_FEET_DIFFER)
    rows[:, DEVIATION] = _within(_deviations(len(steps), seed, walker) + heavier)
    rows[:, SWING] = _bounded(length_m / _USUAL_LENGTH_M)
    return rows


def _periods(
    interval_s: NDArray[np.float64], joined: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gait period before and after each step, (n,) each: that of the bout on its other side."""
    known = np.where(joined, interval_s, np.nan)
    before, after = np.append(np.nan, known), np.append(known, np.nan)
    filled = np.where(np.isnan(before), after, before), np.where(np.isnan(after), before, after)
    tails = [np.minimum(np.nan_to_num(p, nan=_LONE_STEP_S), _LONGEST_TAIL_S) for p in filled]
    return tails[0], tails[1]


def _typical_length_m(
    length_m: NDArray[np.floating], joined: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Mean length of each step and its neighbours in the same bout, (n,). [m]."""
    bout = np.concatenate([[0], np.cumsum(~joined)])
    total, count = length_m.astype(np.float64), np.ones(len(length_m))
    for away in range(1, _NEIGHBOURS + 1):
        same = bout[away:] == bout[:-away]
        total[:-away] += np.where(same, length_m[away:], 0.0)
        total[away:] += np.where(same, length_m[:-away], 0.0)
        count[:-away] += same
        count[away:] += same
    return total / count


def _deviations(count: int, seed: int, walker: str) -> NDArray[np.float64]:
    """Deviation of each peak from the usual, correlated from step to step, (n,). [-]."""
    return drift(Draws(seed=seed, purpose="peak height", walker=walker), count, _PEAK_MEMORY)[:, 0]


def _bounded(swing: NDArray[np.float64]) -> NDArray[np.float64]:
    """Swings that stay below what limbs can, same shape. [-]."""
    return np.asarray(swing / np.sqrt(np.sqrt(1.0 + (swing / _LARGEST_SWING) ** 4)))


def _within(deviation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Deviations that are not too far out, same shape. [-]."""
    return np.clip(deviation, -_LARGEST_DEVIATION, _LARGEST_DEVIATION)
