"""Band-pass step detection: the peaks of the acceleration at the pace of walking."""

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.signal import butter, sosfilt, sosfilt_zi

from blesim.kernels import kernel
from blesim.pdr.steps import DetectedSteps, Found, checked_block
from blesim.settings import Settings
from blesim.units import to_us

# Far enough back, and twice the time since is still a number of 64 bits.
_NEVER_US = -(2**60)
_ORDER = 2
_SINCE, _SLOPE, _LAST_STEP, _CANDIDATE = range(4)
# Filtered: the latest sample and the candidate. Raw: extremes since the last step up to the
# candidate, and since the candidate.
_LATEST, _CANDIDATE_HEIGHT, _HIGH, _LOW, _HIGH_SINCE, _LOW_SINCE = range(6)


class BandPass(Settings):
    """Parameters of the detector.

    Attributes
    ----------
    rate_hz : float
        Nominal sample rate of the phone; the filter counts samples. [Hz]
    low_hz, high_hz : float
        Band of step rates. [Hz]
    height_m_s2 : float
        Least height of a peak of the filtered signal. [m/s^2]
    interval_s : float
        Least time between steps. [s]
    """

    rate_hz: float = Field(default=50.0, ge=10, le=500)
    low_hz: float = Field(default=0.7, ge=0.1, le=2)
    high_hz: float = Field(default=3.0, gt=2, lt=5)
    height_m_s2: float = Field(default=0.5, gt=0, le=100)
    interval_s: float = Field(default=0.3, ge=0, le=10)


class BandPassDetector:
    """The live detector; see `blesim.pdr.steps.StepDetector`.

    The filter is a Butterworth band-pass of second order run twice, which damps each frequency as
    much as running it forwards and backwards does, but needs no sample to come: run once, the
    second harmonic of a slow walk passes and is counted. It begins at rest on the first sample.
    Gravity and offsets of the accelerometer have no share in the band.

    Of local maxima closer together than the least interval the highest is the step; its time is
    that of the filtered peak. Peak and valley are the extremes of the unfiltered signal since the
    step before.

    Parameters
    ----------
    settings : BandPass
        Rate, band and thresholds.
    """

    def __init__(self, settings: BandPass) -> None:
        once = butter(
            _ORDER,
            [settings.low_hz, settings.high_hz],
            btype="bandpass",
            fs=settings.rate_hz,
            output="sos",
        )
        self._filter = np.concatenate([once, once])
        self._filter_state: NDArray[np.float64] | None = None
        self._height_m_s2 = settings.height_m_s2
        self._interval_us = to_us(settings.interval_s)
        self._times = np.array([_NEVER_US, 0, _NEVER_US, _NEVER_US])
        self._heights = np.array([0.0, 0.0, -np.inf, np.inf, -np.inf, np.inf])
        self._now_us = _NEVER_US

    def advance(
        self, time_us: NDArray[np.integer], signal_m_s2: NDArray[np.floating]
    ) -> DetectedSteps:
        """Steps that the next block makes certain; see `blesim.pdr.steps.StepDetector`."""
        times, signal = checked_block(time_us, signal_m_s2, self._now_us)
        if not len(times):
            return Found(0).steps(0)
        self._now_us = int(times[-1])
        found = Found(len(times) + 1)
        count = _advance(
            times,
            signal,
            self._filtered(signal),
            self._height_m_s2,
            self._interval_us,
            self._times,
            self._heights,
            found.times,
            found.heights,
        )
        return found.steps(count)

    def finish(self) -> DetectedSteps:
        """The step that a higher peak might still have replaced."""
        found = Found(1)
        count = 0
        if self._times[_CANDIDATE] != _NEVER_US:
            count = _tell(
                self._now_us, self._times, self._heights, found.times, found.heights, count
            )
        return found.steps(count)

    def _filtered(self, signal_m_s2: NDArray[np.float64]) -> NDArray[np.float64]:
        if self._filter_state is None:
            self._filter_state = sosfilt_zi(self._filter) * signal_m_s2[0]
        filtered: NDArray[np.float64]
        filtered, self._filter_state = sosfilt(self._filter, signal_m_s2, zi=self._filter_state)
        return filtered


@kernel
def _advance(
    time_us: NDArray[np.int64],
    raw: NDArray[np.float64],
    filtered: NDArray[np.float64],
    height: float,
    interval_us: int,
    times: NDArray[np.int64],
    heights: NDArray[np.float64],
    found_times: NDArray[np.int64],
    found_heights: NDArray[np.float64],
) -> int:
    """Number of steps written to the found arrays; times and heights are carried on (kernel)."""
    count = 0
    for i in range(len(time_us)):
        now_us, value = time_us[i], filtered[i]
        # A maximum is known a sample later: the candidate's time comes before this one.
        if times[_SLOPE] == 1 and value < heights[_LATEST] and heights[_LATEST] >= height:
            _consider(interval_us, times, heights)
        since_us = now_us - times[_CANDIDATE]
        if times[_CANDIDATE] != _NEVER_US and since_us > interval_us:
            count = _tell(now_us, times, heights, found_times, found_heights, count)
        if times[_SINCE] == _NEVER_US:
            times[_SINCE], heights[_LATEST] = now_us, value
        elif value != heights[_LATEST]:
            times[_SLOPE] = 1 if value > heights[_LATEST] else -1
            times[_SINCE], heights[_LATEST] = now_us, value
        heights[_HIGH_SINCE] = max(heights[_HIGH_SINCE], raw[i])
        heights[_LOW_SINCE] = min(heights[_LOW_SINCE], raw[i])
    return count


@kernel
def _consider(interval_us: int, times: NDArray[np.int64], heights: NDArray[np.float64]) -> None:
    """Make a maximum the candidate, if it is the first or the highest (kernel)."""
    at_us, height = times[_SINCE], heights[_LATEST]
    if times[_CANDIDATE] == _NEVER_US:
        better = at_us - times[_LAST_STEP] >= interval_us
    else:
        better = height > heights[_CANDIDATE_HEIGHT]
    if better:
        times[_CANDIDATE], heights[_CANDIDATE_HEIGHT] = at_us, height
        heights[_HIGH] = max(heights[_HIGH], heights[_HIGH_SINCE])
        heights[_LOW] = min(heights[_LOW], heights[_LOW_SINCE])
        heights[_HIGH_SINCE], heights[_LOW_SINCE] = -np.inf, np.inf


@kernel
def _tell(
    now_us: int,
    times: NDArray[np.int64],
    heights: NDArray[np.float64],
    found_times: NDArray[np.int64],
    found_heights: NDArray[np.float64],
    count: int,
) -> int:
    """Write down the candidate as a step (kernel)."""
    found_times[count, 0], found_times[count, 1] = times[_CANDIDATE], now_us
    found_heights[count, 0], found_heights[count, 1] = heights[_HIGH], heights[_LOW]
    times[_LAST_STEP], times[_CANDIDATE] = times[_CANDIDATE], _NEVER_US
    heights[_HIGH], heights[_LOW] = -np.inf, np.inf
    return count + 1
