import math
from dataclasses import replace

import numpy as np
import pytest

from blesim.errors import UsageError
from blesim.estimators.base import Need, StartInfo
from blesim.estimators.check import check_estimator
from blesim.estimators.ekfpdr import ErrorStatePdr, predicted, process_noise, transition_of
from blesim.estimators.practice import practice_recording, practice_venue
from blesim.estimators.run import run
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings, Steps

# Beacon row 3 hangs at (14, 0.5); the place beside it is (14, 2).
START = StartInfo(x_m=10.0, y_m=2.0)
TWO_DEGREES_RAD2 = math.radians(2.0) ** 2
RAW = ErrorStatePdr(source="system", heading="raw", first_heading_deg=0.0)


def walked(*rows):
    """Step events of (length, heading), one a second."""
    length_m, heading_rad = np.array(rows, float).reshape(-1, 2).T
    time_us = np.arange(1, len(rows) + 1) * 1_000_000
    return Steps(time_us=time_us, length_m=length_m, heading_rad=heading_rad)


def heard(*rows):
    """Readings of (time in s, beacon, RSSI)."""
    time_s, beacon, rssi_dbm = np.array(rows, float).reshape(-1, 3).T
    return Readings(
        time_us=(time_s * 1e6).astype(int),
        beacon=beacon,
        rssi_dbm=rssi_dbm,
        channel=np.zeros(len(rows)),
    )


def follow(estimator, steps, readings=None, start=START, venue=None):
    fitted = estimator.fit(practice_venue() if venue is None else venue, ())
    tracker = fitted.start(start, Draws(seed=1, purpose="test").generator())
    seen = Observations(steps=steps, readings=Readings.empty() if readings is None else readings)
    return tracker.advance(seen)


def test_eq_18_transition():
    cos, sin = math.cos(0.3), math.sin(0.3)
    np.testing.assert_allclose(
        transition_of(0.7, 0.3),
        [[1, 0, cos, -0.7 * sin], [0, 1, sin, 0.7 * cos], [0, 0, 1, 0], [0, 0, 0, 1]],
    )


def test_eq_18_is_the_derivative_of_eq_24():
    # To first order, what the errors add to a step is what the transition makes of them.
    error = 1e-6 * np.array([1.0, -2.0, 3.0, -4.0])
    place_m, way_m = np.array([5.0, 6.0]), 0.7 * np.array([math.cos(0.3), math.sin(0.3)])
    added = predicted(place_m, error, 0.7, 0.3) - place_m - way_m
    np.testing.assert_allclose(added, (transition_of(0.7, 0.3) @ error)[:2], atol=1e-10)


def test_eq_24_prediction():
    place = predicted(np.array([1.0, 2.0]), np.array([0.5, -0.5, 0.1, 0.2]), 1.0, 0.3)
    expected = [1.5 + 1.1 * math.cos(0.5), 1.5 + 1.1 * math.sin(0.5)]
    np.testing.assert_allclose(place, expected)


def test_eq_21_noise():
    assert np.diag(process_noise(2.0, 1.0, 0.1)).tolist() == pytest.approx([2, 2, 1, 0.01])


def test_a_step_predicts_and_observes_its_own_prediction():
    # P_0 = diag(4, 4, 0.01, 0). A step of 1 m along x: 4 + 0.01 + 2 and 4 + 0 + 2; then, with
    # R = 10 and no innovation, P R / (P + R).
    track = follow(RAW, walked((1, 0)))
    assert (track.x_m[0], track.y_m[0]) == (11.0, 2.0)
    np.testing.assert_allclose(track.variance_x_m2, 6.01 * 10 / 16.01, rtol=1e-6)
    np.testing.assert_allclose(track.variance_y_m2, 6.0 * 10 / 16.0, rtol=1e-6)
    honest = follow(replace(RAW, predicts_itself=False), walked((1, 0)))
    np.testing.assert_allclose(honest.variance_x_m2, 6.01)
    np.testing.assert_allclose(honest.variance_y_m2, 6.0)


