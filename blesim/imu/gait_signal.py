"""What the gait makes of a moment: the kernels from footfalls to accelerations and angles.

Angles and accelerations are sums of harmonics of the stride's phase, which grows by half a turn
from each true step to the next. Between steps, how hard they fall changes smoothly.
"""

import numpy as np
from numpy.typing import NDArray

from blesim.imu import footfalls
from blesim.imu.carriage import ALTERNATION, GAIN, LEVER, MOST, VARIATION
from blesim.imu.trigonometry import sine_cosine
from blesim.kernels import kernel

# Accelerations ahead, left and up; roll, pitch and yaw; their rates.
AHEAD, LEFT, UP, ROLL, PITCH, YAW, ROLL_RATE, PITCH_RATE, YAW_RATE = range(9)
FELT = 9
# Phase and its rate; fall, deviation; swing and its two derivatives.
STATE = 7

_PI = 3.141592653589793
_TIME, _JOINED = footfalls.TIME, footfalls.JOINED
_BEFORE, _AFTER = footfalls.BEFORE, footfalls.AFTER
_FALL, _DEVIATION = footfalls.FALL, footfalls.DEVIATION
_SWING, _FOOT = footfalls.SWING, footfalls.FOOT
_TAIL, _FADES_FROM = footfalls.TAIL, footfalls.FADES_FROM


@kernel
def gait_state(
    time_s: float, row: int, steps: NDArray[np.float64], state: NDArray[np.float64]
) -> None:
    """Phase of the stride, its rate; fall, deviation; swing and its two derivatives (kernel)."""
    state[:] = 0.0
    if row >= 0 and steps[row, _JOINED] > 0.0:
        after = row + 1
        rate = 1.0 / (steps[after, _TIME] - steps[row, _TIME])
        share = (time_s - steps[row, _TIME]) * rate
        w = share * share * (3.0 - 2.0 * share)
        state[0], state[1] = _PI * (steps[row, _FOOT] + share), _PI * rate
        state[2] = steps[row, _FALL] + w * (steps[after, _FALL] - steps[row, _FALL])
        state[3] = steps[row, _DEVIATION] + w * (steps[after, _DEVIATION] - steps[row, _DEVIATION])
        more = steps[after, _SWING] - steps[row, _SWING]
        state[4] = steps[row, _SWING] + w * more
        state[5] = 6.0 * share * (1.0 - share) * rate * more
        state[6] = (6.0 - 12.0 * share) * rate * rate * more
        return
    _tail(time_s, row, 1.0, _AFTER, steps, state)
    _tail(time_s, row + 1, -1.0, _BEFORE, steps, state)


@kernel
def _tail(
    time_s: float,
    row: int,
    sign: float,
    period: int,
    steps: NDArray[np.float64],
    state: NDArray[np.float64],
) -> None:
    """The end of a bout after its last step, or before its first with sign -1 (kernel)."""
    if row < 0 or row >= len(steps):
        return
    rate = 1.0 / steps[row, period]
    share = sign * (time_s - steps[row, _TIME]) * rate
    if share < 0.0 or share >= _TAIL:
        return
    faded, fade_rate, fade_gain = 1.0, 0.0, 0.0
    if share > _FADES_FROM:
        span = _TAIL - _FADES_FROM
        u = (share - _FADES_FROM) / span
        faded = 1.0 - u * u * (3.0 - 2.0 * u)
        fade_rate = -6.0 * u * (1.0 - u) / span * sign * rate
        fade_gain = -(6.0 - 12.0 * u) / (span * span) * rate * rate
    state[0], state[1] = _PI * (steps[row, _FOOT] + sign * share), _PI * rate
    state[2] = faded * steps[row, _FALL]
    state[3] = steps[row, _DEVIATION]
    swing = steps[row, _SWING]
    state[4], state[5], state[6] = faded * swing, fade_rate * swing, fade_gain * swing


