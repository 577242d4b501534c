import numpy as np
import pytest

from blesim.imu.compass import COMPASSES
from blesim.imu.fused_heading import HEADING_SENSORS, HeadingSensor, fused_heading
from blesim.imu.step_events import StepSensor, read_steps
from blesim.units import wrap_angle
from blesim.walkers.gait import Gait, steps_of

ZIGZAG = np.cumsum([(0, 0)] + [(25, 0), (0, 25)] * 10, axis=0)
PROMPT = HeadingSensor(lag_s=0.0, settling_s=0.0)


@pytest.fixture(scope="module")
def walk(route):
    return route(ZIGZAG, speed_m_s=1.0)


@pytest.fixture(scope="module")
def steps(walk):
    return steps_of(walk, Gait(), 3, "w")


def errors_deg(walk, headings):
    true = walk.at(headings.time_us).heading_rad
    return np.degrees(wrap_angle(headings.heading_rad - true))


def test_without_errors_it_is_the_heading(walk, steps, carried):
    exact = StepSensor(stretch_heading_std_deg=0, step_heading_std_deg=0)
    told = fused_heading(walk, steps, carried("hand"), PROMPT, exact, 3, "w")
    assert np.all(np.diff(told.time_us) == 100_000)
    assert told.time_us[0] == walk.time_us[0]
    assert 0 <= walk.time_us[-1] - told.time_us[-1] < 100_000
    assert errors_deg(walk, told) == pytest.approx(np.zeros(len(told)), abs=1e-4)


def test_it_shares_the_bias_of_each_stretch_with_the_steps(walk, steps, carried):
    biased = StepSensor(step_heading_std_deg=0, length_std_m=0)
    read = read_steps(steps, biased, 3, "w")
    told = fused_heading(walk, steps, carried("hand"), PROMPT, biased, 3, "w")
    row = np.searchsorted(told.time_us, steps.time_us)
    middle = np.abs(walk.time_us[:, None] - steps.time_us[None, :]).min(axis=0) > 2_000_000
    same = wrap_angle(told.heading_rad[row] - read.heading_rad)[middle]
    assert middle.sum() > 300
    assert same == pytest.approx(np.zeros(middle.sum()), abs=1e-5)


def test_errors_have_the_spreads_measured(walk, carried):
    biases, within = [], []
    for seed in range(40):
        steps = steps_of(walk, Gait(), seed, "w")
        told = fused_heading(walk, steps, carried("hand"), PROMPT, StepSensor(), seed, "w")
        error = errors_deg(walk, told)
        for start in walk.time_us[walk.state == 1]:
            part = error[(told.time_us > start + 2e6) & (told.time_us < start + 23e6)]
            biases.append(part.mean())
            within.append(part.var())
    # 800 stretches of 21 s; errors are forgotten in 2 s, so that their mean adds a tenth to the
    # bias; good to 2.5 per cent, here to three times.
    of_mean = 5.8 * np.sqrt(2 * 2 / 21)
    assert np.std(biases) == pytest.approx(np.hypot(12.0, of_mean), rel=0.08)
    assert np.sqrt(np.mean(within)) == pytest.approx(np.sqrt(5.8**2 - of_mean**2), rel=0.08)


def test_it_lags(walk, steps, carried):
    exact = StepSensor(stretch_heading_std_deg=0, step_heading_std_deg=0)
    late = HeadingSensor(lag_s=0.4, settling_s=0.0)
    told = fused_heading(walk, steps, carried("hand"), late, exact, 3, "w")
    seen = walk.at(np.maximum(told.time_us - 400_000, walk.time_us[0])).heading_rad
    assert wrap_angle(told.heading_rad - seen) == pytest.approx(np.zeros(len(told)), abs=2e-6)


def test_where_the_phone_hangs_loose_it_points_elsewhere(walk, steps, carried):
    exact = StepSensor(stretch_heading_std_deg=0, step_heading_std_deg=0)
    how = carried((0, "hand"), (60, "pocket"))
    told = fused_heading(walk, steps, how, PROMPT, exact, 3, "w")
    error, loose = errors_deg(walk, told), told.time_us >= 60_000_000
    assert error[~loose] == pytest.approx(np.zeros((~loose).sum()), abs=1e-4)
    assert np.ptp(error[loose]) < 1e-3
    assert abs(error[loose][0]) > 1.0


def test_with_a_compass_the_error_depends_on_the_direction_alone(walk, steps, carried):
    compass = COMPASSES["map-heading"].model_copy(update={"noise_deg": 0.0})
    sensor = StepSensor(compass=compass, length_std_m=0)
    told = fused_heading(walk, steps, carried("hand"), PROMPT, sensor, 3, "w")
    error = errors_deg(walk, told)
    heading = walk.at(told.time_us).heading_rad
    for direction in (0.0, np.pi / 2):
        part = error[np.abs(heading - direction) < 1e-6]
        assert len(part) > 1000
        assert np.ptp(part) < 1e-3
    read = read_steps(steps, sensor, 3, "w")
    row = np.searchsorted(told.time_us, steps.time_us)
    steady = np.abs(wrap_angle(heading[row] - steps.heading_rad)) < 1e-6
    same = wrap_angle(read.heading_rad - told.heading_rad[row])[steady]
    assert same == pytest.approx(np.zeros(steady.sum()), abs=1e-5)


def test_every_system_has_both_sensors(walk, steps, carried):
    for heading in HEADING_SENSORS.values():
        assert len(fused_heading(walk, steps, carried("hand"), heading, StepSensor(), 3, "w"))
