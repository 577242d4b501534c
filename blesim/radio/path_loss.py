"""How a signal fades with distance, and through floors."""

from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

# Closer than this the far field ends, and a phone is never inside a beacon.
NEAREST_M = 0.1


class IndoorModel(NamedTuple):
    """Coefficients of ITU-R P.1238-11. [-], [dB], [-]."""

    alpha: float
    beta: float
    gamma: float


# ITU-R P.1238-11, line of sight, 300 MHz to 83.5 GHz and 450 MHz to 300 GHz.
ITU_P1238 = MappingProxyType(
    {
        "itu-corridor": IndoorModel(1.63, 28.12, 2.25),
        "itu-office": IndoorModel(1.46, 34.62, 2.03),
    }
)


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


def indoor_loss_db(
    distance_m: NDArray[np.float64], frequency_hz: NDArray[np.float64], model: IndoorModel
) -> NDArray[np.float64]:
    """Median basic transmission loss of ITU-R P.1238-11.

    ``10 alpha log10(d / 1 m) + beta + 10 gamma log10(f / 1 GHz)``

    Parameters
    ----------
    distance_m : ndarray of float64, (n,)
        In three dimensions; below 0.1 m it counts as 0.1 m. [m]
    frequency_hz : ndarray of float64, (n,)
        [Hz]
    model : IndoorModel
        Coefficients of an environment; see `ITU_P1238`.

    Returns
    -------
    ndarray of float64, (n,)
        To be taken from the transmit power, antennas without gain. [dB]

    References
    ----------
    Recommendation ITU-R P.1238-11, 2021, eq. 1 and table 2.
    """
    return (
        log_distance_loss_db(distance_m, model.alpha)
        + model.beta
        + 10.0 * model.gamma * np.log10(frequency_hz / 1e9)
    )


def floor_loss_db(floors: NDArray[np.int64]) -> NDArray[np.float64]:
    """Loss through floors of a commercial building: ``6 + 3 (n - 1)``, none for n = 0.

    Parameters
    ----------
    floors : ndarray of int64, any shape
        Number of floors between beacon and phone. [-]

    Returns
    -------
    ndarray of float64, same shape
        [dB]

    References
    ----------
    Recommendation ITU-R P.1238-11, table 4: commercial, 1.8 to 2 GHz, the nearest band given.
    """
    return np.where(floors > 0, 3.0 + 3.0 * floors, 0.0)
