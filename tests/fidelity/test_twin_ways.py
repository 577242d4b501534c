import numpy as np
import pytest

from blesim.columns import STATES
from blesim.fidelity.twin_ways import speed_at_m_s, stops_s, straight_on, way_walked
from blesim.walkers.gait import Gait, steps_of

MARK_S = np.array([1.0, 11.0, 21.0])
MARK_M = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
NO_STOPS = np.empty((0, 2))


def poses(stood_s=NO_STOPS, duration_s=25.0):
    way = way_walked(MARK_S, MARK_M, np.asarray(stood_s), duration_s)
    return lambda *times_s: way.at((np.array(times_s) * 1e6).astype(int))


def test_way_points_are_passed_when_they_were_pressed():
    at = poses()(1.0, 6.0, 11.0, 21.0, 25.0)
    assert at.x_m == pytest.approx([0, 5, 10, 10, 10], abs=1e-5)
    assert at.y_m == pytest.approx([0, 0, 0, 10, 10], abs=1e-5)
    assert at.speed_m_s[1:3] == pytest.approx([1.0, 1.0])
    standing = dict(STATES)["standing"]
    assert (at.state == standing).tolist() == [False, False, False, True, True]


def test_the_heading_turns_about_the_way_point():
    at = poses()(6.0, 10.5, 11.0, 11.5, 16.0)
    assert np.degrees(at.heading_rad) == pytest.approx([0, 0, 45, 90, 90], abs=1e-3)


def test_turns_go_the_short_way_round():
    back = np.array([[0.0, 0.0], [-10.0, 0.1], [-20.0, -0.1]])
    way = way_walked(MARK_S, back, NO_STOPS, 25.0)
    headings = np.degrees(way.at(np.arange(1, 21) * 1_000_000).heading_rad)
    assert np.all(np.abs(headings) > 175)


def test_a_stop_delays_and_the_rest_is_walked_faster():
    at = poses(stood_s=[[3.0, 8.0]])(3.0, 5.0, 8.0, 11.0)
    assert at.x_m == pytest.approx([4.0, 4.0, 4.0, 10.0], abs=1e-5)
    assert at.speed_m_s[[0, 1, 2]] == pytest.approx([0.0, 0.0, 2.0], abs=1e-5)


def test_no_steps_in_a_stop():
    way = way_walked(MARK_S, MARK_M, np.array([[3.0, 8.0]]), 25.0)
    steps_s = steps_of(way, Gait(), seed=1, walker="w").time_us / 1e6
    assert len(steps_s) > 20
    assert not np.any((steps_s > 3.0) & (steps_s < 8.0))
    assert steps_s.max() <= 21.0


def test_the_speed_of_a_step_rate_gives_that_rate():
    gait = Gait()
    # Measured: 1.65 Hz at 1.0 m/s, 1.82 Hz at 1.25 m/s.
    assert speed_at_m_s(1.65, gait) == pytest.approx(1.0, abs=0.02)
    assert speed_at_m_s(1.82, gait) == pytest.approx(1.25, abs=0.02)
    steps = steps_of(straight_on(speed_at_m_s(1.9, gait), 200.0), gait, seed=1, walker="w")
    # 380 intervals vary by 8.5 %: their number is good to 1.7.
    assert len(steps) == pytest.approx(380, abs=6)


def test_stops_at_either_end_are_found():
    assert stops_s(np.array([True, False, True]), 0.5).tolist() == [[0.0, 0.5], [1.0, 1.5]]
    assert stops_s(np.array([False, False]), 0.5).shape == (0, 2)
