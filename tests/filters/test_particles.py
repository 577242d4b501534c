import numpy as np
import pytest

from blesim.errors import DataError
from blesim.filters.particles import normalised, weighted_moments


def test_only_differences_of_log_weights_count() -> None:
    far_below_one = np.log([1.0, 2.0, 5.0]) - 5000.0
    np.testing.assert_allclose(normalised(far_below_one), [0.125, 0.25, 0.625], rtol=1e-12)


def test_log_weights_of_nothing() -> None:
    assert normalised(np.array([-np.inf, 0.0])).tolist() == [0.0, 1.0]
    assert normalised(np.full(4, -np.inf)).tolist() == [0.25] * 4


@pytest.mark.parametrize("bad", [[0.0, np.nan], [0.0, np.inf], []])
def test_bad_log_weights_are_refused(bad: list[float]) -> None:
    with pytest.raises(DataError, match="log weights"):
        normalised(np.array(bad))


def test_moments_are_those_of_numpy() -> None:
    rng = np.random.default_rng(7)
    x_m, y_m = rng.normal(1e4, 3, 200), rng.normal(-5, 1, 200)
    weights = rng.uniform(0, 9, 200)
    mean_x, mean_y, xx, yy, xy = weighted_moments(x_m, y_m, weights, 0.0)
    assert mean_x == pytest.approx(np.average(x_m, weights=weights), rel=1e-12)
    assert mean_y == pytest.approx(np.average(y_m, weights=weights), rel=1e-12)
    theirs = np.cov(x_m, y_m, aweights=weights, ddof=0)
    np.testing.assert_allclose([[xx, xy], [xy, yy]], theirs, rtol=1e-8)


def test_the_floor_is_added_to_both_variances() -> None:
    same = np.ones(3)
    assert weighted_moments(same, same, same, 0.25) == (1.0, 1.0, 0.25, 0.25, 0.0)


def test_particles_of_weight_zero_all_count_the_same() -> None:
    x_m = np.array([0.0, 4.0])
    assert weighted_moments(x_m, x_m, np.zeros(2), 0.0) == (2.0, 2.0, 4.0, 4.0, 4.0)


@pytest.mark.parametrize("bad", [[1.0, np.nan], [1.0, -0.5], [1.0, np.inf]])
def test_bad_weights_are_refused(bad: list[float]) -> None:
    with pytest.raises(DataError, match="particle weights"):
        weighted_moments(np.ones(2), np.ones(2), np.array(bad), 0.0)


def test_no_particles_or_too_few_weights_are_refused() -> None:
    with pytest.raises(DataError, match="none"):
        weighted_moments(np.empty(0), np.empty(0), np.empty(0), 0.0)
    with pytest.raises(ValueError, match="one weight"):
        weighted_moments(np.ones(3), np.ones(3), np.ones(2), 0.0)
