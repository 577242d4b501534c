"""Columns out of a file: whole, of the right type, or a fault that names them."""

from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from blesim.columns import Column, Stream
from blesim.dataset.layout import SEAL, digest, row_size
from blesim.errors import DataError


def dataset_at(file: h5py.File, path: str) -> h5py.Dataset:
    """Dataset of that path.

    Raises
    ------
    DataError
        If there is none.
    """
    try:
        found = file[path]
    except KeyError as fault:
        raise DataError(f"{path} is missing or damaged; make the file again") from fault
    if not isinstance(found, h5py.Dataset):
        raise DataError(f"{path} is a group where a column is needed")
    return found


def read_column(file: h5py.File, stream: Stream, column: Column) -> NDArray[Any]:
    """Values of a numeric column, (number of rows,).

    Raises
    ------
    DataError
        If the column is missing, or not what `columns.py` says.
    """
    dataset = _column_dataset(file, stream, column)
    if dataset.dtype != column.numpy_dtype:
        raise DataError(f"{dataset.name} has type {dataset.dtype}, not {column.dtype}")
    values: NDArray[Any] = dataset[()]
    return values


def read_texts(file: h5py.File, stream: Stream, column: Column) -> list[str]:
    """Values of a text column.

    Raises
    ------
    DataError
        If the column is missing, holds no text, or was changed after it was written.
    """
    return _sealed(_column_dataset(file, stream, column))


def read_text(file: h5py.File, path: str) -> str:
    """One text that stands alone; raises like `read_texts`."""
    return _sealed(dataset_at(file, path))[0]


def read_stream(file: h5py.File, stream: Stream) -> list[NDArray[Any]]:
    """All columns of a stream, equally long.

    Raises
    ------
    DataError
        If a column is missing, wrong, or longer than another.
    """
    found = [read_column(file, stream, column) for column in stream.columns]
    if len({len(values) for values in found}) > 1:
        lengths = ", ".join(str(len(values)) for values in found)
        raise DataError(f"{stream.group}: columns of different length: {lengths}")
    return found


def read_starts(file: h5py.File, counting: Stream, counted: Stream, rows: int) -> NDArray[np.int64]:
    """First row of each walk in a stream, and behind them the number of rows, (walks + 1,).

    Parameters
    ----------
    file : h5py.File
        Open for reading.
    counting, counted : Stream
        The table that holds the row sizes, and the stream whose rows they count.
    rows : int
        Rows the stream really has.

    Raises
    ------
    DataError
        If the row sizes do not add up to `rows`.
    """
    sizes = read_column(file, counting, row_size(counted))
    starts = np.concatenate([[0], np.cumsum(sizes)])
    if np.any(sizes < 0) or starts[-1] != rows:
        raise DataError(
            f"{counting.group}/{counted.row_size} counts {starts[-1]} rows, but {counted.group}"
            f" has {rows}; make the file again"
        )
    return starts


def first_step_back(time_us: NDArray[np.int64], starts: NDArray[np.int64]) -> int | None:
    """First row whose time lies before that of the row above, new walks apart."""
    back = time_us[1:] < time_us[:-1]
    inner = starts[(starts > 0) & (starts < len(time_us))]
    back[inner - 1] = False
    return int(np.argmax(back)) + 1 if back.any() else None


def _column_dataset(file: h5py.File, stream: Stream, column: Column) -> h5py.Dataset:
    dataset = dataset_at(file, f"{stream.group}/{column.name}")
    if dataset.ndim != 1:
        raise DataError(f"{dataset.name} has {dataset.ndim} dimensions instead of one")
    return dataset


def _sealed(dataset: h5py.Dataset) -> list[str]:
    if h5py.check_string_dtype(dataset.dtype) is None:
        raise DataError(f"{dataset.name} holds {dataset.dtype}, not text")
    texts: list[str] = np.atleast_1d(dataset.asstr()[()]).tolist()
    if digest(texts) != dataset.attrs.get(SEAL):
        raise DataError(f"{dataset.name} does not match its {SEAL}; make the file again")
    return texts
