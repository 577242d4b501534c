"""What resampling keeps to: no bias, and how much the schemes vary."""

from typing import get_args

import numpy as np
import pytest
from scipy import stats

from blesim.filters.resampling import Scheme, resample, systematic

SCHEMES: tuple[Scheme, ...] = get_args(Scheme)
REPEATS = 4000
FALSE_ALARM = 1e-6


def weights_and_shares() -> tuple[np.ndarray, np.ndarray]:
    weights = np.random.default_rng(12).exponential(1.0, 25)
    weights[[3, 24]] = 0.0
    return weights, weights / weights.sum()


def copies(scheme: Scheme, weights: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Copies of each particle in each repeat, (repeats, particles)."""
    rng = np.random.default_rng(seed)
    return np.array(
        [
            np.bincount(resample(scheme, weights, count, rng), minlength=len(weights))
            for _ in range(REPEATS)
        ]
    )


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("count", [25, 40])
def test_the_number_of_copies_is_right_on_average(scheme: Scheme, count: int) -> None:
    """False alarms: one in a million for all particles together (Bonferroni)."""
    weights, shares = weights_and_shares()
    drawn = copies(scheme, weights, count, seed=13)
    limit = stats.norm.isf(FALSE_ALARM / len(weights) / 2)
    # No scheme varies more than independent draws.
    error = np.sqrt(count * shares * (1 - shares) / REPEATS)
    assert np.all(np.abs(drawn.mean(axis=0) - count * shares) <= limit * error + 1e-12)


def test_systematic_copies_are_right_exactly_over_all_numbers() -> None:
    weights, shares = weights_and_shares()
    middles = (np.arange(20_000) + 0.5) / 20_000
    drawn = sum(
        np.bincount(systematic(weights, middles[i : i + 1], 25), minlength=25)
        for i in range(len(middles))
    )
    np.testing.assert_allclose(drawn / len(middles), 25 * shares, rtol=0, atol=2 / 20_000)


def test_a_systematic_number_of_copies_is_one_of_the_two_nearest() -> None:
    weights, shares = weights_and_shares()
    drawn = copies("systematic", weights, 25, seed=14)
    assert np.all(drawn >= np.floor(25 * shares))
    assert np.all(drawn <= np.ceil(25 * shares))


def test_residual_keeps_the_certain_copies() -> None:
    weights, shares = weights_and_shares()
    assert np.all(copies("residual", weights, 25, seed=15) >= np.floor(25 * shares))


@pytest.mark.parametrize("scheme", ["stratified", "systematic", "residual"])
def test_a_cloud_s_mean_varies_less_than_with_independent_draws(scheme: Scheme) -> None:
    """The variances differ by a factor of two or more, 45 standard errors at 4000 repeats."""
    weights, _ = weights_and_shares()
    place = np.arange(len(weights))

    def variance(of: Scheme) -> float:
        return float(np.var(copies(of, weights, 25, seed=16) @ place / 25))

    assert variance(scheme) < 0.7 * variance("multinomial")


def test_multinomial_copies_have_the_variance_of_independent_draws() -> None:
    """Bonferroni over the particles; the spread of a variance by its fourth moment."""
    weights, shares = weights_and_shares()
    drawn = copies("multinomial", weights, 25, seed=17)
    expected = 25 * shares * (1 - shares)
    fourth = expected * (1 + 3 * (25 - 2) / 25 * expected)
    error = np.sqrt((fourth - expected**2) / REPEATS)
    limit = stats.norm.isf(FALSE_ALARM / len(weights) / 2)
    assert np.all(np.abs(drawn.var(axis=0) - expected) <= limit * error + 1e-12)
