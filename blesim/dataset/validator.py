"""What is wrong with a recording, fault by fault, measured against `columns.py`."""

from collections.abc import Iterator
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from blesim import columns
from blesim.columns import Column, Stream
from blesim.dataset.columns_in import (
    dataset_at,
    first_step_back,
    read_column,
    read_starts,
    read_text,
    read_texts,
)
from blesim.dataset.files import DAMAGE, RECORDING, AnyPath, first_line, opened
from blesim.dataset.layout import (
    CONVENTIONS,
    RECORDED,
    VENUE_TEXTS,
    attributes,
    dimension,
    row_size,
    sample_dimension,
)
from blesim.dataset.provenance import read_provenance
from blesim.dataset.static_tables import venue_tables
from blesim.dataset.true_places import place_faults, twice_told_faults, visit_faults
from blesim.errors import DataError, VenueError
from blesim.venue.geojson import from_geojson
from blesim.venue.venue import Venue

Attributes = dict[str, str | NDArray[Any]]


def validate(path: AnyPath) -> list[str]:
    """Everything wrong with a recording, one line a fault; nothing if it is valid.

    Parameters
    ----------
    path : path-like
        The recording.

    Raises
    ------
    DataError
        If it cannot be opened at all: missing, truncated, not ours, or of another version.
    """
    with opened(path, RECORDING) as file:
        # Contradictions between columns are worth reporting once each column is what it should be.
        return [*_root(file), *_form(file)] or [*_contents(file)]


def _root(file: h5py.File) -> Iterator[str]:
    if file.attrs.get("Conventions") != CONVENTIONS:
        yield f"root attribute 'Conventions' is not {CONVENTIONS}"
    try:
        read_provenance(file)
    except DataError as fault:
        yield str(fault)
    except DAMAGE as fault:
        yield f"the root attributes are damaged ({first_line(fault)})"


def _form(file: h5py.File) -> Iterator[str]:
    for which in VENUE_TEXTS:
        try:
            _venue(file, which)
        except (DataError, VenueError) as fault:
            yield from str(fault).splitlines()
        except DAMAGE as fault:
            yield f"/venue/{which} is damaged ({first_line(fault)})"
    for stream in _streams(file):
        yield from _table(file, stream)


def _streams(file: h5py.File) -> list[Stream]:
    graph = [stream for stream in (columns.NODES, columns.EDGES) if stream.group in file]
    crowd = (columns.PEOPLE, columns.CROWD)
    return [*graph, columns.BEACONS, columns.WALKS, *RECORDED, *columns.HISTORY, *crowd]


def _table(file: h5py.File, stream: Stream) -> Iterator[str]:
    lengths = set()
    for column, expected in _columns(stream):
        try:
            lengths.add(len(dataset_at(file, f"{stream.group}/{column.name}")))
            yield from _attributes(file, stream, column, expected)
            yield from _values(file, stream, column)
        except DataError as fault:
            yield str(fault)
        except DAMAGE as fault:
            yield f"{stream.group}/{column.name} is damaged ({first_line(fault)})"
    if len(lengths) > 1:
        yield f"{stream.group}: columns of different length: {sorted(lengths)}"


def _columns(stream: Stream) -> Iterator[tuple[Column, Attributes]]:
    """Columns that a table must have, and the attributes of each."""
    for column in stream.columns:
        yield column, attributes(column)
    for counted in columns.COUNTED.get(stream.group, ()):
        column = row_size(counted)
        yield column, attributes(column) | sample_dimension(counted)


def _attributes(
    file: h5py.File, stream: Stream, column: Column, expected: Attributes
) -> Iterator[str]:
    dataset = dataset_at(file, f"{stream.group}/{column.name}")
    for name, value in expected.items():
        found = dataset.attrs.get(name)
        same = type(found) is type(value) and np.array_equal(found, value)
        if not same or getattr(found, "dtype", None) != getattr(value, "dtype", None):
            yield f"{dataset.name}: attribute '{name}' is {found!r}, not {value!r}"
    scales = [scale.name for scale in dataset.dims[0].values()]
    if scales != [f"{stream.group}/{dimension(stream)}"]:
        yield f"{dataset.name}: its dimension is not {stream.group}/{dimension(stream)}"
    elif len(file[scales[0]]) != len(dataset):
        yield f"{dataset.name}: not as long as its dimension"


def _values(file: h5py.File, stream: Stream, column: Column) -> Iterator[str]:
    if column.is_text:
        read_texts(file, stream, column)
        return
    values = read_column(file, stream, column)
    name = f"{stream.group}/{column.name}"
    if values.dtype.kind == "f" and not column.missing and np.isnan(values).any():
        yield f"{name}: NaN in row {np.argmax(np.isnan(values))}, where every value is known"
    yield from _range(name, column, values)
    if column.flags:
        stray = ~np.isin(values, [value for _, value in column.flags])
        if stray.any():
            row = np.argmax(stray)
            yield f"{name}: {values[row]} in row {row} is none of its flag values"


