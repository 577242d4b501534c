"""The moves and updates of the constant-velocity state: by hand, and against filterpy."""

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter, KalmanFilter

from blesim.estimators.constant_velocity import (
    at_rest,
    moved,
    updated_by_places,
    updated_by_ranges,
)

BEACONS_M = np.array([[0.0, 0.0, 2.5], [12.0, 1.0, 2.0], [5.0, 9.0, 3.0]])
HEIGHT_M = 1.2
MEAN = np.array([3.0, 3.5, 0.5, 0.1])
COVARIANCE = np.diag([4.0, 3.0, 1.0, 1.0]) + 0.3
EVERYTHING = np.inf


def test_a_move_is_that_of_the_paper():
    # Eq 22, 23 and 26 for 2 s and 0.5 m/s of change in a second: Q = diag(0, 0, 0.5, 0.5).
    mean, covariance = moved(
        np.array([1.0, 2.0, 3.0, -1.0]), np.diag([1.0, 2.0, 3.0, 4.0]), 2.0, 0.5
    )
    assert mean.tolist() == [7.0, 0.0, 3.0, -1.0]
    expected = [[13, 0, 6, 0], [0, 18, 0, 8], [6, 0, 3.5, 0], [0, 8, 0, 4.5]]
    assert covariance.tolist() == expected


def test_a_state_at_rest_knows_no_velocity():
    belief = at_rest(np.array([1.0, 2.0]), np.array([[2.0, 0.5], [0.5, 1.0]]), 1.5, 3)
    assert belief.mean.tolist() == [1.0, 2.0, 0.0, 0.0]
    assert belief.covariance[:2, :2].tolist() == [[2.0, 0.5], [0.5, 1.0]]
    assert np.diagonal(belief.covariance)[2:].tolist() == [2.25, 2.25]
    assert belief.level == 3


def test_a_place_as_sure_as_the_state_is_met_half_way():
    mean, covariance = updated_by_places(
        np.zeros(4), np.eye(4), np.array([[2.0, 4.0]]), np.array([1.0])
    )
    np.testing.assert_allclose(mean, [1.0, 2.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(covariance, np.diag([0.5, 0.5, 1.0, 1.0]), atol=1e-12)


def test_two_places_equal_one_of_their_mean_and_half_the_variance():
    several = np.array([[2.0, 4.0], [4.0, 2.0]])
    two = updated_by_places(MEAN, COVARIANCE, several, np.array([2.0, 2.0]))
    one = updated_by_places(MEAN, COVARIANCE, several.mean(axis=0)[None], np.array([1.0]))
    for ours, theirs in zip(two, one, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_moves_and_places_equal_filterpys():
    rng = np.random.default_rng(1)
    theirs = KalmanFilter(dim_x=4, dim_z=2)
    theirs.x, theirs.P = MEAN.copy(), COVARIANCE.copy()
    theirs.H, theirs.R = np.eye(2, 4), 2.0 * np.eye(2)
    mean, covariance = MEAN, COVARIANCE
    for step in range(60):
        time_s = 0.3 + 0.1 * (step % 4)
        theirs.F = np.eye(4) + time_s * np.eye(4, k=2)
        theirs.Q = np.diag([0.0, 0.0, 0.49, 0.49]) * time_s
        place_m = rng.normal(5.0, 2.0, 2)
        theirs.predict()
        theirs.update(place_m)
        mean, covariance = moved(mean, covariance, time_s, 0.7)
        mean, covariance = updated_by_places(mean, covariance, place_m[None], np.array([2.0]))
        np.testing.assert_allclose(mean, theirs.x, rtol=0, atol=1e-9)
        np.testing.assert_allclose(covariance, theirs.P, rtol=0, atol=1e-9)


def distances_m(state):
    phone_m = np.array([state[0], state[1], HEIGHT_M])
    return np.linalg.norm(phone_m - BEACONS_M, axis=1)


def jacobian(state):
    away_m = state[:2] - BEACONS_M[:, :2]
    return np.hstack([away_m / distances_m(state)[:, None], np.zeros((3, 2))])


def test_moves_and_ranges_equal_filterpys():
    rng = np.random.default_rng(2)
    variance_m2 = np.array([1.5, 2.0, 0.7])
    theirs = ExtendedKalmanFilter(dim_x=4, dim_z=3)
    theirs.x, theirs.P, theirs.R = MEAN.copy(), COVARIANCE.copy(), np.diag(variance_m2)
    theirs.F, theirs.Q = np.eye(4) + np.eye(4, k=2), np.diag([0.0, 0.0, 0.25, 0.25])
    mean, covariance = MEAN, COVARIANCE
    for step in range(40):
        truth = np.array([3.0 + 0.2 * step, 3.0 + np.sin(0.3 * step)])
        ranges_m = distances_m(truth) + rng.normal(0.0, 1.0, 3)
        theirs.predict()
        theirs.update(ranges_m, jacobian, distances_m)
        mean, covariance = moved(mean, covariance, 1.0, 0.5)
        mean, covariance, _ = updated_by_ranges(
            mean, covariance, BEACONS_M, ranges_m, variance_m2, HEIGHT_M, EVERYTHING
        )
        np.testing.assert_allclose(mean, theirs.x, rtol=0, atol=1e-9)
        np.testing.assert_allclose(covariance, theirs.P, rtol=0, atol=1e-9)


def test_a_range_beyond_its_deviations_is_left_out():
    # State at (3, 4, 1) of a beacon at (0, 0, 1): 5 m, unit vector (0.6, 0.8); with P = 4 I on
    # the place and R = 5 the innovation has a deviation of 3 m.
    beacon_m, variance_m2 = np.array([[0.0, 0.0, 1.0]]), np.array([5.0])
    mean, covariance = np.array([3.0, 4.0, 0.0, 0.0]), np.diag([4.0, 4.0, 1.0, 1.0])

    def believed(range_m):
        after = updated_by_ranges(
            mean, covariance, beacon_m, np.array([range_m]), variance_m2, 1.0, 2.0
        )
        return after[2].tolist(), after[0]

    assert believed(10.9)[0] == [True]
    assert believed(11.1)[0] == [False]
    np.testing.assert_array_equal(believed(11.1)[1], mean)
    # Gain 4 / 9 along the unit vector, innovation 4.5 m: 2 m of (0.6, 0.8).
    np.testing.assert_allclose(believed(9.5)[1], [4.2, 5.6, 0.0, 0.0], atol=1e-12)


def test_right_under_a_beacon_the_update_is_finite():
    beacon_m = np.array([[3.0, 4.0, 1.0]])
    mean, covariance, _ = updated_by_ranges(
        np.array([3.0, 4.0, 0.0, 0.0]), np.eye(4), beacon_m, np.ones(1), np.ones(1), 1.0, EVERYTHING
    )
    assert np.all(np.isfinite(mean))
    assert np.all(np.isfinite(covariance))


@pytest.mark.parametrize("update", ["places", "ranges"])
def test_nothing_measured_changes_nothing(update):
    nothing = np.empty(0)
    mean, covariance = (
        updated_by_places(MEAN, COVARIANCE, np.empty((0, 2)), nothing)
        if update == "places"
        else updated_by_ranges(
            MEAN, COVARIANCE, np.empty((0, 3)), nothing, nothing, HEIGHT_M, EVERYTHING
        )[:2]
    )
    np.testing.assert_array_equal(mean, MEAN)
    np.testing.assert_array_equal(covariance, COVARIANCE)
