import numpy as np
import pytest

from blesim.fidelity.felt import FeltWalk
from blesim.fidelity.way_points import Trace, stretch_errors_deg, within_stretch_deg

# East, north, east, and a detour: 10 m in 30 s.
MARK_S = np.array([0.0, 10.0, 20.0, 30.0, 60.0])
MARK_M = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [20.0, 10.0], [30.0, 10.0]])
TRUE_DEG = (0.0, 90.0, 0.0, 0.0)


def trace(errors_deg, swing_deg=0.0):
    time_s = np.arange(0, 60, 0.02)
    stretch = np.searchsorted(MARK_S, time_s, side="right") - 1
    heading_deg = np.add(TRUE_DEG, errors_deg)[stretch]
    heading_deg = heading_deg + swing_deg * np.sin(2 * np.pi * 0.5 * time_s)
    none = np.empty((0, 3))
    return Trace(
        felt=FeltWalk(
            name="made",
            carrying="flat",
            time_s=time_s,
            acceleration_m_s2=np.zeros((len(time_s), 3)),
            angular_rate_rad_s=none,
            magnetic_field_ut=none,
        ),
        heading_s=time_s,
        heading_rad=np.radians(heading_deg),
        mark_s=MARK_S,
        mark_m=MARK_M,
    )


def test_errors_are_taken_about_the_offset_of_the_walk():
    assert stretch_errors_deg(trace((170, 180, 190, 0))) == pytest.approx([-10, 0, 10])


def test_a_detour_is_no_straight_stretch():
    assert trace((0, 0, 0, 0)).straight() == [0, 1, 2]


def test_the_deviation_within_a_stretch_is_that_of_the_swing():
    # 8 of the 10 s are whole periods; the root mean square of a sine is 1 / sqrt(2).
    within = within_stretch_deg(trace((5, -5, 5, 0), swing_deg=4.0))
    assert within == pytest.approx(np.full(3, 4.0 / np.sqrt(2)), rel=0.01)


def test_the_sample_rate_is_that_of_the_sensors():
    assert trace((0, 0, 0, 0)).rate_hz() == pytest.approx(50.0)
