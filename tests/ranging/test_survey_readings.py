from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from blesim.errors import DataError, VenueError
from blesim.estimators.practice import practice_recording, practice_venue
from blesim.ranging.survey_readings import WALKING, calibration_points, survey_readings
from blesim.recording import Observations, Provenance, Recording, Walk, WalkKind
from blesim.tables import Marks, Readings


def survey(marks, times_s, beacon=0, kind=WalkKind.SURVEY, name="survey"):
    """Survey of the practice venue; marks are rows of (time in s, x, y, level, heading)."""
    rows = np.array(marks, float).reshape(-1, 5)
    observations = Observations(
        readings=Readings(
            time_us=(np.array(times_s) * 1e6).astype(np.int64),
            beacon=np.full(len(times_s), beacon),
            rssi_dbm=np.full(len(times_s), -70),
            channel=np.full(len(times_s), 38),
        ),
        marks=Marks(
            time_us=(rows[:, 0] * 1e6).astype(np.int64),
            x_m=rows[:, 1],
            y_m=rows[:, 2],
            level=rows[:, 3].astype(np.int64),
            heading_rad=rows[:, 4],
        ),
    )
    walk = Walk(name=name, walker="tester", phone="any", kind=kind, observations=observations)
    provenance = Provenance(title="survey", source="test")
    return Recording(venue=practice_venue(), walks=(walk,), provenance=provenance)


NO = np.nan


def test_walking_between_two_marks_worked_by_hand():
    # 8 m in 4 s to the north: after 1 s at y = 2 + 2, after 4 s at its end.
    found = survey_readings([survey([(10, 3, 2, 0, NO), (14, 3, 10, 0, NO)], [10, 11, 14])])
    assert found.x_m.tolist() == [3, 3, 3]
    assert found.y_m.tolist() == [2, 4, 10]
    assert found.heading_rad.tolist() == [np.pi / 2] * 3
    assert found.spot.tolist() == [WALKING] * 3
    assert found.channel.tolist() == [38] * 3
    assert found.rssi_dbm.dtype == np.float64


def test_standing_takes_the_heading_of_the_first_mark():
    marks = [(0, 1, 1, 0, 0.5), (2, 1, 1, 0, 1.5), (4, 1, 1, 0, NO), (6, 1, 1, 0, 3.0)]
    found = survey_readings([survey(marks, [1, 2, 3, 5, 6])])
    assert_allclose(found.heading_rad, [0.5, 1.5, 1.5, np.nan, np.nan])
    assert found.spot.tolist() == [0] * 5


def test_readings_outside_the_marks_and_on_the_stairs_have_no_place():
    marks = [(1, 0, 0, 0, NO), (2, 4, 0, 0, NO), (3, 6, 0, 1, NO), (4, 8, 0, 1, NO)]
    found = survey_readings([survey(marks, [0.5, 1.5, 2.5, 3.5, 4.5])])
    assert (found.time_us / 1e6).tolist() == [1.5, 3.5]
    assert found.level.tolist() == [0, 1]
    assert found.x_m.tolist() == [2, 7]


def test_a_place_visited_twice_is_one_spot():
    marks = [(t, x, 1, 0, NO) for t, x in ((0, 5), (1, 5), (2, 3), (3, 3), (4, 5), (5, 5))]
    first = survey(marks, [0.5, 1.5, 2.5, 4.5])
    other = survey([(0, 3, 1, 0, NO), (1, 3, 1, 0, NO)], [0.5])
    found = survey_readings([first, other])
    assert found.spot.tolist() == [1, WALKING, 0, 1, 0]
    assert found.walk.tolist() == [0, 0, 0, 0, 1]


def test_two_marks_at_one_moment_do_no_harm():
    marks = [(0, 0, 0, 0, NO), (1, 2, 0, 0, NO), (1, 4, 0, 0, NO), (2, 6, 0, 0, NO)]
    found = survey_readings([survey(marks, [0.5, 1.0, 1.5])])
    assert found.x_m.tolist() == [1, 4, 5]


def test_distances_in_space_and_on_the_map():
    # Beacon 0 hangs at (2, 0.5), 2 m high: (5, 4.5) is 5 m away on the map, 1 m below.
    recording = survey([(0, 5, 4.5, 0, NO), (1, 5, 4.5, 0, NO)], [0.5])
    found = survey_readings([recording])
    assert found.horizontal_distance_m(recording.venue).tolist() == [5]
    assert_allclose(found.distance_m(recording.venue, 1.0), np.sqrt(26))


def test_a_beacon_on_another_level_has_no_distance():
    found = survey_readings([survey([(0, 5, 4.5, 1, NO), (1, 5, 4.5, 1, NO)], [0.5])])
    assert np.isnan(found.distance_m(practice_venue(), 1.0)).all()


