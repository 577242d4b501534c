from dataclasses import replace

import numpy as np
import pytest
import shapely

from blesim.errors import UsageError
from blesim.estimators.base import Need
from blesim.estimators.check import check_estimator
from blesim.estimators.practice import practice_recording, practice_venue
from blesim.estimators.proximity_particle_filter import (
    ProximityParticleFilter,
    ProximitySense,
)
from blesim.estimators.run import surveys_of
from blesim.ranging.proximity import Proximity
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings, Steps
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle


def classes_told(*rows):
    """Readings of time, beacon and class, as a phone that tells classes reports them."""
    time_us, beacon, proximity = np.array(rows).T
    return Readings(
        time_us=time_us,
        beacon=beacon,
        rssi_dbm=np.full(len(rows), -70),
        channel=np.zeros(len(rows)),
        proximity=proximity,
    )


def increments(estimator, venue, readings, places_m, surveys=()):
    fitted = estimator.fit(venue, surveys)
    sense = ProximitySense(fitted, fitted.learned)
    sense.feed(readings)
    x_m, y_m = np.array(places_m, float).T
    return sense.increments(int(readings.time_us[-1]) + 1, 0, x_m, y_m)


def with_wall(height_m=float("inf")):
    """Practice venue with a wall at y = 1.25 before beacon 1 at (6, 0.5), which hangs at 2 m."""
    venue = practice_venue()
    wall = Obstacle(
        id="wall",
        outline=shapely.box(5.0, 1.2, 7.0, 1.3),
        material="light-wall",
        height_m=height_m,
    )
    levels = venue.floor_plan.levels
    return replace(venue, floor_plan=FloorPlan(levels=levels, obstacles=(wall,)))


def test_eq_5_to_8_add_up_the_beacons_reported_near():
    # Beacons 0 and 1 at (2, 0.5) and (6, 0.5); from (4, 0.5) both 2 m: 2 (1.1077 - 0.6106).
    readings = classes_told((0, 0, Proximity.NEAR), (1, 1, Proximity.NEAR), (2, 2, Proximity.FAR))
    places_m = [(4.0, 0.5), (2.0, 0.5), (10.0, 0.5), (2.0, 2.9)]
    found = increments(ProximityParticleFilter(), practice_venue(), readings, places_m)
    # P(0) is 1.1077, kept to 1; P(4) is -0.1135, kept to 0; 2.4 m from beacon 0 alone is 0.375.
    np.testing.assert_allclose(found, [0.9942, 1.0, 0.0, 1.1077 - 0.3053 * 2.4], atol=1e-12)


def test_the_printed_line_may_be_taken_as_it_is():
    readings = classes_told((0, 0, Proximity.NEAR))
    estimator = ProximityParticleFilter(clipped=False)
    found = increments(estimator, practice_venue(), readings, [(2.0, 0.5), (6.0, 0.5)])
    np.testing.assert_allclose(found, [1.1077, 1.1077 - 4 * 0.3053], atol=1e-12)


def test_immediate_counts_if_it_is_to():
    readings = classes_told((0, 0, Proximity.IMMEDIATE))
    literal = increments(ProximityParticleFilter(), practice_venue(), readings, [(2.0, 2.5)])
    counted = ProximityParticleFilter(immediate_counts=True)
    found = increments(counted, practice_venue(), readings, [(2.0, 2.5)])
    assert literal.tolist() == [0.0]
    assert found == pytest.approx([1.1077 - 0.6106])


def test_a_beacon_behind_a_wall_tells_nothing():
    readings = classes_told((0, 1, Proximity.NEAR))
    # Behind the wall, beside it, before it.
    places_m = [(6.0, 2.0), (8.5, 1.0), (6.0, 1.1)]
    seen = increments(ProximityParticleFilter(), with_wall(), readings, places_m)
    share = np.clip(1.1077 - 0.3053 * np.array([1.5, np.hypot(2.5, 0.5), 0.6]), 0, 1)
    np.testing.assert_allclose(seen, share * [0, 1, 1])
    blind = increments(ProximityParticleFilter(use_map=False), with_wall(), readings, places_m)
    np.testing.assert_allclose(blind, share)


def test_an_obstacle_lower_than_phone_and_beacon_hides_nothing():
    readings = classes_told((0, 1, Proximity.NEAR))
    # From (6, 2) to 2 m at (6, 0.5): over y = 1.3 the line is at 1.47 m for a phone at 1 m, at 1.2
    # for one at 0.5 m.
    over = increments(ProximityParticleFilter(), with_wall(1.25), readings, [(6.0, 2.0)])
    assert over == pytest.approx([1.1077 - 0.3053 * 1.5])
    low = ProximityParticleFilter(phone_height_m=0.5)
    assert increments(low, with_wall(1.25), readings, [(6.0, 2.0)]).tolist() == [0.0]


