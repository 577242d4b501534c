import gzip

import numpy as np
import pytest

from blesim.errors import DataError
from blesim.fidelity.fit_rooms import body_loss_db
from blesim.fidelity.mitll_static import (
    DISTANCE_M,
    ROOMS,
    read_room,
    room_twin,
)
from blesim.fidelity.room_statistics import Cell, body_swings_db, room_statistics
from blesim.radio.environments import ENVIRONMENTS

HEADER = "angle,rep,placement,t_s,ch,rssi\n"


def cells(loss_db=12.0, placement="purse_right"):
    rng = np.random.default_rng(3)
    made = []
    for angle in range(0, 360, 45):
        level = -50.0 - loss_db * (1 - np.cos(np.deg2rad(angle))) / 2
        time_s = np.sort(rng.uniform(0, 20, 900))
        made.append(
            Cell(
                placement=placement,
                angle_deg=angle,
                rep=1,
                time_s=time_s,
                rssi_dbm=np.rint(level + rng.normal(0, 2, 900)),
                channel=np.tile([37, 38, 39], 300),
            )
        )
    return made


def test_the_body_loss_of_cells_comes_back():
    assert body_loss_db(cells(12.0)) == pytest.approx(12.0, abs=0.3)
    assert body_swings_db(cells(12.0)) == pytest.approx([12.0] * 3, abs=0.8)


def test_statistics_of_white_cells_have_no_memory_and_no_common_fading():
    statistics = {each.name: each.values for each in room_statistics("room", cells())}
    assert np.median(statistics["room: standing: deviation of a channel"]) == pytest.approx(
        2, rel=0.1
    )
    assert abs(np.median(statistics["room: standing: autocorrelation after 0.5 s"])) < 0.05
    assert abs(np.median(statistics["room: correlation between channels"])) < 0.1
    # Of white readings the step is sqrt(2) times the deviation, and a dB of rounding on top.
    assert np.median(statistics["room: standing: step between packets"]) == pytest.approx(
        2.9, abs=0.2
    )


def test_a_twin_has_the_same_cells_levels_and_packet_rates():
    real = cells()
    twin = room_twin(real, ENVIRONMENTS["office"], seed=4)
    assert [(cell.placement, cell.angle_deg) for cell in twin] == [
        (cell.placement, cell.angle_deg) for cell in real
    ]
    mean = [np.mean([cell.levels_dbm() for cell in side]) for side in (real, twin)]
    assert mean[1] == pytest.approx(mean[0], abs=4.0)
    for mine, theirs in zip(real, twin, strict=True):
        assert len(theirs.time_s) == pytest.approx(len(mine.time_s), rel=0.15)
        assert theirs.duration_s == pytest.approx(mine.duration_s, abs=0.5)
    assert pytest.approx(1.83) == DISTANCE_M


def test_a_room_is_read_by_placement(tmp_path):
    rows = [f"45,1,ear_left,{t / 10},37,-50\n" for t in range(150)]
    short = ["90,1,ear_left,0.0,38,-50\n", "90,1,ear_left,2.0,38,-51\n"]
    with gzip.open(tmp_path / ROOMS["room"][0], "wt") as file:
        file.write(HEADER + "".join(rows + short))
    (cell,) = read_room(tmp_path, "room", ("ear_left",))
    assert (cell.angle_deg, len(cell.time_s), cell.duration_s) == (45, 150, 14.9)
    with pytest.raises(DataError, match="no recording of purse_right"):
        read_room(tmp_path, "room", ("purse_right",))


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (None, "not there"),
        (b"angle,rep\n", "damaged"),
        (gzip.compress(b"angle,rep,placement,t_s,ch\n0,1,a,0,37\n"), "damaged"),
        (gzip.compress((HEADER + "0,1,a,x,37,-50\n").encode()), "damaged"),
        (gzip.compress((HEADER + "0,1,a,1,37,-50\n").encode() * 50)[:-20], "damaged"),
    ],
    ids=["missing", "not gzip", "a column missing", "not a number", "cut off"],
)
def test_a_bad_file_is_one_line(tmp_path, content, told):
    if content is not None:
        (tmp_path / ROOMS["chamber"][0]).write_bytes(content)
    with pytest.raises(DataError, match=told) as fault:
        read_room(tmp_path, "chamber", ("ear_left",))
    assert "\n" not in str(fault.value)
