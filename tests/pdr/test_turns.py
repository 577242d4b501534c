import math

import numpy as np
import pytest

from blesim.errors import DataError
from blesim.pdr.turns import TurnDetector, Turning


def test_angles_worked_by_hand():
    # 0.1 s apart; the first sample has no time before it. Told at 0.3: samples of 0.1 and 0.2 s.
    time_us = np.arange(6) * 100_000
    rate = np.array([9.0, 1.0, 2.0, -3.0, -4.0, 5.0])
    turns = TurnDetector(Turning(band_rad=0.31)).advance(
        time_us, rate, np.array([300_000, 500_000])
    )
    assert turns.angle_rad.tolist() == pytest.approx([0.3, -0.7])
    assert turns.turning.tolist() == [False, True]


def test_turning_on_the_spot_shows_in_the_next_step():
    time_us = np.arange(1001) * 20_000
    rate = np.where(time_us < 5_000_000, math.pi / 5, 0.0)
    turns = TurnDetector(Turning()).advance(time_us, rate, np.array([18_000_000, 18_500_000]))
    assert turns.angle_rad.tolist() == pytest.approx([math.pi, 0.0], abs=0.02)
    assert turns.turning.tolist() == [True, False]


@pytest.mark.parametrize("side", [-1, 1])
def test_a_corner_is_turning_and_the_sway_of_walking_is_not(side):
    # The body sways by 6 degrees each way with the stride; a right angle between 5 and 6.5 s.
    time_us = np.arange(600) * 20_000
    now_s = time_us * 1e-6
    yaw = np.radians(6) * np.sin(2 * np.pi * 0.9 * now_s)
    yaw += side * np.pi / 2 * np.clip((now_s - 5) / 1.5, 0, 1)
    rate = np.diff(yaw, prepend=yaw[0]) / 0.02
    told_us = np.arange(1, 21) * 555_556
    turns = TurnDetector(Turning()).advance(time_us, rate, told_us)
    during = (told_us > 5_100_000) & (told_us < 7_000_000)
    assert turns.turning[during].sum() >= 2
    assert not turns.turning[~during].any()
    assert turns.angle_rad.sum() == pytest.approx(side * np.pi / 2, abs=0.2)


def test_disorder_is_refused():
    detector = TurnDetector(Turning())
    none = np.empty(0, np.int64)
    detector.advance(np.array([100]), np.zeros(1), np.array([100]))
    with pytest.raises(DataError, match="samples go back"):
        detector.advance(np.array([99]), np.zeros(1), none)
    with pytest.raises(DataError, match="steps go back"):
        detector.advance(none, np.empty(0), np.array([99]))
