import math
from dataclasses import replace

import numpy as np
import pytest

from blesim.errors import UsageError
from blesim.estimators.aisle_zones import zones_by_level
from blesim.estimators.base import Need, StartInfo
from blesim.estimators.bepdr import BeaconMatchedPdr, key_beacons
from blesim.estimators.check import check_estimator
from blesim.estimators.heading_pdr import RawHeadingPdr
from blesim.estimators.nearest_beacon import beacon_places
from blesim.estimators.practice import practice_recording, practice_venue
from blesim.estimators.run import run
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings, Steps
from blesim.units import wrap_angle

# Aisle 1 from (2, 2) to (14, 2), then north to (14, 6); junctions at both ends, beacons B1 to B4
# (rows 0 to 3) at x = 2, 6, 10, 14, y = 0.5.
START = StartInfo(x_m=5.0, y_m=2.0)
SYSTEM = BeaconMatchedPdr(source="system", junction_m=1.5)


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
    track = tracker.advance(seen)
    return track, np.round(np.stack([track.x_m, track.y_m], axis=1), 3).tolist()


def test_in_a_linear_zone_a_step_follows_the_aisle():
    _, places = follow(SYSTEM, walked((1, 0.2), (1, 0.1), (1, -0.1)))
    assert places == [[6, 2], [7, 2], [8, 2]]


def test_of_the_two_directions_the_one_nearer_to_the_measured_heading():
    _, places = follow(SYSTEM, walked((1, 1.5), (1, 1.6)))
    assert places == [[6, 2], [5, 2]]


def test_a_turning_step_has_the_measured_heading_even_there():
    # The second step turns by half a radian.
    _, places = follow(SYSTEM, walked((1, 0.0), (1, 0.5), (1, 0.5)))
    assert places[1] == pytest.approx([6 + math.cos(0.5), 2 + math.sin(0.5)], abs=1e-3)
    assert places[2] == pytest.approx([7 + math.cos(0.5), 2 + math.sin(0.5)], abs=1e-3)


def test_in_a_non_linear_zone_the_measured_heading_and_then_the_entry():
    start = StartInfo(x_m=13.0, y_m=2.0)
    _, places = follow(SYSTEM, walked((1.5, 0.1), (1.0, 0.1), (0.5, 1.5), (1.0, 1.5)), start=start)
    # 1 m from the junction at (14, 2): measured headings, until beside the straight part.
    first = [13 + 1.5 * math.cos(0.1), 2 + 1.5 * math.sin(0.1)]
    second = [first[0] + math.cos(0.1), first[1] + math.sin(0.1)]
    third = [second[0] + 0.5 * math.cos(1.5), second[1] + 0.5 * math.sin(1.5)]
    np.testing.assert_allclose(places[:3], [first, second, third], atol=1e-3)
    # 1.7 m north of the corner, and back to the entry at 1.5 m.
    assert places[3] == [14.0, 3.5]


def test_the_entry_is_as_unsure_as_the_zone_it_leaves():
    start = StartInfo(x_m=13.5, y_m=2.0)
    track, places = follow(SYSTEM, walked((1.0, math.pi)), start=start)
    assert places == [[12.5, 2.0]]
    track, places = follow(SYSTEM, walked((1.2, 3.0)), start=start)
    assert places == [[12.5, 2.0]]
    # Of a disk of radius 1.5 m, r^2 / 4.
    np.testing.assert_allclose(track.variance_x_m2, 1.5**2 / 4)


def test_a_fix_at_a_key_point_overwrites_the_position():
    readings = heard((0.5, 3, -70), (2.5, 3, -70))
    track, places = follow(SYSTEM, walked((1, 0), (1, 0)), readings)
    assert places == [[14, 2], [15, 2], [16, 2], [14, 2]]
    # Of a zone of radius 5 m, r^2 / 4.
    np.testing.assert_allclose(track.variance_x_m2[[0, 3]], 6.25)


def test_only_the_first_fix_of_a_beacon_if_so_asked():
    readings = heard((0.5, 3, -70), (2.5, 3, -70))
    _, places = follow(replace(SYSTEM, every_fix=False), walked((1, 0), (1, 0)), readings)
    assert places == [[14, 2], [15, 2], [16, 2], [16, 2]]


def test_weak_beacons_and_those_in_the_aisle_are_no_fix():
    readings = heard((0.5, 3, -75), (2.5, 1, -40))
    _, places = follow(SYSTEM, walked((1, 0)), readings)
    assert places == [[5, 2], [6, 2], [6, 2]]
    _, places = follow(replace(SYSTEM, zone_dbm=-75.0), walked((1, 0)), readings)
    assert places[0] == [14, 2]
    # The practice beacons announce -61 dBm: 5 m are -75.0, 4 m are -73.0 dBm.
    weak = heard((0.5, 3, -74))
    _, places = follow(replace(SYSTEM, zone_dbm=None), walked((1, 0)), weak)
    assert places[0] == [14, 2]
    _, places = follow(replace(SYSTEM, zone_dbm=None, zone_m=4.0), walked((1, 0)), weak)
    assert places[0] == [5, 2]


