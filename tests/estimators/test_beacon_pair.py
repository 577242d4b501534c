from dataclasses import replace

import numpy as np
import pytest

from blesim.columns import NO_EDGE
from blesim.errors import DataError, UsageError
from blesim.estimators.base import Need
from blesim.estimators.beacon_pair import BeaconPair
from blesim.estimators.practice import practice_recording, practice_venue
from blesim.estimators.run import surveys_of
from blesim.recording import Observations
from blesim.tables import Readings
from blesim.venue.floor_plan import FloorPlan

# Not smoothed, so that each row shows one place.
PLAIN = BeaconPair(output_rate=1.0)


def readings_of(*rows):
    time_us, beacon, rssi_dbm = np.array(rows).T
    return Readings(time_us=time_us, beacon=beacon, rssi_dbm=rssi_dbm, channel=np.zeros(len(rows)))


def follow(estimator, readings, venue=None):
    fitted = estimator.fit(practice_venue() if venue is None else venue, ())
    tracker = fitted.start(None, np.random.default_rng(1))
    return tracker.advance(Observations(readings=readings))


def test_the_place_divides_the_way_as_the_ranges_do():
    # Eq 5 with s_0 = -61, n = 1: -71 dBm is 10 m; -64 and -68 dBm are 10^0.3 and 10^0.7 m.
    # Beacons 0 and 1 hang beside (2, 2) and (6, 2). Eq 6: 2 + 4 * 1.995 / (1.995 + 5.012).
    track = follow(PLAIN, readings_of((0, 0, -64), (100, 1, -68)))
    assert track.x_m[-1] == pytest.approx(2 + 4 * 1.9952623 / (1.9952623 + 5.0118723), abs=1e-6)
    assert track.y_m[-1] == 2.0
    # n = 2: 10^0.15 and 10^0.35 m.
    track = follow(replace(PLAIN, exponent=2.0), readings_of((0, 0, -64), (100, 1, -68)))
    assert track.x_m[-1] == pytest.approx(2 + 4 * 1.4125375 / (1.4125375 + 2.2387211), abs=1e-6)


def test_each_beacon_announces_its_own_level():
    # Beacon 1 sends 4 dB weaker: both are 10^0.3 m away, half way.
    venue = practice_venue()
    weak = venue.beacons[1].model_copy(update={"measured_power_dbm": -65.0})
    venue = venue.with_beacons((venue.beacons[0], weak, *venue.beacons[2:]))
    track = follow(PLAIN, readings_of((0, 0, -64), (100, 1, -68)), venue)
    assert track.x_m[-1] == pytest.approx(4.0)


def test_the_second_is_the_next_strongest_on_the_same_branch():
    # Beacon 4 (-65) is across in the other aisle, so beacon 3 at x = 14 is the second: half way.
    track = follow(PLAIN, readings_of((0, 4, -65), (1, 3, -64), (2, 1, -90), (3, 0, -64)))
    assert (track.x_m[-1], track.y_m[-1]) == (8.0, 2.0)


def test_without_a_second_it_is_beside_the_first():
    track = follow(PLAIN, readings_of((0, 1, -70), (1, 6, -60)))
    assert list(zip(track.x_m, track.y_m, strict=True)) == [(6, 2), (10, 6)]
    # As for the nearest beacon: 4^2 / 12.
    np.testing.assert_allclose(track.variance_x_m2, 16 / 12, atol=1e-6)


def test_ties_are_averaged():
    # Strongest are 1 at (6, 2) and 6 at (10, 6), each alone in its aisle.
    track = follow(PLAIN, readings_of((0, 1, -60), (1, 6, -60)))
    assert (track.x_m[-1], track.y_m[-1]) == (8.0, 4.0)
    # Parts 2 m off the mean on either axis, along the diagonal.
    assert track.variance_x_m2[-1] == pytest.approx(16 / 12 + 4.0, abs=1e-6)
    assert track.covariance_xy_m2[-1] == pytest.approx(4.0)
    # On one branch, each is the other's second: half way, twice.
    assert follow(PLAIN, readings_of((0, 0, -60), (1, 2, -60))).x_m[-1] == 6.0


def test_of_equal_seconds_the_nearest_is_taken():
    track = follow(PLAIN, readings_of((0, 3, -70), (1, 1, -70), (2, 0, -70), (3, 2, -60)))
    # From x = 10 towards beacon 1 at 6 or 3 at 14: both 4 m, the first row; never 0 at x = 2.
    share = 1 / (1 + 10.0**1.0)
    assert track.x_m[-1] == pytest.approx(10 - 4 * share, abs=1e-6)