def test_beyond_the_bounds_is_wall():
    venue = practice_venue()
    # The inner corner of an L at (8, 4); beacon 3 at (14, 0.5) is round it, seen from (7, 7.5).
    outline = shapely.Polygon([(0, 0), (16, 0), (16, 4), (8, 4), (8, 8), (0, 8)])
    level = Level(level=0, bounds=outline)
    venue = replace(
        venue,
        floor_plan=FloorPlan(levels=(level,)),
        beacons=(venue.beacons[3].model_copy(update={"x_m": 9.0, "y_m": 3.9}),),
        graph=None,
    )
    readings = classes_told((0, 0, Proximity.NEAR))
    hidden, seen = increments(ProximityParticleFilter(), venue, readings, [(7.9, 5.9), (7.5, 2.5)])
    assert hidden == 0
    assert seen > 0


def test_without_a_class_told_rssi_makes_it():
    # -61 dBm at a metre, exponent 2: -70 dBm is 2.8 m, -71 dBm 3.2 m.
    near = replace(classes_told((0, 0, 0)), rssi_dbm=np.array([-70]))
    far = replace(near, rssi_dbm=np.array([-71]))
    place_m = [(2.0, 2.5)]
    estimator = ProximityParticleFilter()
    assert increments(estimator, practice_venue(), near, place_m)[0] > 0
    assert increments(estimator, practice_venue(), far, place_m)[0] == 0
    wider = ProximityParticleFilter(near_m=4.0)
    assert increments(wider, practice_venue(), far, place_m)[0] > 0
    steeper = ProximityParticleFilter(exponent=3.0)
    assert increments(steeper, practice_venue(), far, place_m)[0] > 0
    told = classes_told((0, 0, Proximity.FAR))
    doubting = ProximityParticleFilter(believe_phone=False)
    assert increments(estimator, practice_venue(), told, place_m)[0] == 0
    assert increments(doubting, practice_venue(), told, place_m)[0] > 0


def test_p_of_d_may_be_learned():
    recording = practice_recording()
    estimator = ProximityParticleFilter(likelihood="learned", near_m=6.0)
    learned = estimator.fit(recording.venue, surveys_of(recording)).learned.near
    assert learned.slope_per_m < 0
    assert learned.shares is not None
    assert estimator.needs == {Need.STEPS, Need.SURVEY}
    assert ProximityParticleFilter(source="imu").needs == {Need.IMU}


def corridor_walk():
    """Walk of 20 s along y = 2 from x = 1 at 0.65 m a step, beacons Near within 2 m of the way."""
    step_us, count = 500_000, 20
    time_us = np.arange(1, count + 1) * step_us
    steps = Steps(time_us=time_us, length_m=np.full(count, 0.65), heading_rad=np.zeros(count))
    moments_us = np.arange(0, count * step_us, 100_000)
    x_m = 1.0 + 0.65 * (moments_us // step_us)
    rows = [
        (now_us, beacon, Proximity.NEAR if abs(x - beacon_x) < 2.0 else Proximity.FAR)
        for now_us, x in zip(moments_us.tolist(), x_m.tolist(), strict=True)
        for beacon, beacon_x in enumerate((2.0, 6.0, 10.0, 14.0))
    ]
    return Observations(readings=classes_told(*rows), steps=steps)


def test_it_follows_a_walk_past_beacons():
    venue = practice_venue()
    narrow = Level(level=0, bounds=shapely.box(0.0, 0.0, 16.0, 3.0))
    beacons = venue.beacons[:4]
    venue = replace(venue, floor_plan=FloorPlan(levels=(narrow,)), beacons=beacons, graph=None)
    walk = corridor_walk()
    fitted = ProximityParticleFilter().fit(venue, ())
    track = fitted.start(None, Draws(seed=1, purpose="test").generator()).advance(walk)
    truth_m = 1.0 + 0.65 * (track.time_us // 500_000 - 1)
    later = track.time_us > 3_000_000
    # Near is told 2 m to either side: half of that, and the way of a few updates.
    assert np.abs(track.x_m - truth_m)[later].mean() < 1.0
    assert np.all((track.y_m >= 0) & (track.y_m <= 3))


@pytest.mark.parametrize("wrong", [{"likelihood": "guessed"}, {"near_m": 0.0}, {"exponent": 0.0}])
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        ProximityParticleFilter(**wrong)


def test_it_asks_to_be_fitted():
    with pytest.raises(UsageError, match="call fit"):
        ProximityParticleFilter().start(None, Draws(seed=1, purpose="test").generator())


@pytest.mark.parametrize(
    "estimator",
    [
        ProximityParticleFilter(use_map=False, particles=50),
        ProximityParticleFilter(likelihood="learned", near_m=6.0, particles=50, interval_s=0.3),
        ProximityParticleFilter(source="imu", spread="gaussian", penalty=-0.5, particles=50),
    ],
)
def test_other_settings_keep_the_contract(estimator):
    check_estimator(estimator)
