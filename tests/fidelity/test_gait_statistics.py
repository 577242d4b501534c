"""The measures on walks whose answer is known by construction."""

import numpy as np
import pytest

from blesim.fidelity import gait_statistics as gait
from blesim.fidelity import motion_statistics as motion
from blesim.fidelity.felt import FeltWalk, piece_of, pieces, step_rate_hz
from blesim.pdr.steps import GRAVITY_M_S2

RATE_HZ = 50.0


def walk_of(up_m_s2, *, tilt_rad=0.0, angular=None, field=None):
    """A phone, tilted about its width, that feels an acceleration straight up."""
    force = GRAVITY_M_S2 + np.asarray(up_m_s2)
    tilt = np.broadcast_to(tilt_rad, force.shape)
    none = np.empty((0, 3))
    return FeltWalk(
        name="made",
        carrying="hand",
        time_s=np.arange(len(force)) / RATE_HZ,
        acceleration_m_s2=np.stack(
            [0.0 * force, force * np.sin(tilt), force * np.cos(tilt)], axis=1
        ),
        angular_rate_rad_s=none if angular is None else angular,
        magnetic_field_ut=none if field is None else field,
    )


def bumps(times_s, heights_m_s2, duration_s):
    """Half sines of 0.3 s, upwards, on a level that keeps the mean."""
    time_s = np.arange(0, duration_s, 1 / RATE_HZ)
    up = np.zeros(len(time_s))
    for at_s, height in zip(times_s, heights_m_s2, strict=True):
        near = np.abs(time_s - at_s) < 0.15
        up[near] += height * np.cos(np.pi * (time_s[near] - at_s) / 0.3)
    return up


@pytest.fixture(scope="module")
def even():
    time_s = np.arange(0, 30, 1 / RATE_HZ)
    return piece_of(walk_of(2.0 * np.sin(2 * np.pi * 2.0 * time_s), tilt_rad=np.radians(30)))


def test_a_sine_has_its_rate_and_heights_and_no_variation(even):
    assert step_rate_hz(even) == pytest.approx(2.0, rel=1e-3)
    assert gait.interval_variation(even) < 0.02
    assert gait.alternation(even) < 0.005
    assert gait.peak_to_peak_m_s2(even) == pytest.approx(4.0, rel=0.01)
    assert gait.peak_m_s2(even) == pytest.approx(2.0, rel=0.01)
    assert gait.peak_to_peak_variation(even) < 0.01


def test_a_sine_has_its_power_at_the_step_frequency(even):
    assert gait.norm_share(even, order=1.0) == pytest.approx(1.0, abs=0.01)
    assert gait.norm_share(even, order=0.5) < 0.01
    assert gait.norm_share(even, order=2.0) < 0.01


def test_the_attitude_is_that_of_the_phone(even):
    assert gait.gravity_share(even, axis=0) == pytest.approx(0.0, abs=1e-6)
    assert gait.gravity_share(even, axis=1) == pytest.approx(0.5, abs=0.01)
    assert gait.gravity_share(even, axis=2) == pytest.approx(np.sqrt(0.75), abs=0.01)
    assert gait.wander_deg(even) < 0.1


def test_a_slow_sway_is_wander():
    time_s = np.arange(0, 60, 1 / RATE_HZ)
    up = np.sin(2 * np.pi * 2.0 * time_s)
    sway = np.radians(5.0) * np.sin(2 * np.pi * 0.05 * time_s)
    # The root mean square of a sine is its amplitude over the root of 2.
    assert gait.wander_deg(piece_of(walk_of(up, tilt_rad=sway))) == pytest.approx(3.54, rel=0.05)


def test_two_waves_share_power_by_their_squares():
    time_s = np.arange(0, 30, 1 / RATE_HZ)
    up = 2.0 * np.sin(2 * np.pi * 2.0 * time_s) + np.sin(2 * np.pi * 1.0 * time_s)
    piece = piece_of(walk_of(up))
    assert gait.norm_share(piece, order=1.0) == pytest.approx(0.8, abs=0.05)
    assert gait.norm_share(piece, order=0.5) == pytest.approx(0.2, abs=0.05)


