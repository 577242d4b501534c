"""Slow random processes on a regular grid of time, and smooth curves through them."""

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel
from blesim.rng import Draws


def drift(draws: Draws, count: int, kept: float) -> NDArray[np.float64]:
    """Three independent stationary processes of unit spread, (count, 3). [-].

    First-order Gauss-Markov: each value keeps a share of the one before.
    """
    deviates = np.ascontiguousarray(draws.normals(np.arange(count))[:, :3])
    remember(deviates, kept)
    return deviates


@kernel
def remember(deviates: NDArray[np.float64], kept: float) -> None:
    """Turn independent deviates into a process that keeps a share of itself each step (kernel)."""
    new = np.sqrt(1.0 - kept * kept)
    for row in range(1, len(deviates)):
        for axis in range(deviates.shape[1]):
            deviates[row, axis] = kept * deviates[row - 1, axis] + new * deviates[row, axis]


def spline_spread(kept: float) -> float:
    """Mean spread of a cubic B-spline over coefficients of unit spread that keep this share."""
    u = (np.arange(64) + 0.5)[:, None] / 64.0
    weights = np.concatenate(
        [(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3], axis=1
    )
    lag = np.abs(np.subtract.outer(np.arange(4), np.arange(4)))
    covariance = np.where(lag == 0, 1.0, kept ** lag.astype(float))
    return float(np.sqrt(np.mean(np.einsum("ni,ij,nj->n", weights, covariance, weights)) / 36.0))


@kernel
def spline(
    place: float,
    first: int,
    values: NDArray[np.float64],
    value: NDArray[np.float64],
    slope: NDArray[np.float64],
) -> None:
    """Values of three cubic B-splines, and their derivatives by the grid (kernel).

    Parameters
    ----------
    place : float
        Where, in steps of the grid. [-]
    first : int
        Number of the first coefficient in `values`.
    values : ndarray of float64, (m, 3)
        Coefficients.
    value, slope : ndarray of float64, (3,)
        Filled.
    """
    whole = np.floor(place)
    u = place - whole
    row = np.int64(whole) - first
    v = 1.0 - u
    uu, vv = u * u, v * v
    a, d = vv * v / 6.0, uu * u / 6.0
    b, c = 2.0 / 3.0 - uu * (1.0 - 0.5 * u), 2.0 / 3.0 - vv * (1.0 - 0.5 * v)
    da, dd, db, dc = -0.5 * vv, 0.5 * uu, u * (1.5 * u - 2.0), v * (2.0 - 1.5 * v)
    for axis in range(3):
        p, q = values[row, axis], values[row + 1, axis]
        r, s = values[row + 2, axis], values[row + 3, axis]
        value[axis] = a * p + b * q + c * r + d * s
        slope[axis] = da * p + db * q + dc * r + dd * s
