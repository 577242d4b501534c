import math
from dataclasses import replace

import numpy as np
import pytest

from blesim.errors import UsageError
from blesim.estimators.base import Need, StartInfo
from blesim.estimators.check import check_estimator
from blesim.estimators.heading_pdr import CompensatedHeadingPdr, RawHeadingPdr
from blesim.estimators.practice import practice_recording, practice_venue
from blesim.estimators.run import run
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings, Steps

RECORDING = practice_recording()
START = StartInfo(x_m=2.0, y_m=2.0)


def walked(*rows):
    """Step events of (length, heading), one a second."""
    length_m, heading_rad = np.array(rows, float).T
    time_us = np.arange(1, len(rows) + 1) * 1_000_000
    return Steps(time_us=time_us, length_m=length_m, heading_rad=heading_rad)


def heard(*times_us):
    count = len(times_us)
    return Readings(
        time_us=np.array(times_us),
        beacon=np.zeros(count),
        rssi_dbm=np.full(count, -70),
        channel=np.zeros(count),
    )


def follow(estimator, steps, readings=None, start=START, venue=None):
    fitted = estimator.fit(practice_venue() if venue is None else venue, ())
    tracker = fitted.start(start, Draws(seed=1, purpose="test").generator())
    seen = Observations(steps=steps, readings=Readings.empty() if readings is None else readings)
    return tracker.advance(seen)


def test_eq_1_step_by_step():
    # Azimuth alpha = pi / 2 - heading: X += SL sin alpha, Y += SL cos alpha.
    track = follow(RawHeadingPdr(source="system"), walked((1, 0), (2, math.pi / 2), (2, math.pi)))
    np.testing.assert_allclose(track.x_m, [3, 3, 1], atol=1e-6)
    np.testing.assert_allclose(track.y_m, [2, 4, 4], atol=1e-6)


def test_the_position_is_told_after_every_step_and_every_reading():
    readings = heard(0, 1_000_000, 1_500_000)
    track = follow(RawHeadingPdr(source="system"), walked((1, 0), (1, 0)), readings)
    # At one moment the step comes first.
    assert track.time_us.tolist() == [0, 1_000_000, 1_000_000, 1_500_000, 2_000_000]
    np.testing.assert_allclose(track.x_m, [2, 3, 3, 3, 4])


def test_the_covariance_is_that_of_start_and_steps():
    plain = RawHeadingPdr(source="system", start_m=1.0, length_scale=0.0, heading_bias_deg=0.0)
    track = follow(plain, walked((2, 0)), heard(0))
    # One step of 2 m: a tenth of its length along, 0.1 rad of it across.
    np.testing.assert_allclose(track.variance_x_m2, [1.0, 1.04])
    np.testing.assert_allclose(track.variance_y_m2, [1.0, 1.04])
    biased = replace(plain, length_scale=0.5, heading_bias_deg=math.degrees(1.0))
    track = follow(biased, walked((2, 0)))
    np.testing.assert_allclose(track.variance_x_m2, 1.04 + 0.25 * 4)
    np.testing.assert_allclose(track.variance_y_m2, 1.04 + 4, rtol=1e-6)


def test_a_constant_compass_error_is_compensated_after_ten_steps():
    # Along aisle 1, y = 2, the system tells 0.2 rad to the left.
    steps = walked(*[(0.5, 0.2)] * 16)
    start = StartInfo(x_m=4.5, y_m=2.0)
    raw = follow(RawHeadingPdr(source="system"), steps, start=start)
    corrected = follow(CompensatedHeadingPdr(source="system"), steps, start=start)
    np.testing.assert_allclose(raw.y_m - 2, 0.5 * math.sin(0.2) * np.arange(1, 17), atol=1e-6)
    np.testing.assert_allclose(corrected.y_m[:10], raw.y_m[:10])
    # Least squares over ten steps with the prior of 3000 deg2 leave 25 / 30000 of the error.
    np.testing.assert_allclose(np.diff(corrected.y_m[9:]), 0.5 * 0.2 / 1200, rtol=0.01)


def test_fewer_training_steps_correct_earlier():
    steps = walked(*[(0.5, 0.2)] * 6)
    quick = CompensatedHeadingPdr(source="system", training_steps=2)
    track = follow(quick, steps, start=StartInfo(x_m=4.5, y_m=2.0))
    assert np.all(np.diff(track.y_m)[:1] > 0.09)
    assert np.all(np.diff(track.y_m)[1:] < 0.01)


