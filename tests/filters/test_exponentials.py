import numpy as np

from blesim.filters.exponentials import fill_exponentials, fill_logarithms


def test_logarithms_are_those_of_numpy() -> None:
    rng = np.random.default_rng(81)
    values = np.concatenate(
        [10.0 ** rng.uniform(-290, 290, 5000), rng.uniform(0.4, 2.5, 5000), [0.5, 1.0, 2.0**0.5]]
    )
    out = np.empty(len(values))
    fill_logarithms(values, out)
    np.testing.assert_allclose(out, np.log(values), rtol=1e-15, atol=1e-15)
    assert out[-2] == 0.0


def test_logarithms_may_take_the_place_of_their_values() -> None:
    values = np.array([1.0, np.e, 10.0])
    fill_logarithms(values, values)
    np.testing.assert_allclose(values, [0.0, 1.0, np.log(10.0)], rtol=1e-15)


def test_exponentials_are_those_of_numpy() -> None:
    rng = np.random.default_rng(82)
    values = np.concatenate([-(10.0 ** rng.uniform(-12, 2.8, 10_000)), [0.0, -0.0, -699.0]])
    out = np.empty(len(values))
    fill_exponentials(values, out)
    np.testing.assert_allclose(out, np.exp(values), rtol=1e-13)
    assert out[-3] == 1.0


def test_what_is_far_below_counts_as_nothing_beside_one() -> None:
    out = np.empty(3)
    fill_exponentials(np.array([-701.0, -1e9, -np.inf]), out)
    np.testing.assert_allclose(out, np.exp(-700.0), rtol=1e-13)
