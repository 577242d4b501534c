"""The validator finds each fault sown into a valid recording, and names it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import h5py
import numpy as np
import pytest

from blesim.dataset.layout import SEAL, digest
from blesim.dataset.reader import read_recording
from blesim.dataset.validator import validate
from blesim.dataset.writer import write_recording
from blesim.errors import DataError
from blesim.recording import Person, Recording, Role, Truth, WalkTruth
from blesim.tables import Trajectory, field_names

Change = Callable[[h5py.File], None]


def put(path: str, row: int, value: object) -> Change:
    def change(file: h5py.File) -> None:
        file[path][row] = value

    return change


def attribute(path: str, name: str, value: object) -> Change:
    def change(file: h5py.File) -> None:
        file[path].attrs[name] = value

    return change


def gone(path: str) -> Change:
    def change(file: h5py.File) -> None:
        del file[path]

    return change


def retyped(path: str, dtype: str) -> Change:
    def change(file: h5py.File) -> None:
        values = file[path][()]
        del file[path]
        file[path] = values.astype(dtype)

    return change


def renamed_walk(file: h5py.File) -> None:
    names = ["1", "1", "2"]
    file["walks/walk"][:] = names
    file["walks/walk"].attrs[SEAL] = digest(names)


def moved_beacon_on_the_map(file: h5py.File) -> None:
    text = file["venue/surveyed"].asstr()[()].replace("[4.0, 2.0, 1.5]", "[4.5, 2.0, 1.5]")
    file["venue/surveyed"][()] = text
    file["venue/surveyed"].attrs[SEAL] = digest([text])


def beacon_in_a_shelf(file: h5py.File) -> None:
    text = file["venue/built"].asstr()[()].replace("[4.0, 2.0, 1.5]", "[4.5, 2.5, 1.5]")
    file["venue/built"][()] = text
    file["venue/built"].attrs[SEAL] = digest([text])


def shorter(file: h5py.File) -> None:
    file["rssi/channel"].resize((800,))


def detached(file: h5py.File) -> None:
    file["rssi/time"].dims[0].detach_scale(file["rssi/obs"])


SOWN = {
    "history backwards": (put("truth/beacon_events/time", 0, 6), "/truth/beacon_events/time goes"),
    "unknown event": (put("truth/beacon_events/event", 0, 9), "none of its flag values"),
    "event of no beacon": (put("truth/beacon_events/beacon", 0, 4), "there are only 4"),
    "no history": (gone("truth/beacon_events"), "/truth/beacon_events/time is missing"),
    "unknown proximity": (put("rssi/proximity", 0, 7), "none of its flag values"),
    "missing column": (gone("rssi/channel"), "/rssi/channel is missing"),
    "missing group": (gone("truth/steps"), "/truth/steps/time is missing"),
    "missing text": (gone("venue/built"), "/venue/built is missing"),
    "half a graph": (gone("venue/edges"), "the aisle graph is in only one"),
    "wrong type": (retyped("rssi/rssi", "int16"), "/rssi/rssi has type int16, not int8"),
    "number for text": (retyped("beacons/major", "f8"), "/beacons/major has type float64"),
    "units": (attribute("rssi/time", "units", "s"), "/rssi/time: attribute 'units' is 's'"),
    "flags": (attribute("walks/kind", "flag_meanings", "a b"), "attribute 'flag_meanings'"),
    "range": (attribute("rssi/rssi", "valid_range", np.int8([0, 1])), "attribute 'valid_range'"),
    "range type": (attribute("rssi/rssi", "valid_range", [-127, 20]), "attribute 'valid_range'"),
    "sample": (attribute("walks/imu_row_size", "sample_dimension", "obs"), "'sample_dimension'"),
    "conventions": (attribute("/", "Conventions", "CF-1.6"), "'Conventions' is not CF-1.11"),
    "scenario": (attribute("/", "scenario", "other"), "do not match their text_sha256"),
    "scenario digest": (attribute("/", "scenario_sha256", "0"), "does not match scenario_sha256"),
    "title": (attribute("/", "title", "other"), "do not match their text_sha256"),
    "text": (put("walks/split", 0, "trying"), "/walks/split does not match its text_sha256"),
    "detached": (detached, "/rssi/time: its dimension is not /rssi/obs"),
    "short": (shorter, "/rssi: columns of different length: [800, 830]"),
    "value": (put("rssi/rssi", 5, 21), "/rssi/rssi: 21 in row 5 is not within -127 to 20"),
    "flag": (put("rssi/channel", 6, 36), "/rssi/channel: 36 in row 6 is none of its flag values"),
    "nan": (put("marks/x", 1, np.nan), "/marks/x: NaN in row 1"),
    "infinite": (put("imu/acceleration_x", 1, np.inf), "/imu/acceleration_x: inf in row 1"),
    "back": (put("rssi/time", 89, 0), "/rssi/time goes backwards at row 89"),
    "row sizes": (put("walks/rssi_row_size", 0, 91), "/walks/rssi_row_size counts 831 rows"),
    "beacon": (put("rssi/beacon", 7, 3), "/rssi/beacon: 3 in row 7, but there are only 3"),
    "true beacon": (put("truth/rssi/beacon", 7, 4), "/truth/rssi/beacon: 4 in row 7"),
    "edge": (put("truth/trajectory/edge", 1, 1), "/truth/trajectory/edge: 1 in row 1"),
    "same name": (renamed_walk, "/walks/walk: two walks have the same name"),
    "map": (moved_beacon_on_the_map, "/beacons/x does not agree with the map"),
    "shelf": (beacon_in_a_shelf, "/venue/built: feature 8 (beacon 'B1'): at (4.5, 2.5) is inside"),
    "coverage": (
        put("truth/trajectory/time", 1, 5),
        "walk 'radio map': /rssi reaches beyond its true trajectory",
    ),
}
# What can be in no venue, or contradicts itself.
IMPOSSIBLE = {
    "level of a walk": (
        put("truth/trajectory/level", 1, 3),
        "/truth/trajectory/level: 3 in row 1 is no level of the map",
    ),
    "level of a person": (
        put("truth/crowd/level", 2, -1),
        "/truth/crowd/level: -1 in row 2 is no level of the map",
    ),
    "level of a mark": (put("marks/level", 1, 9), "/marks/level: 9 in row 1 is no level"),
    "level of a beacon": (
        put("truth/beacon_events/level", 2, 9),
        "/truth/beacon_events/level: 9 in row 2 is no level",
    ),
    "offset of a walk": (
        put("truth/trajectory/offset", 1, 18.1),
        "/truth/trajectory/offset: 18.1 in row 1, but edge 0 is 18 m long",
    ),
    "offset of a person": (
        put("truth/crowd/offset", 0, -0.5),
        "/truth/crowd/offset: -0.5 in row 0, but edge 0 is 18 m long",
    ),
    "place of a walk": (
        put("truth/trajectory/x", 3, 21.5),
        "/truth/trajectory: (21.5, 5) in row 3 is out of the bounds of level 0",
    ),
    "place of a person": (
        put("truth/crowd/y", 2, -1.5),
        "/truth/crowd: (1, -1.5) in row 2 is out of the bounds of level 0",
    ),
    "visit too early": (
        put("truth/visits/time", 0, 76),
        "/truth/visits: row 0 of 'Bo' begins before that person came",
    ),
    "visit too late": (
        put("truth/visits/dwell", 1, 4_000_000),
        "/truth/visits: row 1 of 'Eva' ends after that person left",
    ),
}


# What a reader need not notice, since it looks at no attribute, no single value and no truth.
UNREAD = {
    "half a graph",
    "number for text",
    "units",
    "flags",
    "range",
    "range type",
    "sample",
    "conventions",
    "detached",
    "value",
    "flag",
    "nan",
    "infinite",
    "map",
    "missing group",
    "missing text",
    "true beacon",
    "edge",
    "shelf",
    "coverage",
    "history backwards",
    "unknown event",
    "event of no beacon",
    "no history",
    "unknown proximity",
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, recording: Recording, truth: Truth) -> bytes:
    target = tmp_path_factory.mktemp("recording") / "a.h5"
    write_recording(target, recording, truth)
    return target.read_bytes()


@pytest.fixture
def path(tmp_path: Path, whole: bytes) -> Path:
    target = tmp_path / "a.h5"
    target.write_bytes(whole)
    return target


@pytest.mark.parametrize("name", SOWN)
def test_each_fault_is_found(path: Path, name: str) -> None:
    change, expected = SOWN[name]
    assert validate(path) == []
    with h5py.File(path, "r+") as file:
        change(file)
    faults = validate(path)
    assert any(expected in fault for fault in faults), faults
    assert all("\n" not in fault for fault in faults)


@pytest.mark.parametrize("name", sorted(SOWN.keys() - UNREAD))
def test_a_reader_refuses_what_it_would_read_wrongly(path: Path, name: str) -> None:
    with h5py.File(path, "r+") as file:
        SOWN[name][0](file)
    with pytest.raises(DataError) as caught:
        read_recording(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_several_faults_are_told_at_once(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        for name in ("units", "value", "nan", "title", "missing column"):
            SOWN[name][0](file)
    assert len(validate(path)) == 5


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_what_cannot_have_happened_is_one_line(path: Path, name: str) -> None:
    change, expected = IMPOSSIBLE[name]
    with h5py.File(path, "r+") as file:
        change(file)
    (fault,) = validate(path)
    assert fault.startswith(expected)


def test_a_step_over_the_bounds_or_the_end_of_an_edge_is_rounding(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["truth/crowd/x"][0] = -0.9
        file["truth/crowd/offset"][1] = 18.0005
    assert validate(path) == []


def retold(truth: Truth, change: Callable[[Trajectory], Trajectory]) -> Truth:
    """The truth in which Ana, whose phone was recorded, is among everybody."""
    walked = truth.walks["1"].trajectory
    ana = Person(name="Ana", role=Role.TESTER, trajectory=change(walked))
    walks = {name: told if name == "1" else WalkTruth() for name, told in truth.walks.items()}
    crowd = replace(truth.crowd, people=(*truth.crowd.people, ana))
    return replace(truth, walks=MappingProxyType(walks), crowd=crowd)


def longer(way: Trajectory) -> Trajectory:
    """The same walk, with some standing about after it."""
    after = replace(way.rows(slice(1, 2)), time_us=way.time_us[1:] + 9)
    told = {
        name: np.concatenate([getattr(way, name), getattr(after, name)])
        for name in field_names(Trajectory)
    }
    return Trajectory(**told)


def test_a_walk_is_a_stretch_of_its_walkers_life(
    tmp_path: Path, recording: Recording, truth: Truth
) -> None:
    for change in (lambda way: way, longer):
        write_recording(tmp_path / "a.h5", recording, retold(truth, change))
        assert validate(tmp_path / "a.h5") == []
    for other in (
        lambda way: replace(way, y_m=np.array([5.0, 5.01])),
        lambda way: way.rows(slice(0, 1)),
        lambda way: replace(way, time_us=way.time_us + 1),
    ):
        write_recording(tmp_path / "a.h5", recording, retold(truth, other))
        (fault,) = validate(tmp_path / "a.h5")
        assert fault == ("walk '1': /truth/trajectory differs from that of 'Ana' in /truth/crowd")


def test_a_truth_with_nan_where_it_is_legal(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["truth/trajectory/offset"][0] = np.nan
    assert validate(path) == []
