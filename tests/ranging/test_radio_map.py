import numpy as np
import pytest
from numpy.testing import assert_allclose

from blesim.errors import DataError, UsageError
from blesim.estimators.practice import practice_recording
from blesim.ranging.radio_map import (
    ANY_DIRECTION,
    MapLayout,
    channel_radio_maps,
    direction_of,
    radio_map,
)
from blesim.ranging.survey_readings import WALKING, survey_readings

QUARTER = np.pi / 2


def test_two_spots_worked_by_hand(readings_at):
    # Spot 0: beacon 0 at -60 and -64, mean -62, spread sqrt(8); beacon 1 once at -80.
    survey = readings_at(
        [-60, -64, -80, -70, -50],
        beacons=3,
        beacon=[0, 0, 1, 1, 2],
        spot=[0, 0, 0, 1, WALKING],
        x_m=[1, 1, 1, 5, 3],
        y_m=2.0,
    )
    found = radio_map(survey, MapLayout())
    assert found.x_m.tolist() == [1, 5]
    assert found.y_m.tolist() == [2, 2]
    assert found.direction.tolist() == [ANY_DIRECTION] * 2
    nan = np.nan
    assert_allclose(found.mean_dbm, [[-62, -80, nan], [nan, -70, nan]])
    assert_allclose(found.spread_db, [[np.sqrt(8), nan, nan], [nan, nan, nan]])
    assert found.count.tolist() == [[2, 1, 0], [0, 1, 0]]
    assert found.fingerprints_dbm.tolist() == [[-62, -80, -100], [-100, -70, -100]]


def test_a_beacon_heard_too_seldom_counts_as_not_heard(readings_at):
    survey = readings_at([-60, -64, -80, -70], beacons=2, beacon=[0, 0, 1, 1], spot=[0, 0, 0, 1])
    found = radio_map(survey, MapLayout(fewest_readings=2, missing_dbm=-110))
    assert found.fingerprints_dbm.tolist() == [[-62, -110]]
    assert found.count.tolist() == [[2, 0]]


def test_walks_fall_into_cells(readings_at):
    survey = readings_at([-60, -70, -80], x_m=[0.2, 0.8, 1.2], y_m=[0.5, 0.5, -0.5])
    found = radio_map(survey, MapLayout(cell_m=1.0))
    assert_allclose(found.x_m, [0.5, 1.2])
    assert_allclose(found.mean_dbm, [[-65], [-80]])
    with pytest.raises(DataError, match="cell size"):
        radio_map(survey, MapLayout())


def test_levels_are_kept_apart(readings_at):
    survey = readings_at([-60, -70], x_m=0.5, y_m=0.5, level=[0, 3])
    found = radio_map(survey, MapLayout(cell_m=1.0))
    assert found.level.tolist() == [0, 3]
    assert found.mean_dbm.tolist() == [[-60], [-70]]


def test_the_sample_point_of_the_paper_in_four_directions(readings_at):
    # Digest "pdr-fingerprint": the vectors at (8, 9) looking to 0, 90, 180 and 270 degrees.
    vectors = [
        [-66, -85, -76, -79],
        [-79, -84, -76, -81],
        [-72, -85, -79, -77],
        [-71, -79, -74, -69],
    ]
    survey = readings_at(
        np.ravel(vectors),
        beacons=4,
        beacon=np.tile(np.arange(4), 4),
        spot=0,
        heading_rad=np.repeat([0, QUARTER, np.pi, -QUARTER], 4),
    )
    found = radio_map(survey, MapLayout(directions=4))
    for direction, vector in enumerate(vectors):
        assert found.facing(direction).mean_dbm.tolist() == [vector]
    together = radio_map(survey, MapLayout())
    assert_allclose(together.mean_dbm, [np.mean(vectors, axis=0)])


def test_a_direction_nobody_looked_in_is_refused(readings_at):
    layout = MapLayout(directions=4)
    found = radio_map(readings_at([-60, -61], spot=0, heading_rad=[0.0, np.nan]), layout)
    assert found.count.tolist() == [[1]]
    with pytest.raises(DataError, match="direction 2 of 4"):
        found.facing(2)
    with pytest.raises(DataError, match="which way"):
        radio_map(readings_at([-60], spot=0), layout)


def test_the_nearest_direction():
    edges = np.array([-0.249, 0.249, 0.251, 0.749, 0.751, 1.249, 1.251, -0.251]) * np.pi
    assert direction_of(edges, 4).tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    assert direction_of(np.array([np.pi, -np.pi]), 4).tolist() == [2, 2]
    assert direction_of(np.array([0.2, 3.0]), 1).tolist() == [0, 0]


def test_channels_have_maps_of_their_own(readings_at):
    survey = readings_at([-60, -70, -80, -90], channel=[37, 39, 39, 0], spot=[0, 0, 1, 1])
    maps = channel_radio_maps(survey, MapLayout())
    assert list(maps) == [37, 39]
    assert maps[37].mean_dbm.tolist() == [[-60]]
    assert maps[39].mean_dbm.tolist() == [[-70], [-80]]
    assert radio_map(survey, MapLayout()).mean_dbm.tolist() == [[-65], [-85]]
    with pytest.raises(DataError, match="tells no channels"):
        channel_radio_maps(readings_at([-60], spot=0), MapLayout())


def test_every_reading_counts_once():
    survey = survey_readings([practice_recording()])
    found = radio_map(survey, MapLayout(cell_m=0.7, directions=8))
    assert found.count.sum() == len(survey)
    sums = np.nansum(found.mean_dbm * found.count, axis=0)
    assert_allclose(sums, np.bincount(survey.beacon, survey.rssi_dbm))


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"cell_m": 0.0}, "cell_m 0"),
        ({"cell_m": np.nan}, "cell_m nan"),
        ({"directions": -1}, "directions -1"),
        ({"missing_dbm": 1.0}, "missing_dbm 1"),
        ({"fewest_readings": 0}, "fewest_readings 0"),
    ],
)
def test_bad_layouts_are_refused(wrong, says):
    with pytest.raises(UsageError, match=says):
        MapLayout(**wrong)
