import numpy as np
import pytest
from scipy import stats

from blesim.walkers.arrivals import arrival_times_us, group_sizes, mean_group
from blesim.walkers.trading_day import ArrivalRate, Tills, TradingDay

TILLS = Tills(nodes=("t",))


def trading_day(**settings) -> TradingDay:
    return TradingDay(**({"entrance": "e", "tills": TILLS, "group_shares": (1.0,)} | settings))


def test_arrivals_are_poisson_in_each_hour():
    day = trading_day(
        opens="08:00",
        closes="11:00",
        shoppers=90.0,
        arrivals=(
            ArrivalRate(since="00:00", weight=1.0),
            ArrivalRate(since="09:00", weight=3.0),
            ArrivalRate(since="10:00", weight=0.5),
        ),
    )
    hours = np.array(
        [
            np.histogram(arrival_times_us(day, seed), bins=np.arange(4) * 3.6e9)[0]
            for seed in range(400)
        ]
    )
    expected = 90.0 * np.array([1.0, 3.0, 0.5]) / 4.5
    # Means: standard error sqrt(mean / 400); five of them are a false alarm once in 500 000.
    assert np.all(np.abs(hours.mean(axis=0) - expected) < 5 * np.sqrt(expected / 400))
    # Dispersion: (n - 1) var / mean is chi-square; both tails together one in ten thousand each.
    dispersion = 399 * hours.var(axis=0, ddof=1) / hours.mean(axis=0)
    low, high = stats.chi2.ppf([5e-5, 1 - 5e-5], 399)
    assert np.all((dispersion > low) & (dispersion < high))
    # Counts of different hours have nothing to do with each other.
    assert abs(np.corrcoef(hours[:, 0], hours[:, 1])[0, 1]) < 4 / np.sqrt(400)


def test_within_an_hour_arrivals_are_uniform():
    day = trading_day(shoppers=4000.0, arrivals=(ArrivalRate(since="00:00", weight=1.0),))
    times = arrival_times_us(day, 3) / day.open_us
    assert np.all(np.diff(times) >= 0)
    # False alarm once in ten thousand.
    assert stats.kstest(times, "uniform").pvalue > 1e-4


def test_nobody_comes_where_nobody_is_expected():
    assert len(arrival_times_us(trading_day(shoppers=0.0), 1)) == 0
    day = trading_day(
        shoppers=500.0,
        arrivals=(ArrivalRate(since="08:00", weight=0.0), ArrivalRate(since="12:00", weight=1.0)),
    )
    assert arrival_times_us(day, 1).min() >= 4 * 3.6e9


def test_groups_have_the_sizes_asked_for():
    day = trading_day(group_shares=(6.0, 3.0, 0.0, 1.0))
    counts = np.bincount(group_sizes(day, 5000, 2), minlength=5)[1:]
    assert counts[2] == 0
    # False alarm once in ten thousand.
    assert stats.chisquare(counts[[0, 1, 3]], 5000 * np.array([0.6, 0.3, 0.1])).pvalue > 1e-4
    assert mean_group(day) == pytest.approx(1.6)
