from dataclasses import replace

import numpy as np
import pytest

from blesim.columns import NO_EDGE
from blesim.errors import UsageError
from blesim.estimators.nearest_beacon import NearestBeacon, beacon_places
from blesim.estimators.practice import practice_recording, practice_venue
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings
from blesim.venue.floor_plan import FloorPlan


def follow(estimator, venue, readings):
    rng = Draws(seed=1, purpose="test").generator()
    return estimator.fit(venue, ()).start(None, rng).advance(Observations(readings=readings))


def readings_of(*rows):
    time_us, beacon, rssi_dbm = np.array(rows).T
    return Readings(time_us=time_us, beacon=beacon, rssi_dbm=rssi_dbm, channel=np.zeros(len(rows)))


def test_each_reading_gives_the_place_beside_the_strongest_beacon():
    venue = practice_venue()
    # Beacons 1 and 6 hang at (6, 0.5) and (10, 7.5); the aisles are y = 2 and y = 6.
    readings = readings_of((0, 1, -70), (100, 6, -80), (200, 6, -60))
    track = follow(NearestBeacon(), venue, readings)
    assert track.time_us.tolist() == [0, 100, 200]
    assert list(zip(track.x_m, track.y_m, strict=True)) == [(6, 2), (6, 2), (10, 6)]
    np.testing.assert_allclose(
        venue.graph.xy_m(track.edge, track.offset_m), np.stack([track.x_m, track.y_m], axis=1)
    )


def test_the_two_signal_values_choose_different_beacons():
    # Highest: beacon 0 with -60. Averaged: 0.25 * -90 + 0.75 * -60 = -67.5 against -65.
    readings = readings_of((0, 0, -60), (100, 3, -65), (200, 0, -90))
    assert follow(NearestBeacon(), practice_venue(), readings).x_m[-1] == 2.0
    averaged = NearestBeacon(signal="averaged")
    assert follow(averaged, practice_venue(), readings).x_m[-1] == 14.0


def test_the_window_is_forgotten_after_its_length():
    readings = readings_of((0, 0, -50), (2_999_999, 3, -90), (3_000_000, 3, -90))
    assert follow(NearestBeacon(), practice_venue(), readings).x_m.tolist() == [2.0, 2.0, 14.0]


def test_without_a_graph_the_beacon_itself_is_the_place():
    venue = replace(practice_venue(), graph=None)
    track = follow(NearestBeacon(), venue, readings_of((0, 1, -70)))
    assert (track.x_m[0], track.y_m[0], track.edge[0]) == (6.0, 0.5, NO_EDGE)
    assert np.isnan(track.offset_m[0])


def test_a_level_without_aisles_uses_the_beacon_itself():
    venue = practice_venue()
    first, second = venue.floor_plan.levels[0], replace(venue.floor_plan.levels[0], level=1)
    upstairs = venue.beacons[0].model_copy(update={"level": 1})
    venue = replace(
        venue,
        floor_plan=FloorPlan(levels=(first, second)),
        beacons=(upstairs, *venue.beacons[1:]),
    )
    track = follow(NearestBeacon(), venue, readings_of((0, 0, -60), (5_000_000, 1, -60)))
    assert track.level.tolist() == [1, 0]
    assert track.y_m.tolist() == [0.5, 2.0]
    assert track.edge[0] == NO_EDGE


def test_variance_is_that_of_a_square_as_wide_as_the_spacing():
    # Beacons every 4 m along both aisles, which are 4 m apart: 4^2 / 12.
    places = beacon_places(practice_venue())
    np.testing.assert_allclose(places.variance_x_m2, 16 / 12)
    np.testing.assert_allclose(places.variance_y_m2, 16 / 12)


def test_one_beacon_may_be_anywhere_on_its_level():
    venue = practice_venue()
    alone = venue.with_beacons(venue.beacons[:1])
    track = follow(NearestBeacon(), alone, readings_of((0, 0, -60)))
    # The level is 16 m x 8 m.
    assert track.variance_x_m2[0] == pytest.approx(16**2 / 12)
    assert track.variance_y_m2[0] == pytest.approx(8**2 / 12)


def test_two_beacons_at_one_place_still_have_a_variance():
    venue = practice_venue()
    twin = venue.beacons[0].model_copy(update={"id": "twin"})
    places = beacon_places(venue.with_beacons((*venue.beacons, twin)))
    assert np.all(places.variance_x_m2 > 0)


def test_no_readings_and_no_beacons_give_no_track():
    assert len(follow(NearestBeacon(), practice_venue(), Readings.empty())) == 0
    empty = practice_venue().with_beacons(())
    assert len(follow(NearestBeacon(), empty, Readings.empty())) == 0


def test_it_asks_to_be_fitted():
    with pytest.raises(UsageError, match="call fit"):
        NearestBeacon().start(None, Draws(seed=1, purpose="test").generator())


@pytest.mark.parametrize("wrong", [{"window_s": -1.0}, {"rate": 2.0}, {"signal": "loudest"}])
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        NearestBeacon(**wrong)


def test_a_whole_walk_stays_on_the_levels_of_the_venue():
    recording = practice_recording()
    walk = recording.by_name["there"]
    track = follow(NearestBeacon(), recording.venue, walk.observations.readings)
    assert len(track) == len(walk.observations.readings)
    assert set(track.level.tolist()) == {0}