def test_the_variance_is_that_of_anywhere_between():
    track = follow(PLAIN, readings_of((0, 0, -60), (1, 1, -60)))
    assert track.variance_x_m2[-1] == pytest.approx(16 / 12 + 0.25, abs=1e-6)
    assert (track.variance_y_m2[-1], track.covariance_xy_m2[-1]) == (0.25, 0.0)


def test_the_output_is_smoothed():
    # Places 2, 14, 14 with alpha_p = 0.5: 2, 8, 11; each 3.1 s window holds the last alone.
    rows = ((0, 0, -60), (3_000_000, 3, -60), (6_000_000, 3, -60))
    track = follow(BeaconPair(), readings_of(*rows))
    assert track.x_m.tolist() == [2.0, 8.0, 11.0]
    assert follow(BeaconPair(output_rate=0.25), readings_of(*rows)).x_m.tolist() == [2, 5, 7.25]


def test_smoothing_begins_anew_after_a_silence():
    rows = ((0, 0, -60), (3_000_001, 3, -60))
    assert follow(BeaconPair(), readings_of(*rows)).x_m.tolist() == [2.0, 14.0]


def test_the_signal_value_is_a_setting():
    rows = ((0, 0, -60), (1, 0, -70), (2, 1, -66))
    # Averaged with 0.75: -67.5, so beacon 1 leads; highest: -60.
    assert follow(PLAIN, readings_of(*rows)).x_m[-1] > 4.0
    assert follow(replace(PLAIN, signal="highest"), readings_of(*rows)).x_m[-1] < 4.0


def test_a_level_without_aisles_uses_the_beacon_itself():
    venue = practice_venue()
    upper = replace(venue.floor_plan.levels[0], level=1)
    upstairs = venue.beacons[0].model_copy(update={"level": 1})
    venue = replace(
        venue,
        floor_plan=FloorPlan(levels=(venue.floor_plan.levels[0], upper)),
        beacons=(upstairs, *venue.beacons[1:]),
    )
    track = follow(BeaconPair(), readings_of((0, 0, -60), (10, 1, -50)), venue)
    assert track.level.tolist() == [1, 0]
    assert (track.x_m[0], track.y_m[0], track.edge[0]) == (2.0, 0.5, NO_EDGE)
    # Another level: not smoothed with what was below.
    assert (track.x_m[1], track.y_m[1]) == (6.0, 2.0)


def test_the_survey_gives_the_curve():
    recording = practice_recording()
    estimator = BeaconPair(curve="survey")
    assert estimator.needs == {Need.GRAPH, Need.SURVEY}
    fitted = estimator.fit(recording.venue, surveys_of(recording))
    # The practice recording is made with -61 dBm at one metre and exponent 2.
    assert fitted.curves.exponents[0] == pytest.approx(2.0, abs=0.3)
    np.testing.assert_allclose(fitted.curves.level_dbm, -61.0, atol=3.0)
    with pytest.raises(DataError, match="survey"):
        estimator.fit(recording.venue, ())


def test_it_is_between_the_beacons_on_a_walk_without_noise():
    # Along the first aisle, readings after Eq 1 of all four beacons, rounded to 1 dB.
    venue, time_us = practice_venue(), np.arange(2000) * 5000
    x_m = np.interp(time_us * 1e-6, [0, 10], [3, 13])
    beacon = np.arange(2000) % 4
    range_m = np.hypot(venue.beacon_xyz_m[beacon, 0] - x_m, np.hypot(1.5, 1.0))
    rssi_dbm = np.round(-61 - 10 * np.log10(range_m)).astype(int)
    readings = Readings(time_us=time_us, beacon=beacon, rssi_dbm=rssi_dbm, channel=beacon * 0)
    track = follow(BeaconPair(window_s=0.05), readings, venue)
    # Half way between two beacons the ranges are equal and it is right; between them it pulls to
    # the middle, as ranges in space are longer than ways: at most as far as the nearest beacon.
    error_m = np.abs(track.x_m - x_m)[100:]
    assert np.mean(error_m) < 0.8
    assert np.max(error_m) < 2.0


def test_no_readings_give_no_track_and_it_asks_to_be_fitted():
    assert len(follow(BeaconPair(), Readings.empty())) == 0
    with pytest.raises(UsageError, match="call fit"):
        BeaconPair().start(None, np.random.default_rng(1))
    with pytest.raises(UsageError, match="no aisle graph"):
        BeaconPair().fit(replace(practice_venue(), graph=None), ())


@pytest.mark.parametrize(
    "wrong",
    [
        {"window_s": 0.0},
        {"rate": 2.0},
        {"signal": "loudest"},
        {"output_rate": 0.0},
        {"exponent": 0.0},
        {"curve": "guess"},
        {"phone_height_m": -1.0},
    ],
    ids=str,
)
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        BeaconPair(**wrong)
