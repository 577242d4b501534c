"""What real sensors make of the truth: the errors of one phone, and the kernels that add them."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.imu.drift import drift
from blesim.imu.quick_normals import HALF_STEP, HALF_WORD, nine_normals, quick_normal
from blesim.imu.sensors import ImuSettings, Triad
from blesim.kernels import kernel
from blesim.rng import Draws, philox
from blesim.units import MICROSECONDS_PER_SECOND

DRIFT_STEP_S = 1.0
# Sample times stay closer to the regular ones than to their neighbours'.
_LARGEST_JITTER = 0.4
_NAMES = ("accelerometer", "gyroscope", "magnetometer")


@dataclass(frozen=True, slots=True, kw_only=True)
class Instrument:
    """The sensors of one phone on one walk, with the errors that they happen to have.

    Attributes
    ----------
    distortion : ndarray of float64, (3, 3, 3)
        Matrix of each sensor: scale, misalignment, soft iron. [-]
    offset : ndarray of float64, (m, 9)
        Bias every second: constant and drifting part.
    white, resolution, largest : ndarray of float64, (9,)
        Spread of a sample's noise; step, 0 for none; limit.
    address : ndarray of uint64, (4,)
        Of the noise.
    """

    distortion: NDArray[np.float64]
    offset: NDArray[np.float64]
    white: NDArray[np.float64]
    resolution: NDArray[np.float64]
    largest: NDArray[np.float64]
    address: NDArray[np.uint64]

    @classmethod
    def of(cls, phone: ImuSettings, duration_s: float, seed: int, walker: str) -> Self:
        """The sensors that a walker's phone has for some time."""
        sensors = (phone.accelerometer, phone.gyroscope, phone.magnetometer)
        triads = [sensor.triad(phone.rate_hz) for sensor in sensors]
        count = int(duration_s / DRIFT_STEP_S) + 2
        named = list(zip(triads, _NAMES, strict=True))
        distortion = [_distortion(triad, seed, walker, name) for triad, name in named]
        distortion[2] = _soft_iron(phone, seed, walker) @ distortion[2]
        return cls(
            distortion=np.stack(distortion),
            offset=np.concatenate(
                [_offset(triad, count, seed, walker, name) for triad, name in named], axis=1
            ),
            white=np.repeat([triad.white for triad in triads], 3),
            resolution=np.repeat([triad.resolution for triad in triads], 3),
            largest=np.repeat([triad.largest for triad in triads], 3),
            address=Draws(seed=seed, purpose="imu noise", walker=walker).address(),
        )

    def add_to(
        self, regular_us: NDArray[np.int64], time_s: NDArray[np.float64], out: NDArray[np.float64]
    ) -> None:
        """Turn true values into readings, in place.

        Parameters
        ----------
        regular_us : ndarray of int64, (n,)
            Regular time of each sample, which addresses its noise. [us]
        time_s : ndarray of float64, (n,)
            When it was taken. [s]
        out : ndarray of float64, (n, 9)
            [m/s2], [rad/s], [uT]
        """
        _add_errors(
            regular_us,
            time_s,
            self.distortion,
            self.offset,
            self.white,
            self.resolution,
            self.largest,
            self.address,
            out,
        )


def _distortion(triad: Triad, seed: int, walker: str, name: str) -> NDArray[np.float64]:
    """Scale and misalignment of one sensor, (3, 3). [-]."""
    draws = Draws(seed=seed, purpose=f"{name} axes", walker=walker).normals(np.arange(3))[:, :3]
    spread = np.where(np.eye(3) > 0, triad.scale, triad.misalignment)
    return np.eye(3) + spread * draws


def _soft_iron(phone: ImuSettings, seed: int, walker: str) -> NDArray[np.float64]:
    """How iron in the phone distorts the field: a symmetric matrix near one, (3, 3). [-]."""
    draws = Draws(seed=seed, purpose="soft iron", walker=walker).normals(np.arange(3))[:, :3]
    lower = np.tril(draws)
    symmetric = lower + np.tril(lower, -1).T
    return np.eye(3) + phone.magnetometer.soft_iron_percent / 100.0 * symmetric


