"""A file that is missing, cut short, foreign or damaged gives one line, never a wrong answer."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from blesim.dataset.reader import read_recording, read_truth
from blesim.dataset.tracks import TrackSet, read_tracks, sha256_of, write_tracks
from blesim.dataset.validator import validate
from blesim.dataset.writer import write_recording
from blesim.errors import DataError
from blesim.recording import Recording, Truth

KILLED = """
import os, signal, sys
from pathlib import Path
import numpy as np, shapely
from blesim.dataset.writer import RecordingWriter
from blesim.recording import Observations, Provenance, Walk
from blesim.tables import Steps
from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.venue import Venue

plan = FloorPlan(levels=(Level(level=0, bounds=shapely.box(0, 0, 1, 1)),))
venue = Venue(name="v", floor_plan=plan, beacons=())
rows = 300_000
steps = Steps(time_us=np.arange(rows), length_m=np.ones(rows), heading_rad=np.zeros(rows))
about = Provenance(title="t", source="s")
with RecordingWriter(
    Path(sys.argv[1]), venue_surveyed=venue, venue_built=venue, provenance=about
) as writer:
    for name in ("1", "2"):
        observed = Observations(steps=steps)
        writer.append(Walk(name=name, walker="w", phone="p", observations=observed))
    os.kill(os.getpid(), signal.SIGKILL)
"""
READERS = (read_recording, read_truth, validate)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, recording: Recording, truth: Truth) -> bytes:
    target = tmp_path_factory.mktemp("recording") / "a.h5"
    write_recording(target, recording, truth)
    return target.read_bytes()


def _message(read: object, path: Path) -> str:
    with pytest.raises(DataError) as caught:
        read(path)  # type: ignore[operator]
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message


@pytest.mark.parametrize("read", READERS)
def test_missing_directory_or_foreign(tmp_path: Path, read: object) -> None:
    assert "no such file" in _message(read, tmp_path / "missing.h5")
    assert "directory" in _message(read, tmp_path)
    text = tmp_path / "text.h5"
    text.write_text("not HDF5")
    assert "not an HDF5 file" in _message(read, text)
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["x"] = 1
    assert "not one that blesim wrote" in _message(read, tmp_path / "foreign.h5")
    write_tracks(tmp_path / "tracks.h5", TrackSet(recording_sha256="0", runs={}))
    assert "holds tracks, not recording" in _message(read, tmp_path / "tracks.h5")


def test_recording_instead_of_tracks(tmp_path: Path, whole: bytes) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(whole)
    assert "holds recording, not tracks" in _message(read_tracks, path)
    assert "cannot be read" in _message(sha256_of, tmp_path / "missing.h5")


@pytest.mark.parametrize("read", READERS)
def test_version_of_tomorrow(tmp_path: Path, whole: bytes, read: object) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:
        file.attrs["schema_version"] = "2.0"
    says = "schema version 2.0, but this blesim reads 1.2; use a newer blesim"
    assert _message(read, path).endswith(says)


@pytest.mark.parametrize("version", ["1.1", "0.10", "one"])
def test_version_of_yesterday(tmp_path: Path, whole: bytes, version: str) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:
        file.attrs["schema_version"] = version
    message = _message(read_recording, path)
    assert message.endswith("; make the file again, or use the blesim that wrote it")


@pytest.mark.parametrize("read", READERS)
def test_cut_short_anywhere(tmp_path: Path, whole: bytes, read: object) -> None:
    path = tmp_path / "a.h5"
    for length in np.linspace(0, len(whole) - 1, 60).astype(int).tolist():
        path.write_bytes(whole[:length])
        _message(read, path)


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("edge", 999, "edge names an edge that the aisle graph lacks"),
        ("edge", -7, "edge names an edge that the aisle graph lacks"),
        ("x", np.nan, "x is not finite everywhere"),
        ("speed", np.inf, "speed is not finite everywhere"),
        ("offset", np.nan, "offset is not known on every edge"),
    ],
)
def test_truth_that_leads_nowhere(
    tmp_path: Path, whole: bytes, column: str, value: float, words: str
) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:
        file[f"truth/trajectory/{column}"][1] = value
    assert words in _message(read_truth, path)


def test_reasons_are_short(tmp_path: Path, whole: bytes) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(whole[: len(whole) // 2])
    reason = "damaged (truncated file); make it again"
    assert _message(read_recording, path) == f"{path}: {reason}"


FULL = """
import resource, signal, sys
from pathlib import Path
from blesim.dataset.reader import read_recording
from blesim.dataset.writer import write_recording
from blesim.errors import DataError

recording = read_recording(Path(sys.argv[1]))
# Beyond the limit writing fails as it does on a full disk.
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]),) * 2)
try:
    write_recording(Path(sys.argv[2]), recording)
except DataError as fault:
    print(fault)
"""


@pytest.mark.parametrize("room_bytes", [1, 5_000, 60_000])
def test_a_full_disk_is_one_line_and_leaves_nothing(
    tmp_path: Path, whole: bytes, room_bytes: int
) -> None:
    source, target = tmp_path / "a.h5", tmp_path / "new" / "b.h5"
    source.write_bytes(whole)
    target.parent.mkdir()
    ended = subprocess.run(
        [sys.executable, "-c", FULL, source, target, str(room_bytes)],
        check=False,
        capture_output=True,
        text=True,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout == f"{target}: cannot be written: File too large\n"
    assert list(target.parent.iterdir()) == []


def _unharmed(path: Path, recording: Recording, truth: Truth) -> bool:
    """Whether a file still gives all it was written from; False if a reader refuses it."""
    try:
        same = read_recording(path) == recording and read_truth(path) == truth
    except DataError:
        return False
    assert same or validate(path)
    return same


def _noticed(path: Path, whole: bytes, recording: Recording, truth: Truth, count: int) -> int:
    """Count how many of so many random changes of one byte a reader or the validator notices."""
    rng = np.random.default_rng(3)
    noticed = 0
    for place in rng.integers(0, len(whole), count).tolist():
        changed = bytearray(whole)
        changed[place] ^= int(rng.integers(1, 256))
        path.write_bytes(changed)
        noticed += not _unharmed(path, recording, truth)
    return noticed


def test_flipped_bytes_are_noticed_or_change_nothing(
    tmp_path: Path, whole: bytes, recording: Recording, truth: Truth
) -> None:
    assert _noticed(tmp_path / "a.h5", whole, recording, truth, 60) > 15


@pytest.mark.slow
def test_many_flipped_bytes(
    tmp_path: Path, whole: bytes, recording: Recording, truth: Truth
) -> None:
    assert _noticed(tmp_path / "a.h5", whole, recording, truth, 3000) > 750


def test_a_killed_run_leaves_nothing_that_looks_whole(tmp_path: Path) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", KILLED, tmp_path / "a.h5"], check=False, env=dict(os.environ)
    )
    assert ended.returncode == -signal.SIGKILL
    left = list(tmp_path.iterdir())
    assert [path.suffix for path in left] == [".part"]
    _message(read_recording, left[0])


def test_an_old_file_stays_until_the_new_one_is_whole(
    tmp_path: Path, whole: bytes, recording: Recording
) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(whole)
    twice = Recording.__new__(Recording)
    object.__setattr__(twice, "__dict__", {**vars(recording), "walks": recording.walks * 2})
    with pytest.raises(DataError, match="comes twice"):
        write_recording(path, twice)
    assert path.read_bytes() == whole
    assert list(tmp_path.iterdir()) == [path]
