"""The signal: against the plain way of working it out, and the laws of mechanics."""

import importlib
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from blesim.errors import DataError
from blesim.imu.carriage import CARRIAGES
from blesim.imu.feel import Signal, feel
from blesim.imu.magnetics import Magnetics
from blesim.imu.signal import GRAVITY_M_S2
from blesim.tables import Carrying, StepTruth, Trajectory
from blesim.walkers.gait import Gait, steps_of

BENCHMARK = Path(__file__).resolve().parents[1] / "benchmark"
SQUARE = [(0, 0), (12, 0), (12, 9), (0, 9), (0, 0)]
EVERY_MODE = (
    (0, "hand"), (7, "flat"), (15, "pocket"), (23, "swinging"), (31, "bag"), (39, "trolley"),
    (45, "hand"),
)  # fmt: skip

QUIET_M_S2 = {"flat": 0.13}


@pytest.fixture
def plain(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARK))
    return importlib.import_module("plain_imu").plain_phone


def test_the_plain_way_gives_the_same(plain, route, carried):
    walk, carrying = route(SQUARE, speed_m_s=1.1), carried(*EVERY_MODE)
    steps = steps_of(walk, Gait(), 5, "w")
    signal = Signal.of(Magnetics(), walk, steps, carrying, 5, "w")
    time_us = np.arange(50_000, walk.time_us[-1] - 50_000, 97_331)
    # Between steps the attitude is smooth, and differences tell its rate; not across a step.
    away = np.abs(time_us[:, None] - steps.time_us[None, :]).min(axis=1) > 200
    time_us = time_us[away]
    phone = plain(signal, walk, steps, carrying)
    wanted = np.array([phone.sample(time * 1e-6) for time in time_us])
    assert signal.at(time_us) == pytest.approx(wanted, abs=2e-5)


@pytest.mark.parametrize("mode", sorted(set(CARRIAGES)))
def test_at_rest_the_specific_force_is_gravity(mode, felt, standing, perfect, axes):
    imu, _ = felt(perfect, standing(60.0), mode)
    force = np.linalg.norm(axes(imu, "acceleration"), axis=1)
    # 60 s of tremor that is forgotten within a tenth of a second: its mean is good to 0.02.
    assert force.mean() == pytest.approx(GRAVITY_M_S2, abs=0.02)
    # The median half second in which nobody moved spreads by 0.08 m/s2 in hand, and by 0.13 on six
    # walks of people who held the phone flat, standing at way points.
    assert force.std() < QUIET_M_S2.get(mode, 0.085)


def test_in_a_hand_at_rest_the_force_trembles_as_measured(felt, standing, axes):
    from blesim.imu.sensors import ImuSettings

    imu, _ = felt(ImuSettings(), standing(200.0), "hand")
    spread = np.linalg.norm(axes(imu, "acceleration"), axis=1).std()
    assert spread == pytest.approx(0.08, rel=0.1)


@pytest.mark.parametrize("mode", sorted(set(CARRIAGES)))
def test_over_whole_strides_the_mean_force_is_gravity(mode, felt, route, perfect, axes):
    walk = route([(0, 0), (80, 0)], speed_m_s=1.2)
    imu, steps = felt(perfect, walk, mode, gait=Gait(interval_variation=0.0))
    inside = (imu.time_us >= steps.time_us[10]) & (imu.time_us < steps.time_us[90])
    # About the phone's axes gravity turns with the attitude; the vertical is found by turning back.
    force = axes(imu, "acceleration")[inside]
    turned = _attitudes(imu, axes)[inside]
    mean = np.einsum("nij,nj->ni", turned, force).mean(axis=0)
    # Forty strides whose amplitudes vary by a fifth: what does not cancel is below 1 per cent of
    # the peak-to-peak, and the attitude integrated from 50 Hz samples drifts.
    assert np.linalg.norm(mean) == pytest.approx(GRAVITY_M_S2, abs=0.12)


def _attitudes(imu, axes):
    """Attitude from the integrated angular rate, relative to that of the first sample."""
    rate, span_s = axes(imu, "angular_rate"), np.diff(imu.time_us) * 1e-6
    turns = Rotation.from_rotvec(0.5 * (rate[1:] + rate[:-1]) * span_s[:, None])
    total, out = Rotation.identity(), [np.eye(3)]
    for turn in turns:
        total = total * turn
        out.append(total.as_matrix())
    return np.array(out)


def test_the_angular_rate_adds_up_to_the_turns_of_the_walk(felt, route, perfect, axes):
    walk = route(SQUARE, speed_m_s=1.0)
    fast = perfect.model_copy(update={"rate_hz": 200.0})
    imu, _ = felt(fast, walk, "flat")
    force = axes(imu, "acceleration")
    turned = _attitudes(imu, axes)
    up = force[:100].mean(axis=0)
    up /= np.linalg.norm(up)
    # How the phone's level axis turned about the vertical, between rest and rest.
    start = np.cross(up, [1.0, 0.0, 0.0])
    end = turned[-50] @ start
    angle = np.arctan2(up @ np.cross(start, end), start @ end)
    # Three quarters of a turn left; the slow yaw of the hold has a spread of 3 degrees at each end.
    wanted = 1.5 * np.pi - 2.0 * np.pi
    assert np.degrees(angle - wanted) == pytest.approx(0.0, abs=3 * 3.0 * np.sqrt(2))


