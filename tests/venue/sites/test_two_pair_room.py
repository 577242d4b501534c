import numpy as np
import pytest

from blesim.venue.sites.two_pair_room import two_pair_room
from blesim.walkers.survey import grid_spots_m


def test_the_published_measures_hold():
    room = two_pair_room()
    assert room.floor_plan.walkable[0].bounds == (0.0, 0.0, 16.2, 4.8)
    places_m = {beacon.id: np.array([beacon.x_m, beacon.y_m]) for beacon in room.beacons}
    assert sorted(places_m) == ["pink-1", "pink-2", "yellow-1", "yellow-2"]
    for pair in ("pink", "yellow"):
        apart_m = np.linalg.norm(places_m[f"{pair}-1"] - places_m[f"{pair}-2"])
        assert apart_m == pytest.approx(6.0)
    assert {beacon.tx_power_dbm for beacon in room.beacons} == {0.0}
    assert {beacon.advertising_interval_s for beacon in room.beacons} == {0.1}


def test_the_grid_has_a_crossing_in_each_cell_of_60_cm():
    spots_m = grid_spots_m(two_pair_room().floor_plan, 0, 0.6)
    assert len(spots_m) == 27 * 8
    assert np.linalg.norm(np.diff(spots_m, axis=0), axis=1) == pytest.approx(0.6)
