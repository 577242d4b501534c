"""Tracks on disk: what estimators made of a recording, tied to it by its SHA-256."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from blesim import columns
from blesim.dataset.columns_in import read_texts
from blesim.dataset.files import TRACKS, AnyPath, created, opened
from blesim.dataset.layout import write_table
from blesim.dataset.provenance import packages, read_root, write_root
from blesim.dataset.reader import read_tables
from blesim.dataset.writer import Sink
from blesim.errors import DataError
from blesim.recording import Failure
from blesim.tables import Track

_ROOT = ("title", "recording_sha256", "packages")


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackSet:
    """What each estimator made of each walk of one recording.

    Attributes
    ----------
    recording_sha256 : str
        Digest of the recording's file; see `sha256_of`.
    runs : mapping of (str, str) to Track or Failure
        By label of the estimator and name of the walk, in the order in which they were tried.
    """

    recording_sha256: str
    runs: Mapping[tuple[str, str], Track | Failure]

    @property
    def estimators(self) -> tuple[str, ...]:
        """Labels of the estimators, each once, in order."""
        return tuple(dict.fromkeys(label for label, _ in self.runs))


def write_tracks(path: AnyPath, tracks: TrackSet) -> None:
    """Tracks in a file: one row of ``/runs`` a try, all estimates in ``/track``.

    Parameters
    ----------
    path : path-like
        The file; one that is already there is replaced when the new one is whole.
    tracks : TrackSet
        What to write.

    Raises
    ------
    UsageError
        If nothing can be written there.
    DataError
        If the disk fails.
    """
    results = list(tracks.runs.values())
    found = [result if isinstance(result, Track) else Track.empty() for result in results]
    failures = [_reason(result) if isinstance(result, Failure) else "" for result in results]
    texts = ("estimated tracks", tracks.recording_sha256, packages())
    with created(path) as draft, draft.writing():
        write_root(draft.file, TRACKS, dict(zip(_ROOT, texts, strict=True)))
        values = [[label for label, _ in tracks.runs], [walk for _, walk in tracks.runs], failures]
        sizes = [(columns.TRACK, [len(track) for track in found])]
        write_table(draft.file, columns.RUNS, values, sizes)
        sink = Sink(draft.file, columns.TRACK)
        for track in found:
            sink.append(track)
        sink.finish()


def _reason(failure: Failure) -> str:
    # Empty text means success in the file.
    return failure.reason or "no reason given"


def read_tracks(path: AnyPath) -> TrackSet:
    """Tracks out of a file that `write_tracks` wrote.

    Raises
    ------
    DataError
        One line: the file is missing, damaged, not ours, of another version, or inconsistent.
    """
    with opened(path, TRACKS) as file:
        names = [read_texts(file, columns.RUNS, column) for column in columns.RUNS.columns]
        tracks = read_tables(file, columns.RUNS, Track)
        runs = {
            (label, walk): Failure(reason=failure) if failure else track
            for label, walk, failure, track in zip(*names, tracks, strict=True)
        }
        if len(runs) != len(tracks):
            raise DataError("/runs has the same estimator on the same walk twice")
        return TrackSet(
            recording_sha256=read_root(file, _ROOT)["recording_sha256"],
            runs=MappingProxyType(runs),
        )


def sha256_of(path: AnyPath) -> str:
    """SHA-256 of a file's bytes, in hexadecimal.

    Raises
    ------
    DataError
        If the file cannot be read.
    """
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as fault:
        raise DataError(f"{path}: cannot be read: {fault.strerror}") from fault
