import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blesim.errors import DataError
from blesim.filters import kalman
from blesim.filters.gating import squared_innovation


def belief(seed: int, states: int, spread: float) -> tuple[np.ndarray, np.ndarray]:
    """A mean and a covariance whose standard deviations span `spread` powers of ten."""
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(0, 1, (states, states)))
    root = turn * 10.0 ** np.linspace(-spread / 2, spread / 2, states)
    return rng.normal(0, 10, states), root @ root.T


def refuse_bad_covariance(covariance: np.ndarray, scale: float) -> None:
    assert np.array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance).min() >= -1e-12 * scale


cases = st.tuples(
    st.integers(0, 10_000), st.integers(1, 6), st.integers(0, 8), st.floats(0, 5), st.floats(-6, 3)
)


@given(cases)
def test_covariances_stay_symmetric_and_positive_semidefinite(
    case: tuple[int, int, int, float, float],
) -> None:
    seed, states, measurements, spread, noise_power = case
    mean, covariance = belief(seed, states, spread)
    rng = np.random.default_rng(seed + 1)
    model = rng.normal(0, 1, (measurements, states))
    variance = np.full(measurements, 10.0**noise_power)
    innovation = rng.normal(0, 1, measurements)
    scale = float(np.max(covariance))
    after = kalman.update(mean, covariance, innovation, model, np.diag(variance))
    refuse_bad_covariance(after.covariance, scale)
    in_turn = kalman.update_in_turn(mean, covariance, innovation, model, variance)
    refuse_bad_covariance(in_turn.covariance, scale)
    assert np.array_equal(after.innovation_covariance, after.innovation_covariance.T)
    transition = rng.normal(0, 1, (states, states))
    _, wider = kalman.predict(after.mean, after.covariance, transition, np.eye(states))
    assert np.array_equal(wider, wider.T)
    assert np.linalg.eigvalsh(wider).min() >= 1 - 1e-9 * max(1.0, np.max(wider))


@given(cases)
def test_one_by_one_is_the_same_as_all_at_once(case: tuple[int, int, int, float, float]) -> None:
    seed, states, measurements, _, noise_power = case
    mean, covariance = belief(seed, states, 2.0)
    rng = np.random.default_rng(seed + 1)
    model = rng.normal(0, 1, (measurements, states))
    variance = 10.0 ** (noise_power / 3) * rng.uniform(0.5, 2, measurements)
    innovation = rng.normal(0, 1, measurements)
    at_once = kalman.update(mean, covariance, innovation, model, np.diag(variance))
    in_turn = kalman.update_in_turn(mean, covariance, innovation, model, variance)
    np.testing.assert_allclose(in_turn.mean, at_once.mean, rtol=0, atol=1e-7)
    np.testing.assert_allclose(in_turn.covariance, at_once.covariance, rtol=0, atol=1e-7)
    # The innovations of turns are those of all at once, decorrelated.
    np.testing.assert_allclose(
        squared_innovation(in_turn.innovation, in_turn.innovation_covariance),
        squared_innovation(at_once.innovation, at_once.innovation_covariance),
        rtol=1e-6,
    )


def test_an_update_worked_by_hand() -> None:
    # P = 3, R = 1: K = 3/4, m = 0 + 3/4 * 2, P = (1/4)^2 * 3 + (3/4)^2 * 1 = 3/4, S = 4.
    one = np.ones((1, 1))
    after = kalman.update_linear(np.zeros(1), 3 * one, np.array([2.0]), one, one)
    assert after.mean.tolist() == [1.5]
    assert after.covariance.tolist() == [[0.75]]
    assert after.innovation.tolist() == [2.0]
    assert after.innovation_covariance.tolist() == [[4.0]]


def test_a_prediction_worked_by_hand() -> None:
    # One second at 2 m/s: variance 1 + 0.25 of the place, 0.25 shared with the velocity.
    transition = np.array([[1.0, 1.0], [0.0, 1.0]])
    mean, covariance = kalman.predict(
        np.array([1.0, 2.0]), np.diag([1.0, 0.25]), transition, np.diag([0.0, 0.5])
    )
    assert mean.tolist() == [3.0, 2.0]
    assert covariance.tolist() == [[1.25, 0.25], [0.25, 0.75]]


def test_without_measurements_nothing_changes() -> None:
    mean, covariance = belief(1, 3, 1.0)
    nothing = np.empty(0)
    for after in (
        kalman.update(mean, covariance, nothing, np.empty((0, 3)), np.empty((0, 0))),
        kalman.update_in_turn(mean, covariance, nothing, np.empty((0, 3)), nothing),
    ):
        np.testing.assert_array_equal(after.mean, mean)
        np.testing.assert_allclose(after.covariance, covariance, rtol=1e-15)


def test_what_is_given_is_left_as_it_is() -> None:
    mean, covariance = belief(1, 3, 1.0)
    innovation, model, noise = np.ones(2), np.eye(2, 3), np.eye(2)
    given = [mean, covariance, innovation, model, noise]
    copies = [array.copy() for array in given]
    kalman.update(*given)
    kalman.update_in_turn(mean, covariance, innovation, model, np.ones(2))
    kalman.predict(mean, covariance, np.eye(3), np.eye(3))
    for array, copy in zip(given, copies, strict=True):
        np.testing.assert_array_equal(array, copy)


def test_a_second_identical_measurement_without_noise_is_refused() -> None:
    mean, covariance = belief(1, 2, 0.0)
    same = np.ones((2, 2))
    with pytest.raises(DataError, match="singular; give every measurement a noise"):
        kalman.update(mean, covariance, np.ones(2), same, np.zeros((2, 2)))
    with pytest.raises(DataError, match="innovation variance"):
        kalman.update_in_turn(mean, 0 * covariance, np.ones(2), same, np.zeros(2))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite_is_refused(bad: float) -> None:
    mean, covariance = belief(1, 2, 0.0)
    with pytest.raises(DataError, match="innovation: not finite"):
        kalman.update(mean, covariance, np.array([bad]), np.eye(1, 2), np.eye(1))
    with pytest.raises(DataError, match="innovation: not finite"):
        kalman.update_in_turn(mean, covariance, np.array([bad]), np.eye(1, 2), np.ones(1))
    with pytest.raises(DataError, match="not positive semidefinite and finite"):
        kalman.update(mean, covariance * bad, np.ones(1), np.eye(1, 2), np.eye(1))


def test_shapes_that_do_not_fit_are_refused() -> None:
    mean, covariance = belief(1, 3, 0.0)
    with pytest.raises(ValueError, match="shapes"):
        kalman.predict(mean, covariance, np.eye(2), np.eye(3))
    with pytest.raises(ValueError, match="shapes"):
        kalman.predict_covariance(covariance, np.eye(3), np.eye(2))
    with pytest.raises(ValueError, match="shapes"):
        kalman.update(mean, covariance, np.ones(2), np.eye(2), np.eye(2))
    with pytest.raises(ValueError, match="shapes"):
        kalman.update(mean, covariance, np.ones(2), np.eye(2, 3), np.eye(1))
    with pytest.raises(ValueError, match="shapes"):
        kalman.update_linear(mean, covariance, np.ones(2), np.eye(2), np.eye(2))
    with pytest.raises(ValueError, match="one variance"):
        kalman.update_in_turn(mean, covariance, np.ones(2), np.eye(2, 3), np.ones(1))
