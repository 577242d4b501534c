"""Channel-separate EKF: its ranges by hand, its switches, its track where truth is known."""

from dataclasses import replace

import numpy as np
import pytest

from blesim.errors import UsageError
from blesim.estimators.base import Need
from blesim.estimators.channel_ekf import ChannelEkf
from blesim.estimators.constant_velocity import at_rest
from blesim.estimators.fingerprint_maps import Places
from blesim.rng import Draws

CHANNELS = (37, 38, 39)
FROM_M, TO_M = (2.0, 3.0), (10.0, 7.0)
# Filling takes its time, and the survey of the office has no gaps.
PLAIN = ChannelEkf(grid_m=None)


@pytest.fixture(scope="module")
def fitted(office):
    return PLAIN.fit(office.venue, (office.survey(CHANNELS),))


def errors_m(track, duration_s):
    share = track.time_us / (duration_s * 1e6)
    x_m = FROM_M[0] + share * (TO_M[0] - FROM_M[0])
    y_m = FROM_M[1] + share * (TO_M[1] - FROM_M[1])
    return np.hypot(track.x_m - x_m, track.y_m - y_m)


def signal_at(office, x_m, y_m, slots=(1, 2, 3)):
    """Smoothed RSSI (5, 4) of somebody who stands still."""
    signal_dbm = np.full((5, 4), np.nan)
    for slot in slots:
        place = np.full(5, x_m), np.full(5, y_m)
        channel = np.full(5, CHANNELS[slot - 1])
        signal_dbm[:, slot] = office.heard(np.zeros(5, int), *place, np.arange(5), channel).rssi_dbm
    return signal_dbm


def test_without_noise_the_track_is_off_by_less_than_the_surveys_spacing(office):
    readings = office.walked(FROM_M, TO_M, 12.0, channels=CHANNELS)
    for estimator in (PLAIN, replace(PLAIN, separate=False), ChannelEkf(grid_m=0.5)):
        # A mean of more readings would lag behind.
        track, _ = office.follow(replace(estimator, last=1), readings, channels=CHANNELS)
        assert len(track) == 11
        assert np.median(errors_m(track, 12.0)) < 0.6
        assert np.max(errors_m(track, 12.0)) < 1.2


def test_six_distances_make_the_range_of_a_beacon(office, fitted):
    signal_dbm = signal_at(office, 5.0, 3.0)
    places = Places(
        places_m=np.array([[5.0, 3.0], [4.0, 3.0], [5.0, 4.0]]),
        variance_m2=np.array([1.0, 2.0, 3.0]),
        level=0,
    )
    range_m, variance_m2 = fitted.ranges.ranges(signal_dbm, places)
    # Of the first beacon, at (1, 1), a metre above the phone.
    by_places = [np.sqrt(16 + 4 + 1), np.sqrt(9 + 4 + 1), np.sqrt(16 + 9 + 1)]
    curves = fitted.ranges.curves
    by_curves = [curves[c].distance_m(signal_dbm[:, c + 1])[0] for c in range(3)]
    six = np.array([*by_curves, *by_places])
    kept = np.abs(six - six.mean()) <= six.std(ddof=1)
    assert 0 < kept.sum() < 6
    assert range_m[0] == pytest.approx(six[kept].mean())
    spreads_m2 = np.array([*(curve.spread_m[0] ** 2 for curve in curves), 1.0, 2.0, 3.0])
    assert variance_m2[0] == pytest.approx(spreads_m2[kept].mean())


def test_polynomials_are_those_of_numpy_by_channel(office, fitted):
    survey = office.survey(CHANNELS).walks[0].observations
    readings, marks = survey.readings, survey.marks
    at = np.searchsorted(marks.time_us, readings.time_us, side="right") - 1
    apart_m = (
        np.stack([marks.x_m[at], marks.y_m[at]], axis=1) - office.beacons_m[readings.beacon, :2]
    )
    distance_m = np.hypot(np.hypot(*apart_m.T), 1.0)
    own = (readings.beacon == 2) & (readings.channel == 38)
    rssi_dbm = readings.rssi_dbm[own].astype(float)
    theirs = np.polynomial.Polynomial.fit(rssi_dbm, distance_m[own], 2)
    weaker_dbm = np.array([-55.0, -60.0, -68.0])
    # The curve of channel 38 of the third beacon.
    curve = fitted.ranges.curves[1]
    ours = [curve.distance_m(np.full(5, each))[2] for each in weaker_dbm]
    np.testing.assert_allclose(ours, theirs(weaker_dbm), atol=1e-6)


