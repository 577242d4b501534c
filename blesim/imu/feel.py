"""What a phone feels on a walk: the samples of its inertial and magnetic sensors."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError
from blesim.imu.carriage import ANGULAR, LINEAR, MODES
from blesim.imu.drift import drift, spline_spread
from blesim.imu.footfalls import footfalls
from blesim.imu.hold import holds
from blesim.imu.instrument import Instrument, sample_times
from blesim.imu.magnetics import MagneticField, Magnetics
from blesim.imu.motion import stretches
from blesim.imu.quick_normals import three_normals
from blesim.imu.sensors import ImuSettings
from blesim.imu.signal import FIELD_STEP_S, TREMOR_STEP_S, WANDER_STEP_S, felt_truly
from blesim.rng import Draws
from blesim.tables import Carrying, Imu, StepTruth, Trajectory
from blesim.units import MICROSECONDS_PER_SECOND

# Samples worked out together: bounds memory.
BLOCK = 1 << 15
# Time after which a held phone's attitude is forgotten to 1/e; assumed.
_WANDER_S = 4.0
_WANDER_KEPT = float(np.exp(-WANDER_STEP_S / _WANDER_S))
_TREMOR_SPREAD = spline_spread(0.0)
# Coefficients of a spline beyond the last whole step of its grid.
_BEYOND = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Felt:
    """What one phone felt on one walk."""

    imu: Imu


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Signal:
    """Everything that makes the true signal of a walk, a function of time alone.

    Attributes
    ----------
    start_us : int
        First time of the walk. [us]
    stretches, steps, holds : ndarray of float64
        See `motion.stretches`, `footfalls.footfalls`, `hold.holds`.
    wander, field : ndarray of float64, (m, 3)
        Coefficients of splines; see `signal.felt_truly`. [-], [uT]
    tremor : Draws
        Of the coefficients of the tremor.
    """

    start_us: int
    stretches: NDArray[np.float64]
    steps: NDArray[np.float64]
    holds: NDArray[np.float64]
    wander: NDArray[np.float64]
    field: NDArray[np.float64]
    tremor: Draws

    @classmethod
    def of(
        cls,
        magnetics: Magnetics,
        trajectory: Trajectory,
        steps: StepTruth,
        carrying: Carrying,
        seed: int,
        walker: str,
    ) -> Self:
        """The signal of a walk; see `feel`."""
        start_us = int(trajectory.time_us[0])
        span_s = (int(trajectory.time_us[-1]) - start_us) / MICROSECONDS_PER_SECOND
        count = int(span_s / WANDER_STEP_S) + _BEYOND
        wander = drift(Draws(seed=seed, purpose="wander", walker=walker), count, _WANDER_KEPT)
        return cls(
            start_us=start_us,
            stretches=stretches(trajectory),
            steps=footfalls(steps, start_us, seed, walker),
            holds=holds(carrying, start_us, seed, walker),
            wander=wander / spline_spread(_WANDER_KEPT),
            field=_field_on_the_way(magnetics, trajectory, seed),
            tremor=Draws(seed=seed, purpose="tremor", walker=walker),
        )

    def at(self, time_us: NDArray[np.int64]) -> NDArray[np.float64]:
        """What perfect sensors tell.

        Parameters
        ----------
        time_us : ndarray of int64, (n,)
            Ascending, within the walk. [us]

        Returns
        -------
        ndarray of float64, (n, 9)
            Specific force, angular rate, magnetic field. [m/s2], [rad/s], [uT]
        """
        time_s = (time_us - self.start_us) / MICROSECONDS_PER_SECOND
        out = np.empty((len(time_s), 9))
        if len(time_s) == 0:
            return out
        first = int(time_s[0] / TREMOR_STEP_S)
        last = int(time_s[-1] / TREMOR_STEP_S)
        tremor = three_normals(self.tremor, first, last + _BEYOND - first)
        felt_truly(
            time_s,
            self.stretches,
            self.steps,
            self.holds,
            tremor / _TREMOR_SPREAD,
            first,
            self.wander,
            self.field,
            MODES,
            LINEAR,
            ANGULAR,
            out,
        )
        return out


def _field_on_the_way(
    magnetics: Magnetics, trajectory: Trajectory, seed: int
) -> NDArray[np.float64]:
    """Magnetic field where the walker is, every 0.25 s from one step before the walk, (m, 3)."""
    start_us, end_us = int(trajectory.time_us[0]), int(trajectory.time_us[-1])
    step_us = round(FIELD_STEP_S * MICROSECONDS_PER_SECOND)
    time_us = start_us + step_us * np.arange(-1, (end_us - start_us) // step_us + _BEYOND)
    poses = trajectory.at(np.clip(time_us, start_us, end_us))
    field_ut = np.empty((len(time_us), 3))
    for level in np.unique(poses.level):
        there = poses.level == level
        field = MagneticField.draw(magnetics, seed, int(level))
        field_ut[there] = field.at_ut(poses.x_m[there], poses.y_m[there])
    return field_ut


def feel(
    phone: ImuSettings,
    magnetics: Magnetics,
    trajectory: Trajectory,
    steps: StepTruth,
    carrying: Carrying,
    seed: int,
    walker: str,
) -> Felt:
    """What a phone's inertial and magnetic sensors tell on a walk.

    The true signal does not depend on the sensors or their rate; samples of two rates at the same
    regular time have the same jitter, and the same noise but for its spread.

    Parameters
    ----------
    phone : ImuSettings
        The sensors.
    magnetics : Magnetics
        The magnetic field of the venue.
    trajectory : Trajectory
        The walk.
    steps : StepTruth
        The steps taken on it.
    carrying : Carrying
        How the phone is carried; the first row not after the beginning of the walk.
    seed, walker : int, str
        Address of the draws.

    Returns
    -------
    Felt

    Raises
    ------
    DataError
        If there is no walk, or it is not said how the phone is carried from its beginning.
    """
    refuse_unknown(trajectory, carrying, walker)
    signal = Signal.of(magnetics, trajectory, steps, carrying, seed, walker)
    span_s = (int(trajectory.time_us[-1]) - signal.start_us) / MICROSECONDS_PER_SECOND
    instrument = Instrument.of(phone, span_s, seed, walker)
    draws = Draws(seed=seed, purpose="sample time", walker=walker)
    end_us = int(trajectory.time_us[-1])
    times, parts = [], []
    for first, count in _blocks(phone, span_s):
        regular_us, time_us = sample_times(phone, signal.start_us, end_us, first, count, draws)
        values = signal.at(time_us)
        time_s = (time_us - signal.start_us) / MICROSECONDS_PER_SECOND
        instrument.add_to(regular_us, time_s, values)
        times.append(time_us)
        parts.append(values.T.astype(np.float32))
    return Felt(imu=_table(np.concatenate(times), np.concatenate(parts, axis=1)))


def refuse_unknown(trajectory: Trajectory, carrying: Carrying, walker: str) -> None:
    """Raise `DataError` if there is no walk, or its beginning is carried in no known way."""
    if len(trajectory) == 0:
        raise DataError(f"walk of '{walker}': there is no trajectory, so nothing can be felt")
    if len(carrying) == 0 or carrying.time_us[0] > trajectory.time_us[0]:
        raise DataError(
            f"walk of '{walker}': it is not said how the phone is carried from the beginning;"
            " let the first row of its carrying have the walk's first time"
        )


def _blocks(phone: ImuSettings, span_s: float) -> Iterator[tuple[int, int]]:
    """First sample and number of samples of each block."""
    total = int(np.floor(span_s * phone.rate_hz + 1e-6)) + 1
    return ((first, min(BLOCK, total - first)) for first in range(0, total, BLOCK))


def _table(time_us: NDArray[np.int64], values: NDArray[np.float32]) -> Imu:
    """The samples of nine axes, (9, n), as they are recorded."""
    names = [column.field for column in Imu.STREAM.columns[1:]]
    return Imu(time_us=time_us, **dict(zip(names, values, strict=True)))
