"""How a signal fades with distance."""

import numpy as np
from numpy.typing import NDArray

# Closer than this the far field ends, and a phone is never inside a beacon.
NEAREST_M = 0.1


def log_distance_loss_db(distance_m: NDArray[np.float64], exponent: float) -> NDArray[np.float64]:
    """Loss beyond one metre: ``10 n log10(d / 1 m)``.

    Parameters
    ----------
    distance_m : ndarray of float64, any shape
        In three dimensions; below 0.1 m it counts as 0.1 m. [m]
    exponent : float
        Path loss exponent n, 2 in free space. [-]

    Returns
    -------
    ndarray of float64, same shape
        Negative within one metre. [dB]

    References
    ----------
    T. S. Rappaport, "Wireless Communications", 2nd ed., 2002, eq. 4.67.

    Examples
    --------
    >>> log_distance_loss_db(np.array([1.0, 10.0]), 2.0).tolist()
    [0.0, 20.0]
    """
    return 10.0 * exponent * np.log10(np.maximum(distance_m, NEAREST_M))
