"""Turn rate, magnetic azimuth and vertical acceleration of a phone in its level frame.

Up is where gravity comes from: the specific force of a phone at rest points upwards. While walking
it is the mean of the samples so far, an exponentially smaller weight for older ones:

``G_k = G_(k-1) + (a_k - G_(k-1)) / W_k``, ``W_k = 1 + W_(k-1) exp(-(t_k - t_(k-1)) / tau)``

which after a few tau is the usual first-order low-pass, and before is as steady as can be.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.errors import DataError
from blesim.kernels import kernel
from blesim.pdr.steps import GRAVITY_M_S2
from blesim.settings import Settings
from blesim.tables import Imu

Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
_NEVER_US = -(2**60)
# Rows of what is carried from sample to sample: gravity and up have three each.
_GRAVITY, _UP, _WEIGHT, _AZIMUTH = 0, 3, 6, 7
# Rows of what comes out.
_TURN_RATE, _MAGNETIC_AZIMUTH, _VERTICAL = range(3)
# Below it a direction is rounding: |G| in m/s^2, horizontal field in uT.
_NO_DIRECTION = 1e-6


class Levelling(Settings):
    """How up and forward are found.

    Attributes
    ----------
    time_constant_s : float
        tau, the age at which a sample of the acceleration counts 1/e in the mean; a second or two
        keeps the steps out of it. [s]
    forward : {"x", "y", "z", "-x", "-y", "-z"}
        Axis of the phone that looks ahead: ``y``, its top, where it is held flat.
    """

    time_constant_s: float = Field(default=1.0, ge=0.01, le=100)
    forward: Axis = "y"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LevelSamples:
    """Samples in the level frame; arrays (n,).

    Attributes
    ----------
    time_us : ndarray of int64
        [us]
    turn_rate_rad_s : ndarray of float64
        Angular rate about the vertical, counter-clockwise seen from above. [rad/s]
    azimuth_rad : ndarray of float64
        Azimuth of the forward axis from magnetic north, clockwise, in [-pi, pi); the last one known
        while the axis or the field is vertical, NaN before. [rad]
    vertical_m_s2 : ndarray of float64
        Vertical acceleration, gravity taken off. [m/s^2]
    """

    time_us: NDArray[np.int64]
    turn_rate_rad_s: NDArray[np.float64]
    azimuth_rad: NDArray[np.float64]
    vertical_m_s2: NDArray[np.float64]

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.time_us)


class Leveller:
    """The live level frame of one phone; how its samples are cut into blocks changes no bit.

    With the unit vector u upwards, the forward axis f, the angular rate w and the field m:

    - turn rate ``w . u``
    - azimuth ``atan2(f . (m x u), f . (m - (m . u) u))``: ``m x u`` points to the magnetic east,
      the horizontal part of the field to the north.

    A phone that feels no acceleration at all is taken to lie flat, its z axis upwards.

    Parameters
    ----------
    settings : Levelling
        Time constant and forward axis.
    """

    def __init__(self, settings: Levelling) -> None:
        self._time_constant_us = settings.time_constant_s * 1e6
        self._forward = np.zeros(3)
        sign = -1.0 if settings.forward.startswith("-") else 1.0
        self._forward["xyz".index(settings.forward[-1])] = sign
        self._last_us = np.array([_NEVER_US])
        self._state = np.zeros(8)
        self._state[_UP + 2], self._state[_AZIMUTH] = 1.0, np.nan

    def advance(self, imu: Imu) -> LevelSamples:
        """Samples of the next block in the level frame, (n,).

        Parameters
        ----------
        imu : Imu
            The n samples that follow those of the blocks before.

        Raises
        ------
        DataError
            If times go backwards, or a sample is not a number.
        """
        sensed = _sensed(imu)
        time_us = imu.time_us.astype(np.int64)
        if len(imu) and time_us[0] < self._last_us[0]:
            raise DataError("samples go back behind the last block; feed them in order of time")
        level = np.empty((3, len(imu)))
        _advance(
            time_us,
            sensed,
            self._time_constant_us,
            self._forward,
            self._last_us,
            self._state,
            level,
        )
        return LevelSamples(
            time_us=time_us,
            turn_rate_rad_s=level[_TURN_RATE],
            azimuth_rad=level[_MAGNETIC_AZIMUTH],
            vertical_m_s2=level[_VERTICAL],
        )


def _sensed(imu: Imu) -> NDArray[np.float64]:
    """Acceleration, angular rate and field, (n, 9)."""
    columns = list(imu.arrays())[1:]
    sensed = np.column_stack(columns).astype(np.float64)
    if not np.all(np.isfinite(sensed)):
        raise DataError("an IMU sample is not a number; leave such samples out")
    return sensed


@kernel
def _advance(
    time_us: NDArray[np.int64],
    sensed: NDArray[np.float64],
    time_constant_us: float,
    forward: NDArray[np.float64],
    last_us: NDArray[np.int64],
    state: NDArray[np.float64],
    level: NDArray[np.float64],
) -> None:
    """Fill the level samples (3, n); the time and the state are carried on (kernel)."""
    gravity, up = state[_GRAVITY : _GRAVITY + 3], state[_UP : _UP + 3]
    for i in range(len(time_us)):
        force, rate, field = sensed[i, 0:3], sensed[i, 3:6], sensed[i, 6:9]
        if last_us[0] != _NEVER_US:
            state[_WEIGHT] *= math.exp((last_us[0] - time_us[i]) / time_constant_us)
        state[_WEIGHT] += 1.0
        last_us[0] = time_us[i]
        for axis in range(3):
            gravity[axis] += (force[axis] - gravity[axis]) / state[_WEIGHT]
        size = math.sqrt(_dot(gravity, gravity))
        if size > _NO_DIRECTION:
            for axis in range(3):
                up[axis] = gravity[axis] / size
        _azimuth(forward, field, up, state)
        level[_TURN_RATE, i] = _dot(rate, up)
        level[_MAGNETIC_AZIMUTH, i] = state[_AZIMUTH]
        level[_VERTICAL, i] = _dot(force, up) - GRAVITY_M_S2


@kernel
def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Scalar product of two vectors (3,), in this order of additions (kernel)."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@kernel
def _azimuth(
    forward: NDArray[np.float64],
    field: NDArray[np.float64],
    up: NDArray[np.float64],
    state: NDArray[np.float64],
) -> None:
    """Renew the azimuth of the state, where there is one (kernel)."""
    ahead_up = _dot(forward, up)
    north = _dot(forward, field) - _dot(field, up) * ahead_up
    east = (
        forward[0] * (field[1] * up[2] - field[2] * up[1])
        + forward[1] * (field[2] * up[0] - field[0] * up[2])
        + forward[2] * (field[0] * up[1] - field[1] * up[0])
    )
    if math.hypot(north, east) <= _NO_DIRECTION:
        return
    azimuth = math.atan2(east, north)
    state[_AZIMUTH] = azimuth if azimuth < math.pi else -math.pi
