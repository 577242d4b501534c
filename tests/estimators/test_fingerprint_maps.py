"""Radio maps of channels, their gaps and their errors: by hand."""

import numpy as np
import pytest
import shapely

from blesim.errors import DataError, UsageError
from blesim.estimators.constant_velocity import Belief
from blesim.estimators.fingerprint_maps import (
    FingerprintSettings,
    fit_fingerprint_maps,
    gap_places,
    left_out_variance_m2,
)
from blesim.ranging.radio_map import MapLayout, RadioMap, radio_map
from blesim.ranging.survey_readings import survey_readings
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle

PLAIN = {"separate": False, "k": 3, "search_scale": 5.0, "cell_m": 1.0, "grid_m": None}


def maps_of(office, channels=(0,), **settings):
    survey = survey_readings((office.survey(channels),))
    return fit_fingerprint_maps(survey, office.venue, FingerprintSettings(**PLAIN | settings))


def map_of(places_m, mean_dbm):
    places_m, mean_dbm = np.array(places_m, float), np.array(mean_dbm, float)
    return RadioMap(
        layout=MapLayout(),
        x_m=places_m[:, 0].copy(),
        y_m=places_m[:, 1].copy(),
        level=np.zeros(len(places_m), np.int64),
        direction=np.full(len(places_m), -1),
        mean_dbm=mean_dbm,
        spread_db=np.full(mean_dbm.shape, np.nan),
        count=np.where(np.isnan(mean_dbm), 0, 1),
    )


def test_each_place_is_located_among_the_others():
    # k = 1: 0 -> 1 (3 m off), 1 -> 0 (3 m), 2 -> 1 (4 m): (9 + 9 + 16) / 3 / 2.
    surveyed = map_of([[0, 0], [3, 0], [3, 4]], [[-50], [-53], [-58]])
    assert left_out_variance_m2(surveyed, 1) == pytest.approx(34 / 6)


def test_two_others_are_weighted_by_the_inverse_of_how_far_they_are_apart():
    # k = 2: 0 from 1 and 2, apart 3 and 8 dB: weights 8/11, 3/11, place (3, 12/11); others alike.
    surveyed = map_of([[0, 0], [3, 0], [3, 4]], [[-50], [-53], [-58]])
    first = 3**2 + (12 / 11) ** 2
    second = (3 * 5 / 8) ** 2 + (4 * 3 / 8) ** 2
    third = (3 * 5 / 13) ** 2 + 4**2
    assert left_out_variance_m2(surveyed, 2) == pytest.approx((first + second + third) / 6)


def test_places_alike_do_not_find_themselves():
    surveyed = map_of([[0, 0], [2, 0]], [[-50], [-50]])
    assert left_out_variance_m2(surveyed, 1) == pytest.approx(4 / 2)


def test_no_more_than_k_of_places_alike_are_taken():
    # k = 1: each finds the first of the others, 1, 1 and 5 m off.
    surveyed = map_of([[0, 0], [1, 0], [5, 0]], [[-50]] * 3)
    assert left_out_variance_m2(surveyed, 1) == pytest.approx(27 / 6)


def test_one_place_alone_may_be_anywhere_in_ten_metres():
    assert left_out_variance_m2(map_of([[0, 0]], [[-50]]), 3) == pytest.approx(100 / 12)


def test_gaps_are_inside_the_survey_where_one_can_walk(office):
    surveyed = map_of([[0, 0], [4, 0], [4, 4], [0, 4]], [[-50]] * 4)
    level = Level(level=0, bounds=shapely.box(0, 0, 12, 10))
    shelf = Obstacle(id="shelf", outline=shapely.box(1.5, 1.5, 2.5, 2.5), material="wood-4cm")
    venue = type(office.venue)(
        name="shop", floor_plan=FloorPlan(levels=(level,), obstacles=(shelf,)), beacons=()
    )
    gaps_m = gap_places(surveyed, venue, 0, 2.0)
    corners = {(0, 0), (4, 0), (4, 4), (0, 4)}
    expected = {(x, y) for x in (0, 2, 4) for y in (0, 2, 4)} - corners - {(2, 2)}
    assert set(map(tuple, gaps_m.tolist())) == expected