def test_feet_that_differ_show_in_intervals_and_peaks():
    # Intervals of 0.45 and 0.55 s, heights of 3 and 5 m/s2 in turn, and a little chance.
    chance = np.random.Generator(np.random.Philox(3)).normal(size=60)
    times_s = 0.5 + 0.5 * np.arange(60) + 0.05 * (np.arange(60) % 2)
    heights = 4.0 + (-1.0) ** np.arange(60) + 0.1 * chance
    piece = piece_of(walk_of(bumps(times_s, heights, 30.5)))
    # The band-pass draws unequal intervals together.
    assert 0.08 < gait.alternation(piece) < 0.2
    assert gait.peak_correlation(piece, lag=1) < -0.95
    assert gait.peak_correlation(piece, lag=2) > 0.95


def test_heights_of_chance_are_not_correlated():
    heights = 4.0 + 0.5 * np.random.Generator(np.random.Philox(7)).normal(size=240)
    piece = piece_of(walk_of(bumps(0.5 + 0.5 * np.arange(240), heights, 120.5)))
    # The deviation of a correlation of 239 pairs is 0.065: three of them, one run in 370 fails.
    assert abs(gait.peak_correlation(piece, lag=1)) < 0.195
    # The last peak is in no interval.
    expected = heights[:-1].std() / heights[:-1].mean()
    assert gait.peak_to_peak_variation(piece) == pytest.approx(expected, rel=0.05)


def test_a_stop_is_no_interval():
    before, after = 0.5 + 0.5 * np.arange(20), 15.0 + 0.5 * np.arange(20)
    times_s = np.concatenate([before, after])
    piece = piece_of(walk_of(bumps(times_s, np.full(40, 4.0), 25.0)))
    assert step_rate_hz(piece) == pytest.approx(2.0, rel=0.02)
    assert gait.interval_variation(piece) < 0.05


def test_whole_pieces_with_steps_are_kept():
    walk = walk_of(bumps(0.5 + 0.5 * np.arange(40), np.full(40, 4.0), 65.0))
    # 20 s of steps, then a stop: two pieces of 10 s, four without steps, a rest of 5 s.
    assert [len(piece.step) for piece in pieces(walk, 10.0)] == pytest.approx([19, 20], abs=1)


def test_quiet_is_the_deviation_of_half_seconds_without_motion():
    chance = np.random.Generator(np.random.Philox(1)).normal(size=2000)
    signal = np.concatenate([0.1 * chance, 3.0 * chance[:500]])
    statistic = gait.quiet_statistic("hand", [signal])
    assert len(statistic.values) == 80
    # 80 half seconds of 25 samples: the mean is good to 0.002.
    assert statistic.values.mean() == pytest.approx(0.098, abs=0.006)
    assert gait.quiet(signal).tolist() == [True] * 80 + [False] * 20


def test_turning_and_field_are_measured():
    time_s = np.arange(0, 30, 1 / RATE_HZ)
    wave = 2 * np.pi * time_s
    angular = np.stack([np.sin(2 * wave), 0.5 * np.sin(wave), 0.0 * wave], axis=1)
    field = np.stack([0.0 * wave, 0.0 * wave, 40.0 + 2.0 * np.sin(wave / 4)], axis=1)
    piece = piece_of(walk_of(2.0 * np.sin(2 * wave), angular=angular, field=field))
    assert motion.rate_rad_s(piece, axis=0) == pytest.approx(np.sqrt(0.5), rel=0.01)
    assert motion.rate_rad_s(piece, axis=1) == pytest.approx(np.sqrt(0.125), rel=0.01)
    assert motion.turning_share(piece, order=1.0) == pytest.approx(0.8, abs=0.02)
    assert motion.turning_share(piece, order=0.5) == pytest.approx(0.2, abs=0.02)
    assert motion.field_deviation_ut(piece) == pytest.approx(np.sqrt(2.0), rel=0.03)
    # A sine of period 4 s turns its sign over 2 s: the change has twice the deviation.
    assert motion.field_change_ut(piece, over_s=2.0) == pytest.approx(np.sqrt(8.0), rel=0.03)