def _range(name: str, column: Column, values: NDArray[Any]) -> Iterator[str]:
    if column.valid_range is None or not len(values):
        return
    low, high = column.valid_range
    # fmin and fmax pass over NaN, which is another fault or none.
    if np.fmin.reduce(values) < low or np.fmax.reduce(values) > high:
        row = np.argmax((values < low) | (values > high))
        yield f"{name}: {values[row]} in row {row} is not within {low:g} to {high:g}"


def _contents(file: h5py.File) -> Iterator[str]:
    surveyed, built = _venue(file, "surveyed"), _venue(file, "built")
    yield from _map_tables(file, surveyed)
    yield from _names(file)
    starts: dict[str, NDArray[np.int64]] = {}
    counted = [(columns.WALKS, stream) for stream in RECORDED]
    for counting, stream in [*counted, (columns.PEOPLE, columns.CROWD)]:
        time_us = read_column(file, stream, stream.columns[0])
        try:
            found = read_starts(file, counting, stream, len(time_us))
        except DataError as fault:
            yield str(fault)
            continue
        starts[stream.group] = found
        row = first_step_back(time_us, found)
        if row is not None:
            yield f"{stream.group}/time goes backwards at row {row}"
    yield from _history(file)
    dangling = list(_rows(file, surveyed, built))
    yield from dangling
    if not dangling:
        yield from place_faults(file, surveyed, built)
    if starts.keys() >= {stream.group for stream in RECORDED}:
        yield from _coverage(file, starts)
    if not dangling and starts.keys() >= {columns.CROWD.group}:
        yield from visit_faults(file, starts)
    if starts.keys() >= {columns.TRAJECTORY.group, columns.CROWD.group}:
        yield from twice_told_faults(file, starts)


def _map_tables(file: h5py.File, venue: Venue) -> Iterator[str]:
    tables = venue_tables(venue)
    graphs = {columns.NODES.group, columns.EDGES.group}
    there = {stream.group for stream in _streams(file)}
    if there & graphs != {stream.group for stream, _ in tables} & graphs:
        yield "the aisle graph is in only one of /venue/surveyed and /venue/edges"
        return
    for stream, values in tables:
        for column, expected in zip(stream.columns, values, strict=True):
            if not _agrees(file, stream, column, expected):
                yield f"{stream.group}/{column.name} does not agree with the map /venue/surveyed"


def _agrees(file: h5py.File, stream: Stream, column: Column, expected: list[Any]) -> bool:
    if column.is_text:
        return read_texts(file, stream, column) == expected
    found = read_column(file, stream, column)
    if len(found) != len(expected):
        return False
    return bool(np.allclose(found, expected, rtol=0.0, atol=1e-6))


def _history(file: h5py.File) -> Iterator[str]:
    for stream in columns.HISTORY:
        time_us = read_column(file, stream, stream.columns[0])
        row = first_step_back(time_us, np.zeros(1, np.int64))
        if row is not None:
            yield f"{stream.group}/time goes backwards at row {row}"


def _names(file: h5py.File) -> Iterator[str]:
    for stream, row in ((columns.WALKS, "walks"), (columns.PEOPLE, "people")):
        column = stream.columns[0]
        names = read_texts(file, stream, column)
        if len(set(names)) != len(names):
            yield f"{stream.group}/{column.name}: two {row} have the same name"


def _rows(file: h5py.File, surveyed: Venue, built: Venue) -> Iterator[str]:
    """Yield the columns that point at rows which the table they point at does not have."""
    edges = 0 if built.graph is None else len(built.graph.edges)
    people = len(read_texts(file, columns.PEOPLE, columns.PEOPLE.columns[0]))
    for stream, name, rows in (
        (columns.RSSI, "beacon", len(surveyed.beacons)),
        (columns.PACKETS, "beacon", len(built.beacons)),
        (columns.BEACON_HISTORY, "beacon", len(built.beacons)),
        (columns.TRAJECTORY, "edge", edges),
        (columns.CROWD, "edge", edges),
        (columns.VISITS, "person", people),
        (columns.VISITS, "section", len(built.sections)),
    ):
        values = file[f"{stream.group}/{name}"][()]
        if len(values) and values.max() >= rows:
            yield (
                f"{stream.group}/{name}: {values.max()} in row {values.argmax()}, but there are"
                f" only {rows}"
            )


def _coverage(file: h5py.File, starts: dict[str, NDArray[np.int64]]) -> Iterator[str]:
    """Yield the walks that were observed before or after what is known of them."""
    truth_us = read_column(file, columns.TRAJECTORY, columns.TRAJECTORY.columns[0])
    known = starts[columns.TRAJECTORY.group]
    names = read_texts(file, columns.WALKS, columns.WALKS.columns[0])
    for stream in columns.OBSERVATIONS:
        time_us = read_column(file, stream, stream.columns[0])
        rows = starts[stream.group]
        both = np.flatnonzero((np.diff(known) > 0) & (np.diff(rows) > 0))
        early = time_us[rows[both]] < truth_us[known[both]]
        late = time_us[rows[both + 1] - 1] > truth_us[known[both + 1] - 1]
        for walk in both[early | late]:
            yield f"walk '{names[walk]}': {stream.group} reaches beyond its true trajectory"


def _venue(file: h5py.File, which: str) -> Venue:
    return from_geojson(read_text(file, f"/venue/{which}"), f"/venue/{which}")
