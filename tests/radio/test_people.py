import numpy as np
import pytest

from blesim.radio.people import People, body_loss_db, sway_m


def test_body_loss_runs_from_none_in_front_to_all_behind():
    assert body_loss_db(np.array([1.0, 0.0, -1.0]), 10.0).tolist() == [0, 5, 10]


def test_sway_has_its_spread_and_is_forgotten_in_its_time():
    sway = sway_m(People(sway_m=0.02, sway_s=2.0), 3, "w", 0, 4_000_000_000)
    # 40 000 steps of 0.1 s with a memory of 2 s: 1000 independent ones a standard error of 2 %.
    assert sway.std(axis=0) == pytest.approx([0.02, 0.02], rel=0.1)
    lagged = np.corrcoef(sway[:-20, 0], sway[20:, 0])[0, 1]
    assert lagged == pytest.approx(np.exp(-1), abs=0.1)
    assert abs(np.corrcoef(sway.T)[0, 1]) < 0.13
