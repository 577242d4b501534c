"""Recorded streams in memory: frozen tables whose fields are the columns of `columns.py`."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from blesim import columns
from blesim.columns import Column, Stream
from blesim.errors import DataError
from blesim.units import wrap_angle

IntArray = NDArray[np.integer[Any]]
FloatArray = NDArray[np.floating[Any]]
Selection = slice | NDArray[np.bool_] | NDArray[np.intp]
# Stand for columns that were not given, whatever the number of rows.
_NO_PROXIMITY: IntArray = np.empty(0, dtype=np.uint8)
_NO_HEADING: FloatArray = np.empty(0, dtype=np.float64)
_STEADY: FloatArray = np.empty(0, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table:
    """Equally long read-only columns; row i of each belongs together.

    Building a table gives every column its recorded type and decimals, so that a table in memory
    and the same table read back from a file are equal.

    Raises
    ------
    DataError
        If a column is not one-dimensional, the lengths differ, times go backwards, or a value does
        not fit the type of its column.
    """

    STREAM: ClassVar[Stream]

    def __post_init__(self) -> None:
        for column in self.STREAM.columns:
            object.__setattr__(self, column.field, _recorded(column, getattr(self, column.field)))
        lengths = {column.field: len(self[column]) for column in self.STREAM.columns}
        if len(set(lengths.values())) > 1:
            raise DataError(f"{self.STREAM.group}: columns of different length: {lengths}")
        if self.STREAM.ascending and np.any(np.diff(self[self.STREAM.columns[0]]) < 0):
            raise DataError(f"{self.STREAM.group}: times go backwards; sort the rows by time")

    def __len__(self) -> int:
        """Count the rows."""
        return len(self[self.STREAM.columns[0]])

    def __getitem__(self, column: Column) -> NDArray[Any]:
        """Return the values of one column, (n,)."""
        values: NDArray[Any] = getattr(self, column.field)
        return values

    def __eq__(self, other: object) -> bool:
        """Whether the other table has the same columns with the same values, NaN equal to NaN."""
        return type(self) is type(other) and all(
            np.array_equal(mine, theirs, equal_nan=mine.dtype.kind == "f")
            for mine, theirs in zip(self.arrays(), other.arrays(), strict=True)
        )

    __hash__ = None  # type: ignore[assignment]  # arrays have no hash

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle so that the columns are read-only on the other side as well."""
        return _rebuilt, (type(self), list(self.arrays()))

    def arrays(self) -> Iterator[NDArray[Any]]:
        """Yield the columns in the order of the file."""
        return (self[column] for column in self.STREAM.columns)

    def rows(self, selection: Selection) -> Self:
        """Return the selected rows; a slice is a view without copying."""
        return self._trusted([values[selection] for values in self.arrays()])

    @classmethod
    def empty(cls) -> Self:
        """Return a table without rows."""
        return cls._trusted([np.empty(0, column.numpy_dtype) for column in cls.STREAM.columns])

    @classmethod
    def concatenate(cls, parts: Sequence[Self]) -> Self:
        """Return the rows of several tables, one after the other; times must still ascend."""
        if not parts:
            return cls.empty()
        names = [column.field for column in cls.STREAM.columns]
        joined = [
            np.concatenate(arrays) for arrays in zip(*(p.arrays() for p in parts), strict=True)
        ]
        return cls(**dict(zip(names, joined, strict=True)))

    @classmethod
    def _trusted(cls, arrays: Sequence[NDArray[Any]]) -> Self:
        """Build from arrays that already have the recorded type, without looking at each value."""
        table = object.__new__(cls)
        for column, values in zip(cls.STREAM.columns, arrays, strict=True):
            values.flags.writeable = False
            object.__setattr__(table, column.field, values)
        return table


def _recorded(column: Column, values: Any) -> NDArray[Any]:
    """Return a read-only copy of a column's values at its recorded type and decimals."""
    array = np.asarray(values)
    if array.ndim != 1:
        raise DataError(f"column {column.field}: one value a row is needed, not {array.ndim}-D")
    if column.decimals is not None:
        # Adding zero turns -0.0 into 0.0, which would be another byte for the same number.
        array = np.round(array.astype(np.float64), column.decimals) + 0.0
    with np.errstate(invalid="ignore"):
        recorded = array.astype(column.numpy_dtype)
    if column.numpy_dtype.kind in "iu" and array.dtype != recorded.dtype:
        _refuse_changed(column, array, recorded)
    recorded.flags.writeable = False
    return recorded


