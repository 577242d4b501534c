"""What is written is what is read, byte for byte the same each time."""

import hashlib
import time
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from blesim.columns import Column
from blesim.dataset import layout, writer
from blesim.dataset.reader import read_crowd, read_recording, read_truth
from blesim.dataset.validator import validate
from blesim.dataset.writer import RecordingWriter, write_recording
from blesim.errors import DataError, UsageError
from blesim.recording import Observations, Recording, Truth, Walk, WalkTruth
from blesim.tables import Imu, Marks, Packets, Readings, Steps, StepTruth, Table, Trajectory


def test_everything_comes_back(tmp_path: Path, recording: Recording, truth: Truth) -> None:
    write_recording(tmp_path / "a.h5", recording, truth)
    assert read_recording(tmp_path / "a.h5") == recording
    assert read_truth(tmp_path / "a.h5") == truth
    assert validate(tmp_path / "a.h5") == []


def test_a_path_may_be_a_text(tmp_path: Path, recording: Recording, truth: Truth) -> None:
    path = str(tmp_path / "a.h5")
    write_recording(path, recording, truth)
    assert read_recording(path) == recording
    assert read_truth(path) == truth
    assert read_crowd(path) == truth.crowd
    assert validate(path) == []
    with pytest.raises(DataError, match="there is no such file"):
        read_recording(f"{path}.not")


def test_same_input_same_bytes(tmp_path: Path, recording: Recording, truth: Truth) -> None:
    digests = set()
    for name in ("a.h5", "b.h5"):
        write_recording(tmp_path / name, recording, truth)
        digests.add(hashlib.sha256((tmp_path / name).read_bytes()).hexdigest())
        time.sleep(1.1)  # HDF5's time stamps count seconds
    assert len(digests) == 1


