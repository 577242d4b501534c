"""Where people and their phones are: `Trajectory.at` for many times in one pass."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blesim import columns
from blesim.kernels import kernel
from blesim.radio.waves import cosine
from blesim.tables import FloatArray, IntArray, Trajectory

WALKING = dict(columns.STATES)["walking"]


class Places(NamedTuple):
    """Where a walker is and which way they look, arrays (n,). [m], [m], [-], [-]."""

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    cos_heading: NDArray[np.float64]
    sin_heading: NDArray[np.float64]


def places(
    trajectory: Trajectory,
    time_us: NDArray[np.int64],
    sway_m: NDArray[np.float64],
    sway_step_us: int,
) -> Places:
    """Places of a walker at the times of packets; `Trajectory.at` in one pass, with sway.

    Parameters
    ----------
    trajectory : Trajectory
        The walk.
    time_us : ndarray of int64, (n,)
        Within the walk; ascending stretch by stretch, as the channels' packets are. [us]
    sway_m : ndarray of float64, (k, 2)
        Sway at steps of `sway_step_us` from the start of the walk, added wherever the walker does
        not walk; empty for none. [m]
    sway_step_us : int
        [us]

    Returns
    -------
    Places
        The heading of a walker who has none (NaN) counts as 0; see `Air`.
    """
    x, y, cos_heading, sin_heading = (np.empty(len(time_us)) for _ in range(4))
    turns = np.nan_to_num(trajectory.heading_rad / (2.0 * np.pi))
    _fill_places(
        time_us,
        trajectory.time_us,
        trajectory.x_m,
        trajectory.y_m,
        trajectory.speed_m_s,
        trajectory.acceleration_m_s2,
        turns,
        trajectory.state,
        sway_m,
        sway_step_us,
        x,
        y,
        cos_heading,
        sin_heading,
    )
    return Places(x, y, cos_heading, sin_heading)


def fill_steps(
    trajectory: Trajectory,
    first_step: int,
    step_us: int,
    x_m: NDArray[np.float64],
    y_m: NDArray[np.float64],
) -> None:
    """Write a walker's places in the middle of steps of time.

    A walker is there in every step that the walk touches; in the first and the last of them, the
    middle may lie outside the walk, and its end counts.

    Parameters
    ----------
    trajectory : Trajectory
        The walk.
    first_step : int
        The how-manieth step since time 0 the first row stands for.
    step_us : int
        Length of a step. [us]
    x_m, y_m : ndarray of float64, (n,)
        Written where the walker is there, left alone elsewhere. [m]
    """
    _fill_steps(
        trajectory.time_us,
        trajectory.x_m,
        trajectory.y_m,
        trajectory.speed_m_s,
        trajectory.acceleration_m_s2,
        first_step,
        step_us,
        x_m,
        y_m,
    )


@kernel
def _share_walked(elapsed_us: int, span_us: int, speed: float, acceleration: float) -> float:
    """Share of the way to the next knot; the same formula as `Trajectory.at` (kernel). [-]."""
    if acceleration != 0.0:
        elapsed, span = elapsed_us * 1e-6, span_us * 1e-6
        way = (speed + 0.5 * acceleration * span) * span
        if way > 0.0:
            return (speed + 0.5 * acceleration * elapsed) * elapsed / way
    return elapsed_us / span_us


@kernel
def _fill_places(
    time_us: NDArray[np.int64],
    knot_us: IntArray,
    knot_x: FloatArray,
    knot_y: FloatArray,
    knot_speed: FloatArray,
    knot_acceleration: FloatArray,
    knot_turns: FloatArray,
    state: IntArray,
    sway: NDArray[np.float64],
    sway_step_us: int,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    cos_heading: NDArray[np.float64],
    sin_heading: NDArray[np.float64],
) -> None:
    knot = 0
    for row in range(len(time_us)):
        now = time_us[row]
        if row == 0 or now < knot_us[knot]:
            knot = max(np.searchsorted(knot_us, now, side="right") - 1, 0)
        while knot < len(knot_us) - 2 and knot_us[knot + 1] <= now:
            knot += 1
        following = min(knot + 1, len(knot_us) - 1)
        elapsed, span = now - knot_us[knot], max(knot_us[following] - knot_us[knot], 1)
        walked = _share_walked(elapsed, span, knot_speed[knot], knot_acceleration[knot])
        x[row] = knot_x[knot] + walked * (knot_x[following] - knot_x[knot])
        y[row] = knot_y[knot] + walked * (knot_y[following] - knot_y[knot])
        turn = knot_turns[following] - knot_turns[knot]
        turns = knot_turns[knot] + elapsed / span * (turn - np.floor(turn + 0.5))
        cos_heading[row], sin_heading[row] = cosine(turns), cosine(turns - 0.25)
        if state[knot] != WALKING and len(sway) > 1:
            place = (now - knot_us[0]) / sway_step_us
            step = min(int(place), len(sway) - 2)
            x[row] += sway[step, 0] + (place - step) * (sway[step + 1, 0] - sway[step, 0])
            y[row] += sway[step, 1] + (place - step) * (sway[step + 1, 1] - sway[step, 1])


@kernel
def _fill_steps(
    knot_us: IntArray,
    knot_x: FloatArray,
    knot_y: FloatArray,
    knot_speed: FloatArray,
    knot_acceleration: FloatArray,
    first_step: int,
    step_us: int,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
) -> None:
    came, left = knot_us[0], knot_us[-1]
    first, last = max(came // step_us, first_step), left // step_us
    middle = first * step_us + step_us // 2
    knot = max(np.searchsorted(knot_us, middle, side="right") - 1, 0)
    for step in range(first, min(last + 1, first_step + len(x))):
        now = min(max(step * step_us + step_us // 2, came), left)
        while knot < len(knot_us) - 1 and knot_us[knot + 1] <= now:
            knot += 1
        following = min(knot + 1, len(knot_us) - 1)
        elapsed, span = now - knot_us[knot], max(knot_us[following] - knot_us[knot], 1)
        walked = _share_walked(elapsed, span, knot_speed[knot], knot_acceleration[knot])
        x[step - first_step] = knot_x[knot] + walked * (knot_x[following] - knot_x[knot])
        y[step - first_step] = knot_y[knot] + walked * (knot_y[following] - knot_y[knot])
