import numpy as np
import pytest

from blesim.radio.people import Crowd, People, body_loss_db, sway_m
from blesim.tables import Trajectory


def standing(x_m, y_m, until_us=10_000_000):
    return Trajectory(
        time_us=np.array([0, until_us]),
        x_m=np.full(2, x_m),
        y_m=np.full(2, y_m),
        level=np.zeros(2, int),
        heading_rad=np.zeros(2),
        speed_m_s=np.zeros(2),
        edge=np.full(2, -1),
        offset_m=np.full(2, np.nan),
        edge_speed_m_s=np.full(2, np.nan),
        state=np.zeros(2, int),
    )


def test_body_loss_runs_from_none_in_front_to_all_behind():
    assert body_loss_db(np.array([1.0, 0.0, -1.0]), 10.0).tolist() == [0, 5, 10]


def test_sway_has_its_spread_and_is_forgotten_in_its_time():
    sway = sway_m(People(sway_m=0.02, sway_s=2.0), 3, "w", 0, 4_000_000_000)
    # 40 000 steps of 0.1 s with a memory of 2 s: 1000 independent ones a standard error of 2 %.
    assert sway.std(axis=0) == pytest.approx([0.02, 0.02], rel=0.1)
    lagged = np.corrcoef(sway[:-20, 0], sway[20:, 0])[0, 1]
    assert lagged == pytest.approx(np.exp(-1), abs=0.1)
    assert abs(np.corrcoef(sway.T)[0, 1]) < 0.13


def test_only_others_on_the_link_count():
    crowd = Crowd.of(
        {
            "me": standing(0, 0),
            "on": standing(2, 0.1),
            "off": standing(2, 1),
            "behind": standing(-1, 0),
        }
    )
    ends = np.array([[0.0, 0.0, 1.0]]), np.array([[5.0, 0.0, 1.5]])
    now = np.array([1_000_000])
    assert crowd.crossings(now, *ends, "me").tolist() == [1]
    assert crowd.crossings(now, *ends, "on").tolist() == [0]
    assert crowd.crossings(np.array([60_000_000]), *ends, "me").tolist() == [0]


def test_a_link_above_the_heads_is_free():
    crowd = Crowd.of({"on": standing(2, 0)})
    ends = np.array([[0.0, 0.0, 1.0]]), np.array([[3.0, 0.0, 3.0]])
    assert crowd.crossings(np.array([0]), *ends, "me").tolist() == [0]


def test_an_empty_crowd_is_on_no_link():
    ends = np.zeros((3, 3)), np.ones((3, 3))
    assert Crowd.of({}).crossings(np.arange(3), *ends, "me").tolist() == [0, 0, 0]
