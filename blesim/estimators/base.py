"""The contract between an estimator and everybody who runs it, live or over a whole walk.

An estimator is a frozen dataclass: its parameters are its fields, each with a default. What `fit`
learns goes into fields declared ``field(init=False)``, which nobody sets by hand, with the help of
`fitted`. A tracker is one phone on one walk and may change as it goes along.

A block holds what happened since the last block. The order of events is time; at one moment IMU
samples come first, then step events, marks and readings, each stream in its own order (see
`blesim.estimators.events`). Blocks may be cut anywhere in that order, and the cuts must never
change the track: ``advance(a + b)`` equals ``advance(a)`` followed by ``advance(b)``, byte for
byte. So a whole walk in one call and one reading at a time give the same track.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Any, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from blesim.columns import NO_EDGE
from blesim.recording import Observations, Recording
from blesim.tables import Track
from blesim.venue.venue import Venue

E = TypeVar("E")
T = TypeVar("T")


class Need(StrEnum):
    """What an estimator cannot do without; the rest it may use where it is there."""

    SURVEY = "survey"
    IMU = "imu"
    STEPS = "steps"
    CHANNELS = "channels"
    GRAPH = "graph"
    START = "start"


@dataclass(frozen=True, slots=True, kw_only=True)
class StartInfo:
    """Where a walk begins, for those who need it.

    Attributes
    ----------
    x_m, y_m : float
        [m]
    level : int
        Level of the venue.
    heading_rad : float or None
        First heading from the map's x axis counter-clockwise, if known. [rad]
    """

    x_m: float
    y_m: float
    level: int = 0
    heading_rad: float | None = None


class Tracker(Protocol):
    """One phone on one walk."""

    def advance(self, block: Observations) -> Track:
        """Estimates that a block gives rise to; empty for an empty block.

        Their times ascend, lie not before the last event of the block before, and not after the
        last event of this one.
        """
        ...


class Estimator(Protocol):
    """A positioning system: settings in the constructor, what it learns in `fit`."""

    @property
    def needs(self) -> frozenset[Need]:
        """What it cannot do without: a class variable, or a property that looks at the settings."""
        ...

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Return a fitted copy, the original unchanged.

        Parameters
        ----------
        venue : Venue
            As surveyed: where the beacons are believed to be.
        surveys : sequence of Recording
            Survey walks with the marks the tester pressed; empty unless there was a survey.
        """
        ...

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> Tracker:
        """Return a tracker of its own for one walk, which draws from `rng` alone.

        Parameters
        ----------
        start : StartInfo or None
            Where the walk begins; none unless `needs` asks for it.
        rng : numpy.random.Generator
            The only source of randomness.
        """
        ...


def part_of(kind: type[T], settings: object) -> T:
    """Settings of a part, a dataclass, from those of a whole that has them under the same names."""
    names = [field.name for field in fields(kind)]  # type: ignore[arg-type]  # says so itself if it is no dataclass
    return kind(**{name: getattr(settings, name) for name in names})


def fitted(estimator: E, **learned: Any) -> E:
    """Copy of an estimator that holds what was learned.

    Parameters
    ----------
    estimator : dataclass instance
        Left as it is.
    **learned
        Values of its ``field(init=False)`` fields.

    Raises
    ------
    TypeError
        If a name is not that of such a field.
    """
    names = {field.name for field in fields(estimator) if not field.init}  # type: ignore[arg-type]  # says so itself if it is no dataclass
    for name in learned:
        if name not in names:
            raise TypeError(f"{type(estimator).__name__}.{name} is not declared field(init=False)")
    result = copy.copy(estimator)
    for name, value in learned.items():
        object.__setattr__(result, name, value)
    return result


def make_track(
    *,
    time_us: ArrayLike,
    x_m: ArrayLike,
    y_m: ArrayLike,
    variance_x_m2: ArrayLike,
    variance_y_m2: ArrayLike,
    covariance_xy_m2: ArrayLike = 0.0,
    level: ArrayLike = 0,
    edge: ArrayLike = NO_EDGE,
    offset_m: ArrayLike = np.nan,
) -> Track:
    """Track of n estimates; a single value stands for all of them.

    Parameters
    ----------
    time_us : array_like of int, (n,)
        Ascending. [us]
    x_m, y_m : array_like of float, (n,) or ()
        [m]
    variance_x_m2, variance_y_m2, covariance_xy_m2 : array_like of float, (n,) or ()
        How sure the estimates are. [m2]
    level : array_like of int, (n,) or ()
        Level of the venue.
    edge, offset_m : array_like of int and float, (n,) or ()
        Place on the aisle graph that the estimate stands for, where the estimator knows one; x and
        y may lie beside it. [-], [m]

    Returns
    -------
    Track

    Raises
    ------
    DataError
        If times go backwards or lengths differ.
    """
    columns: dict[str, ArrayLike] = {
        "x_m": x_m,
        "y_m": y_m,
        "level": level,
        "variance_x_m2": variance_x_m2,
        "variance_y_m2": variance_y_m2,
        "covariance_xy_m2": covariance_xy_m2,
        "edge": edge,
        "offset_m": offset_m,
    }
    times = np.atleast_1d(np.asarray(time_us))
    return Track(time_us=times, **{name: _column(v, len(times)) for name, v in columns.items()})


def _column(values: ArrayLike, rows: int) -> Any:
    array = np.asarray(values)
    return np.broadcast_to(array, (rows,)) if array.ndim == 0 else array
