"""Recordings and their truth out of HDF5: whole columns, cut into walks without copying."""

from collections.abc import Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import TypeVar

import h5py
import numpy as np

from blesim import columns
from blesim.columns import NO_EDGE, Stream
from blesim.dataset.columns_in import (
    first_step_back,
    read_column,
    read_starts,
    read_stream,
    read_text,
    read_texts,
)
from blesim.dataset.files import RECORDING, AnyPath, opened
from blesim.dataset.provenance import read_provenance
from blesim.errors import DataError
from blesim.recording import (
    Crowd,
    Observations,
    Person,
    Recording,
    Role,
    Truth,
    Walk,
    WalkKind,
    WalkTruth,
)
from blesim.tables import (
    BeaconHistory,
    Carrying,
    Packets,
    StepTruth,
    Table,
    Trajectory,
    Visits,
)
from blesim.venue.geojson import from_geojson
from blesim.venue.venue import Venue

AnyTable = TypeVar("AnyTable", bound=Table)
_OBSERVED = [type(table) for table in Observations().tables()]


def read_recording(path: AnyPath) -> Recording:
    """What phones observed; the truth in the same file is not touched.

    Parameters
    ----------
    path : path-like
        A recording that `RecordingWriter` wrote.

    Returns
    -------
    Recording
        With the venue as surveyed.

    Raises
    ------
    DataError
        One line: the file is missing, damaged, not ours, of another version, or inconsistent.
    """
    with opened(path, RECORDING) as file:
        return Recording(
            venue=_venue(file, "surveyed"),
            walks=_walks(file),
            provenance=read_provenance(file),
        )


def read_truth(path: AnyPath) -> Truth:
    """What really happened on the walks of a recording.

    Raises
    ------
    DataError
        As for `read_recording`, and if nobody recorded the truth of any walk, or a walk leads
        nowhere: scores rest on it.
    """
    with opened(path, RECORDING) as file:
        names = read_texts(file, columns.WALKS, columns.WALKS.columns[0])
        venue = _venue(file, "built")
        trajectories = read_tables(file, columns.WALKS, Trajectory)
        if names and not any(len(trajectory) for trajectory in trajectories):
            raise DataError("holds no truth; nothing can be scored against it")
        for name, trajectory in zip(names, trajectories, strict=True):
            _refuse_bad_places(name, trajectory, venue)
        rest = zip(
            read_tables(file, columns.WALKS, StepTruth),
            read_tables(file, columns.WALKS, Packets),
            read_tables(file, columns.WALKS, Carrying),
            strict=True,
        )
        walks = {
            name: WalkTruth(trajectory=trajectory, steps=steps, packets=packets, carrying=carrying)
            for name, trajectory, (steps, packets, carrying) in zip(
                names, trajectories, rest, strict=True
            )
        }
        return Truth(
            venue=venue,
            walks=MappingProxyType(walks),
            beacon_events=_history(file, BeaconHistory),
            crowd=_crowd(file, venue),
        )


def read_crowd(path: AnyPath) -> Crowd:
    """Everybody who was in the venue; nobody where only the recorded walks are known.

    Raises
    ------
    DataError
        As for `read_recording`, and if somebody is where the venue has no aisle.
    """
    with opened(path, RECORDING) as file:
        return _crowd(file, _venue(file, "built"))


def read_tables(
    file: h5py.File, counting: Stream, table: type[AnyTable], stream: Stream | None = None
) -> list[AnyTable]:
    """One table for each row of the counting table, all of them views of the same columns.

    Parameters
    ----------
    file : h5py.File
        Open for reading.
    counting : Stream
        The table with the row sizes: ``/walks``, ``/truth/people``, or ``/runs`` of tracks.
    table : type of Table
        Which kind.
    stream : Stream, optional
        Where it lies, if not where such tables usually do.

    Raises
    ------
    DataError
        If columns are missing or wrong, or times go backwards within a walk.
    """
    stream = stream or table.STREAM
    whole = read_stream(file, stream)
    starts = read_starts(file, counting, stream, len(whole[0]))
    row = first_step_back(whole[0], starts)
    if row is not None:
        raise DataError(f"{stream.group}/time goes backwards at row {row}; sort each walk by time")
    # Types, lengths and order are checked; checking value by value is the validator's.
    together = table._trusted(whole)
    empty = together.rows(slice(0, 0))
    return [
        together.rows(slice(start, end)) if end > start else empty
        for start, end in pairwise(starts.tolist())
    ]


def _refuse_bad_places(walk: str, trajectory: Trajectory, venue: Venue) -> None:
    group = trajectory.STREAM.group
    for column in trajectory.STREAM.columns:
        if not column.missing and not np.all(np.isfinite(trajectory[column])):
            raise DataError(f"walk '{walk}': {group}/{column.name} is not finite everywhere")
    edges = 0 if venue.graph is None else len(venue.graph.edges)
    on_edge = trajectory.edge != NO_EDGE
    if np.any((trajectory.edge < NO_EDGE) | (trajectory.edge >= edges)):
        raise DataError(f"walk '{walk}': {group}/edge names an edge that the aisle graph lacks")
    if not np.all(np.isfinite(trajectory.offset_m[on_edge])):
        raise DataError(f"walk '{walk}': {group}/offset is not known on every edge")


def _history(file: h5py.File, table: type[AnyTable]) -> AnyTable:
    whole = read_stream(file, table.STREAM)
    pairs = zip(table.STREAM.columns, whole, strict=True)
    return table(**{column.field: values for column, values in pairs})


def _crowd(file: h5py.File, venue: Venue) -> Crowd:
    name, role, group = columns.PEOPLE.columns
    people = zip(
        read_texts(file, columns.PEOPLE, name),
        read_column(file, columns.PEOPLE, role).tolist(),
        read_texts(file, columns.PEOPLE, group),
        read_tables(file, columns.PEOPLE, Trajectory, columns.CROWD),
        strict=True,
    )
    found = [
        Person(name=who, role=Role(what), group=with_whom, trajectory=trajectory)
        for who, what, with_whom, trajectory in people
    ]
    for person in found:
        _refuse_bad_places(person.name, person.trajectory, venue)
    return Crowd(people=tuple(found), visits=_history(file, Visits))


def _venue(file: h5py.File, which: str) -> Venue:
    name = f"/venue/{which}"
    return from_geojson(read_text(file, name), name)


def _walks(file: h5py.File) -> tuple[Walk, ...]:
    kinds = read_column(file, columns.WALKS, columns.WALKS.columns[4]).tolist()
    texts = [
        read_texts(file, columns.WALKS, column)
        for column in columns.WALKS.columns
        if column.is_text
    ]
    rows = zip(*texts, kinds, _observations(file), strict=True)
    return tuple(
        Walk(
            name=name,
            walker=walker,
            phone=phone,
            carrying=carrying,
            kind=WalkKind(kind),
            split=split,
            observations=observations,
        )
        for name, walker, phone, carrying, split, kind, observations in rows
    )


def _observations(file: h5py.File) -> Sequence[Observations]:
    streams = zip(
        *(read_tables(file, columns.WALKS, table) for table in _OBSERVED),
        strict=True,
    )
    return [Observations.of(tables) for tables in streams]
