import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from blesim.errors import DataError
from blesim.estimators.practice import practice_venue
from blesim.metrics.position_error import pooled, position_errors
from blesim.tables import Readings, Track, Trajectory

GRAPH = practice_venue().graph
AISLE_1, EAST, AISLE_2 = 0, 1, 2
FINITE_M = st.floats(-50, 50)


def test_errors_worked_by_hand(by_hand):
    # The walker is at x = 2 + t. Estimates: (3, 2) from 1 s on, (9, 5) from 4 s on.
    track = by_hand.track_of([1, 4], [3.0, 9.0], [2.0, 5.0])
    errors = position_errors(by_hand.readings_at(1, 3, 4, 8), by_hand.along_aisle_1(), track)
    # (3, 2)-(3, 2); (5, 2)-(3, 2); (6, 2)-(9, 5); (10, 2)-(9, 5).
    assert errors.error_m == pytest.approx([0.0, 2.0, np.sqrt(18), np.sqrt(10)])
    assert errors.unmatched == 0


def test_an_estimate_is_in_force_until_the_next_and_never_before(by_hand):
    # A metric that took the nearest estimate in time would give 0 at 5.9 s.
    track = by_hand.track_of([0, 6], [2.0, 8.0], [2.0, 2.0])
    errors = position_errors(by_hand.readings_at(5.9, 6), by_hand.along_aisle_1(), track)
    assert errors.error_m == pytest.approx([5.9, 0.0])


def test_of_estimates_at_one_moment_the_last_is_in_force(by_hand):
    track = by_hand.track_of([3, 3], [0.0, 5.0], [2.0, 2.0])
    errors = position_errors(by_hand.readings_at(3), by_hand.along_aisle_1(), track)
    assert errors.error_m == pytest.approx([0.0])


def test_readings_before_the_first_estimate_are_counted(by_hand):
    track = by_hand.track_of([3], [5.0], [2.0])
    readings = by_hand.readings_at(0, 1, 2.9, 3, 4)
    errors = position_errors(readings, by_hand.along_aisle_1(), track)
    assert (len(errors), errors.unmatched) == (2, 3)
    assert errors.time_us.tolist() == [3_000_000, 4_000_000]


def test_no_estimate_leaves_all_readings_unmatched(by_hand):
    errors = position_errors(by_hand.readings_at(0, 1), by_hand.along_aisle_1(), Track.empty())
    assert (len(errors), errors.unmatched) == (0, 2)


def test_no_readings_have_no_errors(by_hand):
    track = by_hand.track_of([3], [5.0], [2.0])
    errors = position_errors(Readings.empty(), by_hand.along_aisle_1(), track)
    assert (len(errors), errors.unmatched) == (0, 0)


@pytest.mark.parametrize("time_s", [12.000001, 100])
def test_a_track_that_reaches_outside_the_walk_is_refused(by_hand, time_s):
    track = by_hand.track_of([3, time_s], [5.0, 5.0], [2.0, 2.0])
    with pytest.raises(DataError, match="outside the walk"):
        position_errors(by_hand.readings_at(4), by_hand.along_aisle_1(), track)


def test_readings_that_the_truth_does_not_cover_are_refused(by_hand):
    with pytest.raises(DataError, match="outside the walk"):
        position_errors(by_hand.readings_at(13), by_hand.along_aisle_1(), Track.empty())
    track = by_hand.track_of([3], [5.0], [2.0])
    with pytest.raises(DataError, match="no true trajectory"):
        position_errors(by_hand.readings_at(3), Trajectory.empty(), track)


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ({"x_m": np.nan}, "not finite"),
        ({"edge": 4, "offset_m": 1.0}, "edge that the aisle graph lacks"),
        ({"edge": 0}, "no offset"),
    ],
)
def test_a_track_that_is_none_is_refused(by_hand, columns, says):
    track = by_hand.track_of([3], **{"x_m": 5.0, "y_m": 2.0, **columns})
    with pytest.raises(DataError, match=says):
        position_errors(by_hand.readings_at(3), by_hand.along_aisle_1(), track, GRAPH)


def test_aisle_and_distance_along_the_graph_worked_by_hand(by_hand):
    # Walker at (5, 2) and (10, 2); estimates 3 m on in aisle 1, then beside (10, 6) in aisle 2:
    # 4 m to the east corner, 4 m across, 4 m back.
    track = by_hand.track_of(
        [3, 8], [8.0, 10.0], [2.0, 6.0], edge=[AISLE_1, AISLE_2], offset_m=[6.0, 4.0]
    )
    errors = position_errors(by_hand.readings_at(3, 8), by_hand.along_aisle_1(), track, GRAPH)
    assert errors.wrong_aisle.tolist() == [0.0, 1.0]
    assert errors.graph_m == pytest.approx([3.0, 12.0])
    assert errors.error_m == pytest.approx([3.0, 4.0])


def test_an_estimate_off_the_graph_is_taken_to_the_nearest_aisle(by_hand):
    # From (6, 2) to (6, 6): 4 m to the west corner, 4 m across, 4 m back.
    track = by_hand.track_of([3, 4], [5.0, 6.0], [3.9, 4.1])
    errors = position_errors(by_hand.readings_at(3, 4), by_hand.along_aisle_1(), track, GRAPH)
    assert errors.wrong_aisle.tolist() == [0.0, 1.0]
    assert errors.graph_m == pytest.approx([0.0, 12.0])


