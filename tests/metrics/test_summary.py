import itertools
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blesim.metrics.position_error import PositionErrors, no_errors
from blesim.metrics.summary import ErrorSummary, summarise

# Positions are recorded to a micrometre.
ERROR_M = st.integers(0, 10**10).map(lambda micrometres: micrometres / 1e6)


def errors_of(error_m, wrong_aisle=np.nan, graph_m=np.nan, unmatched=0):
    count = len(error_m)
    return PositionErrors(
        time_us=np.arange(count),
        error_m=np.asarray(error_m, float),
        wrong_level=np.zeros(count),
        wrong_aisle=np.full(count, wrong_aisle),
        graph_m=np.full(count, graph_m) if np.isscalar(graph_m) else np.asarray(graph_m),
        unmatched=unmatched,
    )


def test_figures_worked_by_hand():
    # 0, 1, 2, 3, 14: mean 4; mean of squares 42; variance 42 - 16 = 26. Percentile p lies at
    # position 4 p of the order statistics: 75 % at 3, 90 % at 3.6 -> 3 + 0.6 * 11, 95 % at 3.8.
    summary = summarise(errors_of([3, 14, 0, 2, 1], unmatched=7))
    assert (summary.n, summary.unmatched) == (5, 7)
    assert summary.mean_m == pytest.approx(4.0)
    assert summary.std_m == pytest.approx(np.sqrt(26))
    assert summary.rmse_m == pytest.approx(np.sqrt(42))
    assert (summary.median_m, summary.ce50_m) == (2.0, 2.0)
    assert summary.p75_m == pytest.approx(3.0)
    assert summary.p90_m == pytest.approx(9.6)
    assert summary.ce95_m == pytest.approx(11.8)
    assert summary.max_m == 14.0


@given(st.lists(ERROR_M, min_size=1, max_size=50))
def test_laws_of_the_figures(error_m):
    s = summarise(errors_of(error_m))
    assert s.rmse_m**2 == pytest.approx(s.mean_m**2 + s.std_m**2, rel=1e-9, abs=1e-9)
    rising = [s.median_m, s.p75_m, s.p90_m, s.ce95_m, s.max_m]
    assert all(low <= high * (1 + 1e-12) for low, high in itertools.pairwise(rising))
    assert s.mean_m <= s.rmse_m * (1 + 1e-12)
    assert s.max_m == max(error_m)


@given(st.lists(ERROR_M, min_size=1, max_size=20), st.integers(2, 4))
def test_hearing_everything_twice_changes_neither_mean_nor_spread(error_m, times):
    once, more = summarise(errors_of(error_m)), summarise(errors_of(error_m * times))
    assert more.mean_m == pytest.approx(once.mean_m)
    assert more.std_m == pytest.approx(once.std_m, abs=1e-6)
    assert more.n == times * once.n


def test_nothing_to_form_figures_of_gives_none():
    summary = summarise(no_errors(3))
    assert (summary.n, summary.unmatched) == (0, 3)
    rest = [field.name for field in fields(ErrorSummary)][2:]
    assert all(getattr(summary, name) is None for name in rest)


def test_rates_and_graph_distance_are_means():
    summary = summarise(errors_of([1, 1], wrong_aisle=1.0, graph_m=[1.0, 4.0]))
    assert (summary.wrong_aisle, summary.graph_mean_m, summary.wrong_level) == (1.0, 2.5, 0.0)


@pytest.mark.parametrize("missing", [np.nan, np.inf])
def test_a_part_never_stands_for_the_whole(missing):
    summary = summarise(errors_of([1, 1], graph_m=[1.0, missing]))
    assert summary.graph_mean_m is None
    assert summary.wrong_aisle is None
