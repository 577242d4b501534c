"""Recordings into HDF5, walk by walk, in bounded memory, whole or not at all."""

from contextlib import ExitStack
from dataclasses import replace
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from blesim import columns
from blesim.columns import Stream
from blesim.dataset.files import RECORDING, AnyPath, created
from blesim.dataset.layout import (
    CHUNK_ROWS,
    RECORDED,
    attach_dimension,
    create_growing,
    create_text,
    dimension,
    group_at,
    write_table,
)
from blesim.dataset.provenance import write_provenance
from blesim.dataset.static_tables import people_values, venue_tables, walk_values
from blesim.errors import DataError
from blesim.recording import Crowd, Observations, Provenance, Recording, Truth, Walk, WalkTruth
from blesim.tables import BeaconHistory, Table
from blesim.venue.geojson import to_geojson
from blesim.venue.venue import Venue

# Rows held back until they are worth a write; always written in whole chunks.
_WAITING_ROWS = 8 * CHUNK_ROWS
_NOTHING = Observations()
_UNKNOWN = WalkTruth()


class Sink:
    """One stream of a file that is being written."""

    def __init__(self, file: h5py.File, stream: Stream) -> None:
        self.group = group_at(file, stream.group)
        self.stream = stream
        self._datasets = [create_growing(self.group, column) for column in stream.columns]
        self._waiting: list[list[NDArray[Any]]] = []
        self._waiting_rows = 0
        self._written_rows = 0

    def append(self, table: Table) -> None:
        """Take the rows of a table; write what fills chunks once enough has come together."""
        if not len(table):
            return
        self._waiting.append(list(table.arrays()))
        self._waiting_rows += len(table)
        if self._waiting_rows >= _WAITING_ROWS:
            self._write(self._waiting_rows // CHUNK_ROWS * CHUNK_ROWS)

    def finish(self) -> None:
        """Write the last rows and the dimension."""
        if self._waiting_rows:
            self._write(self._waiting_rows)
        name, rows = dimension(self.stream), self._written_rows
        attach_dimension(self.group, name, rows, self._datasets, growing=True)

    def _write(self, count: int) -> None:
        end = self._written_rows + count
        rest = []
        for dataset, parts in zip(self._datasets, zip(*self._waiting, strict=True), strict=True):
            values = parts[0] if len(parts) == 1 else np.concatenate(parts)
            dataset.resize((end,))
            dataset[self._written_rows : end] = values[:count]
            rest.append(values[count:].copy())
        self._waiting = [rest]
        self._waiting_rows -= count
        self._written_rows = end


class RecordingWriter:
    """A recording that appears under its name once the last walk is in, or never.

    Used as a context manager: on a normal end the file is completed, flushed to the disk and
    renamed to `path`; after an exception nothing is left of it.

    Parameters
    ----------
    path : path-like
        The file; one that is already there is replaced when the new one is whole.
    venue_surveyed, venue_built : Venue
        As an estimator may know it, and as it really is.
    provenance : Provenance
        What it shows and where it comes from.
    beacon_events : BeaconHistory or None
        What befell the beacons as built, if anything did.
    crowd : Crowd or None
        Everybody who was there, if that is known.

    Raises
    ------
    UsageError
        If nothing can be written there.
    DataError
        If the disk fails, a walk comes twice, or a walk hears a beacon that nobody surveyed.
    """

    def __init__(
        self,
        path: AnyPath,
        *,
        venue_surveyed: Venue,
        venue_built: Venue,
        provenance: Provenance,
        beacon_events: BeaconHistory | None = None,
        crowd: Crowd | None = None,
    ) -> None:
        self._path = path
        self._surveyed = venue_surveyed
        self._built = venue_built
        self._provenance = provenance
        self._history = beacon_events or BeaconHistory.empty()
        self._crowd = crowd or Crowd()
        self._stack = ExitStack()
        self._walks: dict[str, Walk] = {}
        self._rows: list[list[int]] = []

    def __enter__(self) -> Self:
        """Begin a temporary file beside the target."""
        with ExitStack() as stack:
            self._draft = stack.enter_context(created(self._path))
            with self._draft.writing():
                self._begin()
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        fault: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        """Complete the file, or remove it if something went wrong."""
        with self._stack:
            # Raised in here, so that the temporary file goes away with it.
            if fault is not None:
                raise fault
            with self._draft.writing():
                self._complete()

    def append(self, walk: Walk, truth: WalkTruth | None = None) -> None:
        """Add a walk, and what really happened on it if that is known.

        Raises
        ------
        DataError
            If the walk does not belong into the recording, or the disk fails.
        """
        self._refuse(walk)
        tables = (*walk.observations.tables(), *(truth or _UNKNOWN).tables())
        with self._draft.writing():
            for sink, table in zip(self._sinks, tables, strict=True):
                sink.append(table)
        self._walks[walk.name] = replace(walk, observations=_NOTHING)
        self._rows.append([len(table) for table in tables])

    def _refuse(self, walk: Walk) -> None:
        if walk.name in self._walks:
            raise DataError(f"walk '{walk.name}' comes twice; give each its own name")
        beacon, known = walk.observations.readings.beacon, len(self._surveyed.beacons)
        if len(beacon) and not 0 <= beacon.min() <= beacon.max() < known:
            raise DataError(
                f"walk '{walk.name}': reading of beacon row {beacon.max()}, but {known} beacons"
                " are surveyed"
            )

    def _begin(self) -> None:
        file = self._draft.file
        write_provenance(file, RECORDING, self._provenance)
        venue = group_at(file, "/venue")
        create_text(venue, "built", to_geojson(self._built))
        create_text(venue, "surveyed", to_geojson(self._surveyed))
        for stream, values in venue_tables(self._surveyed):
            write_table(file, stream, values)
        # Before the streams, so that the groups have the order in which one reads them.
        group_at(file, columns.WALKS.group)
        self._sinks = [Sink(file, stream) for stream in RECORDED]
        write_table(file, columns.BEACON_HISTORY, _values(self._history))
        self._write_crowd(file)

    def _write_crowd(self, file: h5py.File) -> None:
        people, visits = self._crowd.people, self._crowd.visits
        sizes = [len(person.trajectory) for person in people]
        write_table(file, columns.PEOPLE, people_values(people), [(columns.CROWD, sizes)])
        write_table(file, columns.VISITS, _values(visits))
        sink = Sink(file, columns.CROWD)
        for person in people:
            sink.append(person.trajectory)
        sink.finish()

    def _complete(self) -> None:
        sizes = zip(*self._rows, strict=True) if self._rows else [()] * len(RECORDED)
        row_sizes = list(zip(RECORDED, sizes, strict=True))
        walks = walk_values(list(self._walks.values()))
        write_table(self._draft.file, columns.WALKS, walks, row_sizes)
        for sink in self._sinks:
            sink.finish()


def _values(table: Table) -> list[list[Any]]:
    return [values.tolist() for values in table.arrays()]


def write_recording(path: AnyPath, recording: Recording, truth: Truth | None = None) -> None:
    """A whole recording in a file; see `RecordingWriter` for how and for what is raised.

    Parameters
    ----------
    path : path-like
        The file.
    recording : Recording
        What phones observed.
    truth : Truth or None
        What really happened, by the same names of walks, where that is known.
    """
    writer = RecordingWriter(
        path,
        venue_surveyed=recording.venue,
        venue_built=truth.venue if truth is not None else recording.venue,
        provenance=recording.provenance,
        beacon_events=truth.beacon_events if truth is not None else None,
        crowd=truth.crowd if truth is not None else None,
    )
    with writer:
        for walk in recording.walks:
            writer.append(walk, truth.walks.get(walk.name) if truth is not None else None)