def test_a_junction_belongs_to_all_its_aisles(by_hand):
    # At 12 s the walker stands at the junction of aisle 1 and the east cross aisle.
    places = {"edge": [EAST, AISLE_2, AISLE_2], "offset_m": [3.0, 0.0, 1.0]}
    for time_s, wrong in ((12, [0.0, 0.0, 1.0]), (11.99, [1.0, 1.0, 1.0])):
        for row, expected in enumerate(wrong):
            place = {name: values[row] for name, values in places.items()}
            track = by_hand.track_of([1], 14.0, 5.0, **place)
            errors = position_errors(
                by_hand.readings_at(time_s), by_hand.along_aisle_1(), track, GRAPH
            )
            assert errors.wrong_aisle.tolist() == [expected]


def test_an_estimated_junction_belongs_to_all_its_aisles_too(by_hand):
    # The end of the east cross aisle is a place of aisle 1 as well.
    track = by_hand.track_of([1], 14.0, 2.0, edge=EAST, offset_m=0.0)
    errors = position_errors(by_hand.readings_at(2), by_hand.along_aisle_1(), track, GRAPH)
    assert errors.wrong_aisle.tolist() == [0.0]
    assert errors.graph_m == pytest.approx([10.0])


def test_a_true_place_off_the_graph_leaves_errors_on_the_map_only(by_hand):
    track = by_hand.track_of([3], 5.0, 2.0)
    errors = position_errors(by_hand.readings_at(3), by_hand.along_aisle_1(edge=-1), track, GRAPH)
    assert errors.error_m.tolist() == [0.0]
    assert np.all(np.isnan(errors.wrong_aisle))
    assert np.all(np.isnan(errors.graph_m))


def test_a_wrong_level_is_counted_and_the_distance_stays_horizontal(by_hand):
    track = by_hand.track_of([3, 4], [5.0, 5.0], [2.0, 2.0], level=[1, 0])
    errors = position_errors(by_hand.readings_at(3, 4), by_hand.along_aisle_1(), track, GRAPH)
    assert errors.wrong_level.tolist() == [1.0, 0.0]
    assert errors.error_m == pytest.approx([0.0, 1.0])
    assert errors.wrong_aisle.tolist() == [1.0, 0.0]
    assert errors.graph_m[0] == np.inf


@settings(deadline=None, max_examples=50)
@given(dx_m=FINITE_M, dy_m=FINITE_M, times=st.lists(st.integers(0, 12), min_size=1, max_size=9))
def test_a_track_shifted_by_d_is_wrong_by_d_everywhere(by_hand, dx_m, dy_m, times):
    readings, trajectory = by_hand.readings_at(*sorted(times)), by_hand.along_aisle_1()
    true = trajectory.at(readings.time_us)
    track = by_hand.track_of(readings.time_us / 1e6, true.x_m + dx_m, true.y_m + dy_m)
    errors = position_errors(readings, trajectory, track)
    np.testing.assert_allclose(errors.error_m, np.hypot(dx_m, dy_m), atol=2e-6)
    assert (len(errors), errors.unmatched) == (len(times), 0)


def test_a_perfect_track_has_no_error_on_map_and_graph(by_hand):
    readings, trajectory = by_hand.readings_at(0, 1, 5.5, 12), by_hand.along_aisle_1()
    true = trajectory.at(readings.time_us)
    track = by_hand.track_of(
        readings.time_us / 1e6, true.x_m, true.y_m, edge=true.edge, offset_m=true.offset_m
    )
    errors = position_errors(readings, trajectory, track, GRAPH)
    assert not np.any(errors.error_m)
    assert not np.any(errors.wrong_aisle)
    np.testing.assert_allclose(errors.graph_m, 0.0, atol=1e-9)


@settings(deadline=None, max_examples=50)
@given(st.lists(st.tuples(FINITE_M, st.integers(0, 12)), min_size=1, max_size=9))
def test_the_way_along_the_aisles_is_never_shorter_than_the_straight_one(by_hand, rows):
    readings = by_hand.readings_at(*sorted(time_s for _, time_s in rows))
    offset_m = np.clip([offset_m for offset_m, _ in rows], 0, 12)
    x_m, y_m = GRAPH.xy_m(np.full(len(rows), AISLE_2), offset_m).T
    track = by_hand.track_of(
        readings.time_us / 1e6, x_m, y_m, edge=np.full(len(rows), AISLE_2), offset_m=offset_m
    )
    errors = position_errors(readings, by_hand.along_aisle_1(), track, GRAPH)
    assert np.all(errors.graph_m >= errors.error_m - 1e-5)


def test_pooled_readings_count_once_each(by_hand):
    one = position_errors(
        by_hand.readings_at(0, 3), by_hand.along_aisle_1(), by_hand.track_of([3], 5.0, 2.0)
    )
    both = pooled([one, one])
    assert (len(both), both.unmatched) == (2, 2)
    assert len(pooled([])) == 0
