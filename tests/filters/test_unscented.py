import numpy as np
import pytest

from blesim.errors import DataError
from blesim.filters import kalman, unscented
from blesim.filters.unscented import Scaling
from blesim.units import wrap_angle

SCALINGS = [Scaling(), Scaling(alpha=1e-3), Scaling(alpha=1.0, beta=0.0, kappa=1.0)]
MEAN = np.array([1.0, -2.0, 0.5])
ROOT = np.array([[2.0, 0.0, 0.0], [0.5, 1.0, 0.0], [-0.3, 0.2, 0.4]])
COVARIANCE = ROOT @ ROOT.T


@pytest.mark.parametrize("scaling", SCALINGS)
def test_sigma_points_have_the_moments_of_the_belief(scaling: Scaling) -> None:
    points = unscented.sigma_points(MEAN, COVARIANCE, scaling)
    of_mean, _ = scaling.weights(3)
    apart = points - MEAN
    assert points.shape == (7, 3)
    np.testing.assert_allclose(of_mean @ apart, 0, atol=1e-8)
    np.testing.assert_allclose((of_mean[:, None] * apart).T @ apart, COVARIANCE, atol=1e-8)


@pytest.mark.parametrize("scaling", SCALINGS)
def test_on_linear_models_it_is_the_linear_filter(scaling: Scaling) -> None:
    rng = np.random.default_rng(5)
    transition, model = rng.normal(0, 1, (3, 3)), rng.normal(0, 1, (2, 3))
    noise, measured = np.array([[1.0, 0.2], [0.2, 0.5]]), np.array([0.3, 4.0])
    ours = unscented.predict(MEAN, COVARIANCE, lambda s: s @ transition.T, np.eye(3), scaling)
    theirs = kalman.predict(MEAN, COVARIANCE, transition, np.eye(3))
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-8)
    updated = unscented.update(MEAN, COVARIANCE, measured, lambda s: s @ model.T, noise, scaling)
    linear = kalman.update_linear(MEAN, COVARIANCE, measured, model, noise)
    for one, other in zip(updated, linear, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-8)


def test_the_mean_of_a_square_worked_by_hand() -> None:
    # E x^2 = m^2 + P exactly, whatever the scaling: 9 + 4.
    for scaling in SCALINGS:
        out = unscented.transform(
            np.array([3.0]), np.array([[4.0]]), np.square, np.zeros((1, 1)), scaling
        )
        assert out.mean[0] == pytest.approx(13.0, abs=1e-8)
        # Covariance of x with x^2 is 2 m P.
        assert out.cross[0, 0] == pytest.approx(24.0, abs=1e-6)


def test_a_known_state_has_no_spread() -> None:
    covariance = np.diag([1.0, 0.0, 2.0])
    points = unscented.sigma_points(MEAN, covariance, Scaling())
    np.testing.assert_array_equal(points[:, 1], MEAN[1])


def test_headings_on_both_sides_of_south_are_close() -> None:
    def turned(one: np.ndarray, other: np.ndarray) -> np.ndarray:
        return wrap_angle(one - other)

    mean, covariance = np.array([np.pi - 0.01]), np.array([[0.04]])
    after = unscented.update(
        mean,
        covariance,
        np.array([-np.pi + 0.03]),
        wrap_angle,
        np.array([[0.04]]),
        Scaling(),
        turned,
    )
    assert after.innovation[0] == pytest.approx(0.04)
    assert after.mean[0] == pytest.approx(np.pi + 0.01)
    assert after.covariance[0, 0] == pytest.approx(0.02)


def test_a_negative_variance_is_refused() -> None:
    with pytest.raises(DataError, match="not positive semidefinite"):
        unscented.sigma_points(np.zeros(2), np.array([[1.0, 2.0], [2.0, 1.0]]), Scaling())


def test_the_covariance_stays_exactly_symmetric() -> None:
    def ranges(states: np.ndarray) -> np.ndarray:
        return np.hypot(states[:, :1] - np.array([0.0, 5.0]), states[:, 1:2])

    after = unscented.update(MEAN, COVARIANCE, np.array([2.0, 4.0]), ranges, np.eye(2), Scaling())
    assert np.array_equal(after.covariance, after.covariance.T)
    assert np.linalg.eigvalsh(after.covariance).min() > 0
