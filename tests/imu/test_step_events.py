import numpy as np
import pytest

from blesim import columns
from blesim.imu.step_events import StepSensor, read_steps
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
