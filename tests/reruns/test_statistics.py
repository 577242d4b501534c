"""Means, intervals, ratios and orderings, on numbers worked by hand."""

import numpy as np
import pytest

from blesim.reruns.base import Expected, Key, Published, Trial
from blesim.reruns.statistics import figures_of, interval, orderings_of, stacked

A, B, C = (Key("table 1", row, "mean [m]") for row in ("a", "b", "c"))


class Experiment:
    paper = "p"
    title = "t"
    published = (
        Published(key=A, value=2.0),
        Published(key=B, value=4.0),
        Published(key=C, value=9.0, compared=False),
    )
    expected = (
        Expected(better=A, worse=B, condition="alike", strong=True),
        Expected(better=B, worse=C, condition="alike"),
    )

    def trial(self, seed, *, pictures=False):
        del pictures
        return Trial(numbers={A: float(seed), B: seed + 2.0, C: 1.0})

    def overview(self, numbers):
        del numbers
        return ()


NUMBERS = stacked([dict(Experiment().trial(seed).numbers) for seed in (1, 2, 3)])


def test_numbers_are_stacked_by_key():
    assert NUMBERS[B].tolist() == [3.0, 4.0, 5.0]
    assert np.isnan(stacked([{A: 1.0}, {B: 2.0}])[B][0])


def test_the_interval_is_students():
    # Mean 2, standard deviation 1, t(0.975, 2) = 4.30265: 4.30265 / sqrt(3) = 2.48414.
    mean, low, high = interval(np.array([1.0, 2.0, 3.0]))
    assert mean == 2.0
    assert (low, high) == pytest.approx((2.0 - 2.48414, 2.0 + 2.48414), abs=1e-5)
    assert np.isnan(interval(np.array([7.0]))[1])


def test_95_of_100_intervals_hold_the_mean():
    rng = np.random.default_rng(7)
    held = 0
    for _ in range(1000):
        _, low, high = interval(rng.normal(3.0, 2.0, 5))
        held += low <= 3.0 <= high
    # Binomial(1000, 0.95): outside 925 to 972 once in a thousand runs.
    assert 925 <= held <= 972


def test_figures_stand_beside_the_published_ones():
    a, b, c = figures_of(Experiment(), NUMBERS)
    assert (a.simulated, a.published, a.ratio, a.agrees) == (2.0, 2.0, 1.0, True)
    assert (b.ratio, b.agrees) == (1.0, True)
    assert c.ratio == pytest.approx(1 / 9)
    assert c.agrees is None
    off = figures_of(Experiment(), {A: np.array([3.01]), B: np.array([2.66]), C: np.array([1.0])})
    assert [figure.agrees for figure in off] == [False, False, None]


def test_an_ordering_holds_if_its_sign_does():
    first, second = orderings_of(Experiment(), NUMBERS)
    assert first.published_difference == -2.0
    assert first.simulated_difference == -2.0
    assert first.held
    assert first.strong
    assert second.published_difference == -5.0
    assert second.simulated_difference == 3.0
    assert not second.held


def test_differences_are_paired():
    # The spread between the seeds is common to both, and no part of the interval.
    (ordering, _) = orderings_of(Experiment(), NUMBERS)
    assert (ordering.low, ordering.high) == (-2.0, -2.0)


def test_an_ordering_in_words_holds_if_better_is_less():
    experiment = Experiment()
    experiment.published = ()
    found = orderings_of(experiment, NUMBERS)
    assert [each.published_difference for each in found] == [None, None]
    assert [each.held for each in found] == [each.simulated_difference < 0 for each in found]
