from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

from blesim.errors import UsageError
from blesim.estimators.check import check_estimator
from blesim.estimators.practice import practice_venue
from blesim.estimators.unscented_kalman import UnscentedKalman
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings


def readings_of(time_us, x_m, y_m, which):
    """Rounded noiseless readings at a height of 1.1 m, each of one practice beacon."""
    beacons_m = practice_venue().beacon_xyz_m[which]
    places_m = np.stack([x_m, y_m, np.full(len(x_m), 1.1)], axis=1)
    rssi_dbm = -61.0 - 20.0 * np.log10(np.linalg.norm(places_m - beacons_m, axis=1))
    return Readings(
        time_us=time_us,
        beacon=which,
        rssi_dbm=np.rint(rssi_dbm).astype(int),
        channel=np.zeros(len(which)),
    )


def walk_of(rows=300):
    """Walk along y = 4 from x = 2 at 0.4 m/s, a reading every 0.1 s of one beacon after another."""
    time_us = np.arange(rows) * 100_000
    x_m = 2.0 + 0.04 * np.arange(rows)
    which = (np.arange(rows) * 3) % 8
    return readings_of(time_us, x_m, np.full(rows, 4.0), which), x_m


def follow(estimator, readings, venue=None):
    venue = practice_venue() if venue is None else venue
    fitted = estimator.fit(venue, ())
    tracker = fitted.start(None, Draws(seed=1, purpose="test").generator())
    return tracker.advance(Observations(readings=readings))


def test_without_noise_it_follows_the_walk():
    readings, x_m = walk_of()
    track = follow(UnscentedKalman(spread_db=2.0), readings)
    error_m = np.hypot(track.x_m - x_m, track.y_m - 4.0)
    assert len(track) == len(readings)
    # Rounding is 6 % of ranges of some metres, averaged over the last seconds.
    assert error_m[50:].mean() < 0.4
    spread_m = np.sqrt(track.variance_x_m2 + track.variance_y_m2)[50:].mean()
    assert error_m[50:].mean() / 3 < spread_m < 2.0


def test_it_equals_filterpy_on_the_same_readings():
    readings, _ = walk_of(60)
    settings = UnscentedKalman(confidence=1.0, alpha=0.5, velocity_change_m_s=0.4, trust=1.0)
    track = follow(settings, readings)
    begun = 2
    first = follow(settings, readings.rows(slice(begun + 1)))
    points = MerweScaledSigmaPoints(4, alpha=0.5, beta=2.0, kappa=0.0)
    beacons_m = practice_venue().beacon_xyz_m
    transition = np.eye(4) + 0.1 * np.eye(4, k=2)
    filter_ = UnscentedKalmanFilter(
        4, 1, 0.1, hx=None, fx=lambda state, _: transition @ state, points=points
    )
    filter_.x = np.array([first.x_m[-1], first.y_m[-1], 0.0, 0.0])
    place_m2 = [
        [first.variance_x_m2[-1], first.covariance_xy_m2[-1]],
        [first.covariance_xy_m2[-1], first.variance_y_m2[-1]],
    ]
    filter_.P = np.eye(4)
    filter_.P[:2, :2] = place_m2
    filter_.Q = np.diag([0.0, 0.0, 0.4**2 * 0.1, 0.4**2 * 0.1])
    filter_.R = np.array([[36.0]])
    for row in range(begun + 1, len(readings)):
        away_m = beacons_m[readings.beacon[row]]

        def expected(state, away_m=away_m):
            distance_m = np.linalg.norm([*state[:2], 1.1] - away_m)
            return np.array([-61.0 - 20.0 * np.log10(distance_m)])

        filter_.predict()
        # Ours draws the points anew from the belief after the prediction.
        filter_.sigmas_f = points.sigma_points(filter_.x, filter_.P)
        filter_.update(np.array([float(readings.rssi_dbm[row])]), hx=expected)
        # The recorded track is rounded.
        assert track.x_m[row] == pytest.approx(filter_.x[0], abs=2e-4)
        assert track.y_m[row] == pytest.approx(filter_.x[1], abs=2e-4)
        assert track.variance_x_m2[row] == pytest.approx(filter_.P[0, 0], rel=1e-3)


