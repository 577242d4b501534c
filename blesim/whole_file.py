"""Files that are whole or not there: written beside their target, renamed when finished."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import FileIO
from pathlib import Path

from blesim.errors import DataError, UsageError
from blesim.stopping import refuse_if_stopped


@contextmanager
def whole_file(path: Path) -> Iterator[FileIO]:
    """An empty file that appears under its name when the block ends well, or never.

    Parameters
    ----------
    path : Path
        The file; one that is already there is replaced, a link to one is followed.

    Raises
    ------
    UsageError
        If nothing can be written there.
    DataError
        If the disk is full or fails.
    """
    target = writable(path)
    _remove_orphans(target)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        file = FileIO(part, "w+")
    except OSError as fault:
        raise UsageError(f"{path}: cannot be created: {fault.strerror}") from fault
    try:
        with file:
            yield file
            with written(path):
                os.fsync(file.fileno())
        refuse_if_stopped()
        with written(path):
            part.replace(target)
            _sync_folder(target.parent)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def write_whole(path: Path, content: bytes) -> None:
    """Bytes in a file, whole or not at all; see `whole_file` for what is raised."""
    with whole_file(path) as file, written(path):
        write_all(file, content)


def write_all(file: FileIO, content: bytes | memoryview) -> None:
    """Write every byte; raises `OSError` if the disk does not take them all."""
    rest = memoryview(content)
    while rest:
        rest = rest[file.write(rest) :]


@contextmanager
def written(path: Path) -> Iterator[None]:
    """A block in which a failing disk is a `DataError` that names the file."""
    try:
        yield
    except OSError as fault:
        raise DataError(f"{path}: cannot be written: {fault.strerror or fault}") from fault


def writable(path: Path) -> Path:
    """The file that a path leads to, links followed, whether or not it is there yet.

    Raises
    ------
    UsageError
        If something else than a file is there, or there is no directory for it.
    """
    try:
        target = path.resolve()
        if target.is_dir():
            raise UsageError(f"{path}: is a directory; give the name of a file")
        if target.exists() and not target.is_file():
            raise UsageError(f"{path}: is no regular file; give the name of a file")
        if not target.parent.is_dir():
            raise UsageError(f"{path}: there is no directory {path.parent}; make it first")
    except (OSError, RuntimeError) as fault:
        raise UsageError(f"{path}: leads nowhere: {getattr(fault, 'strerror', fault)}") from fault
    return target


def _remove_orphans(target: Path) -> None:
    """Remove what killed processes left behind beside the same target."""
    before, after = f".{target.name}.", ".part"
    for part in target.parent.iterdir():
        pid = part.name.removeprefix(before).removesuffix(after)
        if part.name == f"{before}{pid}{after}" and pid.isdecimal() and not _alive(int(pid)):
            with suppress(OSError):
                part.unlink()


def _alive(pid: int) -> bool:
    """Whether a process may be running; elsewhere than on POSIX, asking would end it."""
    if os.name != "posix":
        return True
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def _sync_folder(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