def _offset(triad: Triad, count: int, seed: int, walker: str, name: str) -> NDArray[np.float64]:
    """Bias of one sensor every second, (count, 3)."""
    once = Draws(seed=seed, purpose=f"{name} bias", walker=walker).normals(np.zeros(1, int))
    slow = Draws(seed=seed, purpose=f"{name} drift", walker=walker)
    kept = float(np.exp(-DRIFT_STEP_S / triad.instability_s))
    return triad.bias * once[:, :3] + triad.instability * drift(slow, count, kept)


def sample_times(
    phone: ImuSettings, start_us: int, end_us: int, first: int, count: int, address: Draws
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Regular and real times of the samples of a stretch that reach the application.

    Parameters
    ----------
    phone : ImuSettings
        Rate, jitter and share of lost samples.
    start_us, end_us : int
        First and last time of the walk, which no sample leaves. [us]
    first, count : int
        Which samples, counted from the beginning of the walk.
    address : Draws
        Of jitter and losses.

    Returns
    -------
    ndarray of int64, (n,)
        Regular times, from the beginning of the walk. [us]
    ndarray of int64, (n,)
        Times of the samples. [us]
    """
    number = np.arange(first, first + count)
    regular_us = np.rint(number * (MICROSECONDS_PER_SECOND / phone.rate_hz)).astype(np.int64)
    jitter_us, kept = np.empty(count), np.empty(count, np.bool_)
    limit_us = _LARGEST_JITTER * MICROSECONDS_PER_SECOND / phone.rate_hz
    _draw_times(
        address.address(), regular_us, 1000.0 * phone.jitter_ms, limit_us, phone.dropped, jitter_us,
        kept,
    )  # fmt: skip
    time_us = np.clip(start_us + regular_us + jitter_us.astype(np.int64), start_us, end_us)
    return regular_us[kept], time_us[kept]


@kernel
def _draw_times(
    address: NDArray[np.uint64],
    regular_us: NDArray[np.int64],
    spread_us: float,
    limit_us: float,
    dropped: float,
    jitter_us: NDArray[np.float64],
    kept: NDArray[np.bool_],
) -> None:
    """Whole microseconds of jitter of each sample, and whether it is delivered (kernel)."""
    for row in range(len(regular_us)):
        words = philox(address, np.uint64(regular_us[row]))
        deviation = spread_us * quick_normal(words[0] & HALF_WORD)
        jitter_us[row] = np.rint(min(max(deviation, -limit_us), limit_us))
        kept[row] = (np.float64(words[1] >> np.uint64(32)) + 0.5) * HALF_STEP >= dropped


@kernel
def _add_errors(
    regular_us: NDArray[np.int64],
    time_s: NDArray[np.float64],
    distortion: NDArray[np.float64],
    offset: NDArray[np.float64],
    white: NDArray[np.float64],
    resolution: NDArray[np.float64],
    largest: NDArray[np.float64],
    address: NDArray[np.uint64],
    out: NDArray[np.float64],
) -> None:
    normals, true = np.empty(9), np.empty(3)
    for row in range(len(time_s)):
        nine_normals(address, np.uint64(regular_us[row]), normals)
        place = time_s[row] / DRIFT_STEP_S
        second = min(int(place), len(offset) - 2)
        share = place - second
        for sensor in range(3):
            for axis in range(3):
                true[axis] = out[row, 3 * sensor + axis]
            for axis in range(3):
                column = 3 * sensor + axis
                value = (1.0 - share) * offset[second, column] + share * offset[second + 1, column]
                value += white[column] * normals[column]
                for other in range(3):
                    value += distortion[sensor, axis, other] * true[other]
                if resolution[column] > 0.0:
                    value = resolution[column] * np.rint(value / resolution[column])
                out[row, column] = min(max(value, -largest[column]), largest[column])