@kernel
def _harmonics(s1: float, c1: float, out: NDArray[np.float64]) -> None:
    """Cosines in row 0 and sines in row 1 of 1, 2, 3, 4, 6 and 8 times an angle (kernel)."""
    c2, s2 = c1 * c1 - s1 * s1, 2.0 * s1 * c1
    c4, s4 = c2 * c2 - s2 * s2, 2.0 * s2 * c2
    out[0, 0], out[1, 0] = c1, s1
    out[0, 1], out[1, 1] = c2, s2
    out[0, 2], out[1, 2] = c2 * c1 - s2 * s1, s2 * c1 + c2 * s1
    out[0, 3], out[1, 3] = c4, s4
    out[0, 4], out[1, 4] = c4 * c2 - s4 * s2, s4 * c2 + c4 * s2
    out[0, 5], out[1, 5] = c4 * c4 - s4 * s4, 2.0 * s4 * c4


@kernel
def add_gait(
    mode: int,
    weight: float,
    weight_rate: float,
    state: NDArray[np.float64],
    modes: NDArray[np.float64],
    linear: NDArray[np.float64],
    angular: NDArray[np.float64],
    waves: NDArray[np.float64],
    felt: NDArray[np.float64],
) -> float:
    """Add what the gait makes of this moment in a mode; returns the peak-to-peak (kernel)."""
    if state[1] == 0.0:
        return 0.0
    sine, cosine = sine_cosine(state[0])
    fall, walks = _fall(modes, mode, state)
    fall *= weight
    # A runner's feet fall alike; else one foot's peak comes early, the other's late. Times the
    # phase's slope, the mean stays zero.
    shift = _PI * modes[mode, ALTERNATION] * walks
    slope = 1.0 - shift * sine
    if shift > 0.0:
        early_sine, early_cosine = sine_cosine(state[0] + shift * cosine)
        _harmonics(early_sine, early_cosine, waves)
    else:
        _harmonics(sine, cosine, waves)
    for row in range(2):
        waves[row, 0] *= walks
        waves[row, 2] *= walks
    for axis in range(3):
        total = 0.0
        for order in range(6):
            total += linear[mode, axis, order, 0] * waves[0, order]
            total += linear[mode, axis, order, 1] * waves[1, order]
        felt[axis] += fall * slope * total
    c2, s2 = cosine * cosine - sine * sine, 2.0 * sine * cosine
    for axis in range(3):
        a1, b1 = angular[mode, axis, 0, 0], angular[mode, axis, 0, 1]
        a2, b2 = angular[mode, axis, 1, 0], angular[mode, axis, 1, 1]
        angle = a1 * cosine + b1 * sine + a2 * c2 + b2 * s2
        slope = state[1] * (b1 * cosine - a1 * sine + 2.0 * (b2 * c2 - a2 * s2))
        felt[ROLL + axis] += weight * state[4] * angle
        felt[ROLL_RATE + axis] += weight * (state[4] * slope + state[5] * angle)
        felt[ROLL_RATE + axis] += weight_rate * state[4] * angle
    if modes[mode, LEVER] > 0.0:
        a, b = angular[mode, 1, 0, 0], angular[mode, 1, 0, 1]
        lever = weight * modes[mode, LEVER]
        _add_swing(lever, a * cosine + b * sine, b * cosine - a * sine, state, felt)
    return float(fall)


@kernel
def _fall(modes: NDArray[np.float64], mode: int, state: NDArray[np.float64]) -> tuple[float, float]:
    """Peak-to-peak acceleration in a mode, and how far from the bound it is, 1 to 0 (kernel)."""
    wanted = state[2] * modes[mode, GAIN]
    excess = wanted / modes[mode, MOST]
    walks = 1.0 / (1.0 + excess * excess * excess * excess)
    bounded = wanted * np.sqrt(np.sqrt(walks))
    return bounded * max(1.0 + modes[mode, VARIATION] * state[3], 0.2), walks


@kernel
def _add_swing(
    lever: float,
    shape: float,
    bent: float,
    state: NDArray[np.float64],
    felt: NDArray[np.float64],
) -> None:
    """Add the acceleration of a phone on a limb that swings with the stride (kernel)."""
    slope, bend = state[1] * bent, -state[1] * state[1] * shape
    rate = state[4] * slope + state[5] * shape
    gain = state[4] * bend + 2.0 * state[5] * slope + state[6] * shape
    sine, cosine = sine_cosine(state[4] * shape)
    felt[AHEAD] -= lever * (gain * cosine - rate * rate * sine)
    felt[UP] += lever * (gain * sine + rate * rate * cosine)
