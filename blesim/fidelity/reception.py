"""Which packets of a link arrive, and how long one waits for the next."""

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]


def gap_s(time_s: Numbers, share: float) -> float:
    """Quantile of the time from one reading of a link to the next.

    Parameters
    ----------
    time_s : ndarray of float64, (n,)
        Ascending. [s]
    share : float
        Which quantile, 0.5 for the median. [-]

    Returns
    -------
    float
        NaN for fewer than two readings. [s]
    """
    return float(np.quantile(np.diff(time_s), share)) if len(time_s) > 1 else np.nan


def received_share(time_s: Numbers, duration_s: float, interval_s: float) -> float:
    """Share of advertising events of which at least one packet arrived.

    Parameters
    ----------
    time_s : ndarray of float64, (n,)
        Ascending readings of a link. [s]
    duration_s : float
        How long was listened. [s]
    interval_s : float
        Mean time between events: the advertising interval plus 5 ms. [s]

    Returns
    -------
    float
        Readings closer together than half an interval are of one event. [-]
    """
    if not len(time_s):
        return 0.0
    events = 1 + int(np.sum(np.diff(time_s) > interval_s / 2))
    return min(1.0, events * interval_s / duration_s)


def reception_at(level_dbm: Numbers, received: Numbers, low_dbm: float, high_dbm: float) -> float:
    """Mean share of received events over links whose level lies in [low_dbm, high_dbm).

    Parameters
    ----------
    level_dbm, received : ndarray of float64, (n,)
        Mean RSSI and share of received events of links. [dBm], [-]

    Returns
    -------
    float
        NaN if there is no such link. [-]
    """
    inside = (level_dbm >= low_dbm) & (level_dbm < high_dbm)
    return float(np.mean(received[inside])) if inside.any() else np.nan
