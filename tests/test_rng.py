from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import special, stats

from blesim.errors import UsageError
from blesim.rng import Draws, name_key, normal_quantile, philox, uniform

DRAWS = Draws(seed=20, purpose="fading", walker="w1", beacon="D7")
COUNT = 50_000
ORDINALS = np.arange(COUNT)
# Every statistical test below may fail by chance once in this many other streams; the seed is
# fixed, so it either always passes or never.
FALSE_ALARM = 1e-4
Z_LIMIT = float(stats.norm.isf(FALSE_ALARM / 2))

# Computed with numpy.random.Philox and scipy.special.ndtri, not with blesim.
GOLDEN_KEY = 0xAECD6507B598D99A
GOLDEN_WORDS = [9511838223068147397, 2784996801494747231, 16810451341626895378, 4372670388474222252]
GOLDEN_UNIFORMS = [0.5156377832890572, 0.1509749791272893, 0.9112963932526871, 0.23704293673733934]
GOLDEN_NORMALS = [0.039208153075689485, -1.0322608025073459, 1.348781329132122, -0.715846925572711]
GOLDEN_INTEGERS = [1704666128817266892, 2253613729213197005]

WORDS = st.integers(0, 2**64 - 1)


def numpy_words(key: tuple[int, int], ordinal: int, x: int, y: int) -> list[int]:
    """First four words of NumPy's generator at an address."""
    counter = np.array([ordinal, x, y, 0], dtype=np.uint64)
    bits = np.random.Philox(key=np.array(key, dtype=np.uint64), counter=counter)
    return [int(word) for word in bits.random_raw(4)]


def kernel_words(address: tuple[int, int, int, int], ordinal: int) -> list[int]:
    return [int(w) for w in philox(np.array(address, dtype=np.uint64), np.uint64(ordinal))]


@given(seed=WORDS, purpose=WORDS, walker=WORDS, beacon=WORDS, ordinal=st.integers(0, 2**63 - 1))
def test_words_are_those_of_numpy(
    seed: int, purpose: int, walker: int, beacon: int, ordinal: int
) -> None:
    expected = numpy_words((seed, purpose), ordinal, walker, beacon)
    assert kernel_words((seed, purpose, walker, beacon), ordinal) == expected


@pytest.mark.parametrize("seed", [0, 1, 2**32, 2**63, 2**64 - 1])
@pytest.mark.parametrize("ordinal", [0, 1, 2**31, 2**32 - 1, 2**53 + 1, 2**63 - 1])
def test_words_are_those_of_numpy_at_the_limits(seed: int, ordinal: int) -> None:
    key = name_key("fading")
    assert kernel_words((seed, key, 0, 0), ordinal) == numpy_words((seed, key), ordinal, 0, 0)


def test_uniforms_and_numpy_at_the_largest_address() -> None:
    draws = Draws(seed=2**64 - 1, purpose="p", walker="w", beacon="b")
    ordinal = 2**63 - 1
    words = numpy_words((2**64 - 1, name_key("p")), ordinal, name_key("w"), name_key("b"))
    expected = [((word >> 12) + 0.5) / 2**52 for word in words]
    assert draws.uniforms(np.array([ordinal]))[0].tolist() == expected


def test_golden_values_pin_the_stream_for_ever() -> None:
    assert name_key("") == 0
    assert name_key("fading") == GOLDEN_KEY
    assert kernel_words((20, name_key("fading"), name_key("w1"), name_key("D7")), 3) == GOLDEN_WORDS
    np.testing.assert_array_equal(DRAWS.uniforms(np.array([3]))[0], GOLDEN_UNIFORMS)
    np.testing.assert_allclose(DRAWS.normals(np.array([3]))[0], GOLDEN_NORMALS, rtol=1e-14)
    assert DRAWS.generator().integers(0, 2**62, 2).tolist() == GOLDEN_INTEGERS


@pytest.mark.parametrize("word", [0, 2**11, 2**12, 2**63, 2**64 - 2**12, 2**64 - 1])
def test_a_uniform_is_never_an_end(word: int) -> None:
    assert 0.0 < uniform(np.uint64(word)) < 1.0
    assert np.isfinite(normal_quantile(uniform(np.uint64(word))))


@given(WORDS)
def test_uniforms_are_symmetric_about_one_half(word: int) -> None:
    assert uniform(np.uint64(word)) + uniform(np.uint64(2**64 - 1 - word)) == 1.0


def test_normals_are_the_quantiles_of_the_uniforms() -> None:
    expected = special.ndtri(DRAWS.uniforms(ORDINALS))
    np.testing.assert_allclose(DRAWS.normals(ORDINALS), expected, rtol=1e-14, atol=1e-15)


def test_quantiles_far_out_in_both_tails() -> None:
    p = np.concatenate([np.logspace(-16, -0.31, 400), [0.075, 0.925, 0.5]])
    ours = np.array([normal_quantile(float(each)) for each in p])
    np.testing.assert_allclose(ours, special.ndtri(p), rtol=1e-14, atol=1e-15)
    # The check points printed with the algorithm (Wichura 1988).
    for probability, quantile in ((0.25, -0.6744897501960817), (1e-3, -3.090232306167814)):
        assert normal_quantile(probability) == pytest.approx(quantile, rel=1e-15)
    assert normal_quantile(1e-20) == pytest.approx(-9.262340089798408, rel=1e-15)