def test_the_filled_map_keeps_what_was_surveyed(office):
    plain, filled = maps_of(office).maps[0], maps_of(office, grid_m=0.5).maps[0]
    count = len(plain.nearest.radio_map)
    assert count == 99
    # 21 x 17 crossings of half a metre, less those on the surveyed metres.
    assert len(filled.nearest.radio_map) == 21 * 17
    np.testing.assert_array_equal(
        filled.nearest.radio_map.mean_dbm[:count], plain.nearest.radio_map.mean_dbm
    )
    assert filled.variance_m2 == plain.variance_m2


def test_a_filled_fingerprint_is_near_what_would_be_heard(office):
    filled = maps_of(office, grid_m=0.5).maps[0].nearest.radio_map
    row = np.flatnonzero((filled.x_m == 3.5) & (filled.y_m == 4.5))[0]
    zero = np.zeros(5, np.int64)
    there = office.heard(zero, np.full(5, 3.5), np.full(5, 4.5), np.arange(5), zero)
    np.testing.assert_allclose(filled.mean_dbm[row], there.rssi_dbm, atol=1.5)


def test_each_channel_has_a_map_and_a_place(office):
    channels = (37, 38, 39)
    maps = maps_of(office, channels, separate=True)
    assert [each.slot for each in maps.maps] == [1, 2, 3]
    signal_dbm = np.full((5, 4), np.nan)
    for slot, channel in ((1, 37), (3, 39)):
        place = np.full(5, 5.0), np.full(5, 3.0)
        at = office.heard(np.zeros(5, int), *place, np.arange(5), np.full(5, channel))
        signal_dbm[:, slot] = at.rssi_dbm
    places = maps.locate(signal_dbm, None)
    np.testing.assert_allclose(places.places_m, [[5.0, 3.0], [5.0, 3.0]], atol=0.51)
    assert len(places.variance_m2) == 2


def test_beacons_the_survey_did_not_hear_are_not_compared(office):
    recording = office.survey()
    survey = survey_readings((recording,))
    settings = FingerprintSettings(**PLAIN)
    maps = fit_fingerprint_maps(survey.rows(survey.beacon != 4), office.venue, settings)
    assert maps.known.tolist() == [True] * 4 + [False]
    only_unknown = np.array([np.nan] * 4 + [-60.0])
    assert maps.locate(only_unknown, None).places_m.shape == (0, 2)


def test_the_ellipse_limits_the_search(office):
    maps = maps_of(office, k=1)
    zero = np.zeros(5, np.int64)
    at = office.heard(zero, np.full(5, 9.0), np.full(5, 7.0), np.arange(5), zero)
    signal_dbm = at.rssi_dbm.astype(float)
    assert maps.locate(signal_dbm, None).places_m.tolist() == [[9.0, 7.0]]
    sure = Belief(mean=np.array([3.0, 3.0, 0, 0]), covariance=0.16 * np.eye(4), level=0)
    # Five times 0.4 m about (3, 3).
    place_m = maps.locate(signal_dbm, sure).places_m[0]
    assert np.hypot(*(place_m - 3.0)) <= 2.0
    everywhere = maps_of(office, k=1, search_scale=None)
    assert everywhere.locate(signal_dbm, sure).places_m.tolist() == [[9.0, 7.0]]


def test_spots_are_those_of_the_survey(office):
    survey = survey_readings((office.survey(),))
    spots = radio_map(survey, MapLayout())
    maps = maps_of(office, cell_m=None)
    np.testing.assert_array_equal(maps.maps[0].nearest.radio_map.mean_dbm, spots.mean_dbm)


def test_channels_must_be_told_to_be_separate(office):
    with pytest.raises(DataError, match="channels"):
        maps_of(office, separate=True)


@pytest.mark.parametrize(
    ("name", "value"),
    [("k", 0), ("search_scale", 0.0), ("cell_m", 0.0), ("grid_m", 0.0)],
)
def test_bad_settings_are_refused(name, value):
    with pytest.raises(UsageError, match=name):
        FingerprintSettings(**PLAIN | {name: value})
