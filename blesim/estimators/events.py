"""The order of events across the streams of a block, and the cutting of blocks in that order."""

from collections.abc import Iterator, Sequence
from enum import IntEnum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from blesim import columns
from blesim.recording import Observations
from blesim.tables import Table


class Event(IntEnum):
    """Streams in the order in which they are taken at one and the same moment."""

    IMU = 0
    PRESSURE = 1
    HEADING = 2
    STEP = 3
    MARK = 4
    READING = 5


_STREAMS = {
    Event.IMU: columns.IMU,
    Event.PRESSURE: columns.PRESSURE,
    Event.HEADING: columns.HEADING,
    Event.STEP: columns.STEPS,
    Event.MARK: columns.MARKS,
    Event.READING: columns.RSSI,
}
# Row of each stream of `columns.OBSERVATIONS` in the order of `Event`.
_ORDER = [columns.OBSERVATIONS.index(_STREAMS[event]) for event in Event]
_BACK = [_ORDER.index(place) for place in range(len(_ORDER))]


def event_order(block: Observations) -> tuple[NDArray[np.int8], NDArray[np.int64]]:
    """Kind and row of every event of a block, in order of time.

    Parameters
    ----------
    block : Observations
        With n events in all its streams.

    Returns
    -------
    kind : ndarray of int8, (n,)
        Values of `Event`.
    row : ndarray of int64, (n,)
        Row in the table of that stream.
    """
    tables = _tables(block)
    time_us = np.concatenate([table[table.STREAM.columns[0]] for table in tables])
    kind = np.repeat(np.arange(len(tables), dtype=np.int8), [len(table) for table in tables])
    row = np.concatenate([np.arange(len(table), dtype=np.int64) for table in tables])
    order = np.argsort(time_us, kind="stable")
    return kind[order], row[order]


def cut(observations: Observations, ends: Sequence[int]) -> Iterator[Observations]:
    """Yield the blocks between cuts; together they hold every event once.

    Parameters
    ----------
    observations : Observations
        What is cut, n events.
    ends : sequence of int
        How many events precede each cut, ascending, each 0 to n; 0 and n need not be named.
    """
    kind, _ = event_order(observations)
    tables = _tables(observations)
    seen = np.zeros((len(kind) + 1, len(tables)), np.int64)
    np.cumsum(kind[:, None] == np.arange(len(tables)), axis=0, out=seen[1:])
    for first, last in pairwise([0, *ends, len(kind)]):
        parts = [
            table.rows(slice(seen[first, stream], seen[last, stream]))
            for stream, table in enumerate(tables)
        ]
        yield Observations.of(parts[place] for place in _BACK)


def one_reading_each(observations: Observations) -> Iterator[Observations]:
    """Yield the blocks that each end with one reading, as a live phone gives them."""
    kind, _ = event_order(observations)
    ends = np.flatnonzero(kind == Event.READING) + 1
    return cut(observations, ends.tolist())


def _tables(block: Observations) -> tuple[Table, ...]:
    """Return the streams in the order of `Event`."""
    tables = block.tables()
    return tuple(tables[place] for place in _ORDER)