@pytest.mark.parametrize(
    "blind",
    [{"junction_m": 20.0}, {"reach_m": 0.0, "agree_deg": 5.0}, {"agree_deg": 5.0}],
    ids=["all non-linear", "out of reach", "no aisle agrees"],
)
def test_without_a_known_way_nothing_is_compensated(blind):
    steps, start = walked(*[(0.5, 0.2)] * 16), StartInfo(x_m=4.5, y_m=2.3)
    raw = follow(RawHeadingPdr(source="system"), steps, start=start)
    corrected = follow(CompensatedHeadingPdr(source="system", **blind), steps, start=start)
    np.testing.assert_allclose(corrected.y_m, raw.y_m, atol=1e-6)


def test_steps_told_without_error_lead_to_where_the_walker_went():
    walk = RECORDING.by_name["there"]
    track = run(RawHeadingPdr(source="system"), RECORDING, walk, seed=1, label="ohpdr")
    # 53 steps of 0.6 m along the sides; each corner is cut by less than a step.
    marks = walk.observations.marks
    x_m = np.interp(track.time_us, marks.time_us, marks.x_m)
    y_m = np.interp(track.time_us, marks.time_us, marks.y_m)
    assert np.max(np.hypot(track.x_m - x_m, track.y_m - y_m)) < 3 * 0.6


@pytest.mark.parametrize("estimator", [RawHeadingPdr(), CompensatedHeadingPdr()])
def test_with_the_imu_too_with_lengths_of_the_survey(estimator):
    walk = RECORDING.by_name["there"]
    track = run(estimator, RECORDING, walk, seed=1, label="pdr")
    marks = walk.observations.marks
    x_m = np.interp(track.time_us, marks.time_us, marks.x_m)
    y_m = np.interp(track.time_us, marks.time_us, marks.y_m)
    assert np.max(np.hypot(track.x_m - x_m, track.y_m - y_m)) < 2.0


def test_on_a_level_without_aisles_it_goes_on_as_measured():
    start = StartInfo(x_m=2.0, y_m=2.0, level=3)
    steps = walked(*[(0.5, 0.2)] * 12)
    raw = follow(RawHeadingPdr(source="system"), steps, start=start)
    compensated = follow(CompensatedHeadingPdr(source="system"), steps, start=start)
    assert compensated.x_m.tolist() == raw.x_m.tolist()
    assert compensated.y_m.tolist() == raw.y_m.tolist()
    assert set(raw.level.tolist()) == {3}


def test_what_they_need():
    assert RawHeadingPdr().needs == {Need.START, Need.IMU}
    assert RawHeadingPdr(source="system").needs == {Need.START, Need.STEPS}
    assert CompensatedHeadingPdr().needs == {Need.START, Need.IMU, Need.GRAPH}


def test_they_say_what_is_missing():
    rng = Draws(seed=1, purpose="test").generator()
    for estimator in (RawHeadingPdr(), CompensatedHeadingPdr()):
        with pytest.raises(UsageError, match="call fit"):
            estimator.start(START, rng)
        with pytest.raises(UsageError, match="where the walk begins"):
            estimator.fit(practice_venue(), ()).start(None, rng)
    with pytest.raises(UsageError, match="no aisle graph"):
        CompensatedHeadingPdr().fit(replace(practice_venue(), graph=None), ())
    gyroscope = RawHeadingPdr(compass_weight=0.0).fit(practice_venue(), ())
    with pytest.raises(UsageError, match="start_heading"):
        gyroscope.start(START, rng)


def test_the_gyroscope_alone_starts_from_the_heading_of_the_start():
    walk = RECORDING.by_name["there"]
    fitted = RawHeadingPdr(compass_weight=0.0).fit(practice_venue(), ())
    start = StartInfo(x_m=2.0, y_m=2.0, heading_rad=math.pi / 2)
    tracker = fitted.start(start, Draws(seed=1, purpose="test").generator())
    imu = walk.observations.imu
    track = tracker.advance(Observations(imu=imu.rows(imu.time_us < 8_000_000)))
    # It walks east, but was told that it looks north, and does not turn.
    np.testing.assert_allclose(track.x_m, 2.0, atol=1e-6)
    assert track.y_m[-1] > 5.0


@pytest.mark.parametrize(
    "wrong",
    [{"source": "gps"}, {"start_m": -1.0}, {"heading_bias_deg": 200.0}, {"interval_s": math.nan}],
)
def test_bad_settings_are_refused(wrong):
    for cls in (RawHeadingPdr, CompensatedHeadingPdr):
        with pytest.raises(UsageError, match=next(iter(wrong))):
            cls(**wrong)


@pytest.mark.parametrize(
    "estimator",
    [
        RawHeadingPdr(source="system", system_heading="stream"),
        CompensatedHeadingPdr(source="system", training_steps=3, junction_m=1.0),
        CompensatedHeadingPdr(compass_weight=1.0, turning_deg=30.0, offset_deg=5.0),
    ],
)
def test_other_settings_keep_the_contract(estimator):
    check_estimator(estimator)