def test_a_fix_corrects_position_length_and_heading():
    # Before the first step P = diag(4, 4, 0.01, 0): K = 4 / 14 of the 4 m to (14, 2).
    track = follow(RAW, walked(), heard((0.5, 3, -70)))
    assert track.x_m[0] == pytest.approx(10 + 4 * 4 / 14, abs=1e-6)
    assert track.variance_x_m2[0] == pytest.approx(4 * 10 / 14, abs=1e-6)
    # After a step that did not observe itself: P_xx = 6.01, P_xs = 0.01.
    plain = replace(RAW, predicts_itself=False, errors="kept")
    track = follow(plain, walked((1, 0), (1, 0)), heard((1.5, 3, -70)))
    assert track.x_m[1] == pytest.approx(11 + 3 * 6.01 / 16.01, abs=1e-6)
    step_error_m = 3 * (0.01 + 1.0 * 0) / 16.01
    # The step that follows is longer by ds, and its own 1 m.
    assert track.x_m[2] - track.x_m[1] == pytest.approx(1 + step_error_m, abs=1e-6)


def test_length_errors_that_are_kept_lengthen_every_step_and_reset_ones_the_next():
    steps, fix = walked(*[(1, 0)] * 5), heard((2.5, 3, -70))
    plain = replace(RAW, predicts_itself=False, start_m=1.0, errors="kept")
    start = StartInfo(x_m=2.0, y_m=2.0)
    kept = np.diff(follow(plain, steps, fix, start=start).x_m[2:])
    reset = np.diff(follow(replace(plain, errors="reset"), steps, fix, start=start).x_m[2:])
    assert kept[0] > 1.1
    np.testing.assert_allclose(kept, kept[0], rtol=1e-6)
    np.testing.assert_allclose(reset, [kept[0], 1.0, 1.0], rtol=1e-6)


def test_after_a_fix_the_next_step_does_not_observe_itself():
    fixed = follow(RAW, walked((1, 0)), heard((0.5, 3, -70)))
    # P_xx = 4 * 10 / 14 after the fix, then + P_ss + Q, and no update.
    assert fixed.variance_x_m2[1] == pytest.approx(4 * 10 / 14 + 0.01 + 2.0, abs=1e-6)


def test_without_innovation_its_own_predictions_change_no_position():
    # Errors of length and heading are zero until the first fix.
    steps = walked((1, 0), (0.7, 0.3), (0.7, 0.6))
    track, honest = follow(RAW, steps), follow(replace(RAW, predicts_itself=False), steps)
    np.testing.assert_allclose(track.x_m, honest.x_m)
    assert np.all(track.variance_x_m2 < honest.variance_x_m2)


def test_a_turning_step_makes_the_heading_less_sure():
    # Of a step of 1 m across the way, after one that turned or did not: 2 + s^2 q more.
    plain = replace(RAW, predicts_itself=False, turning_deg=15.0)
    straight = follow(plain, walked((1, 0), (1, 0), (1, 0)))
    turned = follow(plain, walked((1, -1), (1, 0), (1, 0)))
    q, q_turning = TWO_DEGREES_RAD2, math.radians(15.0) ** 2
    grown = np.diff(straight.variance_y_m2)
    # P_hh before the steps: 0, q, 2 q; the variance grows by 2 + s^2 P_hh + 2 s P_yh.
    np.testing.assert_allclose(grown, [2 + q, 2 + 2 * q + 2 * q], atol=2e-6)
    # The second step turned by a radian: the third has the 15 degrees in it.
    third = turned.variance_y_m2[2] - turned.variance_y_m2[1]
    assert third == pytest.approx(2 + (q + q_turning) + 2 * q, abs=2e-6)


def test_ten_is_a_variance_unless_it_is_a_deviation():
    assert ErrorStatePdr().fix_variance_m2 == 10.0
    deviation = replace(RAW, fix_noise_is="deviation")
    assert deviation.fix_variance_m2 == 100.0
    track = follow(deviation, walked(), heard((0.5, 3, -70)))
    assert track.x_m[0] == pytest.approx(10 + 4 * 4 / 104, abs=1e-6)


