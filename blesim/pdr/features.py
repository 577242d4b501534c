"""Features of each step, from which step-length models tell its length."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from blesim.kernels import kernel
from blesim.pdr.steps import checked_block
from blesim.pdr.windows import NEVER_US, StepWindows
from blesim.settings import Settings

_PLAIN, _SMOOTH = range(2)
_VARIANCE, _SMOOTHED_PEAK, _HIGHEST, _LOWEST, _MEAN_ABSOLUTE = range(5)


class StepFelt(Settings):
    """How the features are taken.

    Attributes
    ----------
    longest_s, shortest_s : float
        Longest and shortest period of a gait: a longer one is a pause, a shorter one is taken for
        the shortest. [s]
    usual_s : float
        Period of a step after a pause, and of the first. Recorded phones in hand: 1.65 to 1.82
        steps a second. [s]
    smoothing_s : float
        Time constant of the exponential smoothing before the smoothed peak is taken; assumed. [s]
    """

    longest_s: float = Field(default=1.5, gt=0.1, le=10)
    shortest_s: float = Field(default=0.2, gt=0, le=1)
    usual_s: float = Field(default=0.57, gt=0, le=10)
    smoothing_s: float = Field(default=0.05, gt=0, le=1)

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if not self.shortest_s <= self.usual_s <= self.longest_s:
            raise ValueError("usual_s lies outside shortest_s to longest_s; mend one of them")
        return self


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepFeatures:
    """Features of n steps; arrays (n,). The acceleration is ``|a|`` less gravity.

    Attributes
    ----------
    period_s : ndarray of float64
        Time since the step before. [s]
    variance_m2_s4 : ndarray of float64
        Variance of the acceleration within the step. [m^2/s^4]
    smoothed_peak_m_s2 : ndarray of float64
        Highest smoothed acceleration. [m/s^2]
    highest_m_s2, lowest_m_s2 : ndarray of float64
        Extremes of the acceleration. [m/s^2]
    mean_absolute_m_s2 : ndarray of float64
        Mean size of the acceleration. [m/s^2]
    """

    period_s: NDArray[np.float64]
    variance_m2_s4: NDArray[np.float64]
    smoothed_peak_m_s2: NDArray[np.float64]
    highest_m_s2: NDArray[np.float64]
    lowest_m_s2: NDArray[np.float64]
    mean_absolute_m_s2: NDArray[np.float64]

    def __len__(self) -> int:
        """Count the steps."""
        return len(self.period_s)

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Step frequency, (n,). [Hz]."""
        return 1.0 / self.period_s


class StepFeatureReader:
    """The live features of one phone's steps; how blocks are cut changes no bit.

    Each step is described by the samples of its window (see `blesim.pdr.windows`); one without any
    sample has all but the period 0.

    Parameters
    ----------
    settings : StepFelt
        Periods and smoothing.
    """

    def __init__(self, settings: StepFelt) -> None:
        self._settings = settings
        self._windows = StepWindows(columns=2, longest_s=settings.longest_s)
        self._smooth_m_s2 = np.zeros(1)
        self._now_us = np.array([NEVER_US])
        self._step_us = NEVER_US

    def advance(
        self,
        time_us: NDArray[np.integer],
        signal_m_s2: NDArray[np.floating],
        step_us: NDArray[np.integer],
        told_us: NDArray[np.integer],
    ) -> StepFeatures:
        """Features of the steps told in the next block.

        Parameters
        ----------
        time_us : ndarray of int, (n,)
            Times of the samples that follow those of the blocks before. [us]
        signal_m_s2 : ndarray of float, (n,)
            As `blesim.pdr.steps.step_signal_m_s2` gives it. [m/s^2]
        step_us, told_us : ndarray of int, (m,)
            Times of the steps, and when they were told: of a step event of the phone's system the
            same. [us]

        Raises
        ------
        DataError
            If times go backwards, or a sample is not a number.
        """
        times, signal = checked_block(time_us, signal_m_s2, int(self._now_us[0]))
        values = np.empty((len(times), 2))
        _smooth(
            times,
            signal,
            self._settings.smoothing_s * 1e6,
            self._now_us,
            self._smooth_m_s2,
            values,
        )
        windows = self._windows.advance(times, values, told_us)
        felt = np.zeros((5, len(told_us)))
        _feel(windows.values, windows.first, windows.end, felt)
        return StepFeatures(
            period_s=self._periods_s(step_us),
            variance_m2_s4=felt[_VARIANCE],
            smoothed_peak_m_s2=felt[_SMOOTHED_PEAK],
            highest_m_s2=felt[_HIGHEST],
            lowest_m_s2=felt[_LOWEST],
            mean_absolute_m_s2=felt[_MEAN_ABSOLUTE],
        )

    def _periods_s(self, step_us: NDArray[np.integer]) -> NDArray[np.float64]:
        if not len(step_us):
            return np.empty(0)
        times_us = np.concatenate([[self._step_us], step_us])
        self._step_us = int(step_us[-1])
        period_s = np.diff(times_us) * 1e-6
        gait_s = np.maximum(period_s, self._settings.shortest_s)
        paused = period_s > self._settings.longest_s
        return np.where(paused, self._settings.usual_s, gait_s)


@kernel
def _smooth(
    time_us: NDArray[np.int64],
    signal: NDArray[np.float64],
    time_constant_us: float,
    last_us: NDArray[np.int64],
    smooth: NDArray[np.float64],
    values: NDArray[np.float64],
) -> None:
    """Fill the values (n, 2) with the signal plain and smoothed; time and smooth go on (kernel)."""
    for i in range(len(time_us)):
        # The first sample of all comes so late that it counts whole.
        share = 1.0 - math.exp((last_us[0] - time_us[i]) / time_constant_us)
        smooth[0] += share * (signal[i] - smooth[0])
        last_us[0] = time_us[i]
        values[i, _PLAIN], values[i, _SMOOTH] = signal[i], smooth[0]


@kernel
def _feel(
    values: NDArray[np.float64],
    first: NDArray[np.int64],
    end: NDArray[np.int64],
    felt: NDArray[np.float64],
) -> None:
    """Fill the features (5, m) of the windows that have a sample (kernel)."""
    for step in range(len(first)):
        count = end[step] - first[step]
        if count <= 0:
            continue
        total, size = 0.0, 0.0
        highest, lowest, smoothed = -np.inf, np.inf, -np.inf
        for i in range(first[step], end[step]):
            value = values[i, _PLAIN]
            total += value
            size += abs(value)
            highest, lowest = max(highest, value), min(lowest, value)
            smoothed = max(smoothed, values[i, _SMOOTH])
        mean, squares = total / count, 0.0
        for i in range(first[step], end[step]):
            squares += (values[i, _PLAIN] - mean) ** 2
        felt[_VARIANCE, step], felt[_MEAN_ABSOLUTE, step] = squares / count, size / count
        felt[_HIGHEST, step], felt[_LOWEST, step] = highest, lowest
        felt[_SMOOTHED_PEAK, step] = smoothed
