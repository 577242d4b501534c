"""What perfect sensors in the phone would tell: the kernel that puts body, gait and hold together.

The phone's attitude is ``R = Rz(yaw) Ry(pitch) Rx(roll) C``: the yaw is the carrier's heading plus
what the gait adds, pitch and roll are those of gait and slow wander, and C is how the phone is held
in the walker's frame. Angular rates are the derivatives of this attitude, worked out term by term,
and the specific force is ``R^T (a - g)``.
"""

import numpy as np
from numpy.typing import NDArray

from blesim.imu.carriage import ROUGHNESS, TREMOR, VIBRATION, WANDER
from blesim.imu.drift import spline
from blesim.imu.gait_signal import (
    AHEAD,
    FELT,
    LEFT,
    PITCH,
    PITCH_RATE,
    ROLL,
    ROLL_RATE,
    STATE,
    UP,
    YAW,
    YAW_RATE,
    add_gait,
    gait_state,
)
from blesim.imu.hold import ANGLE, ATTITUDE, AXIS, EARLIER, HOLD_BEGIN, MODE, RISE, SWITCH
from blesim.imu.motion import BODY, body_at, row_at
from blesim.imu.trigonometry import sine_cosine
from blesim.kernels import kernel

GRAVITY_M_S2 = 9.80665
# Grids of what varies in time: tremor, wander, and the magnetic field on the way.
TREMOR_STEP_S = 0.04
WANDER_STEP_S = 0.5
FIELD_STEP_S = 0.25


@kernel
def _add_mode(
    mode: int,
    weight: float,
    weight_rate: float,
    speed: float,
    state: NDArray[np.float64],
    waves: NDArray[np.float64],
    wander: NDArray[np.float64],
    wander_rate: NDArray[np.float64],
    modes: NDArray[np.float64],
    linear: NDArray[np.float64],
    angular: NDArray[np.float64],
    felt: NDArray[np.float64],
) -> float:
    """Add gait and wander of a mode; returns the spread of what is irregular (kernel)."""
    fall = add_gait(mode, weight, weight_rate, state, modes, linear, angular, waves, felt)
    for axis in range(3):
        width = modes[mode, WANDER + axis]
        felt[ROLL + axis] += weight * width * wander[axis]
        changed = weight * wander_rate[axis] / WANDER_STEP_S + weight_rate * wander[axis]
        felt[ROLL_RATE + axis] += width * changed
    quiet = modes[mode, TREMOR] + modes[mode, VIBRATION] * speed
    return float(weight * quiet + fall * modes[mode, ROUGHNESS])


@kernel
def _hold_share(holds: NDArray[np.float64], hold: int, time_s: float) -> tuple[float, float, float]:
    """How far a switch has gone, its rate, and the rise's acceleration; 1 after it (kernel)."""
    if hold == 0 or time_s >= holds[hold, HOLD_BEGIN] + holds[hold, SWITCH]:
        return 1.0, 0.0, 0.0
    rate = 1.0 / holds[hold, SWITCH]
    u = (time_s - holds[hold, HOLD_BEGIN]) * rate
    v = 1.0 - u
    share = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    rise = holds[hold, RISE] * 60.0 * u * v * (1.0 - 2.0 * u) * rate * rate
    return share, 30.0 * u * u * v * v * rate, rise


@kernel
def _turn_back(holds: NDArray[np.float64], hold: int, share: float, v: NDArray[np.float64]) -> None:
    """Turn a vector back by a share of the way to a hold, in place (kernel)."""
    sine, cosine = sine_cosine(-share * holds[hold, ANGLE])
    x, y, z = holds[hold, AXIS], holds[hold, AXIS + 1], holds[hold, AXIS + 2]
    along = (x * v[0] + y * v[1] + z * v[2]) * (1.0 - cosine)
    vx, vy, vz = v[0], v[1], v[2]
    v[0] = vx * cosine + (y * vz - z * vy) * sine + x * along
    v[1] = vy * cosine + (z * vx - x * vz) * sine + y * along
    v[2] = vz * cosine + (x * vy - y * vx) * sine + z * along


@kernel
def _into_phone(
    holds: NDArray[np.float64],
    hold: int,
    first: int,
    x: float,
    y: float,
    z: float,
    out: NDArray[np.float64],
) -> None:
    """A vector of the walker's frame in the phone's: C^T v (kernel)."""
    for axis in range(3):
        column = first + axis
        out[axis] = holds[hold, column] * x + holds[hold, column + 3] * y
        out[axis] += holds[hold, column + 6] * z


