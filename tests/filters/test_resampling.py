from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blesim.errors import DataError, UsageError
from blesim.filters.resampling import (
    Scheme,
    effective_sample_size,
    multinomial,
    resample,
    residual,
    stratified,
    systematic,
)

SCHEMES: tuple[Scheme, ...] = get_args(Scheme)
KERNELS = (multinomial, stratified, systematic, residual)
# Shares 0.1, 0.4, 0.5.
WEIGHTS = np.array([1.0, 0.0, 4.0, 5.0])


def test_draws_worked_by_hand() -> None:
    uniforms = np.array([0.95, 0.05, 0.5, 0.3])
    # Running totals 0.1, 0.1, 0.5, 1: the row is the first whose total exceeds the number.
    assert multinomial(WEIGHTS, uniforms, 4).tolist() == [3, 0, 3, 2]
    # Places (0.95, 1.05, 2.5, 3.3) / 4.
    assert stratified(WEIGHTS, uniforms, 4).tolist() == [2, 2, 3, 3]
    # Places (0.2, 1.2, 2.2, 3.2) / 4.
    assert systematic(WEIGHTS, np.array([0.2]), 4).tolist() == [0, 2, 3, 3]
    # 0.4, 0, 1.6, 2 copies: one and two for certain, one draw with 0.4 against 0.6.
    assert residual(WEIGHTS, np.array([0.39, 0, 0, 0]), 4).tolist() == [2, 3, 3, 0]
    assert residual(WEIGHTS, np.array([0.41, 0, 0, 0]), 4).tolist() == [2, 3, 3, 2]


@given(
    st.lists(st.one_of(st.just(0.0), st.floats(0, 1e300)), min_size=1, max_size=30),
    st.integers(0, 40),
    st.integers(0, 1000),
)
def test_what_every_scheme_keeps_to(weights: list[float], count: int, seed: int) -> None:
    given_weights = np.array(weights)
    for scheme in SCHEMES:
        rows = resample(scheme, given_weights, count, np.random.default_rng(seed))
        assert rows.shape == (count,)
        assert np.all((rows >= 0) & (rows < len(weights)))
        if given_weights.any():
            assert np.all(given_weights[rows] > 0)
        again = resample(scheme, given_weights, count, np.random.default_rng(seed))
        np.testing.assert_array_equal(rows, again)
    np.testing.assert_array_equal(given_weights, weights)


@pytest.mark.parametrize("edge", [0.0, np.nextafter(1.0, 0.0)])
def test_the_ends_of_the_range_of_uniform_numbers_name_particles_that_have_weight(
    edge: float,
) -> None:
    weights = np.array([0.0, 0.1, 0.2, 0.3, 0.0])
    for kernel in KERNELS:
        rows = kernel(weights, np.full(7, edge), 7)
        assert set(rows.tolist()) <= {1, 2, 3}


def test_one_heavy_particle_has_all_copies() -> None:
    weights = np.full(50, 1e-300)
    weights[31] = 1.0
    for scheme in SCHEMES:
        assert set(resample(scheme, weights, 50, np.random.default_rng(1))) == {31}


def test_particles_that_all_have_weight_zero_are_equally_likely() -> None:
    for scheme in ("systematic", "stratified"):
        rows = resample(scheme, np.zeros(20), 20, np.random.default_rng(1))
        assert rows.tolist() == list(range(20))
    rows = resample("multinomial", np.zeros(20), 20, np.random.default_rng(1))
    as_equal = resample("multinomial", np.ones(20), 20, np.random.default_rng(1))
    np.testing.assert_array_equal(rows, as_equal)


def test_the_size_of_the_weights_does_not_matter() -> None:
    weights = np.array([1.0, 2.0, 3.0, 4.0])
    for scheme in SCHEMES:
        rows = [
            resample(scheme, weights * factor, 9, np.random.default_rng(2)).tolist()
            for factor in (1.0, 2.0**-1040, 2.0**1021)
        ]
        assert rows[0] == rows[1] == rows[2]


@pytest.mark.parametrize("bad", [[1.0, np.nan], [1.0, np.inf], [1.0, -1e-9], []])
def test_bad_weights_are_refused(bad: list[float]) -> None:
    for scheme in SCHEMES:
        with pytest.raises(DataError, match="particle weights"):
            resample(scheme, np.array(bad), 3, np.random.default_rng(1))
    with pytest.raises(DataError, match="particle weights"):
        effective_sample_size(np.array(bad))


def test_an_unknown_scheme_and_too_few_numbers_are_refused() -> None:
    with pytest.raises(UsageError, match="'best': use one of multinomial, stratified"):
        resample("best", WEIGHTS, 3, np.random.default_rng(1))  # type: ignore[arg-type]  # on purpose
    for kernel in KERNELS:
        with pytest.raises(ValueError, match="as many uniform numbers"):
            kernel(WEIGHTS, np.empty(0), 3)


def test_the_effective_sample_size() -> None:
    assert effective_sample_size(np.full(40, 0.3)) == pytest.approx(40)
    assert effective_sample_size(np.array([0.0, 7.0, 0.0])) == 1.0
    # (1 + 4 + 5)^2 / (1 + 16 + 25).
    assert effective_sample_size(WEIGHTS) == pytest.approx(100 / 42)
    assert effective_sample_size(np.zeros(12)) == 12.0
    assert effective_sample_size(np.array([1e-200, 1e-200])) == pytest.approx(2)
