"""The order of events across the streams of a block, and the cutting of blocks in that order."""

from collections.abc import Iterator, Sequence
from enum import IntEnum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from blesim.recording import Observations
from blesim.tables import Table


class Event(IntEnum):
    """Streams in the order in which they are taken at one and the same moment."""

    IMU = 0
    STEP = 1
    MARK = 2
    READING = 3


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
        imu, steps, marks, readings = (
            slice(seen[first, stream], seen[last, stream]) for stream in range(len(tables))
        )
        yield Observations(
            readings=observations.readings.rows(readings),
            imu=observations.imu.rows(imu),
            steps=observations.steps.rows(steps),
            marks=observations.marks.rows(marks),
        )


def one_reading_each(observations: Observations) -> Iterator[Observations]:
    """Yield the blocks that each end with one reading, as a live phone gives them."""
    kind, _ = event_order(observations)
    ends = np.flatnonzero(kind == Event.READING) + 1
    return cut(observations, ends.tolist())


def _tables(block: Observations) -> tuple[Table, ...]:
    """Return the streams in the order of `Event`."""
    return (block.imu, block.steps, block.marks, block.readings)
