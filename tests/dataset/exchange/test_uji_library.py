import shutil

import numpy as np
import pytest

from blesim.dataset.exchange.uji_library import read_uji_library
from blesim.dataset.reader import read_recording, read_truth
from blesim.dataset.validator import validate
from blesim.dataset.writer import write_recording
from blesim.errors import DataError
from blesim.recording import WalkKind

FILES = {
    "dep/lib.csv": "id,x,y\n23,1.0,1.0\n24,4.05,5.0\n",
    # A bookcase whose face beacon 24 stands 5 cm behind, and a pillar.
    "obs/lib.csv": "id,x,y,type\n"
    "1,4,4,1\n1,5,4,1\n1,5,6,1\n1,4,6,1\n1,4,4,1\n"
    "2,2,2,2\n2,2.5,2,2\n2,2.5,2.5,2\n2,2,2,2\n",
    "rss/lib_ids.csv": "12200101\n12200102\n12200103\n32200101\n",
    "rss/lib_crd.csv": "1.5,3.0\n1.5,3.0\n1.5,3.0\n1.5,3.0\n",
    "rss/lib_rss.csv": "100,100\n-60,-70\n-61,100\n-80,100\n",
    "rss/lib_tms.csv": "0,0\n5000000000,5400000000\n6100000000,0\n9000000000,0\n",
}


@pytest.fixture
def folder(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def test_a_made_up_library(folder):
    imported = read_uji_library(folder)
    first, second = imported.recording.walks
    assert first.name == "A5 at -12 dBm, campaign 2, point 001"
    assert (second.phone, second.kind, second.split) == ("S6", WalkKind.SURVEY, "campaign 2")
    readings, marks = first.observations.readings, first.observations.marks
    # A second of silence, the scan from 1.000001 s to 1.4 s, and one reading at 2.1 s.
    assert readings.time_us.tolist() == [1_000_001, 1_400_001, 2_100_001]
    assert readings.beacon.tolist() == [0, 1, 0]
    assert readings.rssi_dbm.tolist() == [-60, -70, -61]
    assert marks.time_us.tolist() == [1_000_000, 1_400_001, 2_100_001]
    assert np.isnan(imported.truth.walks[first.name].trajectory.heading_rad).all()
    assert (marks.x_m[0], marks.y_m[0]) == (1.5, 3.0)


def test_obstacles_have_their_material_and_beacons_stand_on_faces(folder):
    venue = read_uji_library(folder).recording.venue
    assert [obstacle.material for obstacle in venue.floor_plan.obstacles] == ["bookcase", "pillar"]
    assert [(beacon.id, beacon.x_m, beacon.y_m) for beacon in venue.beacons] == [
        ("23", 1.0, 1.0),
        ("24", 4.0, 5.0),
    ]


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("rss/lib_rss.csv", None, "cannot be read"),
        ("rss/lib_tms.csv", "0,0\n", "differ in size"),
        ("rss/lib_crd.csv", "a,b\n" * 4, "not a table of numbers"),
        ("rss/lib_rss.csv", "100,100\n-60\n-61,100\n-80,100\n", "rows of different length"),
        ("rss/lib_ids.csv", "1\n2\n3\n4\n", "not eight digits"),
        ("rss/lib_ids.csv", "92200101\n" * 4, "phone 9"),
        ("dep/lib.csv", "id,x,y\n23,1,1\n", "1 beacons, 2 columns"),
        ("dep/lib.csv", "id,x,y\n23,one,1\n24,2,2\n", "no beacon in the line"),
        ("obs/lib.csv", "id,x,y,type\n1,4,4,7\n", "no outlines"),
    ],
)
def test_a_bad_file_is_one_line(folder, name, text, told):
    if text is None:
        (folder / name).unlink()
    else:
        (folder / name).write_text(text)
    with pytest.raises(DataError, match=told) as fault:
        read_uji_library(folder)
    assert "\n" not in str(fault.value)


def test_a_point_where_nothing_was_heard_is_counted(folder):
    (folder / "rss" / "lib_rss.csv").write_text("100,100\n-60,-70\n-61,100\n100,100\n")
    (folder / "rss" / "lib_tms.csv").write_text("0,0\n5000000000,5400000000\n6100000000,0\n0,0\n")
    imported = read_uji_library(folder)
    assert len(imported.recording.walks) == 1
    assert imported.report == ("left out: 1 points at which nothing was heard",)


def test_the_real_library_on_disk(data_dir, tmp_path):
    imported = read_uji_library(data_dir("uji_library"))
    assert len(imported.recording.venue.beacons) == 24
    assert len(imported.recording.walks) == 348
    assert sum(len(walk.observations.marks) for walk in imported.recording.walks) == 2100
    assert sum(len(walk.observations.readings) for walk in imported.recording.walks) == 25_419
    file = tmp_path / "library.h5"
    write_recording(file, imported.recording, imported.truth)
    assert validate(file) == []
    assert read_recording(file) == imported.recording
    assert read_truth(file) == imported.truth


def test_a_folder_of_something_else_is_refused(tmp_path):
    shutil.rmtree(tmp_path)
    with pytest.raises(DataError, match="cannot be read"):
        read_uji_library(tmp_path)
