"""Outlier detection 1, on numbers worked by hand."""

import numpy as np
import pytest

from blesim.estimators.enhanced_ranges import enhanced_ranges

NAN = np.nan


def enhanced(distances_m, variances_m2=None, drop=True):
    distances_m = np.array([distances_m], float)
    variances_m2 = np.ones_like(distances_m) if variances_m2 is None else np.array([variances_m2])
    (range_m,), (variance_m2,) = enhanced_ranges(distances_m, variances_m2, drop)
    return range_m, variance_m2


def test_distances_outside_the_interval_are_dropped():
    # Mean 5, squares 9 + 4 + 1 + 1 + 4 + 49 = 68, deviation sqrt(68 / 5) = 3.69: 12 goes.
    distances_m = [2.0, 3.0, 4.0, 4.0, 5.0, 12.0]
    mean = np.mean(distances_m)
    kept = [d for d in distances_m if abs(d - mean) <= np.std(distances_m, ddof=1)]
    assert kept == [2.0, 3.0, 4.0, 4.0, 5.0]
    assert enhanced(distances_m)[0] == pytest.approx(3.6)
    assert enhanced(distances_m, drop=False)[0] == pytest.approx(5.0)


def test_the_variance_is_the_mean_of_those_kept():
    distances_m, variances_m2 = [4.0, 5.0, 6.0, 30.0], [1.0, 2.0, 6.0, 100.0]
    assert enhanced(distances_m, variances_m2) == (5.0, 3.0)
    assert enhanced(distances_m, variances_m2, drop=False)[1] == pytest.approx(109 / 4)


def test_the_deviation_is_that_of_a_sample():
    # Sample deviation 3, so that all are kept; that of a population is 2.45.
    assert enhanced([2.0, 5.0, 8.0], [1.0, 2.0, 6.0]) == (5.0, 3.0)


@pytest.mark.parametrize("distances_m", [[3.0, 9.0, NAN], [NAN, 6.0, NAN], [6.0, 6.0, 6.0]])
def test_two_one_or_equal_distances_are_all_kept(distances_m):
    assert enhanced(distances_m)[0] == pytest.approx(6.0)


def test_equal_distances_are_kept_whatever_their_mean_rounds_to():
    for value in np.random.default_rng(1).uniform(0.1, 50.0, 200):
        assert enhanced([value] * 6)[0] == pytest.approx(value, abs=1e-12)


def test_a_beacon_without_a_distance_has_no_range():
    assert np.isnan(enhanced([NAN, NAN])).all()


def test_beacons_are_apart_from_each_other():
    distances_m = np.array([[1.0, 3.0], [NAN, NAN], [8.0, NAN]])
    ranges_m, _ = enhanced_ranges(distances_m, np.ones((3, 2)), True)
    np.testing.assert_array_equal(ranges_m, [2.0, NAN, 8.0])