def test_chunks_never_show(
    tmp_path: Path, recording: Recording, truth: Truth, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (layout, writer):
        monkeypatch.setattr(module, "CHUNK_ROWS", 64)
    monkeypatch.setattr(writer, "_WAITING_ROWS", 128)
    write_recording(tmp_path / "a.h5", recording, truth)
    assert read_recording(tmp_path / "a.h5") == recording
    assert read_truth(tmp_path / "a.h5") == truth


def test_without_walks_and_without_graph(tmp_path: Path, recording: Recording) -> None:
    bare = replace(recording.venue, graph=None, sections=(), beacons=(), georeference=None)
    nothing = replace(
        recording, venue=bare, walks=(), provenance=replace(recording.provenance, seed=None)
    )
    write_recording(tmp_path / "a.h5", nothing)
    assert read_recording(tmp_path / "a.h5") == nothing
    assert read_truth(tmp_path / "a.h5") == Truth(venue=bare, walks=MappingProxyType({}))
    assert validate(tmp_path / "a.h5") == []


def test_recording_without_truth(tmp_path: Path, recording: Recording) -> None:
    write_recording(tmp_path / "a.h5", recording)
    assert validate(tmp_path / "a.h5") == []
    with pytest.raises(DataError, match=r"a\.h5: holds no truth"):
        read_truth(tmp_path / "a.h5")


def test_long_scenario(tmp_path: Path, recording: Recording) -> None:
    long = replace(recording.provenance, scenario="walker: Ana\n" * 20_000)
    write_recording(tmp_path / "a.h5", replace(recording, provenance=long))
    assert read_recording(tmp_path / "a.h5").provenance == long


def test_tables_read_back_are_views_nobody_can_write(tmp_path: Path, recording: Recording) -> None:
    write_recording(tmp_path / "a.h5", recording)
    walks = read_recording(tmp_path / "a.h5").walks
    first, second = (walk.observations.readings.time_us for walk in walks[:2])
    assert first.base is second.base
    with pytest.raises(ValueError, match="read-only"):
        first[0] = 1


def _written(path: Path, recording: Recording, walks: tuple[Walk, ...]) -> None:
    venue = recording.venue
    with RecordingWriter(
        path, venue_surveyed=venue, venue_built=venue, provenance=recording.provenance
    ) as opened:
        for walk in walks:
            opened.append(walk)


def test_a_walk_comes_once(tmp_path: Path, recording: Recording) -> None:
    with pytest.raises(DataError, match="walk 'radio map' comes twice"):
        _written(tmp_path / "a.h5", recording, recording.walks[:1] * 2)
    assert list(tmp_path.iterdir()) == []


def test_a_walk_hears_surveyed_beacons(tmp_path: Path, recording: Recording) -> None:
    deaf = SimpleNamespace(
        venue=recording.venue.with_beacons(recording.venue.beacons[:1]),
        provenance=recording.provenance,
    )
    with pytest.raises(DataError, match="beacon row 2, but 1 beacons are surveyed"):
        _written(tmp_path / "a.h5", deaf, recording.walks)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


def test_text_no_file_can_hold(tmp_path: Path, recording: Recording) -> None:
    for name in ("a\0b", "\ud800"):
        with pytest.raises(DataError, match="no file can hold"):
            write_recording(
                tmp_path / "a.h5",
                replace(recording, walks=(replace(recording.walks[0], name=name),)),
            )
        assert list(tmp_path.iterdir()) == []


def test_target_that_cannot_be(tmp_path: Path, recording: Recording) -> None:
    with pytest.raises(UsageError, match="is a directory"):
        write_recording(tmp_path, recording)
    with pytest.raises(UsageError, match="there is no directory"):
        write_recording(tmp_path / "b" / "a.h5", recording)


def _values(column: Column, rows: int) -> st.SearchStrategy[np.ndarray]:
    dtype = column.numpy_dtype
    if column.flags:
        return arrays(dtype, rows, elements=st.sampled_from([value for _, value in column.flags]))
    low, high = column.valid_range
    if dtype.kind == "f":
        numbers = st.floats(low, high, width=dtype.itemsize * 8)
        return arrays(
            dtype, rows, elements=numbers | st.just(np.nan) if column.missing else numbers
        )
    return arrays(dtype, rows, elements=st.integers(int(low), int(min(high, 2))))


@st.composite
def tables(draw: st.DrawFn, kind: type[Table]) -> Table:
    rows = draw(st.integers(0, 5))
    values = {column.field: draw(_values(column, rows)) for column in kind.STREAM.columns}
    values["time_us"] = np.sort(values["time_us"])
    return kind(**values)


@st.composite
def walks(draw: st.DrawFn) -> tuple[Walk, WalkTruth]:
    text = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=8)
    observations = Observations(
        readings=draw(tables(Readings)),
        imu=draw(tables(Imu)),
        steps=draw(tables(Steps)),
        marks=draw(tables(Marks)),
    )
    walk = Walk(name=draw(text), walker=draw(text), phone=draw(text), observations=observations)
    walked = draw(tables(Trajectory))
    truth = WalkTruth(
        # The venue has one edge; whoever is on it is somewhere on it.
        trajectory=replace(
            walked, edge=np.where(np.isnan(walked.offset_m), -1, np.minimum(walked.edge, 0))
        ),
        steps=draw(tables(StepTruth)),
        packets=draw(tables(Packets)),
    )
    return walk, truth


@given(found=st.lists(walks(), max_size=3, unique_by=lambda pair: pair[0].name))
@settings(
    max_examples=15,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
def test_any_tables_come_back(
    tmp_path: Path, recording: Recording, found: list[tuple[Walk, WalkTruth]]
) -> None:
    made = replace(recording, walks=tuple(walk for walk, _ in found))
    truth = Truth(
        venue=recording.venue,
        walks=MappingProxyType({walk.name: of_walk for walk, of_walk in found}),
    )
    write_recording(tmp_path / "a.h5", made, truth)
    assert read_recording(tmp_path / "a.h5") == made
    if any(len(of_walk.trajectory) for _, of_walk in found):
        assert read_truth(tmp_path / "a.h5") == truth
