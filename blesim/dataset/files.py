"""HDF5 files: new ones that are whole or not there, and our own opened for reading."""

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import FileIO
from pathlib import Path

import h5py

from blesim.errors import DataError, VenueError
from blesim.recording import SCHEMA_VERSION
from blesim.whole_file import whole_file, write_all, written

AnyPath = str | os.PathLike[str]

RECORDING = "recording"
TRACKS = "tracks"
# Few chunks, so that each is still in the processor's cache when its turn to be compressed comes.
_CHUNK_CACHE_BYTES = 2**19
# What h5py raises on damage, depending on what the damaged bytes meant.
DAMAGE = (OSError, RuntimeError, KeyError, ValueError, TypeError, OverflowError, MemoryError)
# HDF5 says what it could not do, and in brackets why, with the addresses it was at.
_HDF5_REASON = re.compile(r"(?:Can't|Unable to) [^(]*\(([^():]+)")


class Disk:
    """What HDF5 writes through; it keeps the first fault and goes on as if nothing had happened.

    HDF5 can neither close nor forget a file that it failed to write: the interpreter then crashes
    at its end. So HDF5 is never told, finds what it believes written when it reads it back, and the
    one who writes asks for the fault.
    """

    def __init__(self, file: FileIO) -> None:
        self.fault: BaseException | None = None
        self._file = file
        self._unwritten: list[tuple[int, bytes]] = []

    def seek(self, offset: int, whence: int = 0) -> int:
        """Go to a place."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Return the place."""
        return self._file.tell()

    def read(self, size: int) -> bytes:
        """Read what was written, or would have been."""
        buffer = bytearray(size)
        return bytes(buffer[: self.readinto(memoryview(buffer))])

    def readinto(self, buffer: memoryview) -> int:
        """Read what was written, or would have been."""
        if self.fault is None:
            return self._file.readinto(buffer)
        start = self._file.tell()
        buffer[:] = bytes(len(buffer))
        self._file.readinto(buffer)
        for place, content in self._unwritten:
            first, last = max(place, start), min(place + len(content), start + len(buffer))
            if first < last:
                buffer[first - start : last - start] = content[first - place : last - place]
        self._file.seek(start + len(buffer))
        return len(buffer)

    def write(self, content: memoryview) -> int:
        """Write, unless that has failed before."""
        start = self._file.tell()
        self._try(lambda: write_all(self._file, content))
        if self.fault is not None:
            self._unwritten.append((start, bytes(content)))
            self._file.seek(start + len(content))
        return len(content)

    def truncate(self, size: int) -> int:
        """Set the length, unless writing has failed before."""
        self._try(lambda: self._file.truncate(size))
        return size

    def flush(self) -> None:
        """Do nothing: nothing is held back here."""

    def _try(self, change: Callable[[], object]) -> None:
        if self.fault is not None:
            return
        try:
            change()
        except BaseException as fault:  # a signal's too: raised through HDF5, it would be lost
            self.fault = fault


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """An HDF5 file that is being written, and what is to become of it."""

    path: Path
    file: h5py.File
    disk: Disk

    @contextmanager
    def writing(self) -> Iterator[None]:
        """A block that writes; a failing disk is a `DataError` that names the file."""
        with written(self.path):
            try:
                yield
            finally:
                if self.disk.fault is not None:
                    raise self.disk.fault


@contextmanager
def created(path: AnyPath) -> Iterator[Draft]:
    """An empty HDF5 file that appears under its name when the block ends well, or never.

    Raises
    ------
    UsageError
        If nothing can be written there.
    DataError
        If the disk is full or fails.
    """
    path = Path(path)
    with whole_file(path) as raw:
        disk = Disk(raw)
        # No time stamps anywhere: the same content must give the same bytes.
        file = h5py.File(
            disk,
            "w",
            libver=("v110", "v110"),
            track_order=True,
            track_times=False,
            rdcc_nbytes=_CHUNK_CACHE_BYTES,
        )
        draft = Draft(path=path, file=file, disk=disk)
        try:
            yield draft
        finally:
            with draft.writing():
                file.close()


@contextmanager
def opened(path: AnyPath, content: str) -> Iterator[h5py.File]:
    """A file of ours, open for reading; whatever is wrong with it is one line that names it.

    Parameters
    ----------
    path : path-like
        The file.
    content : str
        `RECORDING` or `TRACKS`.

    Raises
    ------
    DataError
        If it is missing, damaged, not ours, or made by another version.
    """
    path = Path(path)
    try:
        with _open(path) as file:
            _refuse_foreign(file, content)
            yield file
    except (DataError, VenueError) as fault:
        raise DataError(f"{path}: {first_line(fault)}") from fault
    except DAMAGE as fault:
        raise DataError(f"{path}: damaged ({first_line(fault)}); make it again") from fault


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
        ours = f"schema version {version}, but this blesim reads {SCHEMA_VERSION}"
        raise DataError(f"{ours}; {_what_to_do(version)}")


def _what_to_do(version: str) -> str:
    if _numbers(version) > _numbers(SCHEMA_VERSION):
        return "use a newer blesim"
    return "make the file again, or use the blesim that wrote it"


def _numbers(version: str) -> list[int]:
    return [int(part) if part.isdecimal() else 0 for part in version.split(".")]


def first_line(fault: BaseException) -> str:
    """What an exception has to say, in one line and without the insides of HDF5."""
    if isinstance(fault, OSError) and fault.errno:
        return os.strerror(fault.errno)
    # A KeyError shows its message in quotes.
    text = str(fault.args[0]) if isinstance(fault, KeyError) and fault.args else str(fault)
    reason = _HDF5_REASON.match(text)
    if reason is not None:
        text = reason[1]
    return text.splitlines()[0] if text else type(fault).__name__
