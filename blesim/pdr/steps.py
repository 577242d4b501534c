"""What step detectors hear and tell: the acceleration without gravity, and the steps found in it.

Detectors are live: fed block by block they find the same steps as in one go, each as soon as no
later sample can change it.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError
from blesim.tables import Imu

# Standard gravity, 3rd General Conference on Weights and Measures, 1901.
GRAVITY_M_S2 = 9.80665


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DetectedSteps:
    """Steps that a detector found, in order of time; arrays (n,).

    Attributes
    ----------
    time_us : ndarray of int64
        Time of the step's peak. [us]
    told_us : ndarray of int64
        Time of the sample after which the step was certain. [us]
    peak_m_s2, valley_m_s2 : ndarray of float64
        Highest and lowest acceleration of the step, gravity taken off. [m/s^2]
    """

    time_us: NDArray[np.int64]
    told_us: NDArray[np.int64]
    peak_m_s2: NDArray[np.float64]
    valley_m_s2: NDArray[np.float64]

    def __len__(self) -> int:
        """Count the steps."""
        return len(self.time_us)


class StepDetector(Protocol):
    """A live detector of one phone's steps."""

    def advance(
        self, time_us: NDArray[np.integer], signal_m_s2: NDArray[np.floating]
    ) -> DetectedSteps:
        """Steps that the next block of samples makes certain.

        Parameters
        ----------
        time_us : ndarray of int, (n,)
            Times of the samples, ascending, not before those of the last block. [us]
        signal_m_s2 : ndarray of float, (n,)
            Acceleration without gravity, as `step_signal_m_s2` gives it. [m/s^2]

        Raises
        ------
        DataError
            If times go backwards, or a sample is not a number.
        """
        ...

    def finish(self) -> DetectedSteps:
        """The step, if any, that was found but might still have changed; the end of the walk."""
        ...


def step_signal_m_s2(imu: Imu) -> NDArray[np.float64]:
    """Norm of the specific force less standard gravity, (n,): ``|a| - g``. [m/s^2].

    It needs neither attitude nor a sample to come. The offset of an accelerometer stays in it,
    0.2 to 0.9 m/s^2 before calibration.
    """
    squares = imu.acceleration_x_m_s2**2 + imu.acceleration_y_m_s2**2 + imu.acceleration_z_m_s2**2
    return np.sqrt(squares, dtype=np.float64) - GRAVITY_M_S2


class Found:
    """Room for the steps of one block: a detector fills its rows from the first on.

    Parameters
    ----------
    most : int
        Number of steps that fit.
    """

    def __init__(self, most: int) -> None:
        self.times = np.empty((most, 2), np.int64)
        self.heights = np.empty((most, 2))

    def steps(self, count: int) -> DetectedSteps:
        """The first `count` of them."""
        return DetectedSteps(
            time_us=self.times[:count, 0].copy(),
            told_us=self.times[:count, 1].copy(),
            peak_m_s2=self.heights[:count, 0].copy(),
            valley_m_s2=self.heights[:count, 1].copy(),
        )


def checked_block(
    time_us: NDArray[np.integer], signal_m_s2: NDArray[np.floating], after_us: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Times and signal of a block at the types of the kernels, (n,) each.

    Parameters
    ----------
    time_us, signal_m_s2 : ndarray, (n,)
        As given. [us], [m/s^2]
    after_us : int
        Time of the last sample before. [us]

    Raises
    ------
    DataError
        If the lengths differ, times go backwards, or a sample is not a number.
    """
    times = np.ascontiguousarray(time_us, dtype=np.int64)
    signal = np.ascontiguousarray(signal_m_s2, dtype=np.float64)
    if times.shape != signal.shape:
        raise DataError(f"{len(times)} times for {len(signal)} samples; give one for each")
    if len(times) and (times[0] < after_us or np.any(np.diff(times) < 0)):
        raise DataError("samples go back behind the last one; feed them in order of time")
    if not np.all(np.isfinite(signal)):
        raise DataError("an acceleration is not a number; leave such samples out")
    return times, signal