def test_uniforms_are_uniform() -> None:
    values = DRAWS.uniforms(ORDINALS).ravel()
    assert stats.kstest(values, "uniform").pvalue > FALSE_ALARM
    low_bits = np.floor(values * 2.0**52) % 16
    assert stats.chisquare(np.bincount(low_bits.astype(int), minlength=16)).pvalue > FALSE_ALARM


def test_normals_are_normal() -> None:
    values = DRAWS.normals(ORDINALS).ravel()
    root_n = np.sqrt(len(values))
    assert stats.kstest(values, "norm").pvalue > FALSE_ALARM
    assert abs(values.mean()) < Z_LIMIT / root_n
    # Variances of the sample moments of N(0, 1): 2, 15 (third, about 0) and 96 (fourth).
    assert abs((values**2).mean() - 1.0) < Z_LIMIT * np.sqrt(2.0) / root_n
    assert abs((values**3).mean()) < Z_LIMIT * np.sqrt(15.0) / root_n
    assert abs((values**4).mean() - 3.0) < Z_LIMIT * np.sqrt(96.0) / root_n


def correlation(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])


@pytest.mark.parametrize(
    "change",
    [{"seed": 21}, {"purpose": "fading "}, {"walker": "w2"}, {"walker": ""}, {"beacon": "D8"}],
    ids=str,
)
def test_another_name_is_another_stream(change: dict[str, object]) -> None:
    mine = DRAWS.normals(ORDINALS)
    theirs = replace(DRAWS, **change).normals(ORDINALS)  # type: ignore[arg-type]
    assert abs(correlation(mine, theirs)) < Z_LIMIT / np.sqrt(mine.size)


def test_walker_and_beacon_are_not_interchangeable() -> None:
    swapped = replace(DRAWS, walker="D7", beacon="w1")
    assert not np.any(swapped.uniforms(ORDINALS[:100]) == DRAWS.uniforms(ORDINALS[:100]))


@pytest.mark.parametrize("lag", [1, 2, 3, 64])
def test_ordinals_do_not_correlate(lag: int) -> None:
    values = DRAWS.normals(ORDINALS)
    assert abs(correlation(values[lag:], values[:-lag])) < Z_LIMIT / np.sqrt(values[lag:].size)


def test_the_four_numbers_of_an_ordinal_do_not_correlate() -> None:
    off_diagonal = np.corrcoef(DRAWS.normals(ORDINALS).T)[np.triu_indices(4, 1)]
    assert np.abs(off_diagonal).max() < stats.norm.isf(FALSE_ALARM / 12) / np.sqrt(COUNT)


def test_a_draw_depends_on_its_ordinal_alone() -> None:
    whole = DRAWS.normals(ORDINALS)
    some = np.random.default_rng(5).permutation(COUNT)[:1000]
    np.testing.assert_array_equal(DRAWS.normals(some), whole[some])
    np.testing.assert_array_equal(DRAWS.normals(ORDINALS[::7]), whole[::7])
    np.testing.assert_array_equal(DRAWS.normals(np.array([9])), whole[[9]])
    assert DRAWS.normals(ORDINALS[:0]).shape == (0, 4)


def test_other_names_and_generators_disturb_nothing() -> None:
    before = DRAWS.uniforms(ORDINALS[:10])
    replace(DRAWS, beacon="E1").uniforms(ORDINALS)
    DRAWS.generator().random(1000)
    np.random.default_rng(3).random(10)
    np.testing.assert_array_equal(DRAWS.uniforms(ORDINALS[:10]), before)


def test_a_generator_begins_anew_and_never_meets_the_single_draws() -> None:
    raw = DRAWS.generator().bit_generator.random_raw(4 * COUNT)
    again = DRAWS.generator().bit_generator.random_raw(4 * COUNT)
    np.testing.assert_array_equal(raw, again)
    singles = DRAWS.uniforms(ORDINALS).ravel()
    sequence = ((raw >> np.uint64(12)).astype(np.float64) + 0.5) / 2.0**52
    assert not np.intersect1d(singles, sequence).size
    assert abs(correlation(singles, sequence)) < Z_LIMIT / np.sqrt(singles.size)
    # Disjoint for every ordinal, not only these: the fourth counter words differ.
    assert DRAWS.generator().bit_generator.state["state"]["counter"][3] == 1


@pytest.mark.parametrize("seed", [-1, 2**64])
def test_seeds_out_of_range(seed: int) -> None:
    with pytest.raises(UsageError, match="whole number from 0 to"):
        Draws(seed=seed, purpose="fading")


def test_a_draw_needs_a_purpose() -> None:
    with pytest.raises(ValueError, match="purpose"):
        Draws(seed=1, purpose="")


@given(st.lists(st.text(min_size=1), min_size=2, max_size=20, unique=True))
def test_names_have_keys_of_their_own(names: list[str]) -> None:
    keys = {name_key(name) for name in names}
    assert len(keys) == len(names)
    assert all(0 < key < 2**64 for key in keys)
