"""PM + EKF: its ranges by hand, its track where truth is known, its filter against filterpy."""

from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter

from blesim.errors import DataError, UsageError
from blesim.estimators.base import Need
from blesim.estimators.epochs import EpochTracker
from blesim.estimators.path_loss_ekf import PathLossEkf, PathLossRanges
from blesim.ranging.path_loss_fit import PathLossFit
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings
from blesim.venue.floor_plan import FloorPlan

FROM_M, TO_M = (2.0, 3.0), (10.0, 7.0)


def errors_m(track, duration_s):
    share = track.time_us / (duration_s * 1e6)
    x_m = FROM_M[0] + share * (TO_M[0] - FROM_M[0])
    y_m = FROM_M[1] + share * (TO_M[1] - FROM_M[1])
    return np.hypot(track.x_m - x_m, track.y_m - y_m)


def in_space(office, levels=(0, 0, 0, 0, 0)):
    curve = PathLossFit(
        level_dbm=np.full(5, -50.0), exponent=np.full(5, 2.0), spread_db=np.full(5, 4.0)
    )
    return PathLossRanges(
        beacons_m=office.beacons_m,
        levels=np.array(levels),
        curve=curve,
        phone_height_m=office.phone_height_m,
        start_speed_m_s=1.0,
    )


def test_the_ranges_are_those_of_the_curve(office):
    range_m, spread_m = in_space(office).ranges(np.array([-50.0, -70.0, np.nan, -90.0, -50.0]))
    # 10^((A - RSSI) / 20), and ln(10) / 20 * 4 dB = 0.4605 of it.
    np.testing.assert_allclose(range_m, [1.0, 10.0, np.nan, 100.0, 1.0])
    np.testing.assert_allclose(spread_m, [0.4605, 4.605, np.nan, 46.05, 0.4605], rtol=1e-3)


def test_without_noise_the_track_is_off_by_the_rounding_of_rssi(office):
    track, _ = office.follow(PathLossEkf(), office.walked(FROM_M, TO_M, 12.0))
    assert len(track) == 11
    assert np.median(errors_m(track, 12.0)) < 0.3
    assert np.max(errors_m(track, 12.0)) < 0.6


def test_standing_still_it_finds_the_place_and_grows_sure(office):
    track, tracker = office.follow(PathLossEkf(), office.walked((4.0, 3.0), (4.0, 3.0), 20.0))
    # Half a dB of rounding is 6 % of a range, 0.5 m of the longest.
    assert np.hypot(track.x_m[-1] - 4.0, track.y_m[-1] - 3.0) < 0.5
    assert track.variance_x_m2[-1] < track.variance_x_m2[0]
    assert np.abs(tracker.belief.mean[2:]).max() < 0.05


def test_the_whole_tracker_equals_filterpys(office):
    readings = office.walked(FROM_M, TO_M, 12.0)
    ranges = in_space(office)
    tracker = EpochTracker(PathLossEkf().epoch_settings(), np.ones(5, bool), ranges)
    smoother = PathLossEkf().smoother_settings().start(5)
    theirs, fed = None, 0
    for end_us in range(1_000_000, 12_000_000, 1_000_000):
        now = (readings.time_us >= end_us - 1_000_000) & (readings.time_us < end_us)
        smoother.signals(readings.rows(now))
        range_m, spread_m = ranges.ranges(smoother.at(end_us))
        # The reading at the very end is of the next epoch and ends this one.
        known = int(np.searchsorted(readings.time_us, end_us, side="right"))
        tracker.advance(Observations(readings=readings.rows(slice(fed, known))))
        fed = known
        if theirs is None:
            theirs = ExtendedKalmanFilter(dim_x=4, dim_z=5)
            theirs.x, theirs.P = tracker.belief.mean.copy(), tracker.belief.covariance.copy()
            theirs.F, theirs.Q = np.eye(4) + np.eye(4, k=2), np.diag([0.0, 0.0, 0.25, 0.25])
            continue
        theirs.R = np.diag(spread_m**2)
        theirs.predict()
        theirs.update(range_m, lambda x: jacobian(office, x), lambda x: distances(office, x))
        np.testing.assert_allclose(tracker.belief.mean, theirs.x, rtol=0, atol=1e-9)
        np.testing.assert_allclose(tracker.belief.covariance, theirs.P, rtol=0, atol=1e-9)


