import numpy as np
import pytest
from scipy import stats

from blesim.walkers.shopping import (
    basket_size,
    drawn_sections,
    times_us,
    with_detours,
)
from blesim.walkers.trading_day import Basket, Detours, Spread
from blesim.walkers.visiting_order import along_circuit, nearest_next


def test_basket_sizes_have_the_mean_and_spread_asked_for():
    normals = stats.norm.ppf((np.arange(20000) + 0.5) / 20000)
    sizes = [basket_size(Basket(mean=15, spread=8), n, 320) for n in normals]
    assert np.mean(sizes) == pytest.approx(15, rel=0.01)
    assert np.std(sizes) == pytest.approx(8, rel=0.02)
    assert basket_size(Basket(mean=15, spread=8), 9.0, 20) == 20
    assert basket_size(Basket(mean=1, spread=5), -9.0, 20) == 1


def test_sections_are_drawn_by_their_weights():
    weights = np.array([1.0, 2.0, 3.0, 0.0, 4.0])
    first = [int(drawn_sections(1, weights, 7, f"s{k}")[0]) for k in range(2000)]
    counts = np.bincount(first, minlength=5)
    assert counts[3] == 0
    # False alarm once in ten thousand.
    assert stats.chisquare(counts[[0, 1, 2, 4]], 200.0 * weights[[0, 1, 2, 4]]).pvalue > 1e-4


def test_nothing_is_twice_on_a_list():
    drawn = drawn_sections(50, np.ones(60), 7, "s")
    assert len(set(drawn.tolist())) == 50
    assert len(drawn_sections(50, np.array([1.0, 1.0, 0.0]), 7, "s")) == 2


def test_times_are_log_normal():
    uniforms = (np.arange(9999) + 0.5) / 9999
    times = times_us(Spread(median_s=20.0, spread=0.6), uniforms)
    assert np.median(times) == pytest.approx(20e6, rel=1e-6)
    assert np.log(times).std() == pytest.approx(0.6, rel=0.01)


def test_nearest_next_walks_along_a_line():
    at = np.array([5.0, 1.0, 9.0, 4.0])
    between = np.abs(at[:, None] - at[None, :])
    assert nearest_next(np.array([0, 2, 3, 1]), at, between).tolist() == [1, 3, 0, 2]
    assert nearest_next(np.empty(0, np.int64), at, between).tolist() == []


def test_a_circuit_passes_the_gates_of_all_aisles():
    circuit = np.array([3, 1, 0, 2, 4])
    sections, stops = along_circuit(np.array([0, 4]), circuit, np.array([1, 2]))
    assert sections.tolist() == [1, 0, 2, 4]
    assert stops.tolist() == [False, True, False, True]


def test_detours_pass_and_impulses_stop():
    neighbours = np.array([[1], [0], [1]])
    always = Detours(probability=1.0, impulse_probability=1.0)
    uniforms = np.array([[0.5, 0.5, 0.7, 0.2]])
    sections, stops = with_detours(np.array([0]), np.array([True]), neighbours, always, uniforms)
    assert sections.tolist() == [2, 0, 1]
    assert stops.tolist() == [False, True, True]
    never = Detours(probability=0.0, impulse_probability=0.0)
    same, _ = with_detours(np.array([0]), np.array([True]), neighbours, never, uniforms)
    assert same.tolist() == [0]