def test_it_begins_with_laterations_until_three_beacons_are_heard():
    readings = readings_of(np.array([0, 100, 200]), np.full(3, 5.0), np.full(3, 4.0), [0, 4, 1])
    track = follow(UnscentedKalman(), readings)
    # One beacon: its own place; three not on a line: the fix.
    assert (track.x_m[0], track.y_m[0]) == (2.0, 0.5)
    assert np.hypot(track.x_m[2] - 5.0, track.y_m[2] - 4.0) < 0.5


def test_one_beacon_alone_says_how_little_it_knows():
    count = 100
    readings = readings_of(
        np.arange(count) * 100_000, np.full(count, 2.0), np.full(count, 4.5), np.zeros(count, int)
    )
    track = follow(UnscentedKalman(), readings)
    assert np.all(np.isfinite(track.x_m))
    assert track.variance_x_m2[-1] > 4.0


def test_a_long_silence_and_another_setting_of_it():
    readings, _ = walk_of(100)
    late = readings_of(np.array([30_000_000]), np.array([14.0]), np.array([7.0]), [7])
    readings = Readings.concatenate([readings, late])
    anew = follow(UnscentedKalman(), readings)
    assert (anew.x_m[-1], anew.y_m[-1]) == (14.0, 7.5)
    kept = follow(UnscentedKalman(silence_s=60.0), readings)
    assert kept.y_m[-1] != 7.5


def test_the_gate_keeps_outliers_out():
    readings, x_m = walk_of()
    wild_dbm = readings.rssi_dbm.astype(int).copy()
    wild_dbm[100::20] = -30
    wild = replace(readings, rssi_dbm=wild_dbm)
    errors_m = [
        np.hypot(track.x_m - x_m, track.y_m - 4.0)[100:].mean()
        for track in (
            follow(UnscentedKalman(spread_db=2.0, confidence=confidence, trust=1.0), wild)
            for confidence in (0.999, 1.0)
        )
    ]
    assert errors_m[0] < 0.5 * errors_m[1]


def test_the_position_stays_inside_the_level():
    readings, _ = walk_of()
    loud = replace(readings, rssi_dbm=np.full(len(readings), -100), beacon=np.zeros(300, int))
    track = follow(UnscentedKalman(velocity_change_m_s=5.0, confidence=1.0), loud)
    assert np.all((track.x_m >= 0) & (track.x_m <= 16))
    assert np.all((track.y_m >= 0) & (track.y_m <= 8))


def test_a_wider_curve_and_less_trust_leave_more_variance():
    readings, _ = walk_of()
    sure, wide, doubting = (
        follow(settings, readings).variance_x_m2[100:].mean()
        for settings in (
            UnscentedKalman(spread_db=3.0, trust=1.0),
            UnscentedKalman(spread_db=6.0, trust=1.0),
            UnscentedKalman(spread_db=3.0, trust=0.25),
        )
    )
    assert wide > 1.5 * sure
    # Half the spread with a quarter of the trust is the same variance, but for the first fix.
    assert doubting == pytest.approx(wide, rel=0.1)


def test_strange_beacons_are_skipped_and_nothing_heard_is_no_track():
    readings, _ = walk_of(40)
    strange = replace(readings, beacon=readings.beacon + 4)
    assert len(follow(UnscentedKalman(), strange)) == np.count_nonzero(strange.beacon < 8)
    assert len(follow(UnscentedKalman(), Readings.empty())) == 0


@pytest.mark.parametrize("wrong", [{"alpha": 0.0}, {"trust": 2.0}, {"confidence": 0.0}])
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        UnscentedKalman(**wrong)


def test_it_asks_to_be_fitted():
    with pytest.raises(UsageError, match="call fit"):
        UnscentedKalman().start(None, Draws(seed=1, purpose="test").generator())


def test_other_settings_keep_the_contract():
    check_estimator(UnscentedKalman(alpha=1.0, confidence=1.0, curves="all", silence_s=0.2))