def distances(office, state):
    phone_m = np.array([state[0], state[1], office.phone_height_m])
    return np.linalg.norm(phone_m - office.beacons_m, axis=1)


def jacobian(office, state):
    away_m = (state[:2] - office.beacons_m[:, :2]) / distances(office, state)[:, None]
    return np.hstack([away_m, np.zeros((5, 2))])


def test_the_curves_are_learned_from_the_survey(office):
    fitted = PathLossEkf().fit(office.venue, (office.survey(),))
    np.testing.assert_allclose(fitted.ranges.curve.level_dbm, -50.0, atol=0.5)
    np.testing.assert_allclose(fitted.ranges.curve.exponent, 2.0, atol=0.1)
    assert np.all(fitted.ranges.curve.spread_db < 0.5)


def test_one_beacon_alone_gives_a_place_no_farther_than_its_range(office):
    readings = office.walked((4.0, 3.0), (4.0, 3.0), 5.0, beacons=[0])
    track, _ = office.follow(PathLossEkf(), readings)
    assert len(track) == 4
    # The beacon at (1, 1) is 3.6 m away.
    assert np.all(np.hypot(track.x_m - 1.0, track.y_m - 1.0) < 4.0)
    assert np.all(track.variance_x_m2 > 1.0)


def test_after_a_long_silence_it_is_found_anew(office):
    here, there = (office.walked(place, place, 5.0) for place in ((3.0, 3.0), (9.0, 7.0)))
    later = replace(there, time_us=there.time_us + 60_000_000)
    track, _ = office.follow(PathLossEkf(), Readings.concatenate([here, later]))
    after = track.time_us >= 60_000_000
    assert track.time_us[after][0] == 61_000_000
    assert np.all(np.hypot(track.x_m[after] - 9.0, track.y_m[after] - 7.0) < 0.5)


def test_only_beacons_on_the_level_of_the_strongest_count(office):
    ranges = in_space(office, levels=[0, 0, 0, 1, 1])
    signal_dbm = np.array([-60.0, -62.0, -64.0, -55.0, np.nan])
    upstairs = ranges.found(signal_dbm)
    assert upstairs.level == 1
    np.testing.assert_allclose(upstairs.mean[:2], office.beacons_m[3, :2])
    signal_dbm[3] = -80.0
    assert ranges.updated(upstairs, upstairs, signal_dbm).level == 0


def test_levels_reach_the_track(office):
    level = office.venue.floor_plan.levels[0]
    raised = tuple(beacon.model_copy(update={"level": 1}) for beacon in office.venue.beacons)
    plan = FloorPlan(levels=(level, replace(level, level=1)))
    fitted = PathLossEkf().fit(office.venue, (office.survey(),))
    ranges = replace(fitted.ranges, levels=np.array([each.level for each in raised]))
    tracker = EpochTracker(PathLossEkf().epoch_settings(), np.ones(5, bool), ranges)
    track = tracker.advance(Observations(readings=office.walked(FROM_M, TO_M, 3.0)))
    assert set(track.level.tolist()) == {plan.levels[1].level}


def test_each_setting_changes_what_it_says(office):
    readings = office.walked(FROM_M, TO_M, 12.0)
    plain, _ = office.follow(PathLossEkf(), readings)
    for changed in (
        {"velocity_change_m_s": 0.05},
        {"start_speed_m_s": 0.1},
        {"phone_height_m": 0.5},
        {"last": 1},
        {"smoothing": "highest"},
    ):
        other, _ = office.follow(PathLossEkf(**changed), readings)
        assert other.time_us.tolist() == plain.time_us.tolist()
        assert not np.allclose(other.x_m, plain.x_m, atol=1e-3), changed
    assert len(office.follow(PathLossEkf(epoch_s=0.5), readings)[0]) == 23


def test_a_survey_is_needed():
    assert PathLossEkf().needs == {Need.SURVEY}


def test_bad_calls_are_refused(office):
    with pytest.raises(UsageError, match="call fit"):
        PathLossEkf().start(None, Draws(seed=1, purpose="test").generator())
    with pytest.raises(UsageError, match="epoch_s"):
        PathLossEkf(epoch_s=-1.0)
    with pytest.raises(UsageError, match="phone_height_m"):
        PathLossEkf(phone_height_m=1e4)
    empty = replace(office.survey(), walks=())
    with pytest.raises(DataError, match="survey"):
        PathLossEkf().fit(office.venue, (empty,))
