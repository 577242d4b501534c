"""The few levels of a link that stands still: one for each advertising channel."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

_LEVELS = 3


class Levels(NamedTuple):
    """RSSI of a link split into three levels.

    Attributes
    ----------
    centre_dbm : ndarray of float64, (3,)
        Mean of each level, ascending; fewer where fewer than three values occur. [dBm]
    member : ndarray of int64, (n,)
        Which level each reading belongs to.
    """

    centre_dbm: Numbers
    member: NDArray[np.int64]


def three_levels(rssi_dbm: Numbers) -> Levels:
    """The split into three that leaves the least variance within: one-dimensional k-means, exact.

    Parameters
    ----------
    rssi_dbm : ndarray of float64, (n,)
        Readings of one link, at least one. [dBm]

    Returns
    -------
    Levels

    Examples
    --------
    >>> three_levels(np.array([-70.0, -71.0, -80.0, -60.0, -61.0])).centre_dbm.tolist()
    [-80.0, -70.5, -60.5]
    """
    values, row, count = np.unique(rssi_dbm, return_inverse=True, return_counts=True)
    if len(values) <= _LEVELS:
        return Levels(centre_dbm=values, member=row.astype(np.int64))
    cuts = _best_cuts(values - values[0], count)
    member = np.searchsorted(cuts, row, side="right").astype(np.int64)
    sums = np.bincount(member, weights=rssi_dbm, minlength=_LEVELS)
    return Levels(centre_dbm=sums / np.bincount(member, minlength=_LEVELS), member=member)


def _best_cuts(values: Numbers, count: NDArray[np.int64]) -> NDArray[np.int64]:
    """First value of the second and of the third level, by trying all pairs."""
    number = np.concatenate([[0.0], np.cumsum(count)])
    total = np.concatenate([[0.0], np.cumsum(count * values)])
    # Sum of squares about the means = a constant minus the sum of (sum of values)^2 / number.
    first, second = np.triu_indices(len(values) - 1, k=1)
    first, second = first + 1, second + 1
    gain = (
        total[first] ** 2 / number[first]
        + (total[second] - total[first]) ** 2 / (number[second] - number[first])
        + (total[-1] - total[second]) ** 2 / (number[-1] - number[second])
    )
    best = int(np.argmax(gain))
    return np.array([first[best], second[best]])


def explained_share(rssi_dbm: Numbers) -> float:
    """Share of a link's variance that three levels explain; NaN for a constant link. [-]."""
    variance = np.var(rssi_dbm)
    return float(1.0 - np.var(_residuals_db(rssi_dbm)) / variance) if variance > 0 else np.nan


def level_spread_db(rssi_dbm: Numbers) -> float:
    """From the lowest to the highest of the three levels of a link. [dB]."""
    return float(np.ptp(three_levels(rssi_dbm).centre_dbm))


def level_deviation_db(rssi_dbm: Numbers) -> float:
    """Standard deviation of the three levels of a link, each counted once. [dB]."""
    return float(np.std(three_levels(rssi_dbm).centre_dbm))


def level_noise_db(rssi_dbm: Numbers) -> float:
    """Standard deviation of a link's readings about their levels. [dB]."""
    return float(np.std(_residuals_db(rssi_dbm)))


def drift_db(time_s: Numbers, rssi_dbm: Numbers, over_s: float) -> float:
    """Change of a link's levels from one stretch of time to the next.

    Parameters
    ----------
    time_s, rssi_dbm : ndarray of float64, (n,)
        Readings of one link. [s], [dBm]
    over_s : float
        Length of a stretch. [s]

    Returns
    -------
    float
        Standard deviation of the means, over stretches, of what the levels leave; NaN for fewer
        than three stretches. [dB]
    """
    stretch = ((time_s - time_s[0]) // over_s).astype(np.int64)
    count = np.bincount(stretch)
    # The last stretch is cut short.
    whole = (count > 0) & (np.arange(len(count)) < len(count) - 1)
    if whole.sum() < 3:
        return np.nan
    sums = np.bincount(stretch, weights=_residuals_db(rssi_dbm))
    return float(np.std(sums[whole] / count[whole]))


def _residuals_db(rssi_dbm: Numbers) -> Numbers:
    levels = three_levels(rssi_dbm)
    residuals: Numbers = rssi_dbm - levels.centre_dbm[levels.member]
    return residuals
