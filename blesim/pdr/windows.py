"""The samples of each step: those from the moment the step before was told until it is told itself.

A step is told when no later sample can change it, a little after its peak. What follows the moments
of telling holds one gait cycle as well, and needs no sample that is long past. The sample at the
very moment belongs to the next step: of several events at one moment a phone may not have heard
all, so a step is described by what came before it, however blocks are cut.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError
from blesim.units import to_us

NEVER_US = -(2**60)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Windows:
    """Samples of m steps: step i has the rows ``first[i]`` to ``end[i] - 1`` of the values.

    Attributes
    ----------
    values : ndarray of float64, (r, columns)
        Samples.
    first, end : ndarray of int64, (m,)
        Equal for a step before the first sample of all.
    """

    values: NDArray[np.float64]
    first: NDArray[np.int64]
    end: NDArray[np.int64]


class StepWindows:
    """The live samples of the steps of one phone.

    Step i that is told at T_i has the samples with ``max(T_(i-1), T_i - longest) <= t < T_i``, or
    the latest before T_i if there is none.

    Parameters
    ----------
    columns : int
        Number of values of a sample.
    longest_s : float
        Longest window; where a walker pauses, the first step has no more. [s]
    """

    def __init__(self, *, columns: int, longest_s: float) -> None:
        self._longest_us = to_us(longest_s)
        self._time_us = np.empty(0, np.int64)
        self._values = np.empty((0, columns))
        self._told_us = NEVER_US

    def advance(
        self,
        time_us: NDArray[np.integer],
        values: NDArray[np.floating],
        told_us: NDArray[np.integer],
    ) -> Windows:
        """Samples of the steps told in the next block.

        Parameters
        ----------
        time_us : ndarray of int, (n,)
            Times of the samples that follow those of the blocks before. [us]
        values : ndarray of float, (n, columns)
            The samples.
        told_us : ndarray of int, (m,)
            When the steps of the block were told. [us]

        Raises
        ------
        DataError
            If samples or steps go backwards in time.
        """
        self._refuse_disorder(time_us, told_us)
        times = np.concatenate([self._time_us, time_us])
        samples = np.concatenate([self._values, values])
        previous_us = np.concatenate([[self._told_us], told_us]).astype(np.int64)[:-1]
        begin_us = np.maximum(previous_us, told_us - self._longest_us)
        end = np.searchsorted(times, told_us)
        first = np.minimum(np.searchsorted(times, begin_us), np.maximum(end - 1, 0))
        if len(told_us):
            self._told_us = int(told_us[-1])
        self._keep(times, samples)
        return Windows(values=samples, first=first.astype(np.int64), end=end.astype(np.int64))

    def _refuse_disorder(self, time_us: NDArray[np.integer], told_us: NDArray[np.integer]) -> None:
        last_us = self._time_us[-1] if len(self._time_us) else NEVER_US
        if np.any(np.diff(time_us, prepend=last_us) < 0):
            raise DataError("samples go back behind the last one; feed them in order of time")
        if np.any(np.diff(told_us, prepend=self._told_us) < 0):
            raise DataError("steps go back behind the last one; feed them in order of time")

    def _keep(self, times: NDArray[np.int64], samples: NDArray[np.float64]) -> None:
        """Keep what a later step may ask for, and the latest sample before the last moment."""
        if not len(times):
            return
        needed_us = max(self._told_us, int(times[-1]) - self._longest_us)
        first = min(np.searchsorted(times, needed_us), np.searchsorted(times, times[-1]) - 1)
        first = max(int(first), 0)
        self._time_us, self._values = times[first:].copy(), samples[first:].copy()
