"""Walks as a phone felt them, real or simulated, cut into pieces whose steps are known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, find_peaks, sosfiltfilt

from blesim import columns
from blesim.pdr.steps import GRAVITY_M_S2
from blesim.tables import Carrying, Imu
from blesim.units import to_s

Numbers = NDArray[np.float64]

RATE_HZ = 50.0
# The plain detector of steps, run both ways so that its peaks lie where the signal's do.
_BAND = butter(2, (0.7, 3.0), btype="bandpass", fs=RATE_HZ, output="sos")
_HEIGHT_M_S2 = 0.5
_INTERVAL_S = 0.3
# Whoever stops in between has not made a step of that length.
_LONGEST_INTERVAL_S = 1.0
_FEWEST_STEPS = 12
# Between the filtered peak of a step and that of the samples.
_PEAK_S = 0.12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FeltWalk:
    """What the sensors of one phone told on one walk, sampled at 50 Hz.

    Attributes
    ----------
    name, carrying : str
        Which walk; how the phone was carried, one of `columns.CARRYINGS`.
    time_s : ndarray of float64, (n,)
        From the start of the walk. [s]
    acceleration_m_s2 : ndarray of float64, (n, 3)
        Specific force in the phone's frame. [m/s^2]
    angular_rate_rad_s, magnetic_field_ut : ndarray of float64, (n, 3)
        Without rows where the recording has none. [rad/s], [uT]
    """

    name: str
    carrying: str
    time_s: Numbers
    acceleration_m_s2: Numbers
    angular_rate_rad_s: Numbers
    magnetic_field_ut: Numbers

    def between(self, start_s: float, end_s: float) -> "FeltWalk":
        """The samples from `start_s` until just before `end_s`."""
        rows = slice(*np.searchsorted(self.time_s, [start_s, end_s]))
        return FeltWalk(
            name=self.name,
            carrying=self.carrying,
            time_s=self.time_s[rows],
            acceleration_m_s2=self.acceleration_m_s2[rows],
            angular_rate_rad_s=self.angular_rate_rad_s[rows],
            magnetic_field_ut=self.magnetic_field_ut[rows],
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """A piece of a walk and the steps in it.

    Attributes
    ----------
    felt : FeltWalk
        The samples.
    signal_m_s2 : ndarray of float64, (n,)
        Norm of the specific force less gravity. [m/s^2]
    step : ndarray of int64, (k,)
        Sample at each step.
    """

    felt: FeltWalk
    signal_m_s2: Numbers
    step: NDArray[np.int64]

    @property
    def steps_s(self) -> Numbers:
        """Times of the steps, (k,). [s]."""
        return self.felt.time_s[self.step]

    @property
    def walked(self) -> NDArray[np.bool_]:
        """Which intervals between steps, (k - 1,), were walked through without a stop."""
        return np.diff(self.steps_s) < _LONGEST_INTERVAL_S

    def intervals_s(self) -> Numbers:
        """Intervals between steps; NaN where the walker stopped, (k - 1,). [s]."""
        return np.where(self.walked, np.diff(self.steps_s), np.nan)

    def peaks_m_s2(self) -> Numbers:
        """Highest sample around each step but the last, (k - 1,). [m/s^2]."""
        # Cut from step to step, a peak at the cut would count for both.
        reach = round(_PEAK_S * RATE_HZ)
        padded = np.pad(self.signal_m_s2, reach, mode="edge")
        around = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
        return np.asarray(around[self.step[:-1]].max(axis=1))

    def spans_m_s2(self) -> Numbers:
        """Peak of each step but the last less the lowest sample until the next. [m/s^2]."""
        if len(self.step) < 2:
            return np.empty(0)
        lowest = np.minimum.reduceat(self.signal_m_s2[: self.step[-1]], self.step[:-1])
        return np.asarray(self.peaks_m_s2() - lowest)


def felt_of(name: str, carrying: str, imu: Imu) -> FeltWalk:
    """A simulated walk as `FeltWalk`, time counted from its first sample."""
    columns_of = {
        kind: np.stack([getattr(imu, f"{kind}_{axis}_{unit}") for axis in "xyz"], axis=1)
        for kind, unit in (
            ("acceleration", "m_s2"),
            ("angular_rate", "rad_s"),
            ("magnetic_field", "ut"),
        )
    }
    return FeltWalk(
        name=name,
        carrying=carrying,
        time_s=to_s(imu.time_us - imu.time_us[0]),
        acceleration_m_s2=columns_of["acceleration"].astype(np.float64),
        angular_rate_rad_s=columns_of["angular_rate"].astype(np.float64),
        magnetic_field_ut=columns_of["magnetic_field"].astype(np.float64),
    )


def pieces(walk: FeltWalk, length_s: float) -> list[Piece]:
    """Whole pieces of a walk; those with next to no steps in them are left out.

    Parameters
    ----------
    walk : FeltWalk
        The walk.
    length_s : float
        Duration of a piece. [s]
    """
    whole = int(walk.time_s[-1] // length_s)
    cut = [piece_of(walk.between(i * length_s, (i + 1) * length_s)) for i in range(whole)]
    return [piece for piece in cut if len(piece.step) >= _FEWEST_STEPS]


def piece_of(felt: FeltWalk) -> Piece:
    """A piece with its steps: peaks of the band-passed signal, filtered both ways."""
    signal_m_s2 = np.linalg.norm(felt.acceleration_m_s2, axis=1) - GRAVITY_M_S2
    filtered = sosfiltfilt(_BAND, signal_m_s2 - signal_m_s2.mean())
    found, _ = find_peaks(filtered, height=_HEIGHT_M_S2, distance=round(_INTERVAL_S * RATE_HZ))
    return Piece(felt=felt, signal_m_s2=signal_m_s2, step=found.astype(np.int64))


def step_rate_hz(piece: Piece) -> float:
    """Step rate while walking; NaN without an interval. [Hz]."""
    intervals_s = piece.intervals_s()
    return float(1.0 / np.nanmean(intervals_s)) if np.isfinite(intervals_s).any() else np.nan


def carried(carrying: str) -> Carrying:
    """A phone that is carried the same way all along."""
    code = dict(columns.CARRYINGS)[carrying]
    return Carrying(time_us=np.zeros(1, int), carrying=np.array([code]))
