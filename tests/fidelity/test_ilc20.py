import gzip

import numpy as np
import pytest

from blesim.errors import DataError
from blesim.fidelity.felt import pieces, step_rate_hz
from blesim.fidelity.ilc20 import FOLDER, read_fitted, read_scored, twin_of
from blesim.fidelity.way_points import stretch_errors_deg

START_MS = 1_574_572_275_527


def lines_of(heading_rad):
    """A walk of 60 s with a turn at 30 s: level phone, even steps, a way point every 15 s."""
    lines = ["#\tstartTime:1", f"{START_MS - 100}\tTYPE_WAYPOINT\t0.0\t0.0"]
    for number, (x_m, y_m) in enumerate([(20, 0), (40, 0), (40, 20), (40, 39)]):
        lines.append(f"{START_MS + 15_000 * (number + 1) - 100}\tTYPE_WAYPOINT\t{x_m}\t{y_m}")
    for row in range(3000):
        time_ms = START_MS + 20 * row
        up = 9.81 + 5.0 * np.sin(2 * np.pi * 1.9 * row / 50)
        # A turn from the north about the vertical, as unit quaternion: half the angle.
        half = (heading_rad + np.pi / 2 * (row >= 1500) - np.pi / 2) / 2
        lines += [
            f"{time_ms}\tTYPE_ACCELEROMETER\t0.0\t0.0\t{up:.4f}\t2",
            f"{time_ms}\tTYPE_GYROSCOPE\t0.0\t0.0\t0.0\t2",
            f"{time_ms}\tTYPE_MAGNETIC_FIELD\t0.0\t20.0\t-40.0\t2",
            f"{time_ms}\tTYPE_ROTATION_VECTOR\t0.0\t0.0\t{np.sin(half):.6f}\t2",
            f"{time_ms}\tTYPE_BEACON\tuuid\t1\t2\t-59\t-80\t3.0\tmac",
        ]
    return lines


@pytest.fixture
def folder(tmp_path):
    (tmp_path / FOLDER).mkdir()
    for name in ("a", "b", "c"):
        with gzip.open(tmp_path / FOLDER / f"{name}.txt.gz", "wt") as file:
            file.write("\n".join(lines_of(0.2)) + "\n")
    return tmp_path


def test_every_other_trace_is_scored(folder):
    assert [trace.felt.name for trace in read_scored(folder)] == ["b"]
    assert [trace.felt.name for trace in read_fitted(folder)] == ["a", "c"]


def test_the_heading_is_that_of_the_phones_length_on_the_map(folder):
    (trace,) = read_scored(folder)
    first = trace.heading_errors_rad(0)
    # 0.2 rad to the left of the way, which leads along x.
    assert first == pytest.approx(np.full(len(first), 0.2), abs=1e-5)
    # It turns with the way at 30 s; what is left is the offset. Way points come 0.1 s early.
    assert stretch_errors_deg(trace) == pytest.approx(np.zeros(4), abs=0.5)
    assert trace.rate_hz() == pytest.approx(50.0)
    assert trace.mark_s.tolist() == pytest.approx([-0.1, 14.9, 29.9, 44.9, 59.9])


def test_a_twin_passes_the_way_points_with_the_step_rate(folder):
    (trace,) = read_scored(folder)
    twin = twin_of(trace, 0, seed=3)
    assert twin.mark_s is trace.mark_s
    assert len(twin.felt.magnetic_field_ut) == pytest.approx(len(trace.felt.time_s), abs=2)
    rates_hz = [step_rate_hz(piece) for piece in pieces(twin.felt, 20.0)]
    # 110 intervals vary by 8.5 %: their mean is good to 0.8 %.
    assert np.mean(rates_hz) == pytest.approx(1.9, rel=0.03)
    assert len(stretch_errors_deg(twin)) == 4


@pytest.mark.parametrize(
    "change",
    [
        lambda lines: [line for line in lines if "GYRO" not in line],
        lambda lines: [line for line in lines if "WAYPOINT" not in line],
        lambda lines: lines[:-8],
        lambda lines: [*lines, "12\tTYPE_GYROSCOPE\tx\t0\t0"],
        lambda lines: [*lines, "no tabs"],
    ],
    ids=["no gyroscope", "no way points", "cut off", "not a number", "not a line"],
)
def test_a_bad_file_is_one_line(folder, change):
    with gzip.open(folder / FOLDER / "b.txt.gz", "wt") as file:
        file.write("\n".join(change(lines_of(0.0))) + "\n")
    with pytest.raises(DataError, match="damaged") as fault:
        read_scored(folder)
    assert "\n" not in str(fault.value)


def test_a_missing_folder_is_told(tmp_path):
    with pytest.raises(DataError, match="too few traces"):
        read_scored(tmp_path)
