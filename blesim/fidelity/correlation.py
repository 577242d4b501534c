"""How alike readings are that lie apart in time, in space or in channel."""

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

# Fewer pairs than this say nothing about a correlation.
_FEWEST_PAIRS = 12
_FEWEST_PLACES = 5


def autocorrelation(time_s: Numbers, values: Numbers, low_s: float, high_s: float) -> float:
    """Correlation of readings that lie a lag apart.

    Parameters
    ----------
    time_s : ndarray of float64, (n,)
        Ascending; need not be regular. Any other ascending coordinate will do, such as metres
        travelled. [s]
    values : ndarray of float64, (n,)
        One link, or one channel of it. [dB]
    low_s, high_s : float
        Pairs whose lag lies in [low_s, high_s) count. [s]

    Returns
    -------
    float
        NaN for fewer than twelve pairs, or readings all alike. [-]
    """
    first, second = _pairs(time_s, low_s, high_s)
    centred = values - values.mean() if len(values) else values
    variance = float(np.mean(centred**2)) if len(values) else 0.0
    if len(first) < _FEWEST_PAIRS or variance == 0.0:
        return np.nan
    return float(np.mean(centred[first] * centred[second]) / variance)


def _pairs(
    time_s: Numbers, low_s: float, high_s: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    begin = np.searchsorted(time_s, time_s + low_s)
    begin = np.maximum(begin, np.arange(len(time_s)) + 1)
    count = np.maximum(np.searchsorted(time_s, time_s + high_s) - begin, 0)
    first = np.repeat(np.arange(len(time_s)), count)
    within = np.arange(len(first)) - np.repeat(np.cumsum(count) - count, count)
    return first, begin[first] + within


def decay_time_s(time_s: Numbers, values: Numbers, step_s: float, longest_s: float) -> float:
    """Lag at which the correlation has fallen to 1/e of what it is at the shortest lag.

    Measured against the shortest lag and not against 1, so that the receiver's noise and its
    rounding, which belong to lag 0 alone, do not count.

    Parameters
    ----------
    time_s, values : ndarray of float64, (n,)
        One channel of one link. [s], [dB]
    step_s : float
        Lags are taken in bins of this width. [s]
    longest_s : float
        Lags looked at. [s]

    Returns
    -------
    float
        Interpolated between bins; `longest_s` if it stays above. NaN if there is no correlation at
        the shortest lag. [s]
    """
    edges_s = np.arange(0.0, longest_s + step_s / 2, step_s)
    curve = np.array(
        [autocorrelation(time_s, values, low, low + step_s) for low in edges_s.tolist()]
    )
    if not curve[0] > 0:
        return np.nan
    below = np.flatnonzero(curve < curve[0] / np.e)
    if not len(below):
        return longest_s
    at = int(below[0])
    share = (curve[at - 1] - curve[0] / np.e) / (curve[at - 1] - curve[at])
    return float((at - 1 + share) * step_s)


def correlation_between_places(
    places_m: Numbers, residuals_db: Numbers, low_m: float, high_m: float
) -> float:
    """Correlation of what distance leaves unexplained, between places some distance apart.

    Parameters
    ----------
    places_m : ndarray of float64, (n, 2)
        [m]
    residuals_db : ndarray of float64, (n,)
        Of one receiver. [dB]
    low_m, high_m : float
        Pairs whose distance lies in [low_m, high_m) count. [m]

    Returns
    -------
    float
        Mean product over the variance; NaN for fewer than five pairs. [-]
    """
    first, second = np.triu_indices(len(places_m), k=1)
    apart_m = np.hypot(*(places_m[first] - places_m[second]).T)
    near = (apart_m >= low_m) & (apart_m < high_m)
    variance = np.var(residuals_db)
    if near.sum() < _FEWEST_PLACES or variance == 0:
        return np.nan
    centred = residuals_db - residuals_db.mean()
    return float(np.mean(centred[first[near]] * centred[second[near]]) / variance)


def channel_correlation(
    time_s: tuple[Numbers, Numbers], values: tuple[Numbers, Numbers], within_s: float
) -> float:
    """Correlation between two channels of a link.

    Parameters
    ----------
    time_s, values : two ndarray of float64 each, (n,) and (m,)
        Readings of either channel, in order of time. [s], [dB]
    within_s : float
        Each reading of the first is paired with the next of the second within this time. [s]

    Returns
    -------
    float
        NaN for fewer than twelve pairs or a constant channel. [-]
    """
    following = np.searchsorted(time_s[1], time_s[0])
    inside = np.flatnonzero(following < len(time_s[1]))
    close = inside[time_s[1][following[inside]] - time_s[0][inside] <= within_s]
    one, other = values[0][close], values[1][following[close]]
    if len(close) < _FEWEST_PAIRS or one.std() == 0 or other.std() == 0:
        return np.nan
    return float(np.corrcoef(one, other)[0, 1])
