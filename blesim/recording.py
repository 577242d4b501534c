"""A recording: what phones observed in a venue. Truth is another object and travels apart."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from enum import IntEnum
from functools import cached_property
from types import MappingProxyType
from typing import Any, Self

from blesim import columns
from blesim.errors import DataError
from blesim.tables import (
    BeaconHistory,
    Carrying,
    Headings,
    Imu,
    Marks,
    Packets,
    Pressures,
    Readings,
    Steps,
    StepTruth,
    Table,
    Trajectory,
    Visits,
)
from blesim.venue.venue import Venue

SCHEMA_VERSION = "1.2"
# What tables call the readings of all walks together; no walk may have this name.
ALL_WALKS = "all"


class WalkKind(IntEnum):
    """What a walk is for."""

    SURVEY = dict(columns.KINDS)["survey"]
    WALK = dict(columns.KINDS)["walk"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Observations:
    """What one phone reports, in order of time; a stream it does not have is empty."""

    readings: Readings = field(default_factory=Readings.empty)
    imu: Imu = field(default_factory=Imu.empty)
    steps: Steps = field(default_factory=Steps.empty)
    marks: Marks = field(default_factory=Marks.empty)
    headings: Headings = field(default_factory=Headings.empty)
    pressures: Pressures = field(default_factory=Pressures.empty)

    def tables(self) -> tuple[Table, ...]:
        """Return the streams in the order of `columns.OBSERVATIONS`."""
        return tuple(getattr(self, each.name) for each in fields(self))

    @classmethod
    def of(cls, tables: Iterable[Table]) -> Self:
        """Return observations of the streams in the order of `columns.OBSERVATIONS`."""
        names = [each.name for each in fields(cls)]
        return cls(**dict(zip(names, tables, strict=True)))  # type: ignore[arg-type]  # in order

    def between(self, start_us: int, end_us: int) -> "Observations":
        """Return what happened from `start_us` until just before `end_us`. [us]."""
        return Observations.of(
            table.rows(slice(*table[table.STREAM.columns[0]].searchsorted([start_us, end_us])))
            for table in self.tables()
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Walk:
    """One walk of one phone.

    Attributes
    ----------
    name : str
        Unique in its recording.
    walker, phone, carrying : str
        Who walked, with which phone profile, carried how.
    kind : WalkKind
        Survey walks are for learning, the others for trying.
    split : str
        Part of a benchmark, such as ``"tuning"``; may be empty.
    observations : Observations
        What the phone reported.

    Raises
    ------
    DataError
        If its name is the one that stands for all walks together.
    """

    name: str
    walker: str
    phone: str
    carrying: str = "hand"
    kind: WalkKind = WalkKind.WALK
    split: str = ""
    observations: Observations = field(default_factory=Observations)

    def __post_init__(self) -> None:
        if self.name == ALL_WALKS:
            raise DataError(f"walk '{ALL_WALKS}': the name stands for all walks; give it another")


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkTruth:
    """What really happened on one walk; opened by `metrics` alone."""

    trajectory: Trajectory = field(default_factory=Trajectory.empty)
    steps: StepTruth = field(default_factory=StepTruth.empty)
    packets: Packets = field(default_factory=Packets.empty)
    carrying: Carrying = field(default_factory=Carrying.empty)

    def tables(self) -> tuple[Table, ...]:
        """Return the streams in the order of `columns.TRUTH`."""
        return (self.trajectory, self.steps, self.packets, self.carrying)


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """Where a recording comes from: the attributes at the root of its file.

    Attributes
    ----------
    title, source, license : str
        What it shows; what made it; under which terms it may be used.
    scenario : str
        Text of the scenario, verbatim; empty for a real recording.
    seed : int or None
        Seed of the simulation; none for a real recording.
    references : str
        What to cite, and what was left out on the way in.
    """

    title: str
    source: str
    license: str = "CC0-1.0"
    scenario: str = ""
    seed: int | None = None
    references: str = ""


@dataclass(frozen=True, kw_only=True)
class Recording:
    """Walks through a venue as surveyed: all that an estimator may ever see.

    Raises
    ------
    DataError
        If two walks share a name, or a reading names a beacon the venue does not have.
    """

    venue: Venue
    walks: tuple[Walk, ...]
    provenance: Provenance

    def __post_init__(self) -> None:
        if len(self.by_name) != len(self.walks):
            raise DataError("two walks of the recording have the same name")
        for walk in self.walks:
            beacon = walk.observations.readings.beacon
            low, high = beacon.min(initial=0), beacon.max(initial=-1)
            if low < 0 or high >= len(self.venue.beacons):
                raise DataError(
                    f"walk '{walk.name}': reading of beacon row {low if low < 0 else high}, but"
                    f" the venue has {len(self.venue.beacons)} beacons"
                )

    @cached_property
    def by_name(self) -> Mapping[str, Walk]:
        """Walks by their names."""
        return {walk.name: walk for walk in self.walks}


class Role(IntEnum):
    """What a person is in the venue for."""

    SHOPPER = dict(columns.ROLES)["shopper"]
    STAFF = dict(columns.ROLES)["staff"]
    TESTER = dict(columns.ROLES)["tester"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Person:
    """Somebody who was in the venue while it was open.

    Attributes
    ----------
    name : str
        Unique; the walker of the walks of this person's phone, if one was recorded.
    role : Role
        Shopper, staff or tester.
    group : str
        Who came together; empty for a person alone.
    trajectory : Trajectory
        From the entrance until out again.
    """

    name: str
    role: Role
    group: str = ""
    trajectory: Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class Crowd:
    """Everybody who was there, and where they stopped.

    Attributes
    ----------
    people : tuple of Person
        Testers included; empty where nobody but the recorded walkers is known.
    visits : Visits
        Stops at product sections, in order of time, by row of the people.
    """

    people: tuple[Person, ...] = ()
    visits: Visits = field(default_factory=Visits.empty)


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """What really happened: the venue as built, its beacons, everybody, each walk by its name."""

    venue: Venue
    walks: MappingProxyType[str, WalkTruth]
    beacon_events: BeaconHistory = field(default_factory=BeaconHistory.empty)
    crowd: Crowd = field(default_factory=Crowd)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the walks as what can travel to another process."""
        return _truth, (self.venue, dict(self.walks), self.beacon_events, self.crowd)


def _truth(
    venue: Venue, walks: dict[str, WalkTruth], beacon_events: BeaconHistory, crowd: Crowd
) -> Truth:
    """Return the truth that a pickle holds."""
    return Truth(
        venue=venue, walks=MappingProxyType(walks), beacon_events=beacon_events, crowd=crowd
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """What stands in the place of a track whose estimator failed.

    Attributes
    ----------
    reason : str
        One line: what went wrong.
    """

    reason: str
