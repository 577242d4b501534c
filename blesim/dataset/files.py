"""Files that are whole or not there: written beside their target, renamed when finished."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import h5py

from blesim.errors import DataError, UsageError, VenueError
from blesim.recording import SCHEMA_VERSION

RECORDING = "recording"
TRACKS = "tracks"
# Few chunks, so that each is still in the processor's cache when its turn to be compressed comes.
_CHUNK_CACHE_BYTES = 2**19
# What h5py raises on damage, depending on what the damaged bytes meant.
DAMAGE = (OSError, RuntimeError, KeyError, ValueError, TypeError, OverflowError, MemoryError)


@contextmanager
def created(path: Path) -> Iterator[h5py.File]:
    """An empty HDF5 file that appears under its name when the block ends well, or never.

    Raises
    ------
    UsageError
        If nothing can be written there.
    DataError
        If the disk is full or fails.
    """
    _refuse_target(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    file = _create(path, part)
    try:
        yield file
        with written(path):
            file.close()
            _sync(part)
            part.replace(path)
            _sync(path.parent)
    except BaseException:
        with suppress(OSError, RuntimeError):
            file.close()
        part.unlink(missing_ok=True)
        raise


@contextmanager
def written(path: Path) -> Iterator[None]:
    """A block in which a failing disk is a `DataError` that names the file."""
    try:
        yield
    except (OSError, RuntimeError) as fault:
        raise DataError(f"{path}: cannot be written: {first_line(fault)}") from fault


@contextmanager
def opened(path: Path, content: str) -> Iterator[h5py.File]:
    """A file of ours, open for reading; whatever is wrong with it is one line that names it.

    Parameters
    ----------
    path : Path
        The file.
    content : str
        `RECORDING` or `TRACKS`.

    Raises
    ------
    DataError
        If it is missing, damaged, not ours, or made by another version.
    """
    try:
        with _open(path) as file:
            _refuse_foreign(file, content)
            yield file
    except (DataError, VenueError) as fault:
        raise DataError(f"{path}: {first_line(fault)}") from fault
    except DAMAGE as fault:
        raise DataError(f"{path}: damaged ({first_line(fault)}); make it again") from fault


def _refuse_target(path: Path) -> None:
    if path.is_dir():
        raise UsageError(f"{path}: is a directory; give the name of a file")
    if not path.parent.is_dir():
        raise UsageError(f"{path}: there is no directory {path.parent}; make it first")


def _create(path: Path, part: Path) -> h5py.File:
    try:
        # No time stamps anywhere: the same content must give the same bytes.
        return h5py.File(
            part,
            "w",
            libver=("v110", "v110"),
            track_order=True,
            track_times=False,
            rdcc_nbytes=_CHUNK_CACHE_BYTES,
        )
    except OSError as fault:
        raise UsageError(f"{path}: cannot be created: {first_line(fault)}") from fault


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _open(path: Path) -> h5py.File:
    if path.is_dir():
        raise DataError("is a directory; give the name of a file")
    if not path.exists():
        raise DataError("there is no such file")
    with path.open("rb"):  # what the operating system has to say comes before HDF5's view
        pass
    if not h5py.is_hdf5(path):
        raise DataError("not an HDF5 file, or its beginning is damaged")
    return h5py.File(path, "r")


def _refuse_foreign(file: h5py.File, content: str) -> None:
    version, found = file.attrs.get("schema_version"), file.attrs.get("content")
    if not isinstance(version, str) or not isinstance(found, str):
        raise DataError("an HDF5 file, but not one that blesim wrote")
    if found != content:
        raise DataError(f"holds {found}, not {content}; give the other file")
    if version != SCHEMA_VERSION:
        raise DataError(
            f"schema version {version}, but this blesim reads {SCHEMA_VERSION};"
            " use the blesim that wrote it, or a newer one"
        )


def first_line(fault: BaseException) -> str:
    """First line of what an exception has to say."""
    # A KeyError shows its message in quotes.
    text = str(fault.args[0]) if isinstance(fault, KeyError) and fault.args else str(fault)
    return text.splitlines()[0] if text else type(fault).__name__
