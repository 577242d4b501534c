"""Kalman, extended and unscented filters against filterpy's on the same traces, to 1e-9."""

import numpy as np
import pytest
from filterpy.kalman import (
    ExtendedKalmanFilter,
    KalmanFilter,
    MerweScaledSigmaPoints,
    UnscentedKalmanFilter,
)

from blesim.filters import kalman, unscented

INTERVAL_S = 0.5
TRANSITION = np.eye(4) + INTERVAL_S * np.eye(4, k=2)
PROCESS_NOISE = np.diag([0.01, 0.01, 0.2, 0.1])
PLACES_ONLY = np.eye(2, 4)
BEACONS_M = np.array([[0.0, 0.0], [12.0, 1.0], [5.0, 9.0]])
RANGE_NOISE = np.diag([1.5, 2.0, 0.7])
START = np.array([3.0, 3.0, 0.5, 0.1])
START_COVARIANCE = np.diag([4.0, 4.0, 1.0, 1.0]) + 0.3


def walk() -> np.ndarray:
    steps = np.arange(60)[:, None] * INTERVAL_S
    return np.hstack([3.0 + 0.2 * steps, 3.0 + np.sin(0.3 * steps)])


def ranges(states: np.ndarray) -> np.ndarray:
    """Distances (..., 3) of states (..., 4) to the beacons."""
    return np.linalg.norm(states[..., None, :2] - BEACONS_M, axis=-1)


def range_jacobian(state: np.ndarray) -> np.ndarray:
    away = (state[:2] - BEACONS_M) / ranges(state)[:, None]
    return np.hstack([away, np.zeros((3, 2))])


def moved(states: np.ndarray) -> np.ndarray:
    """States after a step that turns the velocity a little: no linear model."""
    angle = 0.1 * np.tanh(states[..., 0])
    turned = states.copy()
    turned[..., 2] = np.cos(angle) * states[..., 2] - np.sin(angle) * states[..., 3]
    turned[..., 3] = np.sin(angle) * states[..., 2] + np.cos(angle) * states[..., 3]
    turned[..., :2] += INTERVAL_S * turned[..., 2:]
    return turned


def same(ours: tuple[np.ndarray, np.ndarray], theirs: KalmanFilter) -> None:
    np.testing.assert_allclose(ours[0], theirs.x, rtol=0, atol=1e-9)
    np.testing.assert_allclose(ours[1], theirs.P, rtol=0, atol=1e-9)


def test_the_linear_filter() -> None:
    rng = np.random.default_rng(1)
    noise = np.array([[2.0, 0.4], [0.4, 1.0]])
    theirs = KalmanFilter(dim_x=4, dim_z=2)
    theirs.x, theirs.P = START.copy(), START_COVARIANCE.copy()
    theirs.F, theirs.Q, theirs.H, theirs.R = TRANSITION, PROCESS_NOISE, PLACES_ONLY, noise
    mean, covariance = START, START_COVARIANCE
    for place in walk():
        measured = place + rng.normal(0, 1, 2)
        theirs.predict()
        mean, covariance = kalman.predict(mean, covariance, TRANSITION, PROCESS_NOISE)
        same((mean, covariance), theirs)
        theirs.update(measured)
        after = kalman.update_linear(mean, covariance, measured, PLACES_ONLY, noise)
        mean, covariance = after.mean, after.covariance
        same((mean, covariance), theirs)
        np.testing.assert_allclose(after.innovation, theirs.y, rtol=0, atol=1e-9)
        np.testing.assert_allclose(after.innovation_covariance, theirs.S, rtol=0, atol=1e-9)


@pytest.mark.parametrize("in_turn", [False, True])
def test_the_extended_filter(in_turn: bool) -> None:
    rng = np.random.default_rng(2)
    theirs = ExtendedKalmanFilter(dim_x=4, dim_z=3)
    theirs.x, theirs.P = START.copy(), START_COVARIANCE.copy()
    theirs.F, theirs.Q, theirs.R = TRANSITION, PROCESS_NOISE, RANGE_NOISE
    mean, covariance = START, START_COVARIANCE
    for place in walk():
        measured = ranges(place) + rng.normal(0, 1, 3)
        theirs.predict()
        mean = TRANSITION @ mean
        covariance = kalman.predict_covariance(covariance, TRANSITION, PROCESS_NOISE)
        theirs.update(measured, range_jacobian, ranges)
        off, jacobian = measured - ranges(mean), range_jacobian(mean)
        if in_turn:
            variance = np.diag(RANGE_NOISE).copy()
            after = kalman.update_in_turn(mean, covariance, off, jacobian, variance)
        else:
            after = kalman.update(mean, covariance, off, jacobian, RANGE_NOISE)
        mean, covariance = after.mean, after.covariance
        same((mean, covariance), theirs)


@pytest.mark.parametrize(("alpha", "beta", "kappa"), [(0.1, 2.0, 0.0), (1.0, 0.0, 1.0)])
def test_the_unscented_filter(alpha: float, beta: float, kappa: float) -> None:
    rng = np.random.default_rng(3)
    theirs = UnscentedKalmanFilter(
        dim_x=4,
        dim_z=3,
        dt=INTERVAL_S,
        hx=ranges,
        fx=lambda state, _: moved(state),
        points=MerweScaledSigmaPoints(4, alpha, beta, kappa),
    )
    theirs.x, theirs.P = START.copy(), START_COVARIANCE.copy()
    theirs.Q, theirs.R = PROCESS_NOISE, RANGE_NOISE
    scaling = unscented.Scaling(alpha=alpha, beta=beta, kappa=kappa)
    mean, covariance = START, START_COVARIANCE
    for place in walk():
        measured = ranges(place) + rng.normal(0, 1, 3)
        theirs.predict()
        mean, covariance = unscented.predict(mean, covariance, moved, PROCESS_NOISE, scaling)
        same((mean, covariance), theirs)
        theirs.update(measured)
        after = unscented.update(mean, covariance, measured, ranges, RANGE_NOISE, scaling)
        mean, covariance = after.mean, after.covariance
        same((mean, covariance), theirs)
        np.testing.assert_allclose(after.innovation_covariance, theirs.S, rtol=0, atol=1e-9)
