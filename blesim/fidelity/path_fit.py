"""RSSI against distance, with and without what stands in between."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

_FEWEST = 6


class PathFit(NamedTuple):
    """Least squares of RSSI against distance and crossings.

    Attributes
    ----------
    level_dbm : float
        At one metre, A. [dBm]
    exponent : float
        n. [-]
    loss_db : ndarray of float64, (k,)
        Of each kind of crossing. [dB]
    residuals_db : ndarray of float64, (n,)
        What is left. [dB]
    """

    level_dbm: float
    exponent: float
    loss_db: Numbers
    residuals_db: Numbers

    @property
    def deviation_db(self) -> float:
        """Standard deviation of the residuals, sigma. [dB]."""
        return float(np.std(self.residuals_db))


def fit_path(distance_m: Numbers, rssi_dbm: Numbers, crossings: Numbers | None = None) -> PathFit:
    """Fit of ``A - 10 n log10(d) - sum of L_k c_k`` by least squares.

    Parameters
    ----------
    distance_m, rssi_dbm : ndarray of float64, (n,)
        One link or reading each. [m], [dBm]
    crossings : ndarray of float64, (n, k), optional
        How many obstacles of each kind each link crosses. [-]

    Returns
    -------
    PathFit
        All NaN where there are fewer than six rows, or distances all alike.
    """
    kinds = 0 if crossings is None else crossings.shape[1]
    if len(distance_m) < _FEWEST or np.ptp(distance_m) == 0:
        return PathFit(np.nan, np.nan, np.full(kinds, np.nan), np.full(len(rssi_dbm), np.nan))
    columns = [np.ones(len(distance_m)), -10.0 * np.log10(distance_m)]
    design = np.stack([*columns, *(() if crossings is None else -crossings.T)], axis=1)
    solution = np.linalg.lstsq(design, rssi_dbm, rcond=None)[0]
    # A kind of obstacle that is never crossed has no loss to tell.
    seen = np.ptp(design[:, 2:], axis=0) > 0
    return PathFit(
        level_dbm=float(solution[0]),
        exponent=float(solution[1]),
        loss_db=np.where(seen, solution[2:], np.nan),
        residuals_db=rssi_dbm - design @ solution,
    )
