"""What a cloud of weighted particles says: weights out of log weights, mean and covariance."""

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError
from blesim.filters.exponentials import fill_exponentials
from blesim.kernels import kernel

Array = NDArray[np.float64]


@kernel
def normalised(log_weights: Array) -> Array:
    """Weights that add up to one, ``exp(l_i - max l)`` over their sum (kernel).

    Products of many small likelihoods are kept as sums of logarithms; only their differences count.

    Parameters
    ----------
    log_weights : ndarray of float64, (n,)
        Minus infinity for a weight of zero; where all are, all particles are equally likely. [-]

    Returns
    -------
    ndarray of float64, (n,)
        [-]

    Raises
    ------
    DataError
        If one is NaN or plus infinity, or there is none.
    """
    largest = -np.inf
    for value in log_weights:
        if not value < np.inf:
            raise DataError("log weights: NaN or infinite; check the likelihood")
        largest = max(largest, value)
    if not len(log_weights):
        raise DataError("log weights: there is none; give at least one particle")
    out = np.ones(len(log_weights))
    if largest > -np.inf:
        fill_exponentials(log_weights - largest, out)
        for i in range(len(out)):
            if log_weights[i] == -np.inf:
                out[i] = 0.0
    out /= out.sum()
    return out


@kernel
def weighted_moments(
    x_m: Array, y_m: Array, weights: Array, floor_m2: float
) -> tuple[float, float, float, float, float]:
    """Mean and covariance of a cloud (kernel).

    Parameters
    ----------
    x_m, y_m : ndarray of float64, (n,)
        Places of the particles. [m]
    weights : ndarray of float64, (n,)
        Not negative; where all are zero, all count the same. [-]
    floor_m2 : float
        Added to both variances: particles that all sit in one place are not certain. [m^2]

    Returns
    -------
    mean_x_m, mean_y_m : float
        [m]
    variance_x_m2, variance_y_m2, covariance_xy_m2 : float
        [m^2]

    Raises
    ------
    DataError
        If the weights are NaN, infinite or negative, or there is none.
    ValueError
        If the arrays are not of one length.
    """
    if len(x_m) != len(weights) or len(y_m) != len(weights):
        raise ValueError("give one place and one weight for each particle")
    share = _shares(weights)
    mean_x, mean_y = 0.0, 0.0
    for i in range(len(share)):
        mean_x += share[i] * x_m[i]
        mean_y += share[i] * y_m[i]
    xx, yy, xy = 0.0, 0.0, 0.0
    for i in range(len(share)):
        dx, dy = x_m[i] - mean_x, y_m[i] - mean_y
        xx += share[i] * dx * dx
        yy += share[i] * dy * dy
        xy += share[i] * dx * dy
    return mean_x, mean_y, xx + floor_m2, yy + floor_m2, xy


@kernel
def _shares(weights: Array) -> Array:
    """Weights that add up to one, (n,) (kernel)."""
    total = weights.sum()
    if not len(weights) or not 0.0 <= total < np.inf or weights.min() < 0.0:
        raise DataError("particle weights: NaN, infinite, negative or none; check the likelihood")
    return weights / total if total > 0.0 else np.full(len(weights), 1.0 / len(weights))
