"""How a table lies in a file: group, dimension, columns and attributes, all from `columns.py`."""

import hashlib
from collections.abc import Iterable, Sequence
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from blesim import columns
from blesim.columns import Column, Stream
from blesim.errors import DataError

CONVENTIONS = "CF-1.11"
CHUNK_ROWS = 32_768
SEAL = "text_sha256"
RECORDED = columns.COUNTED[columns.WALKS.group]
VENUE_TEXTS = ("built", "surveyed")

_FILTERS = {
    "shuffle": True,
    "compression": "gzip",
    "compression_opts": 1,
    "fletcher32": True,
}
_DIMENSIONS = {
    columns.WALKS.group: "trajectory",
    columns.RUNS.group: "trajectory",
    columns.PEOPLE.group: "trajectory",
    columns.NODES.group: "node",
    columns.EDGES.group: "edge",
    columns.BEACONS.group: "beacon",
}
# The name by which the netCDF library knows a dimension that has no coordinates.
_NO_COORDINATES = "This is a netCDF dimension but not a netCDF variable."
_TEXT = h5py.string_dtype("utf-8")


def dimension(stream: Stream) -> str:
    """Name of the dimension along which a table's rows lie."""
    return _DIMENSIONS.get(stream.group, "obs")


def row_size(stream: Stream) -> Column:
    """Column that says how many of a stream's rows belong to each walk."""
    return Column(
        name=stream.row_size,
        field=stream.row_size,
        dtype="int64",
        units="1",
        long_name=f"rows of {stream.group} that belong to this row, in order",
        valid_range=(0, 2**53),
    )


def attributes(column: Column) -> dict[str, str | NDArray[Any]]:
    """CF attributes of a column; numbers have the column's own type where it can hold them."""
    found: dict[str, str | NDArray[Any]] = {"long_name": column.long_name}
    if not column.is_text:
        found["units"] = column.units
    if column.valid_range is not None:
        found["valid_range"] = np.array(column.valid_range).astype(column.numpy_dtype)
    if column.flags:
        names, values = zip(*column.flags, strict=True)
        found["flag_values"] = np.array(values, column.numpy_dtype)
        found["flag_meanings"] = " ".join(names)
    if column in (columns.WALKS.columns[0], columns.PEOPLE.columns[0]):
        found["cf_role"] = "trajectory_id"
    return found


def sample_dimension(stream: Stream) -> dict[str, str | NDArray[Any]]:
    """Attribute that ties a row-size column to the dimension whose rows it counts."""
    return {"sample_dimension": f"{stream.group}/{dimension(stream)}"}


def group_at(file: h5py.File, path: str) -> h5py.Group:
    """Group of that path, made without time stamps where it is not there yet."""
    group: h5py.Group = file
    for name in path.strip("/").split("/"):
        if name not in group:
            group.create_group(name, track_order=True, track_times=False)
        group = group[name]
    return group


def create_growing(group: h5py.Group, column: Column) -> h5py.Dataset:
    """Column without rows that can grow by whole chunks."""
    dataset = group.create_dataset(
        column.name,
        shape=(0,),
        maxshape=(None,),
        chunks=(CHUNK_ROWS,),
        dtype=column.numpy_dtype,
        track_times=False,
        **_FILTERS,
    )
    dataset.attrs.update(attributes(column))
    return dataset


def create_column(group: h5py.Group, column: Column, values: Sequence[Any]) -> h5py.Dataset:
    """Column with all its rows; text carries a seal, since HDF5 has no checksum for it."""
    if column.is_text:
        return _create_text(group, column, values)
    rows = len(values)
    storage = {"chunks": (min(rows, CHUNK_ROWS),), **_FILTERS} if rows else {}
    dataset = group.create_dataset(
        column.name,
        data=_rounded(column, values),
        track_times=False,
        **storage,
    )
    dataset.attrs.update(attributes(column))
    return dataset


def _create_text(group: h5py.Group, column: Column, values: Sequence[str]) -> h5py.Dataset:
    texts = np.array([checked_text(value) for value in values], dtype=object)
    dataset = group.create_dataset(column.name, data=texts, dtype=_TEXT, track_times=False)
    dataset.attrs.update(attributes(column))
    dataset.attrs[SEAL] = digest(values)
    return dataset


def _rounded(column: Column, values: Sequence[Any]) -> NDArray[Any]:
    array = np.asarray(values, dtype=column.numpy_dtype)
    return array if column.decimals is None else np.round(array, column.decimals) + 0.0


def create_text(group: h5py.Group, name: str, text: str) -> None:
    """One text as a scalar, with its seal."""
    dataset = group.create_dataset(name, data=checked_text(text), dtype=_TEXT, track_times=False)
    dataset.attrs[SEAL] = digest([text])


def attach_dimension(
    group: h5py.Group, name: str, rows: int, datasets: Iterable[h5py.Dataset], *, growing: bool
) -> None:
    """Dimension of a table, attached to each of its columns."""
    extent = {"maxshape": (None,), "chunks": (CHUNK_ROWS,)} if growing else {}
    scale = group.create_dataset(name, shape=(rows,), dtype=">f4", track_times=False, **extent)
    scale.make_scale(f"{_NO_COORDINATES}{rows:10d}")
    for dataset in datasets:
        dataset.dims[0].attach_scale(scale)


def write_table(
    file: h5py.File,
    stream: Stream,
    values: Sequence[Sequence[Any]],
    row_sizes: Sequence[tuple[Stream, Sequence[int]]] = (),
) -> None:
    """A whole table at once: one sequence for each column, then the row sizes of other streams."""
    group = group_at(file, stream.group)
    datasets = [
        create_column(group, column, of_column)
        for column, of_column in zip(stream.columns, values, strict=True)
    ]
    for counted, sizes in row_sizes:
        dataset = create_column(group, row_size(counted), sizes)
        dataset.attrs.update(sample_dimension(counted))
        datasets.append(dataset)
    attach_dimension(group, dimension(stream), len(values[0]), datasets, growing=False)


def digest(texts: Iterable[str]) -> str:
    """SHA-256 of texts in order, each ended by a NUL, which none of them contains."""
    found = hashlib.sha256()
    for text in texts:
        found.update(text.encode() + b"\0")
    return found.hexdigest()


def checked_text(text: str) -> str:
    """The same text, if HDF5 can hold it.

    Raises
    ------
    DataError
        If it contains a NUL or is not Unicode.
    """
    if "\0" in text or any("\ud800" <= letter <= "\udfff" for letter in text):
        raise DataError(f"text {text[:40]!r} has a character that no file can hold; remove it")
    return text
