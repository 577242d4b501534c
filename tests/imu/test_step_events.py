import numpy as np
import pytest
from scipy.stats import binom

from blesim import columns
from blesim.imu.step_events import STEP_SENSORS, StepSensor, read_steps
from blesim.tables import Steps, StepTruth
from blesim.units import wrap_angle


def walked(stretches: int, steps_each: int) -> StepTruth:
    count = stretches * steps_each
    return StepTruth(
        time_us=np.arange(count) * 600_000,
        length_m=np.full(count, 0.6),
        heading_rad=np.repeat(np.where(np.arange(stretches) % 2, 1.5, -3.0), steps_each),
        foot=np.arange(count) % 2,
    )


def heading_errors_deg(truth: StepTruth, read: Steps) -> np.ndarray:
    return np.degrees(wrap_angle(read.heading_rad - truth.heading_rad))


def test_heading_error_is_a_bias_per_stretch():
    truth = walked(2000, 10)
    read = read_steps(truth, StepSensor(), 3, "w")
    errors = heading_errors_deg(truth, read).reshape(2000, 10)
    # Between stretches sqrt(12^2 + 5.8^2 / 10), within 5.8 degrees; standard errors below 2 %.
    assert errors.mean(axis=1).std() == pytest.approx(np.hypot(12, 5.8 / np.sqrt(10)), rel=0.08)
    assert errors.std(axis=1, ddof=1).mean() == pytest.approx(5.8, rel=0.08)


def test_length_is_read_with_a_scale_of_the_walker_and_noise():
    truth = walked(1, 20000)
    read = read_steps(truth, StepSensor(length_scale_std=0.05, length_std_m=0.03), 3, "w")
    assert read.length_m.std() == pytest.approx(0.03, rel=0.05)
    scales = [
        read_steps(walked(1, 1), StepSensor(length_std_m=0.0), seed, "w").length_m[0] / 0.6
        for seed in range(500)
    ]
    assert np.std(scales) == pytest.approx(0.05, rel=0.15)


def test_a_perfect_sensor_reads_the_truth():
    truth = walked(3, 7)
    perfect = StepSensor(
        length_scale_std=0, length_std_m=0, stretch_heading_std_deg=0, step_heading_std_deg=0
    )
    read = read_steps(truth, perfect, 3, "w")
    assert np.array_equal(read.time_us, truth.time_us)
    assert np.array_equal(read.length_m, truth.length_m)
    assert read.heading_rad == pytest.approx(truth.heading_rad, abs=2e-6)


def test_no_reading_is_beyond_what_a_recording_holds():
    truth = walked(1, 5000)
    long_steps = StepTruth(
        time_us=truth.time_us,
        length_m=np.full(len(truth), 2.9),
        heading_rad=truth.heading_rad,
        foot=truth.foot,
    )
    read = read_steps(long_steps, StepSensor(length_std_m=0.3), 3, "w")
    (column,) = (column for column in columns.STEPS.columns if column.name == "length")
    assert read.length_m.max() == column.valid_range[1]


def test_no_steps_give_no_events():
    assert read_steps(StepTruth.empty(), StepSensor(), 3, "w") == Steps.empty()


def _perfect(**settings) -> StepSensor:
    return StepSensor(
        length_scale_std=0,
        length_std_m=0,
        stretch_heading_std_deg=0,
        step_heading_std_deg=0,
        **settings,
    )


def test_steps_are_missed_as_often_as_configured():
    truth = walked(1, 20_000)
    read = read_steps(truth, _perfect(missed=0.05), 3, "w")
    # Wrong once in a million runs.
    low, high = binom.ppf([5e-7, 1 - 5e-7], 20_000, 0.95)
    assert low <= len(read) <= high
    assert np.all(np.isin(read.time_us, truth.time_us))


def test_steps_are_told_late_and_in_order():
    truth = walked(1, 10_000)
    read = read_steps(truth, _perfect(delay_s=0.6, delay_std_s=0.1), 3, "w")
    late_s = (read.time_us - truth.time_us) * 1e-6
    # 10 000 delays: the mean is good to a millisecond, the spread to 0.7 per cent.
    assert late_s.mean() == pytest.approx(0.6, abs=0.005)
    assert late_s.std() == pytest.approx(0.1, rel=0.04)
    assert late_s.min() >= 0.0


def test_batches_come_at_regular_times():
    read = read_steps(walked(1, 500), _perfect(batch_s=2.5), 3, "w")
    assert len(read) == 500
    assert np.all(read.time_us % 2_500_000 == 0)


def test_what_is_told_after_the_walk_is_lost():
    truth = walked(1, 100)
    end_us = int(truth.time_us[-1])
    read = read_steps(truth, _perfect(delay_s=2.0), 3, "w", until_us=end_us)
    assert len(read) == 96
    assert read.time_us[-1] <= end_us


def test_in_a_trolley_no_step_is_felt(carried):
    truth = walked(1, 100)
    how = carried((0, "hand"), (30, "trolley"), (45, "hand"))
    read = read_steps(truth, _perfect(), 3, "w", carrying=how)
    rolling = (truth.time_us >= 30_000_000) & (truth.time_us < 45_000_000)
    assert rolling.sum() == 25
    assert np.array_equal(read.time_us, truth.time_us[~rolling])


def test_handling_the_phone_looks_like_steps(carried):
    truth = walked(1, 3000)
    modes = [(1.5 * number, "hand" if number % 2 else "pocket") for number in range(1001)]
    read = read_steps(truth, _perfect(extra_steps=0.5), 3, "w", carrying=carried(*modes))
    # A binomial count of 1000 at one half: within five spreads of 16.
    assert len(read) - len(truth) == pytest.approx(500, abs=80)
    assert np.all(np.diff(read.time_us) >= 0)


@pytest.mark.parametrize("name", sorted(STEP_SENSORS))
def test_systems_tell_most_steps_within_what_they_promise(name, carried):
    truth = walked(4, 500)
    read = read_steps(truth, STEP_SENSORS[name], 3, "w", carrying=carried("hand"))
    assert len(read) == pytest.approx(len(truth), rel=0.04)
    assert np.all(np.diff(read.time_us) >= 0)
