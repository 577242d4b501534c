"""FP + EKF: its track where truth is known, and its whole filter against filterpy."""

from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from blesim.errors import UsageError
from blesim.estimators.base import Need
from blesim.estimators.constant_velocity import Belief
from blesim.estimators.fingerprint_ekf import FingerprintEkf
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings

FROM_M, TO_M = (2.0, 3.0), (10.0, 7.0)
# Filling takes its time, and the survey of the office has no gaps.
PLAIN = FingerprintEkf(grid_m=None)


def errors_m(track, duration_s):
    share = track.time_us / (duration_s * 1e6)
    x_m = FROM_M[0] + share * (TO_M[0] - FROM_M[0])
    y_m = FROM_M[1] + share * (TO_M[1] - FROM_M[1])
    return np.hypot(track.x_m - x_m, track.y_m - y_m)


@pytest.mark.parametrize("grid_m", [None, 0.5])
def test_without_noise_the_track_is_off_by_less_than_the_surveys_spacing(office, grid_m):
    track, _ = office.follow(FingerprintEkf(grid_m=grid_m), office.walked(FROM_M, TO_M, 12.0))
    assert len(track) == 11
    assert np.median(errors_m(track, 12.0)) < 0.5
    assert np.max(errors_m(track, 12.0)) < 1.0


@pytest.mark.parametrize("separate", [False, True])
def test_the_whole_tracker_equals_filterpys(office, separate):
    channels = (37, 38, 39)
    estimator = replace(PLAIN, separate=separate)
    readings = office.walked(FROM_M, TO_M, 12.0, channels=channels)
    recording = office.survey(channels)
    fitted = estimator.fit(office.venue, (recording,))
    tracker = fitted.start(None, Draws(seed=1, purpose="test").generator())
    smoother = estimator.smoother_settings(by_channel=separate).start(5)
    theirs, fed = None, 0
    for end_us in range(1_000_000, 12_000_000, 1_000_000):
        now = (readings.time_us >= end_us - 1_000_000) & (readings.time_us < end_us)
        smoother.signals(readings.rows(now))
        last = tracker.belief
        known = int(np.searchsorted(readings.time_us, end_us, side="right"))
        tracker.advance(Observations(readings=readings.rows(slice(fed, known))))
        fed = known
        places = fitted.maps.locate(smoother.at(end_us), last)
        count = len(places.places_m)
        assert count == (3 if separate else 1)
        if theirs is None:
            theirs = KalmanFilter(dim_x=4, dim_z=2 * count)
            theirs.x = np.append(places.places_m.mean(axis=0), [0.0, 0.0])
            theirs.P = np.diag([*[places.variance_m2.mean()] * 2, 1.0, 1.0])
            theirs.F, theirs.Q = np.eye(4) + np.eye(4, k=2), np.diag([0.0, 0.0, 0.25, 0.25])
            theirs.H = np.tile(np.eye(2, 4), (count, 1))
            theirs.R = np.diag(np.repeat(places.variance_m2, 2))
        else:
            theirs.predict()
            theirs.update(places.places_m.ravel())
        np.testing.assert_allclose(tracker.belief.mean, theirs.x, rtol=0, atol=1e-9)
        np.testing.assert_allclose(tracker.belief.covariance, theirs.P, rtol=0, atol=1e-9)


def test_the_search_follows_the_last_state(office, monkeypatch):
    seen = []
    fitted = PLAIN.fit(office.venue, (office.survey(),))
    ellipse = type(fitted.maps.settings).ellipse

    def spied(settings, last):
        seen.append(last)
        return ellipse(settings, last)

    monkeypatch.setattr(type(fitted.maps.settings), "ellipse", spied)
    tracker = fitted.start(None, Draws(seed=1, purpose="test").generator())
    tracker.advance(Observations(readings=office.walked(FROM_M, TO_M, 4.0)))
    assert seen[0] is None
    assert all(isinstance(each, Belief) for each in seen[1:])


def test_one_beacon_alone_still_gives_a_place_near_it(office):
    readings = office.walked((2.0, 2.0), (2.0, 2.0), 5.0, beacons=[0])
    track, _ = office.follow(PLAIN, readings)
    assert len(track) == 4
    assert np.all(np.hypot(track.x_m - 1.0, track.y_m - 1.0) < 3.0)


def test_readings_of_beacons_out_of_the_survey_are_skipped(office):
    recording = office.survey()
    walk = recording.walks[0]
    readings = walk.observations.readings
    heard = replace(walk.observations, readings=readings.rows(readings.beacon != 4))
    lacking = replace(recording, walks=(replace(walk, observations=heard),))
    fitted = PLAIN.fit(office.venue, (lacking,))
    way = office.walked(FROM_M, TO_M, 5.0)

    def follow(readings):
        tracker = fitted.start(None, Draws(seed=1, purpose="test").generator())
        return tracker.advance(Observations(readings=readings))

    assert follow(way) == follow(way.rows(way.beacon != 4))
    assert len(follow(way.rows(way.beacon == 4))) == 0


def test_each_setting_changes_what_it_says(office):
    readings = office.walked(FROM_M, TO_M, 12.0, channels=(37, 38, 39))
    plain, _ = office.follow(PLAIN, readings, channels=(37, 38, 39))
    for changed in (
        {"separate": True},
        {"k": 1},
        {"search_scale": 0.2},
        {"cell_m": 3.0},
        {"grid_m": 0.5},
        {"velocity_change_m_s": 0.05},
        {"start_speed_m_s": 0.1},
        {"last": 1},
    ):
        other, _ = office.follow(replace(PLAIN, **changed), readings, channels=(37, 38, 39))
        assert other.time_us.tolist() == plain.time_us.tolist()
        assert not np.allclose(other.x_m, plain.x_m, atol=1e-3), changed


def test_channels_are_needed_only_if_they_are_kept_apart():
    assert FingerprintEkf().needs == {Need.SURVEY}
    assert FingerprintEkf(separate=True).needs == {Need.SURVEY, Need.CHANNELS}


def test_no_readings_and_no_fit(office):
    assert len(office.follow(PLAIN, Readings.empty())[0]) == 0
    with pytest.raises(UsageError, match="call fit"):
        PLAIN.start(None, Draws(seed=1, purpose="test").generator())
    with pytest.raises(UsageError, match="grid_m"):
        FingerprintEkf(grid_m=0.0)
