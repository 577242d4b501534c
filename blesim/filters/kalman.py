"""Predict and update steps of the Kalman filter, linear and extended.

A belief is a mean (n,) and a covariance (n, n). The covariance is updated in the form of
Joseph [1]_, ``P = (I - K H) P (I - K H)' + K R K'``, which stays positive semidefinite under
rounding, and is kept exactly symmetric. All steps are kernels, to be called from Python or from
other kernels; none changes what it is given.

An extended filter moves its mean by its own model and calls `predict_covariance` with the Jacobian
of that model; it hands its innovation, with angles already wrapped, and the Jacobian of the
measurement to `update` or `update_in_turn`. All arrays are of float64 and C-contiguous, or a kernel
is compiled anew.

References
----------
.. [1] R. S. Bucy, P. D. Joseph, "Filtering for Stochastic Processes with Applications to Guidance",
   1968.
.. [2] Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
   Navigation", 2001. doi:10.1002/0471221279
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError
from blesim.filters.matrices import (
    applied,
    inverse_factor,
    product,
    product_transposed,
    refuse_bad_shape,
    sandwich,
)
from blesim.kernels import kernel

Array = NDArray[np.float64]


class Update(NamedTuple):
    """What an update gives.

    Attributes
    ----------
    mean, covariance : ndarray of float64, (n,) and (n, n)
        The belief after the measurements.
    innovation : ndarray of float64, (m,)
        Measured minus predicted.
    innovation_covariance : ndarray of float64, (m, m)
        ``S = H P H' + R`` of the belief before.
    """

    mean: Array
    covariance: Array
    innovation: Array
    innovation_covariance: Array


@kernel
def predict(mean: Array, covariance: Array, transition: Array, noise: Array) -> tuple[Array, Array]:
    """Mean and covariance after a linear step: ``F m`` and ``F P F' + Q``, [2]_ Eq 5.2.3 (kernel).

    Parameters
    ----------
    mean, covariance : ndarray of float64, (n,) and (n, n)
        The belief before.
    transition, noise : ndarray of float64, (n, n)
        F and the covariance Q of the process noise.

    Raises
    ------
    ValueError
        If shapes do not fit.
    """
    refuse_bad_shape(transition, len(mean), len(mean))
    return applied(transition, mean), predict_covariance(covariance, transition, noise)


@kernel
def predict_covariance(covariance: Array, jacobian: Array, noise: Array) -> Array:
    """Covariance after a step of the extended filter: ``F P F' + Q``, (n, n) (kernel).

    Parameters
    ----------
    covariance : ndarray of float64, (n, n)
        Before the step.
    jacobian, noise : ndarray of float64, (n, n)
        Jacobian F of the motion at the mean before, and covariance Q of the process noise.

    Raises
    ------
    ValueError
        If shapes do not fit.
    """
    n = covariance.shape[0]
    refuse_bad_shape(covariance, n, n)
    refuse_bad_shape(jacobian, n, n)
    refuse_bad_shape(noise, n, n)
    return sandwich(jacobian, covariance, noise)


@kernel
def update(
    mean: Array, covariance: Array, innovation: Array, jacobian: Array, noise: Array
) -> Update:
    """Belief after m measurements taken at once (kernel).

    Parameters
    ----------
    mean, covariance : ndarray of float64, (n,) and (n, n)
        The belief before.
    innovation : ndarray of float64, (m,)
        Measured minus predicted; m may be 0.
    jacobian : ndarray of float64, (m, n)
        H: of the linear model, or at the mean before.
    noise : ndarray of float64, (m, m)
        Covariance R of the measurements.

    Raises
    ------
    DataError
        If the covariance of the innovation is singular or not finite.
    ValueError
        If shapes do not fit.
    """
    _refuse_bad_update(mean, covariance, innovation, jacobian)
    refuse_bad_shape(noise, len(innovation), len(innovation))
    spread = sandwich(jacobian, covariance, noise)
    whitening = inverse_factor(spread)
    cross = product_transposed(covariance, jacobian)
    gain = product(product_transposed(cross, whitening), whitening)
    return Update(
        mean + applied(gain, innovation),
        _joseph(covariance, gain, jacobian, noise),
        innovation.copy(),
        spread,
    )


@kernel
def update_linear(
    mean: Array, covariance: Array, measurement: Array, model: Array, noise: Array
) -> Update:
    """Belief after m measurements of a linear model, ``innovation = z - H m``; see `update`."""
    refuse_bad_shape(model, len(measurement), len(mean))
    return update(mean, covariance, measurement - applied(model, mean), model, noise)


@kernel
def update_in_turn(
    mean: Array, covariance: Array, innovation: Array, jacobian: Array, variance: Array
) -> Update:
    """Belief after m independent measurements taken one by one: equal to `update` (kernel).

    Each is a scalar update, so that nothing is inverted. The extended filter, too, gives the same
    as taking all at once: every measurement stays linearised at the mean before.

    Parameters
    ----------
    mean, covariance : ndarray of float64, (n,) and (n, n)
        The belief before.
    innovation : ndarray of float64, (m,)
        Measured minus predicted at the mean before.
    jacobian : ndarray of float64, (m, n)
        H: of the linear model, or at the mean before.
    variance : ndarray of float64, (m,)
        Diagonal of R.

    Returns
    -------
    Update
        Each innovation as it was when its turn came. These are uncorrelated, so that their
        covariance is diagonal; its squared innovation is that of `update`.

    Raises
    ------
    DataError
        If an innovation has no variance, or it is not finite.
    ValueError
        If shapes do not fit.
    """
    _refuse_bad_update(mean, covariance, innovation, jacobian)
    if len(variance) != len(innovation):
        raise ValueError("give one variance for each innovation")
    moved, narrowed = mean.copy(), covariance.copy()
    left, spread = innovation.copy(), np.zeros((len(innovation), len(innovation)))
    for row in range(len(innovation)):
        for i in range(len(mean)):
            left[row] -= jacobian[row, i] * (moved[i] - mean[i])
        spread[row, row] = _take_one(moved, narrowed, left[row], jacobian[row], variance[row])
    return Update(moved, narrowed, left, spread)


@kernel
def _take_one(
    mean: Array, covariance: Array, innovation: float, row: Array, variance: float
) -> float:
    """Variance of one innovation; mean and covariance are updated in place (kernel)."""
    n = len(mean)
    cross = applied(covariance, row)
    spread = variance
    for i in range(n):
        spread += row[i] * cross[i]
    if not 0.0 < spread < np.inf:
        raise DataError("innovation variance: not positive and finite; check the noise")
    gain = cross / spread
    mean += gain * innovation
    # Joseph's form with k = gain: (I - k h') P first, then its product with (I - k h')'.
    for i in range(n):
        for j in range(n):
            covariance[i, j] -= gain[i] * cross[j]
    turned = applied(covariance, row)
    for i in range(n):
        for j in range(i + 1):
            half = covariance[i, j] - turned[i] * gain[j]
            other = covariance[j, i] - turned[j] * gain[i]
            value = 0.5 * (half + other) + variance * gain[i] * gain[j]
            covariance[i, j], covariance[j, i] = value, value
    return spread


@kernel
def _joseph(covariance: Array, gain: Array, jacobian: Array, noise: Array) -> Array:
    """``(I - K H) P (I - K H)' + K R K'``, exactly symmetric (kernel)."""
    kept = -product(gain, jacobian)
    for i in range(len(kept)):
        kept[i, i] += 1.0
    return sandwich(kept, covariance, sandwich(gain, noise, np.zeros(covariance.shape)))


@kernel
def _refuse_bad_update(mean: Array, covariance: Array, innovation: Array, jacobian: Array) -> None:
    refuse_bad_shape(covariance, len(mean), len(mean))
    refuse_bad_shape(jacobian, len(innovation), len(mean))
    for value in innovation:
        if not np.isfinite(value):
            raise DataError("innovation: not finite; leave out what was not measured")
