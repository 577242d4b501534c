"""Where commands write: into the folder asked for, or into ``output`` by default."""

from pathlib import Path


def output_path(asked: Path | None, default: str) -> Path:
    """Path of the output, its folder made if it is not there.

    Raises
    ------
    UsageError
        If the folder cannot be made.
    """
    from blesim.errors import UsageError

    path = asked or Path("output", default)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        raise UsageError(f"{path}: cannot make its folder: {fault.strerror}") from fault
    return path
