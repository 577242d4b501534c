"""Recordings and their truth out of HDF5: whole columns, cut into walks without copying."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
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
from blesim.dataset.files import RECORDING, opened
from blesim.dataset.provenance import read_provenance
from blesim.errors import DataError
from blesim.recording import Observations, Recording, Truth, Walk, WalkKind, WalkTruth
from blesim.tables import (
    BeaconHistory,
    Imu,
    Marks,
    Packets,
    Readings,
    Steps,
    StepTruth,
    Table,
    Trajectory,
)
from blesim.venue.geojson import from_geojson
from blesim.venue.venue import Venue

AnyTable = TypeVar("AnyTable", bound=Table)


def read_recording(path: Path) -> Recording:
    """What phones observed; the truth in the same file is not touched.

    Parameters
    ----------
    path : Path
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


def read_truth(path: Path) -> Truth:
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
        steps = read_tables(file, columns.WALKS, StepTruth)
        packets = read_tables(file, columns.WALKS, Packets)
        walks = {
            name: WalkTruth(trajectory=trajectory, steps=of_steps, packets=of_packets)
            for name, trajectory, of_steps, of_packets in zip(
                names, trajectories, steps, packets, strict=True
            )
        }
        return Truth(
            venue=venue,
            walks=MappingProxyType(walks),
            beacon_events=_history(file),
        )


def read_tables(file: h5py.File, counting: Stream, table: type[AnyTable]) -> list[AnyTable]:
    """One table for each row of the counting table, all of them views of the same columns.

    Parameters
    ----------
    file : h5py.File
        Open for reading.
    counting : Stream
        The table with the row sizes: ``/walks``, or ``/runs`` of tracks.
    table : type of Table
        Which stream.

    Raises
    ------
    DataError
        If columns are missing or wrong, or times go backwards within a walk.
    """
    stream = table.STREAM
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


def _history(file: h5py.File) -> BeaconHistory:
    stream = BeaconHistory.STREAM
    whole = read_stream(file, stream)
    return BeaconHistory(
        **{column.field: values for column, values in zip(stream.columns, whole, strict=True)}
    )


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
        read_tables(file, columns.WALKS, Readings),
        read_tables(file, columns.WALKS, Imu),
        read_tables(file, columns.WALKS, Steps),
        read_tables(file, columns.WALKS, Marks),
        strict=True,
    )
    return [
        Observations(readings=readings, imu=imu, steps=steps, marks=marks)
        for readings, imu, steps, marks in streams
    ]