def test_key_points_are_the_nearest_beacons_of_the_junctions():
    venue = practice_venue()
    zones, places = zones_by_level(venue, 2.0)[0], beacon_places(venue)
    assert key_beacons(zones, places, 0, 5.0).tolist() == [0, 3, 4, 7]
    assert key_beacons(zones, places, 1, 5.0).tolist() == []
    away = venue.with_beacons(venue.beacons[1:3])
    places = beacon_places(away)
    assert key_beacons(zones, places, 0, 3.9).tolist() == []
    assert key_beacons(zones, places, 0, 4.1).tolist() == [0, 1]


def test_beyond_the_end_of_an_aisle_the_measured_heading_leads_back():
    # The walker turned at (14, 2), but the position ran on to (17, 2).
    start = StartInfo(x_m=17.0, y_m=2.0)
    steps = walked((1, 1.5), (1, 1.5))
    _, places = follow(SYSTEM, steps, start=start)
    assert places[0] == pytest.approx([17 + math.cos(1.5), 2 + math.sin(1.5)], abs=1e-3)
    # Now beside the straight part of the cross aisle: at its entry.
    assert places[1] == [14, 3.5]
    _, places = follow(replace(SYSTEM, reach_m=2.5), steps, start=start)
    assert places[1] == pytest.approx([17 + 2 * math.cos(1.5), 2 + 2 * math.sin(1.5)], abs=1e-3)


def test_a_drifting_heading_does_not_leave_the_corridor():
    recording = practice_recording()
    walk = recording.by_name["there"]
    steps = walk.observations.steps
    drift_rad = np.linspace(0.0, 0.5, len(steps))
    steps = replace(steps, heading_rad=wrap_angle(steps.heading_rad + drift_rad))
    walk = replace(walk, observations=replace(walk.observations, steps=steps))
    marks = walk.observations.marks

    def errors_m(estimator):
        track = run(estimator, recording, walk, seed=1, label="pdr")
        x_m = np.interp(track.time_us, marks.time_us, marks.x_m)
        y_m = np.interp(track.time_us, marks.time_us, marks.y_m)
        return np.hypot(track.x_m - x_m, track.y_m - y_m)

    # No beacon is as strong as 20 dBm: the map alone.
    matched_m = errors_m(replace(SYSTEM, offset_deg=0.0, zone_dbm=20.0))
    raw_m = errors_m(RawHeadingPdr(source="system", offset_deg=0.0))
    assert raw_m[-1] > 3.0
    # A turn is seen a step late, and the entry is up to a step away.
    assert np.max(matched_m) < 3 * 0.6


def test_one_beacon_or_none_will_do():
    venue = practice_venue()
    _, places = follow(SYSTEM, walked((1, 0.1)), venue=venue.with_beacons(venue.beacons[:1]))
    assert places == [[6, 2]]
    _, places = follow(SYSTEM, walked((1, 0.1)), venue=venue.with_beacons(()))
    assert places == [[6, 2]]


def test_on_a_level_without_aisles_it_goes_on_as_measured():
    start = StartInfo(x_m=5.0, y_m=2.0, level=2)
    _, places = follow(SYSTEM, walked((1, 0.5)), heard((0.5, 3, -40)), start=start)
    assert places[-1] == pytest.approx([5 + math.cos(0.5), 2 + math.sin(0.5)], abs=1e-3)


def test_what_it_needs_and_says():
    assert BeaconMatchedPdr().needs == {Need.START, Need.GRAPH, Need.IMU}
    assert SYSTEM.needs == {Need.START, Need.GRAPH, Need.STEPS}
    rng = Draws(seed=1, purpose="test").generator()
    with pytest.raises(UsageError, match="call fit"):
        SYSTEM.start(START, rng)
    with pytest.raises(UsageError, match="where the walk begins"):
        SYSTEM.fit(practice_venue(), ()).start(None, rng)
    with pytest.raises(UsageError, match="no aisle graph"):
        SYSTEM.fit(replace(practice_venue(), graph=None), ())


@pytest.mark.parametrize(
    "wrong", [{"zone_m": 0.0}, {"zone_dbm": 99.0}, {"signal": "loudest"}, {"rate": 0.0}]
)
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        BeaconMatchedPdr(**wrong)


@pytest.mark.parametrize(
    "estimator",
    [replace(SYSTEM, zone_dbm=None, signal="highest"), replace(SYSTEM, every_fix=False)],
)
def test_other_settings_keep_the_contract(estimator):
    check_estimator(estimator)
