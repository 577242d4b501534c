"""How the carrier's body moves: velocity and heading of a trajectory, without its jolts.

A trajectory turns and changes speed abruptly; a body takes a moment. Velocity and heading are
therefore means over a window about the time asked for. Angular rate and acceleration are then the
differences across the window over its length: continuous, or at least finite, and their integrals
are exactly the changes of heading and of velocity of the trajectory.
"""

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel
from blesim.tables import Trajectory
from blesim.units import MICROSECONDS_PER_SECOND, wrap_angle

# Assumed: about the time of a step.
WINDOW_S = 0.5
# What `body_at` tells.
BODY = 5
# Columns of a stretch: its beginning; heading, its rate and its integral so far; velocity and
# acceleration along x and y; distance walked so far, speed and acceleration along the way.
BEGIN, HEADING, RATE, HEADING_SUM, VX, VY, AX, AY, DISTANCE, SPEED, GAIN = range(11)


def stretches(trajectory: Trajectory) -> NDArray[np.float64]:
    """What a trajectory does from each knot to the next, and before and after.

    Parameters
    ----------
    trajectory : Trajectory
        One knot or more.

    Returns
    -------
    ndarray of float64, (n + 1, 11)
        A row for each knot, after one for the time before the first; times are counted from the
        first knot. At the ends the walker goes on as at the nearest knot. [s], [rad], [m/s] ...
    """
    begin_s = (trajectory.time_us - trajectory.time_us[0]) / MICROSECONDS_PER_SECOND
    span_s = np.diff(begin_s)
    turn_rad = wrap_angle(np.diff(trajectory.heading_rad))
    heading_rad = trajectory.heading_rad[0] + np.concatenate([[0.0], np.cumsum(turn_rad)])
    rows = np.zeros((len(trajectory), 11))
    rows[:, BEGIN], rows[:, HEADING] = begin_s, heading_rad
    inner = span_s > 0
    rows[:-1, RATE][inner] = turn_rad[inner] / span_s[inner]
    rows[1:, HEADING_SUM] = np.cumsum(span_s * (heading_rad[:-1] + 0.5 * turn_rad))
    _add_velocities(rows, trajectory, span_s)
    return _with_ends(rows)


def _add_velocities(
    rows: NDArray[np.float64], trajectory: Trajectory, span_s: NDArray[np.float64]
) -> None:
    """Fill in how each stretch is walked: straight, with a constant acceleration."""
    step_m = np.stack([np.diff(trajectory.x_m), np.diff(trajectory.y_m)])
    speed, gain = trajectory.speed_m_s[:-1], trajectory.acceleration_m_s2[:-1]
    walked = speed * span_s + 0.5 * gain * span_s**2
    moves = (walked > 0) & (span_s > 0)
    # The ends of a stretch are rounded in the table; the places decide, not the speed.
    share = np.where(moves, 1.0 / np.where(moves, walked, 1.0), 0.0)
    rows[:-1, [VX, VY]] = (step_m * share * speed).T
    rows[:-1, [AX, AY]] = (step_m * share * gain).T
    length_m = np.hypot(*step_m) * moves
    rows[1:, DISTANCE] = np.cumsum(length_m)
    rows[:-1, SPEED], rows[:-1, GAIN] = length_m * share * speed, length_m * share * gain


def _with_ends(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Add the time before the walk, and let the last knot go on with the last velocity."""
    before = rows[:1].copy()
    before[0, [RATE, AX, AY, GAIN]] = 0.0
    before[0, BEGIN] = -WINDOW_S
    before[0, HEADING_SUM] = -WINDOW_S * rows[0, HEADING]
    before[0, DISTANCE] = -WINDOW_S * rows[0, SPEED]
    if len(rows) > 1:
        span_s = rows[-1, BEGIN] - rows[-2, BEGIN]
        rows[-1, [VX, VY]] = rows[-2, [VX, VY]] + span_s * rows[-2, [AX, AY]]
        rows[-1, SPEED] = rows[-2, SPEED] + span_s * rows[-2, GAIN]
    return np.concatenate([before, rows])


@kernel
def row_at(rows: NDArray[np.float64], time_s: float, row: int) -> int:
    """Last row that has begun, looked for from an earlier one on (kernel)."""
    while row + 1 < len(rows) and rows[row + 1, 0] <= time_s:
        row += 1
    return row


@kernel
def body_at(
    time_s: float,
    stretches: NDArray[np.float64],
    early: int,
    late: int,
    out: NDArray[np.float64],
) -> tuple[int, int]:
    """Heading, its rate, acceleration along x and y, and speed; returns the rows found (kernel)."""
    t0, t1 = time_s - 0.5 * WINDOW_S, time_s + 0.5 * WINDOW_S
    early, late = row_at(stretches, t0, early), row_at(stretches, t1, late)
    d0, d1 = t0 - stretches[early, BEGIN], t1 - stretches[late, BEGIN]
    turned = _changed(stretches, early, late, HEADING_SUM, HEADING, RATE, d0, d1)
    walked = _changed(stretches, early, late, DISTANCE, SPEED, GAIN, d0, d1)
    turn = stretches[late, HEADING] + d1 * stretches[late, RATE]
    vx = stretches[late, VX] + d1 * stretches[late, AX]
    vy = stretches[late, VY] + d1 * stretches[late, AY]
    out[0] = turned / WINDOW_S
    out[1] = (turn - stretches[early, HEADING] - d0 * stretches[early, RATE]) / WINDOW_S
    out[2] = (vx - stretches[early, VX] - d0 * stretches[early, AX]) / WINDOW_S
    out[3] = (vy - stretches[early, VY] - d0 * stretches[early, AY]) / WINDOW_S
    out[4] = walked / WINDOW_S
    return early, late


@kernel
def _changed(
    stretches: NDArray[np.float64],
    early: int,
    late: int,
    total: int,
    rate: int,
    gain: int,
    d0: float,
    d1: float,
) -> float:
    """Change, from one time to another, of what grows with a rate and its gain (kernel)."""
    after = d1 * (stretches[late, rate] + 0.5 * d1 * stretches[late, gain])
    before = d0 * (stretches[early, rate] + 0.5 * d0 * stretches[early, gain])
    return float(stretches[late, total] + after - stretches[early, total] - before)