def test_a_beacon_that_is_not_heard_has_no_range(office, fitted):
    signal_dbm = signal_at(office, 5.0, 3.0, slots=(2,))
    signal_dbm[1] = np.nan
    places = fitted.ranges.maps.locate(signal_dbm, None)
    range_m, _ = fitted.ranges.ranges(signal_dbm, places)
    assert np.flatnonzero(np.isnan(range_m)).tolist() == [1]
    # One channel: its polynomial and its place alone.
    assert places.places_m.shape == (1, 2)


def test_outlier_detection_1_keeps_a_wild_distance_out(office, fitted):
    signal_dbm = signal_at(office, 5.0, 3.0)
    places = fitted.ranges.maps.locate(signal_dbm, None)
    honest, _ = fitted.ranges.ranges(signal_dbm, places)
    signal_dbm[0, 1] = -90.0
    guarded, _ = fitted.ranges.ranges(signal_dbm, places)
    open_ranges = replace(fitted.ranges, estimator=replace(PLAIN, outliers_1=False))
    unguarded, _ = open_ranges.ranges(signal_dbm, places)
    assert abs(guarded[0] - honest[0]) < 0.5
    assert unguarded[0] - honest[0] > 0.8


def test_outlier_detection_2_keeps_a_wild_range_out(office, fitted):
    signal_dbm = signal_at(office, 5.0, 3.0)
    here = at_rest(np.array([5.0, 3.0]), 0.25 * np.eye(2), 0.5, 0)
    # The beacon in the middle, 3 m away, sounds as if it were far away on all channels.
    signal_dbm[4, 1:] = -85.0

    def moved_m(**switches):
        ranges = replace(fitted.ranges, estimator=replace(PLAIN, outliers_1=False, **switches))
        after = ranges.updated(here, here, signal_dbm)
        return np.hypot(*(after.mean[:2] - here.mean[:2]))

    assert moved_m(outliers_2=True) < moved_m(outliers_2=False)
    assert moved_m(outliers_2=True, confidence=1.0) == moved_m(outliers_2=False)


def test_each_setting_changes_what_it_says(office):
    readings = office.walked(FROM_M, TO_M, 12.0, channels=CHANNELS)
    # Some noise, and a beacon that falls almost silent half way, so that there are outliers.
    rng = np.random.default_rng(1)
    rough_dbm = readings.rssi_dbm + np.rint(rng.normal(0, 3, len(readings))).astype(int)
    rough_dbm[(readings.beacon == 4) & (readings.time_us > 5_000_000)] = -90
    readings = replace(readings, rssi_dbm=rough_dbm)
    plain, _ = office.follow(PLAIN, readings, channels=CHANNELS)
    for changed in (
        {"separate": False},
        {"degree": 1},
        {"outliers_1": False},
        {"outliers_2": False},
        {"confidence": 0.5},
        {"k": 1},
        {"search_scale": 0.2},
        {"cell_m": 3.0},
        {"grid_m": 0.5},
        {"phone_height_m": 0.5},
        {"velocity_change_m_s": 0.05},
        {"start_speed_m_s": 0.1},
        {"last": 1},
    ):
        other, _ = office.follow(replace(PLAIN, **changed), readings, channels=CHANNELS)
        assert other.time_us.tolist() == plain.time_us.tolist()
        assert not np.allclose(other.x_m, plain.x_m, atol=1e-4), changed


def test_the_aggregate_mode_does_not_look_at_channels(office):
    readings = office.walked(FROM_M, TO_M, 5.0, channels=CHANNELS)
    aggregate = replace(PLAIN, separate=False)
    untold = replace(readings, channel=np.zeros(len(readings), np.uint8))
    told, _ = office.follow(aggregate, readings, channels=CHANNELS)
    assert told == office.follow(aggregate, untold, channels=CHANNELS)[0]


def test_one_beacon_and_one_channel_give_a_track(office):
    readings = office.walked((2.0, 2.0), (2.0, 2.0), 5.0, channels=(38,), beacons=[0])
    track, _ = office.follow(PLAIN, readings, channels=CHANNELS)
    assert len(track) == 4
    assert np.all(np.hypot(track.x_m - 1.0, track.y_m - 1.0) < 4.0)


def test_channels_are_needed_only_if_they_are_kept_apart():
    assert ChannelEkf().needs == {Need.SURVEY, Need.CHANNELS}
    assert ChannelEkf(separate=False).needs == {Need.SURVEY}


@pytest.mark.parametrize(
    ("name", "value"),
    [("degree", 10), ("confidence", 0.0), ("k", 0), ("phone_height_m", -1.0), ("epoch_s", 0.0)],
)
def test_bad_settings_are_refused(name, value):
    with pytest.raises(UsageError, match=name):
        ChannelEkf(**{name: value})


def test_it_asks_to_be_fitted():
    with pytest.raises(UsageError, match="call fit"):
        ChannelEkf().start(None, Draws(seed=1, purpose="test").generator())