def _refuse_changed(column: Column, array: NDArray[Any], recorded: NDArray[Any]) -> None:
    """Raise if a conversion to whole numbers cut or wrapped a value."""
    changed = np.flatnonzero(array != recorded)
    if len(changed):
        raise DataError(
            f"column {column.field}: {array[changed[0]]} in row {changed[0]} does not fit"
            f" {column.dtype}; round it, or mend it where it comes from"
        )


def _rebuilt(table: type[Table], arrays: list[NDArray[Any]]) -> Table:
    """Return a table from the columns that a pickle holds."""
    return table._trusted(arrays)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Readings(Table):
    """RSSI readings, in order of time; ``beacon`` counts the beacons of the venue from 0.

    Without ``proximity`` no reading tells a proximity class, as most systems do not.
    """

    STREAM: ClassVar[Stream] = columns.RSSI
    time_us: IntArray
    beacon: IntArray
    rssi_dbm: IntArray
    channel: IntArray
    proximity: IntArray = field(default_factory=lambda: _NO_PROXIMITY)

    def __post_init__(self) -> None:
        if self.proximity is _NO_PROXIMITY:
            told = np.full(np.size(self.time_us), columns.PROXIMITY_NOT_TOLD)
            object.__setattr__(self, "proximity", told)
        Table.__post_init__(self)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Imu(Table):
    """Samples of accelerometer, gyroscope and magnetometer in the phone's frame."""

    STREAM: ClassVar[Stream] = columns.IMU
    time_us: IntArray
    acceleration_x_m_s2: FloatArray
    acceleration_y_m_s2: FloatArray
    acceleration_z_m_s2: FloatArray
    angular_rate_x_rad_s: FloatArray
    angular_rate_y_rad_s: FloatArray
    angular_rate_z_rad_s: FloatArray
    magnetic_field_x_ut: FloatArray
    magnetic_field_y_ut: FloatArray
    magnetic_field_z_ut: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Steps(Table):
    """Step events with the phone's own reading of length and heading."""

    STREAM: ClassVar[Stream] = columns.STEPS
    time_us: IntArray
    length_m: FloatArray
    heading_rad: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Marks(Table):
    """Way points the tester marked, at their known positions.

    Without ``heading_rad`` the tester told none; a survey that stands in several directions does.
    """

    STREAM: ClassVar[Stream] = columns.MARKS
    time_us: IntArray
    x_m: FloatArray
    y_m: FloatArray
    level: IntArray
    heading_rad: FloatArray = field(default_factory=lambda: _NO_HEADING)

    def __post_init__(self) -> None:
        if self.heading_rad is _NO_HEADING:
            object.__setattr__(self, "heading_rad", np.full(np.size(self.time_us), np.nan))
        Table.__post_init__(self)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Headings(Table):
    """Headings that the phone's system makes of its sensors."""

    STREAM: ClassVar[Stream] = columns.HEADING
    time_us: IntArray
    heading_rad: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pressures(Table):
    """Samples of the phone's barometer."""

    STREAM: ClassVar[Stream] = columns.PRESSURE
    time_us: IntArray
    pressure_hpa: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepTruth(Table):
    """Steps the walker really took."""

    STREAM: ClassVar[Stream] = columns.STEP_TRUTH
    time_us: IntArray
    length_m: FloatArray
    heading_rad: FloatArray
    foot: IntArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Packets(Table):
    """What became of every packet sent while the phone was there, component by component."""

    STREAM: ClassVar[Stream] = columns.PACKETS
    time_us: IntArray
    beacon: IntArray
    channel: IntArray
    fate: IntArray
    distance_m: FloatArray
    path_loss_db: FloatArray
    obstacle_loss_db: FloatArray
    shadowing_db: FloatArray
    fading_db: FloatArray
    body_loss_db: FloatArray
    power_dbm: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Carrying(Table):
    """How a phone was carried; each row holds until the next, the first from the walk's start."""

    STREAM: ClassVar[Stream] = columns.CARRYING
    time_us: IntArray
    carrying: IntArray

    def at(self, time_us: IntArray) -> IntArray:
        """How the phone was carried at the given times, (n,); before the first row as there."""
        row = np.searchsorted(self.time_us, time_us, side="right") - 1
        modes: IntArray = self.carrying[np.maximum(row, 0)]
        return modes


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Visits(Table):
    """Who stopped at which product section, for how long."""

    STREAM: ClassVar[Stream] = columns.VISITS
    time_us: IntArray
    person: IntArray
    section: IntArray
    dwell_us: IntArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BeaconHistory(Table):
    """What happened to the beacons while they were heard, and what each is like from then on."""

    STREAM: ClassVar[Stream] = columns.BEACON_HISTORY
    time_us: IntArray
    beacon: IntArray
    event: IntArray
    x_m: FloatArray
    y_m: FloatArray
    z_m: FloatArray
    level: IntArray
    power_change_db: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track(Table):
    """Estimated positions, in order of time; edge -1 and offset NaN where not on the graph."""

    STREAM: ClassVar[Stream] = columns.TRACK
    time_us: IntArray
    x_m: FloatArray
    y_m: FloatArray
    level: IntArray
    variance_x_m2: FloatArray
    variance_y_m2: FloatArray
    covariance_xy_m2: FloatArray
    edge: IntArray
    offset_m: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Poses:
    """Where a walker is at each of n times: the answer of `Trajectory.at`, all arrays (n,)."""

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    level: IntArray
    heading_rad: NDArray[np.float64]
    speed_m_s: FloatArray
    edge: IntArray
    offset_m: FloatArray
    state: IntArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trajectory(Table):
    """An exact walk: knots, between which the way is straight and the acceleration constant.

    Heading turns evenly; edge, state and the mean rate of the offset hold from their knot until
    the next. Without ``acceleration_m_s2`` every speed is steady.
    """

    STREAM: ClassVar[Stream] = columns.TRAJECTORY
    time_us: IntArray
    x_m: FloatArray
    y_m: FloatArray
    level: IntArray
    heading_rad: FloatArray
    speed_m_s: FloatArray
    acceleration_m_s2: FloatArray = field(default_factory=lambda: _STEADY)
    edge: IntArray
    offset_m: FloatArray
    edge_speed_m_s: FloatArray
    state: IntArray

    def __post_init__(self) -> None:
        if self.acceleration_m_s2 is _STEADY:
            object.__setattr__(self, "acceleration_m_s2", np.zeros(np.size(self.time_us)))
        Table.__post_init__(self)

    def at(self, time_us: IntArray) -> Poses:
        """Poses at the given times.

        Parameters
        ----------
        time_us : ndarray of int, (n,)
            In any order, each within the walk. [us]

        Returns
        -------
        Poses

        Raises
        ------
        DataError
            If a time lies before the first or after the last knot.
        """
        self._refuse_outside(time_us)
        last = np.searchsorted(self.time_us, time_us, side="right") - 1
        following = np.minimum(last + 1, len(self) - 1)
        elapsed_us = (time_us - self.time_us[last]).astype(np.float64)
        span_us = np.maximum(self.time_us[following] - self.time_us[last], 1)
        turned = elapsed_us / span_us
        share, along_us = self._walked(last, elapsed_us, span_us)
        turn_rad = wrap_angle(self.heading_rad[following] - self.heading_rad[last])
        return Poses(
            x_m=self.x_m[last] + share * (self.x_m[following] - self.x_m[last]),
            y_m=self.y_m[last] + share * (self.y_m[following] - self.y_m[last]),
            level=self.level[last],
            heading_rad=wrap_angle(self.heading_rad[last] + turned * turn_rad),
            speed_m_s=self.speed_m_s[last] + self.acceleration_m_s2[last] * elapsed_us * 1e-6,
            edge=self.edge[last],
            offset_m=self.offset_m[last] + along_us * 1e-6 * self.edge_speed_m_s[last],
            state=self.state[last],
        )

    def _walked(
        self, last: IntArray, elapsed_us: FloatArray, span_us: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        """Share of the way to the next knot, and the time a steady walker needs for it. [us].

        The share is ``(v t + a t^2 / 2) / (v T + a T^2 / 2)``, so that knots are met exactly.
        """
        steady = elapsed_us / span_us
        rate_m_s2 = self.acceleration_m_s2[last]
        if not rate_m_s2.any():
            return steady, elapsed_us
        elapsed_s, span_s = elapsed_us * 1e-6, span_us * 1e-6
        speed_m_s = self.speed_m_s[last]
        way_m = (speed_m_s + 0.5 * rate_m_s2 * span_s) * span_s
        done_m = (speed_m_s + 0.5 * rate_m_s2 * elapsed_s) * elapsed_s
        moves = (rate_m_s2 != 0) & (way_m > 0)
        share = np.where(moves, done_m / np.where(moves, way_m, 1.0), steady)
        return share, np.where(moves, share * span_us, elapsed_us)

    def _refuse_outside(self, time_us: IntArray) -> None:
        if len(time_us) == 0:
            return
        if len(self) == 0:
            raise DataError("the walk has no trajectory")
        if time_us.min() < self.time_us[0] or time_us.max() > self.time_us[-1]:
            raise DataError(
                f"times from {time_us.min()} to {time_us.max()} us reach outside the walk,"
                f" which lasts from {self.time_us[0]} to {self.time_us[-1]} us"
            )


def field_names(table: type[Table]) -> tuple[str, ...]:
    """Names of a table's fields in order; the tests hold them against `columns.py`."""
    return tuple(field.name for field in fields(table))
