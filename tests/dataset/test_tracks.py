"""Tracks and failures of estimators, on disk and back."""

from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from blesim.dataset.tracks import TrackSet, read_tracks, sha256_of, write_tracks
from blesim.errors import DataError
from blesim.recording import Failure
from blesim.tables import Track


def _track(count: int) -> Track:
    rng = np.random.default_rng(count)
    return Track(
        time_us=np.arange(count) * 1000,
        x_m=rng.normal(size=count),
        y_m=rng.normal(size=count),
        level=np.zeros(count, int),
        variance_x_m2=rng.uniform(size=count),
        variance_y_m2=rng.uniform(size=count),
        covariance_xy_m2=rng.uniform(size=count),
        edge=np.full(count, -1),
        offset_m=np.full(count, np.nan),
    )


TRACKS = TrackSet(
    recording_sha256="ab" * 32,
    runs={
        ("nearest-beacon", "1"): _track(40),
        ("nearest-beacon", "2"): Failure(reason="no survey to learn from"),
        ("nearest-beacon:window=2", "1"): Track.empty(),
        ("nearest-beacon:window=2", "2"): _track(3),
    },
)


def test_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "t.h5"
    write_tracks(path, TRACKS)
    found = read_tracks(path)
    assert found.recording_sha256 == TRACKS.recording_sha256
    assert dict(found.runs) == TRACKS.runs
    assert list(found.runs) == list(TRACKS.runs)
    assert found.estimators == ("nearest-beacon", "nearest-beacon:window=2")


def test_same_tracks_same_bytes(tmp_path: Path) -> None:
    for name in ("a.h5", "b.h5"):
        write_tracks(tmp_path / name, TRACKS)
    assert sha256_of(tmp_path / "a.h5") == sha256_of(tmp_path / "b.h5")


def test_no_tracks_at_all(tmp_path: Path) -> None:
    write_tracks(tmp_path / "t.h5", TrackSet(recording_sha256="0", runs={}))
    assert dict(read_tracks(tmp_path / "t.h5").runs) == {}


def test_a_failure_is_never_mistaken_for_a_track(tmp_path: Path) -> None:
    write_tracks(
        tmp_path / "t.h5",
        TrackSet(recording_sha256="0", runs={("e", "1"): Failure(reason="")}),
    )
    assert isinstance(read_tracks(tmp_path / "t.h5").runs["e", "1"], Failure)


def test_xarray_opens_tracks(tmp_path: Path) -> None:
    write_tracks(tmp_path / "t.h5", TRACKS)
    with xarray.open_dataset(tmp_path / "t.h5", group="runs") as runs:
        assert runs["track_row_size"].values.tolist() == [40, 0, 0, 3]
        assert runs["track_row_size"].attrs["sample_dimension"] == "/track/obs"


def test_damage_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "t.h5"
    write_tracks(path, TRACKS)
    with h5py.File(path, "r+") as file:
        file["runs/track_row_size"][0] = 41
    with pytest.raises(DataError, match=r"t\.h5: /runs/track_row_size counts 44 rows, but /track"):
        read_tracks(path)
    whole = path.read_bytes()
    for length in np.linspace(0, len(whole) - 1, 20).astype(int).tolist():
        path.write_bytes(whole[:length])
        with pytest.raises(DataError, match=r"t\.h5: "):
            read_tracks(path)
