"""Double-threshold step detection: a rise above one threshold that stays below another.

References
----------
.. [1] PDR and four-direction fingerprints in a Kalman filter: a step where the vertical
   acceleration lies between two thresholds; digest "pdr-fingerprint-kalman".
"""

from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from blesim.kernels import kernel
from blesim.pdr.steps import DetectedSteps, Found, checked_block
from blesim.settings import Settings
from blesim.units import to_us

# Far enough back, and twice the time since is still a number of 64 bits.
_NEVER_US = -(2**60)
_LAST_STEP, _PEAK, _RISEN = range(3)
_PEAK_HEIGHT, _VALLEY_HEIGHT = range(2)


class DoubleThreshold(Settings):
    """The thresholds of the detector.

    Attributes
    ----------
    lower_m_s2, upper_m_s2 : float
        The peak of a step lies between them, ``a_1 <= a <= a_2`` [1]_, which gives no numbers;
        assumed. [m/s^2]
    interval_s : float
        Least time from step to step, so that a ripple at the lower threshold is not a step; [1]_
        has none, and 0 switches it off. [s]
    """

    lower_m_s2: float = Field(default=1.0, ge=0, le=100)
    upper_m_s2: float = Field(default=30.0, ge=0, le=1000)
    interval_s: float = Field(default=0.3, ge=0, le=10)

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.upper_m_s2 < self.lower_m_s2:
            raise ValueError("upper_m_s2 lies below lower_m_s2; exchange them")
        return self


class DoubleThresholdDetector:
    """The live detector; see `blesim.pdr.steps.StepDetector`.

    A step is told when the signal falls back below the lower threshold after a rise whose highest
    sample stayed at or below the upper one; a higher rise is a blow to the phone. The valley of a
    step is the lowest sample since the last rise.

    Parameters
    ----------
    settings : DoubleThreshold
        The thresholds.
    """

    def __init__(self, settings: DoubleThreshold) -> None:
        self._bounds_m_s2 = np.array([settings.lower_m_s2, settings.upper_m_s2])
        self._interval_us = to_us(settings.interval_s)
        self._times = np.array([_NEVER_US, _NEVER_US, 0])
        self._heights = np.array([-np.inf, np.inf])
        self._now_us = _NEVER_US

    def advance(
        self, time_us: NDArray[np.integer], signal_m_s2: NDArray[np.floating]
    ) -> DetectedSteps:
        """Steps that the next block makes certain; see `blesim.pdr.steps.StepDetector`."""
        times, signal = checked_block(time_us, signal_m_s2, self._now_us)
        if not len(times):
            return Found(0).steps(0)
        self._now_us = int(times[-1])
        found = Found(len(times))
        count = _advance(
            times,
            signal,
            self._bounds_m_s2,
            self._interval_us,
            self._times,
            self._heights,
            found.times,
            found.heights,
        )
        return found.steps(count)

    def finish(self) -> DetectedSteps:
        """Nothing: a rise that has not fallen back is no step yet."""
        return Found(0).steps(0)


@kernel
def _advance(
    time_us: NDArray[np.int64],
    signal: NDArray[np.float64],
    bounds: NDArray[np.float64],
    interval_us: int,
    times: NDArray[np.int64],
    heights: NDArray[np.float64],
    found_times: NDArray[np.int64],
    found_heights: NDArray[np.float64],
) -> int:
    """Number of steps written to the found arrays; times and heights are carried on (kernel)."""
    count = 0
    for i in range(len(time_us)):
        now_us, value = time_us[i], signal[i]
        if value >= bounds[0]:
            if not times[_RISEN] or value > heights[_PEAK_HEIGHT]:
                times[_PEAK], heights[_PEAK_HEIGHT] = now_us, value
            times[_RISEN] = 1
            continue
        if times[_RISEN]:
            low_enough = heights[_PEAK_HEIGHT] <= bounds[1]
            if low_enough and times[_PEAK] - times[_LAST_STEP] >= interval_us:
                found_times[count, 0], found_times[count, 1] = times[_PEAK], now_us
                found_heights[count, 0] = heights[_PEAK_HEIGHT]
                found_heights[count, 1] = min(heights[_VALLEY_HEIGHT], value)
                times[_LAST_STEP] = times[_PEAK]
                count += 1
            times[_RISEN], heights[_VALLEY_HEIGHT] = 0, value
        heights[_VALLEY_HEIGHT] = min(heights[_VALLEY_HEIGHT], value)
    return count
