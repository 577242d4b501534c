"""Heading of the walker from compass, gyroscope or the phone's system, by sample and by step.

A heading is counted from the map's x axis counter-clockwise; an azimuth, as a compass tells it,
from north clockwise. `blesim.units` converts, and a fixed offset, learned from a survey, turns
magnetic north and the way the phone is held into the map's frame.

References
----------
.. [1] PDR with map-compensated heading, Eq 9; digest "map-heading-ekf".
.. [2] PDR and four-direction fingerprints, step 2; digest "pdr-fingerprint-kalman".
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from blesim.errors import DataError, UsageError
from blesim.kernels import kernel
from blesim.pdr.windows import NEVER_US, StepWindows
from blesim.settings import Settings
from blesim.units import azimuth_to_heading, wrap_angle


def compass_heading_rad(azimuth_rad: ArrayLike, offset_rad: float = 0.0) -> NDArray[np.float64]:
    """Heading of a compass azimuth, any shape: ``pi / 2 - azimuth + offset``, wrapped. [rad].

    Parameters
    ----------
    azimuth_rad : array_like of float
        As `blesim.pdr.attitude.Leveller` gives it. [rad]
    offset_rad : float
        From the compass's frame into the map's, [2]_. [rad]
    """
    return wrap_angle(azimuth_to_heading(azimuth_rad) + offset_rad)


def compass_offset_rad(azimuth_rad: ArrayLike, heading_rad: ArrayLike) -> float:
    """Fixed offset of a compass: circular mean of heading less compass heading. [rad].

    Parameters
    ----------
    azimuth_rad, heading_rad : array_like of float, (n,)
        What the compass told, and the direction walked there; pairs with NaN are left out. [rad]

    Raises
    ------
    DataError
        If there is no pair, or the differences point everywhere.
    """
    difference = np.asarray(heading_rad, np.float64) - compass_heading_rad(azimuth_rad)
    known = difference[np.isfinite(difference)]
    if not len(known):
        raise DataError("no compass azimuth where the heading is known; survey along straight ways")
    along, across = float(np.cos(known).mean()), float(np.sin(known).mean())
    # Differences spread evenly over the circle have a mean of this size by chance.
    if math.hypot(along, across) < 1.0 / math.sqrt(len(known)):
        raise DataError("the compass has no fixed offset to the survey; is the phone held forward?")
    return math.atan2(across, along)


class Complementary(Settings):
    """Parameters of the complementary filter.

    Attributes
    ----------
    weight : float
        W, the share of the compass in each sample: 0 is the gyroscope alone, 1 the compass alone.
        Assumed: 0.02 forgets the gyroscope's drift within a second at 50 Hz. [-]
    """

    weight: float = Field(default=0.02, ge=0, le=1)


class ComplementaryFilter:
    """The live heading of one phone, Eq 9 of [1]_; how blocks are cut changes no bit.

    ``h_k = (1 - W) (h_(k-1) + w_k dt) + W h_mag``, along the shorter way round the circle: the
    prediction p turns towards the compass by ``W wrap(h_mag - p)``.

    Parameters
    ----------
    settings : Complementary
        The weight.
    start_heading_rad : float, optional
        Heading before the first sample; the compass tells it unless given. [rad]

    Raises
    ------
    UsageError
        If the gyroscope alone is asked for without a heading to start from.
    """

    def __init__(self, settings: Complementary, start_heading_rad: float | None = None) -> None:
        if settings.weight == 0 and start_heading_rad is None:
            raise UsageError("weight 0 is the gyroscope alone: give start_heading_rad as well")
        self._weight = settings.weight
        known = start_heading_rad is not None
        self._heading_rad = np.array([start_heading_rad if known else np.nan], np.float64)
        self._last_us = np.array([NEVER_US])

    def advance(
        self,
        time_us: NDArray[np.integer],
        turn_rate_rad_s: NDArray[np.floating],
        compass_rad: NDArray[np.floating],
    ) -> NDArray[np.float64]:
        """Heading at each sample of the next block, (n,); NaN until it is known. [rad].

        Parameters
        ----------
        time_us : ndarray of int, (n,)
            Times of the samples that follow those of the blocks before. [us]
        turn_rate_rad_s : ndarray of float, (n,)
            Counter-clockwise; see `blesim.pdr.attitude.LevelSamples`. [rad/s]
        compass_rad : ndarray of float, (n,)
            Heading by the compass; see `compass_heading_rad`. NaN where it tells none. [rad]

        Raises
        ------
        DataError
            If times go backwards.
        """
        if np.any(np.diff(time_us, prepend=self._last_us[0]) < 0):
            raise DataError("samples go back behind the last one; feed them in order of time")
        heading_rad = np.empty(len(time_us))
        _advance(
            np.ascontiguousarray(time_us, dtype=np.int64),
            np.ascontiguousarray(turn_rate_rad_s, dtype=np.float64),
            np.ascontiguousarray(compass_rad, dtype=np.float64),
            self._weight,
            self._last_us,
            self._heading_rad,
            heading_rad,
        )
        return heading_rad


class StepHeadings:
    """The live mean heading of each step; how blocks are cut changes no bit.

    The circular mean over the samples of the step's window (see `blesim.pdr.windows`) that have a
    heading. A step without any keeps that of the step before, NaN if there is none.

    Parameters
    ----------
    longest_s : float
        Longest time that is averaged, for a step after a pause. [s]
    """

    def __init__(self, *, longest_s: float = 1.5) -> None:
        self._windows = StepWindows(columns=1, longest_s=longest_s)
        self._latest_rad = np.array([np.nan])

    def advance(
        self,
        time_us: NDArray[np.integer],
        heading_rad: NDArray[np.floating],
        told_us: NDArray[np.integer],
    ) -> NDArray[np.float64]:
        """Headings of the steps told in the next block, (m,). [rad].

        Parameters
        ----------
        time_us, heading_rad : ndarray, (n,)
            Samples of the heading that follow those of the blocks before. [us], [rad]
        told_us : ndarray of int, (m,)
            When the steps of the block were told. [us]

        Raises
        ------
        DataError
            If samples or steps go backwards in time.
        """
        column = np.asarray(heading_rad, np.float64)[:, None]
        windows = self._windows.advance(time_us, column, told_us)
        mean_rad = np.empty(len(told_us))
        _mean(windows.values, windows.first, windows.end, self._latest_rad, mean_rad)
        return mean_rad


class HeldHeadings:
    """The live headings of the phone's system held to steps; how blocks are cut changes no bit.

    A step has the latest heading told before it, whatever its age; NaN before the first.
    """

    def __init__(self) -> None:
        self._time_us = np.array([NEVER_US])
        self._heading_rad = np.array([np.nan])

    def advance(
        self,
        time_us: NDArray[np.integer],
        heading_rad: NDArray[np.floating],
        told_us: NDArray[np.integer],
    ) -> NDArray[np.float64]:
        """Headings of the steps told in the next block, (m,). [rad].

        Parameters
        ----------
        time_us, heading_rad : ndarray, (n,)
            As in `blesim.tables.Headings`, following those of the blocks before. [us], [rad]
        told_us : ndarray of int, (m,)
            When the steps of the block were told. [us]

        Raises
        ------
        DataError
            If headings go backwards in time.
        """
        times = np.concatenate([self._time_us, time_us])
        headings_rad = np.concatenate([self._heading_rad, heading_rad])
        if np.any(np.diff(times) < 0):
            raise DataError("headings go back behind the last one; feed them in order of time")
        held = np.searchsorted(times, told_us) - 1
        # Of those at one moment a step at that moment has heard none for certain: keep one before.
        first = max(int(np.searchsorted(times, times[-1])) - 1, 0)
        self._time_us, self._heading_rad = times[first:].copy(), headings_rad[first:].copy()
        return headings_rad[np.maximum(held, 0)]


@kernel
def _wrapped(angle: float) -> float:
    """The same direction in [-pi, pi), as `blesim.units.wrap_angle` has it (kernel)."""
    wrapped = (angle + math.pi) % (2.0 * math.pi) - math.pi
    return -math.pi if wrapped >= math.pi else wrapped


@kernel
def _advance(
    time_us: NDArray[np.int64],
    turn_rate: NDArray[np.float64],
    compass: NDArray[np.float64],
    weight: float,
    last_us: NDArray[np.int64],
    state: NDArray[np.float64],
    heading: NDArray[np.float64],
) -> None:
    """Fill the headings (n,); the time and the heading are carried on (kernel)."""
    for i in range(len(time_us)):
        elapsed_s = 0.0 if last_us[0] == NEVER_US else (time_us[i] - last_us[0]) * 1e-6
        last_us[0] = time_us[i]
        if np.isnan(state[0]):
            state[0] = _wrapped(compass[i])
        else:
            predicted = state[0] + turn_rate[i] * elapsed_s
            if not np.isnan(compass[i]):
                predicted += weight * _wrapped(compass[i] - predicted)
            state[0] = _wrapped(predicted)
        heading[i] = state[0]


@kernel
def _mean(
    values: NDArray[np.float64],
    first: NDArray[np.int64],
    end: NDArray[np.int64],
    latest: NDArray[np.float64],
    mean: NDArray[np.float64],
) -> None:
    """Fill the circular means (m,) of the windows; the latest is carried on (kernel)."""
    for step in range(len(first)):
        along, across = 0.0, 0.0
        for i in range(first[step], end[step]):
            if not np.isnan(values[i, 0]):
                along += math.cos(values[i, 0])
                across += math.sin(values[i, 0])
        if along != 0.0 or across != 0.0:
            latest[0] = _wrapped(math.atan2(across, along))
        mean[step] = latest[0]