def test_weak_beacons_and_those_of_other_levels_are_no_fix():
    weak = follow(RAW, walked(), heard((0.5, 3, -75)))
    assert weak.x_m.tolist() == [10.0]
    assert follow(replace(RAW, zone_dbm=-80.0), walked(), heard((0.5, 3, -75))).x_m[0] > 10.5
    upstairs = replace(START, level=1)
    assert follow(RAW, walked(), heard((0.5, 3, -60)), start=upstairs).x_m.tolist() == [10.0]


def test_fixes_come_once_a_second():
    readings = heard(*[(0.1 * k, 3, -70) for k in range(25)])
    moves = np.flatnonzero(np.diff(follow(RAW, walked(), readings).x_m, prepend=10.0))
    assert moves.tolist() == [0, 10, 20]
    often = follow(replace(RAW, fix_s=0.5), walked(), readings)
    assert np.flatnonzero(np.diff(often.x_m, prepend=10.0)).tolist() == [0, 5, 10, 15, 20]


def test_headings_are_compensated_by_the_map_unless_raw():
    steps, start = walked(*[(0.5, 0.2)] * 16), StartInfo(x_m=4.5, y_m=2.0)
    raw = follow(RAW, steps, start=start)
    mapped = follow(replace(RAW, heading="map"), steps, start=start)
    np.testing.assert_allclose(np.diff(raw.y_m), 0.5 * math.sin(0.2), atol=2e-6)
    assert np.all(np.abs(np.diff(mapped.y_m)[10:]) < 1e-3)


def test_with_fixes_it_stays_nearer_than_without():
    recording = practice_recording()
    walk = recording.by_name["there"]
    steps = walk.observations.steps
    short = replace(steps, length_m=steps.length_m * 0.3)
    walk = replace(walk, observations=replace(walk.observations, steps=short))
    marks = walk.observations.marks

    def error_m(estimator):
        track = run(estimator, recording, walk, seed=1, label="ekfpdr")
        x_m = np.interp(track.time_us, marks.time_us, marks.x_m)
        y_m = np.interp(track.time_us, marks.time_us, marks.y_m)
        return np.mean(np.hypot(track.x_m - x_m, track.y_m - y_m))

    # Steps told much too short; no beacon is as strong as -20 dBm.
    assert error_m(RAW) < error_m(replace(RAW, zone_dbm=-20.0))


def test_one_beacon_or_none_will_do():
    venue = practice_venue()
    for beacons in (venue.beacons[:1], ()):
        track = follow(RAW, walked((1, 0)), venue=venue.with_beacons(beacons))
        assert track.x_m.tolist() == [11.0]


def test_what_it_needs_and_says():
    assert ErrorStatePdr().needs == {Need.START, Need.IMU, Need.GRAPH}
    assert RAW.needs == {Need.START, Need.STEPS}
    rng = Draws(seed=1, purpose="test").generator()
    with pytest.raises(UsageError, match="call fit"):
        RAW.start(START, rng)
    with pytest.raises(UsageError, match="where the walk begins"):
        RAW.fit(practice_venue(), ()).start(None, rng)
    without = replace(practice_venue(), graph=None)
    with pytest.raises(UsageError, match="no aisle graph"):
        ErrorStatePdr().fit(without, ())
    # Without a graph the place beside a beacon is its own.
    track = follow(RAW, walked(), heard((0.5, 3, -70)), venue=without)
    assert track.y_m[0] == pytest.approx(2 - 1.5 * 4 / 14, abs=1e-6)


@pytest.mark.parametrize(
    "wrong", [{"fix_noise": 0.0}, {"heading": "none"}, {"straight_deg": -1.0}, {"errors": "lost"}]
)
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        ErrorStatePdr(**wrong)


@pytest.mark.parametrize(
    "estimator",
    [
        replace(RAW, errors="reset"),
        ErrorStatePdr(zone_dbm=None, predicts_itself=False, fix_noise_is="deviation"),
    ],
)
def test_other_settings_keep_the_contract(estimator):
    check_estimator(estimator)
