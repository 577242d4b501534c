import gzip

import numpy as np
import pytest

from blesim.errors import DataError
from blesim.fidelity.felt import pieces, step_rate_hz
from blesim.fidelity.oxford_steps import (
    FITTED_ENDS,
    SCORED_ENDS,
    read_walks,
    twin_of,
)

HEADER = "recording,user,phone,position,surface,duration_s,gt_steps,n_step_edges\n"
ROWS = (
    "P_InHand_1,J,P,InHand,Hard,9,9,9\n"
    "P_InHand_2,J,P,InHand,Hard,9,9,9\n"
    "P_Purse_4,J,P,Purse,Hard,9,9,9\n"
    "P_Armband_2,J,P,Armband,Hard,9,9,9\n"
    "P_gone_2,J,P,InHand,Hard,9,9,9\n"
)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "index.csv").write_text(HEADER + ROWS)
    time_s = np.arange(0, 90, 0.02)
    up = 9.81 + 2.5 * np.sin(2 * np.pi * 1.85 * time_s)
    lines = [f"{t:.2f},0.0,0.0,{a:.4f}\n" for t, a in zip(time_s, up, strict=True)]
    for name in ("P_InHand_1", "P_InHand_2", "P_Purse_4", "P_Armband_2"):
        with gzip.open(tmp_path / f"{name}_50hz.csv.gz", "wt") as file:
            file.write("t_s,ax,ay,az\n" + "".join(lines))
    return tmp_path


def test_walks_are_told_apart_by_their_ends_and_ways_of_carrying(folder):
    scored = read_walks(folder, SCORED_ENDS)
    assert [(walk.name, walk.carrying) for walk in scored] == [
        ("P_InHand_2", "hand"),
        ("P_Purse_4", "bag"),
    ]
    assert [walk.name for walk in read_walks(folder, FITTED_ENDS)] == ["P_InHand_1"]
    assert scored[0].acceleration_m_s2.shape == (4500, 3)


def test_a_twin_has_duration_step_rate_and_way_of_carrying(folder):
    walk = read_walks(folder, ("2",))[0]
    twin = twin_of(walk, 0, seed=5)
    assert twin.carrying == "hand"
    assert twin.time_s[-1] == pytest.approx(walk.time_s[-1], abs=0.03)
    rates_hz = [step_rate_hz(piece) for piece in pieces(twin, 30.0)]
    # 160 intervals vary by 8.5 %: their mean is good to 0.7 %.
    assert np.mean(rates_hz) == pytest.approx(1.85, rel=0.02)
    other = twin_of(walk, 1, seed=5)
    assert not np.array_equal(twin.acceleration_m_s2, other.acceleration_m_s2)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"t_s,ax,ay,az\n", "damaged"),
        (gzip.compress(b"t_s,ax,ay,az\n0,1,2\n1,2,3\n"), "damaged"),
        (gzip.compress(b"t_s,ax,ay,az\n0,1,2,x\n1,2,3,4\n"), "damaged"),
        (gzip.compress(b"t_s,ax,ay,az\n0,1,2,nan\n1,2,3,4\n"), "damaged"),
        (gzip.compress(b"t_s,ax,ay,az\n" + b"0,1,2,3\n" * 900)[:-9], "damaged"),
    ],
    ids=["not gzip", "a column missing", "not a number", "nan", "cut off"],
)
def test_a_bad_file_is_one_line(folder, content, told):
    (folder / "P_InHand_2_50hz.csv.gz").write_bytes(content)
    with pytest.raises(DataError, match=told) as fault:
        read_walks(folder, SCORED_ENDS)
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize(
    ("index", "told"),
    [(None, "not there"), ("a,b\n1,2\n", "damaged"), (HEADER + ROWS, "none of the 3 walks")],
    ids=["no index", "another index", "no walks"],
)
def test_a_bad_index_is_one_line(tmp_path, index, told):
    if index is not None:
        (tmp_path / "index.csv").write_text(index)
    with pytest.raises(DataError, match=told):
        read_walks(tmp_path, SCORED_ENDS)