@kernel
def felt_truly(
    time_s: NDArray[np.float64],
    stretches: NDArray[np.float64],
    steps: NDArray[np.float64],
    holds: NDArray[np.float64],
    tremor: NDArray[np.float64],
    first_tremor: int,
    wander: NDArray[np.float64],
    field: NDArray[np.float64],
    modes: NDArray[np.float64],
    linear: NDArray[np.float64],
    angular: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Specific force, angular rate and magnetic field in the phone's frame (kernel).

    Parameters
    ----------
    time_s : ndarray of float64, (n,)
        Ascending, from the beginning of the walk. [s]
    stretches, steps, holds : ndarray of float64
        See `motion.stretches`, `footfalls.footfalls`, `hold.holds`.
    tremor : ndarray of float64, (m, 3)
        Spline coefficients every 40 ms, from number `first_tremor` on. [-]
    wander : ndarray of float64, (m, 3)
        Spline coefficients every half second. [-]
    field : ndarray of float64, (m, 3)
        Spline coefficients, every 0.25 s, of the magnetic field where the walker is. [uT]
    modes, linear, angular : ndarray of float64
        Tables of the ways of carrying: `carriage.MODES`, `LINEAR`, `ANGULAR`. Handed over, since a
        compiled kernel would keep what they were when it was compiled.
    out : ndarray of float64, (n, 9)
        Filled. [m/s2], [rad/s], [uT]
    """
    early = late = hold = 0
    step = -1
    body, state, waves = np.empty(BODY), np.empty(STATE), np.empty((2, 6))
    felt, vector, world = np.empty(FELT), np.empty(3), np.empty(3)
    value, slope = np.empty(3), np.empty(3)
    for sample in range(len(time_s)):
        t = time_s[sample]
        early, late = body_at(t, stretches, early, late, body)
        hold = row_at(holds, t, hold)
        share, share_rate, rise = _hold_share(holds, hold, t)
        while step + 1 < len(steps) and steps[step + 1, 0] <= t:
            step += 1
        gait_state(t, step, steps, state)
        felt[:] = 0.0
        spline(t / WANDER_STEP_S, 0, wander, value, slope)
        mode = int(holds[hold, MODE])
        shaken = _add_mode(
            mode, share, share_rate, body[4], state, waves, value, slope, modes, linear, angular,
            felt,
        )  # fmt: skip
        if share < 1.0:
            mode = int(holds[hold - 1, MODE])
            left, rate = 1.0 - share, -share_rate
            shaken += _add_mode(
                mode, left, rate, body[4], state, waves, value, slope, modes, linear, angular,
                felt,
            )  # fmt: skip
        spline(t / TREMOR_STEP_S, first_tremor, tremor, value, slope)
        for axis in range(3):
            felt[axis] += shaken * value[axis]
        spline(t / FIELD_STEP_S, 0, field, world, slope)
        sr, cr = sine_cosine(felt[ROLL])
        sp, cp = sine_cosine(felt[PITCH])
        sy, cy = sine_cosine(body[0] + felt[YAW])
        yaw_rate = body[1] + felt[YAW_RATE]
        for quantity in range(3):
            if quantity == 1:
                x = felt[ROLL_RATE] - yaw_rate * sp
                y = felt[PITCH_RATE] * cr + yaw_rate * sr * cp
                z = yaw_rate * cr * cp - felt[PITCH_RATE] * sr
            else:
                if quantity == 0:
                    x = felt[AHEAD] + cy * body[2] + sy * body[3]
                    y = felt[LEFT] - sy * body[2] + cy * body[3]
                    z = felt[UP] + rise + GRAVITY_M_S2
                else:
                    x, y = cy * world[0] + sy * world[1], cy * world[1] - sy * world[0]
                    z = world[2]
                x, z = cp * x - sp * z, sp * x + cp * z
                y, z = cr * y + sr * z, cr * z - sr * y
            if share < 1.0:
                _into_phone(holds, hold, EARLIER, x, y, z, vector)
                _turn_back(holds, hold, share, vector)
            else:
                _into_phone(holds, hold, ATTITUDE, x, y, z, vector)
            for axis in range(3):
                out[sample, 3 * quantity + axis] = vector[axis]
                if quantity == 1:
                    turn = holds[hold, ANGLE] * holds[hold, AXIS + axis]
                    out[sample, 3 + axis] += share_rate * turn
