"""Straight or turning: the angle the gyroscope accumulates over each step.

References
----------
.. [1] PDR with map-compensated heading, section on heading, Fig 7; digest "map-heading-ekf".
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.errors import DataError
from blesim.kernels import kernel
from blesim.pdr.windows import NEVER_US
from blesim.settings import Settings

_LAST_SAMPLE, _LAST_STEP = range(2)
# Angle before the moment of the latest sample, and of the samples at that moment.
_BEFORE, _AT = range(2)


class Turning(Settings):
    """The threshold band.

    Attributes
    ----------
    band_rad : float
        A step that turns by more is turning. Assumed, for [1]_ shows the band only in a figure: a
        right angle takes two to five steps. [rad]
    """

    band_rad: float = Field(default=math.radians(15.0), gt=0, le=math.pi)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepTurns:
    """How n steps turned; arrays (n,).

    Attributes
    ----------
    angle_rad : ndarray of float64
        Angle turned since the step before, counter-clockwise, not wrapped. [rad]
    turning : ndarray of bool
        Whether it leaves the band.
    """

    angle_rad: NDArray[np.float64]
    turning: NDArray[np.bool_]


class TurnDetector:
    """The live turns of one phone [1]_; how blocks are cut changes no bit.

    A step that is told at T has the angle ``sum w_k (t_k - t_(k-1))`` of the samples before T that
    no earlier step has: all of them, so that turning on the spot shows in the next step.

    Parameters
    ----------
    settings : Turning
        The band.
    """

    def __init__(self, settings: Turning) -> None:
        self._band_rad = settings.band_rad
        self._last_us = np.full(2, NEVER_US)
        self._angle_rad = np.zeros(2)

    def advance(
        self,
        time_us: NDArray[np.integer],
        turn_rate_rad_s: NDArray[np.floating],
        told_us: NDArray[np.integer],
    ) -> StepTurns:
        """Turns of the steps told in the next block.

        Parameters
        ----------
        time_us, turn_rate_rad_s : ndarray, (n,)
            Samples that follow those of the blocks before; see
            `blesim.pdr.attitude.LevelSamples`. [us], [rad/s]
        told_us : ndarray of int, (m,)
            When the steps of the block were told. [us]

        Raises
        ------
        DataError
            If samples or steps go backwards in time.
        """
        if np.any(np.diff(time_us, prepend=self._last_us[_LAST_SAMPLE]) < 0):
            raise DataError("samples go back behind the last one; feed them in order of time")
        if np.any(np.diff(told_us, prepend=self._last_us[_LAST_STEP]) < 0):
            raise DataError("steps go back behind the last one; feed them in order of time")
        angle_rad = np.empty(len(told_us))
        _advance(
            np.ascontiguousarray(time_us, dtype=np.int64),
            np.ascontiguousarray(turn_rate_rad_s, dtype=np.float64),
            np.ascontiguousarray(told_us, dtype=np.int64),
            self._last_us,
            self._angle_rad,
            angle_rad,
        )
        return StepTurns(angle_rad=angle_rad, turning=np.abs(angle_rad) > self._band_rad)


@kernel
def _advance(
    time_us: NDArray[np.int64],
    turn_rate: NDArray[np.float64],
    told_us: NDArray[np.int64],
    last_us: NDArray[np.int64],
    state: NDArray[np.float64],
    angle: NDArray[np.float64],
) -> None:
    """Fill the angles (m,); the times and the angles so far are carried on (kernel)."""
    step = 0
    for i in range(len(time_us)):
        while step < len(told_us) and told_us[step] <= time_us[i]:
            _tell(step, told_us, last_us, state, angle)
            step += 1
        elapsed_us = time_us[i] - last_us[_LAST_SAMPLE]
        if elapsed_us > 0:
            state[_BEFORE] += state[_AT]
            state[_AT] = 0.0
        if last_us[_LAST_SAMPLE] != NEVER_US:
            state[_AT] += turn_rate[i] * (elapsed_us * 1e-6)
        last_us[_LAST_SAMPLE] = time_us[i]
    while step < len(told_us):
        _tell(step, told_us, last_us, state, angle)
        step += 1


@kernel
def _tell(
    step: int,
    told_us: NDArray[np.int64],
    last_us: NDArray[np.int64],
    state: NDArray[np.float64],
    angle: NDArray[np.float64],
) -> None:
    """Give a step the angle of the samples before it (kernel)."""
    if told_us[step] > last_us[_LAST_SAMPLE]:
        state[_BEFORE] += state[_AT]
        state[_AT] = 0.0
    angle[step], state[_BEFORE] = state[_BEFORE], 0.0
    last_us[_LAST_STEP] = told_us[step]
