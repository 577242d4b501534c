"""When people come to the store, and how many together."""

import numpy as np
from numpy.typing import NDArray

from blesim.rng import Draws
from blesim.units import MICROSECONDS_PER_SECOND
from blesim.walkers.trading_day import TradingDay


def arrival_times_us(day: TradingDay, seed: int) -> NDArray[np.int64]:
    """Times at which parties come: a Poisson process whose rate follows the clock, (n,). [us].

    Unit exponential gaps are laid out on the integral of the rate.
    """
    since_s, weight = (np.array(column, np.float64) for column in zip(*day.rates(), strict=True))
    span_s = np.diff(since_s, append=day.open_us / MICROSECONDS_PER_SECOND)
    expected = np.concatenate([[0.0], np.cumsum(weight * span_s)])
    if day.shoppers == 0 or expected[-1] == 0:
        return np.empty(0, np.int64)
    parties = day.shoppers / mean_group(day)
    expected *= parties / expected[-1]
    rows = np.arange(int(parties + 10.0 * np.sqrt(parties) + 40.0) // 4 + 1)
    gaps = -np.log(Draws(seed=seed, purpose="arrival").uniforms(rows)).reshape(-1)
    reached = np.cumsum(gaps)
    reached = reached[reached < expected[-1]]
    breaks_s = np.append(since_s, day.open_us / MICROSECONDS_PER_SECOND)
    times_s = np.interp(reached, expected, breaks_s)
    return np.asarray(np.round(times_s * 1e6).astype(np.int64))


def mean_group(day: TradingDay) -> float:
    """Mean size of the groups that come together. [-]."""
    shares = np.array(day.group_shares)
    return float((np.arange(1, len(shares) + 1) * shares).sum() / shares.sum())


def group_sizes(day: TradingDay, count: int, seed: int) -> NDArray[np.int64]:
    """Sizes of groups in order of arrival, (count,)."""
    bounds = np.cumsum(day.group_shares) / np.sum(day.group_shares)
    draws = Draws(seed=seed, purpose="group size").uniforms(np.arange(count))[:, 0]
    return np.minimum(np.searchsorted(bounds, draws, side="right"), len(bounds) - 1) + 1
