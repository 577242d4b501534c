"""The real recording of the hall comes in whole, and what is left out is counted."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from blesim.dataset.exchange import IMPORTERS
from blesim.dataset.exchange.imported import Imported
from blesim.dataset.exchange.philotuxo import read_philotuxo
from blesim.dataset.reader import read_recording, read_truth
from blesim.dataset.validator import validate
from blesim.dataset.writer import write_recording
from blesim.errors import DataError
from blesim.recording import WalkKind

HERE = Path(__file__).parents[3]
DATA = Path(os.environ.get("BLESIM_DATA", HERE.parent / "shared" / "data")) / "philotuxo"
real = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"no philotuxo data in {DATA}; set BLESIM_DATA to the data folder"
)

LINE = "{unix_s},{mac},e78f135624ce,{rssi},{x},{y},1.8,1,0,0,0,1,0,0,0,1\n"


def made_up(folder: Path, track: str) -> Path:
    for name in ("cnf", "trk"):
        (folder / name).mkdir()
    (folder / "cnf" / "tetam.dev").write_text(
        'Dongles:{"bb": [[9.0, 5.0, 2.3], 1, "sensor11"], "aa": [[1.0, 5.0, 1.2], 2, "sensor10"]}\n'
    )
    (folder / "cnf" / "tetam.par").write_text('{"limits": [0.0, 0.0, 10.0, 10.0]}')
    (folder / "trk" / "line_all_sensors.mbd").write_text(track)
    return folder


def test_a_made_up_track(tmp_path: Path) -> None:
    lines = [
        LINE.format(unix_s="1000.5", mac="bb", rssi=-70, x=2.0, y=3.0),
        LINE.format(unix_s="1000.25", mac="aa", rssi=-60, x=1.0, y=3.0),
        LINE.format(unix_s="1000.75", mac="aa", rssi=30, x=3.0, y=3.0),
        LINE.format(unix_s="1000.75", mac="cc", rssi=-60, x=3.0, y=3.0),
        LINE.format(unix_s="nan", mac="aa", rssi=-60, x=3.0, y=3.0),
        "1000.7,aa,e78f\n",
        "\n",
    ]
    imported = read_philotuxo(made_up(tmp_path, "".join(lines)))
    (walk,) = imported.recording.walks
    assert walk.name == "line"
    assert walk.observations.readings.time_us.tolist() == [0, 250_000]
    assert walk.observations.readings.beacon.tolist() == [0, 1]
    assert walk.observations.readings.rssi_dbm.tolist() == [-60, -70]
    trajectory = imported.truth.walks["line"].trajectory
    assert trajectory.x_m.tolist() == [1.0, 2.0]
    assert trajectory.speed_m_s.tolist() == [4.0, 0.0]
    assert imported.report == (
        "left out: 1 readings above 0 dBm",
        "left out: 3 lines that cannot be read",
    )
    assert all(line in imported.recording.provenance.references for line in imported.report)


def test_a_made_up_set_of_points(tmp_path: Path) -> None:
    folder = made_up(tmp_path, LINE.format(unix_s=1, mac="aa", rssi=-60, x=1, y=1))
    np.savez(
        folder / "fingerprints_set_2.npz",
        points_xyz=np.array([[4.0, 5.0, 1.8], [6.0, 5.0, 1.8]]),
        sensors=np.array(["sensor11", "sensor10"]),
        point=np.array([1, 1, 0, 0, 1], np.uint8),
        sensor=np.array([0, 1, 0, 1, 1], np.uint8),
        t_ms=np.array([30, 20, 7, 9, 10], np.uint32),
        rssi=np.array([-50, -51, -52, 62, -54], np.int8),
    )
    imported = read_philotuxo(folder)
    first, second = imported.recording.walks[1:]
    assert (first.name, first.kind, first.split) == ("set 2, point 00", WalkKind.SURVEY, "set 2")
    assert first.observations.readings.beacon.tolist() == [1]
    assert second.observations.readings.time_us.tolist() == [10_000, 20_000, 30_000]
    assert second.observations.readings.rssi_dbm.tolist() == [-54, -51, -50]
    assert second.observations.marks.x_m.tolist() == [6.0, 6.0]
    assert second.observations.marks.time_us.tolist() == [0, 30_000]
    assert imported.report[0] == "left out: 1 readings above 0 dBm"


def test_numbers_beyond_all_measure_are_no_reading(tmp_path: Path) -> None:
    good = {"unix_s": 1000, "mac": "aa", "rssi": -60, "x": 1, "y": 1}
    bad = [{"unix_s": "1e300"}, {"unix_s": -1}, {"x": "1e300"}, {"y": "inf"}, {"rssi": -200}]
    lines = [LINE.format(**good), *(LINE.format(**good | wrong) for wrong in bad)]
    imported = read_philotuxo(made_up(tmp_path, "".join(lines)))
    assert len(imported.recording.walks[0].observations.readings) == 1
    assert imported.report == ("left out: 5 lines that cannot be read",)


def test_nothing_left_out_nothing_told(tmp_path: Path) -> None:
    line = LINE.format(unix_s=1, mac="aa", rssi=-60, x=1, y=1)
    assert read_philotuxo(made_up(tmp_path, line)).report == ()


def _one_array(folder: Path) -> None:
    np.save(folder / "a.npy", np.zeros(3))
    (folder / "a.npy").rename(folder / "fingerprints_set_1.npz")


def _years_later(folder: Path) -> None:
    with (folder / "trk/line_all_sensors.mbd").open("a") as file:
        file.write(LINE.format(unix_s=1e9, mac="aa", rssi=-60, x=1, y=1))


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda folder: shutil.rmtree(folder / "trk"), r"no trk/\*\.mbd"),
        (lambda folder: shutil.rmtree(folder / "cnf"), r"tetam\.dev: cannot be read"),
        (lambda folder: (folder / "cnf/tetam.dev").write_text("Dongles:{"), "list of receivers"),
        (lambda folder: (folder / "cnf/tetam.dev").write_text("nothing"), "list of receivers"),
        (lambda folder: (folder / "cnf/tetam.par").write_text("{}"), "'limits' of the hall"),
        (lambda folder: (folder / "trk/line_all_sensors.mbd").write_text("x"), "not one reading"),
        (lambda folder: (folder / "fingerprints_set_1.npz").write_text("x"), "damaged"),
        (_one_array, "one array, where an archive of several is needed"),
        (_years_later, "more than a day apart"),
    ],
)
def test_spoiled_folder(tmp_path: Path, spoil: object, message: str) -> None:
    folder = made_up(tmp_path, LINE.format(unix_s=1, mac="aa", rssi=-60, x=1, y=1))
    spoil(folder)  # type: ignore[operator]
    with pytest.raises(DataError, match=message) as caught:
        read_philotuxo(folder)
    assert "\n" not in str(caught.value)


@pytest.fixture(scope="module")
def hall() -> Imported:
    return IMPORTERS["philotuxo"](DATA)


@real
def test_hall(hall: Imported) -> None:
    venue = hall.recording.venue
    assert len(venue.beacons) == 12
    assert venue.beacons[0].id == "sensor10"
    assert venue.beacon_xyz_m[0].tolist() == [7.00, 7.09, 1.22]
    assert venue.floor_plan.levels[0].bounds.bounds[2:] == (20.660138018121128, 17.64103475472807)
    assert len({(beacon.uuid, beacon.major, beacon.minor) for beacon in venue.beacons}) == 12


@real
def test_walks(hall: Imported) -> None:
    walks = [walk for walk in hall.recording.walks if walk.kind is WalkKind.WALK]
    assert {walk.name: len(walk.observations.readings) for walk in walks} == {
        "rectangular_without_rotation": 1949,
        "straight_01": 1365,
        "straight_02": 1240,
        "zigzagging_without_rotation": 2203,
    }
    readings = walks[1].observations.readings
    # 1581249601.4086823, b827eb4521b4 = sensor10, -87 dBm, then 1.3084 ms later sensor40, -77 dBm
    assert readings.time_us[:2].tolist() == [0, 1308]
    assert readings.beacon[:2].tolist() == [0, 9]
    assert readings.rssi_dbm[:2].tolist() == [-87, -77]
    trajectory = hall.truth.walks["straight_01"].trajectory
    assert (trajectory.x_m[0], trajectory.y_m[0]) == (18.031, 8.465)
    assert trajectory.time_us[-1] == pytest.approx(58.718897e6, abs=1)


@real
def test_points(hall: Imported) -> None:
    surveys = [walk for walk in hall.recording.walks if walk.kind is WalkKind.SURVEY]
    splits = [walk.split for walk in surveys]
    assert (splits.count("set 1"), splits.count("set 2")) == (81, 45)
    rows = dict.fromkeys(("set 1", "set 2"), 0)
    for walk in surveys:
        rows[walk.split] += len(walk.observations.readings)
    assert rows == {"set 1": 554_822, "set 2": 1_846_053 - 139}
    assert hall.report[0] == "left out: 139 readings above 0 dBm"


@real
def test_everybody_stays_in_the_hall(hall: Imported) -> None:
    for walk in hall.truth.walks.values():
        assert walk.trajectory.x_m.min() >= 0
        assert walk.trajectory.y_m.min() >= 0
        assert walk.trajectory.x_m.max() <= 20.67
        assert walk.trajectory.y_m.max() <= 17.65
        assert walk.trajectory.speed_m_s.max() < 5


@real
def test_hall_on_disk(tmp_path: Path, hall: Imported) -> None:
    write_recording(tmp_path / "hall.h5", hall.recording, hall.truth)
    assert validate(tmp_path / "hall.h5") == []
    assert read_recording(tmp_path / "hall.h5") == hall.recording
    assert read_truth(tmp_path / "hall.h5") == hall.truth
