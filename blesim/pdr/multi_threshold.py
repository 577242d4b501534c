"""Multi-threshold step detection: a step is a peak and the valley that follows it.

References
----------
.. [1] PDR with map-compensated heading, Eq 2 to 5 and table 1; digest "map-heading-ekf".
"""

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.kernels import kernel
from blesim.pdr.steps import DetectedSteps, Found, checked_block
from blesim.settings import Settings
from blesim.units import to_us

# Far enough back, and twice the time since is still a number of 64 bits.
_NEVER_US = -(2**60)
# Rows of what is carried from sample to sample.
_SINCE, _SLOPE, _LAST_VALLEY, _PEAK, _VALLEY, _STAGE = range(6)
_LATEST, _PEAK_HEIGHT, _VALLEY_HEIGHT = range(3)
_SEEKING, _PEAK_WAITS, _VALLEY_FOUND = range(3)


class MultiThreshold(Settings):
    """The two thresholds of the detector.

    Attributes
    ----------
    amplitude_m_s2 : float
        Least height of a peak and depth of a valley; delta_a of [1]_. [m/s^2]
    interval_s : float
        Least time between peaks; delta_dt of [1]_. [s]
    """

    amplitude_m_s2: float = Field(default=1.0, ge=0, le=100)
    interval_s: float = Field(default=0.14, ge=0, le=10)


class MultiThresholdDetector:
    """The live detector; see `blesim.pdr.steps.StepDetector`.

    With thresholds A and D [1]_:

    - A peak is a local maximum of at least A, at least D / 2 after the valley of the step before
      (Eq 2, 3). Of several with no valley between them the highest counts.
    - A valley is a local minimum of at most -A, D / 2 to 3 D after the peak that waits for it
      (Eq 4, 5). Of several the lowest counts.

    That peaks lie D apart, and valleys too, as Eq 2 and 4 ask, follows from the halves. A peak
    without a valley within 3 D is dropped. Of equal samples in a row the first counts.

    Parameters
    ----------
    settings : MultiThreshold
        The thresholds.
    """

    def __init__(self, settings: MultiThreshold) -> None:
        self._amplitude_m_s2 = settings.amplitude_m_s2
        self._interval_us = to_us(settings.interval_s)
        self._times = np.full(6, _NEVER_US, np.int64)
        self._times[[_SLOPE, _STAGE]] = 0
        self._heights = np.zeros(3)
        self._now_us = _NEVER_US

    def advance(
        self, time_us: NDArray[np.integer], signal_m_s2: NDArray[np.floating]
    ) -> DetectedSteps:
        """Steps that the next block makes certain; see `blesim.pdr.steps.StepDetector`."""
        times, signal = checked_block(time_us, signal_m_s2, self._now_us)
        if not len(times):
            return Found(0).steps(0)
        self._now_us = int(times[-1])
        # A sample closes at most two steps: one by its extremum, one by the time that has passed.
        found = Found(2 * len(times))
        count = _advance(
            times,
            signal,
            self._amplitude_m_s2,
            self._interval_us,
            self._times,
            self._heights,
            found.times,
            found.heights,
        )
        return found.steps(count)

    def finish(self) -> DetectedSteps:
        """The step whose valley might still have become lower."""
        found = Found(1)
        count = 0
        if self._times[_STAGE] == _VALLEY_FOUND:
            count = _close(
                self._now_us, self._times, self._heights, found.times, found.heights, count
            )
        return found.steps(count)


@kernel
def _advance(
    time_us: NDArray[np.int64],
    signal: NDArray[np.float64],
    amplitude: float,
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
        if times[_SINCE] == _NEVER_US:
            times[_SINCE], heights[_LATEST] = now_us, value
            continue
        if value != heights[_LATEST]:
            slope = 1 if value > heights[_LATEST] else -1
            if times[_SLOPE] == 1 and slope == -1 and heights[_LATEST] >= amplitude:
                count = _peak(
                    now_us, interval_us, times, heights, found_times, found_heights, count
                )
            elif times[_SLOPE] == -1 and slope == 1 and heights[_LATEST] <= -amplitude:
                _valley(interval_us, times, heights)
            times[_SLOPE], times[_SINCE], heights[_LATEST] = slope, now_us, value
        # The next extremum will lie where the signal has been level since, or later.
        if times[_STAGE] != _SEEKING and times[_SINCE] - times[_PEAK] > 3 * interval_us:
            if times[_STAGE] == _VALLEY_FOUND:
                count = _close(now_us, times, heights, found_times, found_heights, count)
            times[_STAGE] = _SEEKING
    return count


@kernel
def _peak(
    now_us: int,
    interval_us: int,
    times: NDArray[np.int64],
    heights: NDArray[np.float64],
    found_times: NDArray[np.int64],
    found_heights: NDArray[np.float64],
    count: int,
) -> int:
    """Take a high maximum, closing the step before; the number of steps so far (kernel)."""
    at_us, height = times[_SINCE], heights[_LATEST]
    if times[_STAGE] == _PEAK_WAITS:
        if height > heights[_PEAK_HEIGHT]:
            times[_PEAK], heights[_PEAK_HEIGHT] = at_us, height
        return count
    complete = times[_STAGE] == _VALLEY_FOUND
    last_valley_us = times[_VALLEY] if complete else times[_LAST_VALLEY]
    if 2 * (at_us - last_valley_us) < interval_us:
        return count
    if complete:
        count = _close(now_us, times, heights, found_times, found_heights, count)
    times[_PEAK], heights[_PEAK_HEIGHT], times[_STAGE] = at_us, height, _PEAK_WAITS
    return count


@kernel
def _valley(interval_us: int, times: NDArray[np.int64], heights: NDArray[np.float64]) -> None:
    """Take a low minimum, if a peak waits for one or a higher one was taken (kernel)."""
    at_us, height = times[_SINCE], heights[_LATEST]
    after_us = at_us - times[_PEAK]
    if times[_STAGE] == _SEEKING or after_us > 3 * interval_us:
        return
    if times[_STAGE] == _VALLEY_FOUND:
        better = height < heights[_VALLEY_HEIGHT]
    else:
        better = 2 * after_us >= interval_us
    if better:
        times[_VALLEY], heights[_VALLEY_HEIGHT], times[_STAGE] = at_us, height, _VALLEY_FOUND


@kernel
def _close(
    now_us: int,
    times: NDArray[np.int64],
    heights: NDArray[np.float64],
    found_times: NDArray[np.int64],
    found_heights: NDArray[np.float64],
    count: int,
) -> int:
    """Write down the step whose peak and valley are known (kernel)."""
    found_times[count, 0], found_times[count, 1] = times[_PEAK], now_us
    found_heights[count, 0], found_heights[count, 1] = (
        heights[_PEAK_HEIGHT],
        heights[_VALLEY_HEIGHT],
    )
    times[_LAST_VALLEY], times[_STAGE] = times[_VALLEY], _SEEKING
    return count + 1