def test_branches_are_those_of_the_aisle_graph():
    # Beacons 0 to 3 are beside aisle 1 (y = 2), 4 to 7 beside aisle 2 (y = 6).
    marks = [(0, 7, 2, 0, NO), (1, 7, 2, 0, NO)]
    venue = practice_venue()
    assert survey_readings([survey(marks, [0.5], beacon=1)]).same_branch(venue).tolist() == [True]
    assert survey_readings([survey(marks, [0.5], beacon=5)]).same_branch(venue).tolist() == [False]
    with pytest.raises(VenueError, match="no aisle graph"):
        survey_readings([survey(marks, [0.5])]).same_branch(replace(venue, graph=None))


def test_the_practice_survey_is_where_its_walker_is():
    found = survey_readings([practice_recording()])
    walk = practice_recording().by_name["survey"].observations
    assert len(found) == len(walk.readings)
    # The round is 1 m/s along the sides of a rectangle: 12 m to the east, 4 m to the north.
    seconds = found.time_us / 1e6
    assert_allclose(found.x_m, np.interp(seconds, [0, 12, 16, 28, 32], [2, 14, 14, 2, 2]))
    assert_allclose(found.y_m, np.interp(seconds, [0, 12, 16, 28, 32], [2, 2, 6, 6, 2]))


@pytest.mark.parametrize(
    "surveys",
    [
        [],
        [survey([], [1])],
        [survey([(0, 0, 0, 0, NO)], [0])],
        [survey([(5, 0, 0, 0, NO), (6, 0, 0, 0, NO)], [1])],
        [survey([(0, 0, 0, 0, NO), (6, 0, 0, 0, NO)], [1], kind=WalkKind.WALK)],
    ],
)
def test_a_survey_that_tells_no_place_is_refused(surveys):
    with pytest.raises(DataError, match="between two marks") as fault:
        survey_readings(surveys)
    assert "\n" not in str(fault.value)


def test_surveys_of_different_beacons_are_refused():
    one = survey([(0, 0, 0, 0, NO), (6, 0, 0, 0, NO)], [1])
    other = replace(one, venue=one.venue.with_beacons(one.venue.beacons[:1]))
    with pytest.raises(DataError, match="different beacons"):
        survey_readings([one, other])


def stood_twice_and_walked():
    """Readings at one spot by two channels, looking two ways, then on a way of 4 m in 4 s."""
    marks = [(0, 2, 2, 0, 0.0), (2, 2, 2, 0, 1.5), (4, 2, 2, 0, NO), (8, 6, 2, 0, NO)]
    found = survey_readings([survey(marks, [0.5, 1.5, 2.5, 3.5, 4.25, 4.75, 6.5])])
    levels_dbm = np.array([-60.0, -64.0, -70.0, -72.0, -80.0, -82.0, -90.0])
    return replace(found, rssi_dbm=levels_dbm, channel=np.array([37, 37, 38, 37, 39, 39, 39]))


def test_a_calibration_point_is_the_mean_where_somebody_stood_worked_by_hand():
    apart = calibration_points(stood_twice_and_walked(), by_channel=True)
    found = sorted(zip(apart.channel, apart.rssi_dbm, apart.x_m, apart.spot, strict=True))
    assert found == [(37, pytest.approx(-196 / 3), 2.0, 0), (38, -70.0, 2.0, 0)]
    together = calibration_points(stood_twice_and_walked(), by_channel=False)
    assert (together.rssi_dbm.tolist(), together.channel.tolist()) == ([-66.5], [0])


def test_where_nobody_stood_points_are_cells_worked_by_hand():
    survey = stood_twice_and_walked()
    cells = calibration_points(survey.rows(survey.spot == WALKING), by_channel=True)
    # From 2 to 3 m and from 4 to 5 m of the way.
    assert sorted(zip(cells.rssi_dbm, cells.x_m, strict=True)) == [(-90.0, 4.5), (-81.0, 2.5)]


def test_columns_cannot_be_changed():
    found = survey_readings([practice_recording()])
    with pytest.raises(ValueError, match="read-only"):
        found.x_m[0] = 0.0


def test_static_points_of_a_real_hall_are_spots(hall):
    found = hall.survey
    walks = [walk for walk in hall.recording.walks if walk.kind == WalkKind.SURVEY]
    assert len(found) == sum(len(walk.observations.readings) for walk in walks)
    assert found.spot.min() == 0
    # Some of the 126 points of the two sets are at the same place.
    places = {(w.observations.marks.x_m[0], w.observations.marks.y_m[0]) for w in walks}
    assert found.spot.max() + 1 == len(places) <= 126
