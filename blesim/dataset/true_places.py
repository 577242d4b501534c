"""Whether what a recording tells of the truth can have happened in its venue.

Every column is taken to be what `columns.py` says, and rows of edges, people and sections to exist.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import h5py
import numpy as np
import shapely
from numpy.typing import NDArray

from blesim import columns
from blesim.columns import NO_EDGE, Stream
from blesim.dataset.columns_in import read_column, read_texts
from blesim.venue.venue import Venue

Starts = Mapping[str, NDArray[np.int64]]

# Offsets are recorded to a micrometre; people who are led by hand may lean over a drawn line.
_OFFSET_TOLERANCE_M = 1e-3
_BOUNDS_TOLERANCE_M = 1.0


def place_faults(file: h5py.File, surveyed: Venue, built: Venue) -> Iterator[str]:
    """Faults of places: a level that the map lacks, beyond the end of an edge, out of bounds.

    Parameters
    ----------
    file : h5py.File
        Open for reading.
    surveyed, built : Venue
        Its venues.
    """
    for stream, venue in (
        (columns.MARKS, surveyed),
        (columns.TRAJECTORY, built),
        (columns.CROWD, built),
        (columns.BEACON_HISTORY, built),
    ):
        level = _column(file, stream, "level")
        yield from _level_faults(stream, level, venue)
    for stream in (columns.TRAJECTORY, columns.CROWD):
        yield from _offset_faults(file, stream, built)
        yield from _bounds_faults(file, stream, built)


def visit_faults(file: h5py.File, starts: Starts) -> Iterator[str]:
    """Visits that begin before the person came, or end after the person left."""
    came_us, left_us = _stays_us(file, starts[columns.CROWD.group])
    person = _column(file, columns.VISITS, "person").astype(np.int64)
    since_us = _column(file, columns.VISITS, "time")
    until_us = since_us + _column(file, columns.VISITS, "dwell")
    names = _names(file, columns.PEOPLE)
    for wrong, words in (
        (since_us < came_us[person], "before that person came"),
        (until_us > left_us[person], "after that person left"),
    ):
        if wrong.any():
            row = int(np.argmax(wrong))
            what = "begins" if "came" in words else "ends"
            yield f"{columns.VISITS.group}: row {row} of '{names[person[row]]}' {what} {words}"


def twice_told_faults(file: h5py.File, starts: Starts) -> Iterator[str]:
    """Recorded walks that are no stretch of what their walker did among everybody."""
    row_of = {name: row for row, name in enumerate(_names(file, columns.PEOPLE))}
    walkers = read_texts(file, columns.WALKS, columns.WALKS.columns[1])
    known = [(walk, row_of[walker]) for walk, walker in enumerate(walkers) if walker in row_of]
    if not known:
        return
    walked, lived = (_whole(file, stream) for stream in (columns.TRAJECTORY, columns.CROWD))
    names = _names(file, columns.WALKS)
    for walk, person in known:
        rows, within = _rows(starts, columns.TRAJECTORY, walk), _rows(starts, columns.CROWD, person)
        if rows.stop > rows.start and not _is_stretch(walked, rows, lived, within):
            yield (
                f"walk '{names[walk]}': {columns.TRAJECTORY.group} differs from that of"
                f" '{walkers[walk]}' in {columns.CROWD.group}"
            )


def _level_faults(stream: Stream, level: NDArray[Any], venue: Venue) -> Iterator[str]:
    stray = ~np.isin(level, [known.level for known in venue.floor_plan.levels])
    if stray.any():
        row = np.argmax(stray)
        yield f"{stream.group}/level: {level[row]} in row {row} is no level of the map"


def _offset_faults(file: h5py.File, stream: Stream, venue: Venue) -> Iterator[str]:
    if venue.graph is None:
        return
    edge, offset_m = _column(file, stream, "edge"), _column(file, stream, "offset")
    length_m = np.where(edge == NO_EDGE, np.inf, venue.graph.length_m[np.maximum(edge, 0)])
    # A comparison with NaN, where the offset is not known, is false.
    stray = (edge != NO_EDGE) & (offset_m < -_OFFSET_TOLERANCE_M)
    stray |= offset_m > length_m + _OFFSET_TOLERANCE_M
    if stray.any():
        row = np.argmax(stray)
        yield (
            f"{stream.group}/offset: {offset_m[row]:g} in row {row}, but edge {edge[row]} is"
            f" {length_m[row]:g} m long"
        )


def _bounds_faults(file: h5py.File, stream: Stream, venue: Venue) -> Iterator[str]:
    x_m, y_m, level = (_column(file, stream, name) for name in ("x", "y", "level"))
    stray = np.zeros(len(level), np.bool_)
    for known in venue.floor_plan.levels:
        area = shapely.buffer(known.bounds, _BOUNDS_TOLERANCE_M)
        shapely.prepare(area)
        here = np.flatnonzero(level == known.level)
        stray[here] = ~shapely.contains_xy(area, x_m[here], y_m[here])
    if stray.any():
        row = np.argmax(stray)
        yield (
            f"{stream.group}: ({x_m[row]:g}, {y_m[row]:g}) in row {row} is out of the bounds of"
            f" level {level[row]}"
        )


def _stays_us(
    file: h5py.File, starts: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """When each person came and left, two arrays (people,); never for the absent. [us]."""
    limits = np.iinfo(np.int64)
    came_us = np.full(len(starts) - 1, limits.max, np.int64)
    left_us = np.full(len(starts) - 1, limits.min, np.int64)
    time_us = _column(file, columns.CROWD, "time")
    there = np.flatnonzero(np.diff(starts) > 0)
    came_us[there], left_us[there] = time_us[starts[there]], time_us[starts[there + 1] - 1]
    return came_us, left_us


def _is_stretch(
    walked: list[NDArray[Any]], rows: slice, lived: list[NDArray[Any]], within: slice
) -> bool:
    """Whether some rows are equal to as many rows, one after the other, among some others."""
    first = within.start + int(np.searchsorted(lived[0][within], walked[0][rows.start]))
    same = slice(first, first + rows.stop - rows.start)
    if same.stop > within.stop:
        return False
    return all(
        np.array_equal(told[rows], lives[same], equal_nan=told.dtype.kind == "f")
        for told, lives in zip(walked, lived, strict=True)
    )


def _rows(starts: Starts, stream: Stream, number: int) -> slice:
    first, after = starts[stream.group][number : number + 2].tolist()
    return slice(first, after)


def _names(file: h5py.File, stream: Stream) -> list[str]:
    return read_texts(file, stream, stream.columns[0])


def _whole(file: h5py.File, stream: Stream) -> list[NDArray[Any]]:
    return [read_column(file, stream, column) for column in stream.columns]


def _column(file: h5py.File, stream: Stream, name: str) -> NDArray[Any]:
    (found,) = (column for column in stream.columns if column.name == name)
    return read_column(file, stream, found)