def test_a_field_without_anomalies_keeps_its_magnitude(felt, route, perfect, axes):
    calm = Magnetics(anomaly_ut=0.0, clutter_ut=0.0)
    imu, _ = felt(perfect, route(SQUARE), "pocket", magnetics=calm)
    magnitude = np.linalg.norm(axes(imu, "magnetic_field"), axis=1)
    assert magnitude == pytest.approx(calm.field_ut, abs=1e-3)


def test_samples_of_two_rates_at_one_time_are_one_signal(felt, route, perfect, axes):
    walk = route(SQUARE)
    slow, _ = felt(perfect, walk, "pocket")
    fast, _ = felt(perfect.model_copy(update={"rate_hz": 100.0}), walk, "pocket")
    assert np.array_equal(slow.time_us, fast.time_us[::2])
    for name in ("acceleration", "angular_rate", "magnetic_field"):
        assert np.array_equal(axes(slow, name), axes(fast, name)[::2])


def test_samples_reach_from_the_first_to_the_last_time(felt, route, perfect):
    walk = route(SQUARE)
    imu, _ = felt(perfect, walk)
    assert imu.time_us[0] == walk.time_us[0]
    assert 0 <= walk.time_us[-1] - imu.time_us[-1] < 20_000
    assert np.all(np.diff(imu.time_us) == 20_000)


def test_a_long_walk_is_the_same_in_blocks(felt, route, perfect, monkeypatch):
    walk = route(SQUARE)
    whole, _ = felt(perfect, walk, "bag")
    monkeypatch.setattr("blesim.imu.feel.BLOCK", 777)
    assert felt(perfect, walk, "bag")[0] == whole


def test_another_walker_has_other_draws(felt, route, perfect):
    walk = route(SQUARE)
    assert felt(perfect, walk, walker="a")[0] != felt(perfect, walk, walker="b")[0]
    assert felt(perfect, walk, walker="a")[0] == felt(perfect, walk, walker="a")[0]


def test_a_switch_is_smooth_and_takes_a_second(felt, standing, carried, perfect, axes):
    carrying = carried((0, "hand"), (5, "pocket"))
    imu, _ = felt(perfect, standing(10.0), carrying)
    rate = np.linalg.norm(axes(imu, "angular_rate"), axis=1)
    moving = imu.time_us[rate > 0.5] * 1e-6
    assert 5.0 < moving.min() < moving.max() < 6.0
    # From up along (y .40, z .91) to up along y, and about: within half a turn in a second.
    assert np.trapezoid(rate, imu.time_us * 1e-6) < np.pi + 1.0
    jump = np.abs(np.diff(rate)).max()
    assert jump < 0.5


def test_a_switch_that_is_given_up_at_once_does_not_jump(felt, standing, carried, perfect, axes):
    carrying = carried((0, "hand"), (5, "pocket"), (5.4, "hand"))
    fast = perfect.model_copy(update={"rate_hz": 500.0})
    imu, _ = felt(fast, standing(8.0), carrying)
    field = axes(imu, "magnetic_field")
    # 49 uT turned at 20 rad/s changes by 2 uT in 2 ms.
    assert np.abs(np.diff(field, axis=0)).max() < 2.0


def test_a_trolley_vibrates_with_its_speed_and_knows_no_steps(felt, route, perfect, axes):
    spreads = []
    for speed in (0.5, 1.0):
        walk = route([(0, 0), (40, 0)], speed_m_s=speed)
        imu, steps = felt(perfect, walk, "trolley")
        inside = (imu.time_us > steps.time_us[3]) & (imu.time_us < steps.time_us[-3])
        spreads.append(np.linalg.norm(axes(imu, "acceleration"), axis=1)[inside].std())
        spectrum = np.abs(np.fft.rfft(axes(imu, "acceleration")[inside, 2])) ** 2
        rate = 1e6 / np.mean(np.diff(steps.time_us))
        bin_hz = 50.0 / inside.sum()
        near = slice(int((rate - 0.1) / bin_hz), int((rate + 0.1) / bin_hz) + 2)
        around = slice(int((rate - 0.6) / bin_hz), int((rate + 0.6) / bin_hz))
        # No line at the step rate: the mean of a few bins is within five times that around.
        assert spectrum[near].mean() < 5 * spectrum[around].mean()
    # The spread of several hundred independent values is good to 5 per cent.
    assert spreads[1] / spreads[0] == pytest.approx(2.0, rel=0.15)


def test_a_walk_of_which_nothing_is_known_is_refused(perfect, standing, carried):
    with pytest.raises(DataError, match="'w': there is no trajectory"):
        feel(perfect, Magnetics(), Trajectory.empty(), StepTruth.empty(), carried("hand"), 1, "w")
    late = carried((1.0, "hand"))
    for carrying in (late, Carrying.empty()):
        with pytest.raises(DataError, match="'w': it is not said how the phone is carried"):
            feel(perfect, Magnetics(), standing(5.0), StepTruth.empty(), carrying, 1, "w")
