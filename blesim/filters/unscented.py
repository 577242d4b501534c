"""Predict and update steps of the unscented Kalman filter with scaled sigma points.

2 n + 1 points stand for a belief of n states: the mean and, one after the other, the mean plus and
minus each column of the Cholesky factor of ``(n + lambda) P``, with
``lambda = alpha^2 (n + kappa) - n`` [1]_. Moved through a model, their weighted mean and covariance
are those of the model's outcome. Means are formed as differences from the first point: the weights
of a small alpha are of the order of 1e6 and would cost as many digits, and angles need only a
difference that is wrapped.

References
----------
.. [1] E. A. Wan, R. van der Merwe, "The unscented Kalman filter for nonlinear estimation",
   AS-SPCC 2000, Eq 15. doi:10.1109/ASSPCC.2000.882463
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.filters.kalman import Update
from blesim.filters.matrices import cholesky, inverse_factor
from blesim.settings import Settings

Array = NDArray[np.float64]
# Of (points, k) to (points, m): the model for many states at once.
Model = Callable[[Array], Array]
# Difference of two arrays of the same shape, angles wrapped.
Difference = Callable[[Array, Array], Array]


class Scaling(Settings):
    """How far the sigma points lie apart and how the first is weighted.

    Attributes
    ----------
    alpha : float
        Spread of the points. [-]
    beta : float
        2 is best for a Gaussian. [-]
    kappa : float
        Second spread; with alpha 1, ``3 - n`` matches the fourth moment of a Gaussian. [-]
    """

    alpha: float = Field(default=0.1, ge=1e-4, le=1)
    beta: float = Field(default=2.0, ge=0, le=100)
    kappa: float = Field(default=0.0, ge=0, le=100)

    def stretch(self, states: int) -> float:
        """Factor ``n + lambda`` of the covariance. [-]."""
        return self.alpha**2 * (states + self.kappa)

    def weights(self, states: int) -> tuple[Array, Array]:
        """Weights of the 2 n + 1 points in a mean and in a covariance, (2 n + 1,) each. [-]."""
        stretch = self.stretch(states)
        of_mean = np.full(2 * states + 1, 0.5 / stretch)
        of_mean[0] = 1.0 - states / stretch
        of_covariance = of_mean.copy()
        of_covariance[0] += 1.0 - self.alpha**2 + self.beta
        return of_mean, of_covariance


class Transformed(NamedTuple):
    """Moments of a model's outcome.

    Attributes
    ----------
    mean, covariance : ndarray of float64, (m,) and (m, m)
        Of the outcome, noise included.
    cross : ndarray of float64, (k, m)
        Covariance of the state with the outcome.
    """

    mean: Array
    covariance: Array
    cross: Array


def sigma_points(mean: Array, covariance: Array, scaling: Scaling) -> Array:
    """The points that stand for a belief.

    Parameters
    ----------
    mean, covariance : ndarray of float64, (n,) and (n, n)
        The covariance may be semidefinite.
    scaling : Scaling
        Where the points lie.

    Returns
    -------
    ndarray of float64, (2 n + 1, n)

    Raises
    ------
    DataError
        If the covariance has a negative variance or is not finite.
    """
    away = cholesky(np.ascontiguousarray(covariance)).T * np.sqrt(scaling.stretch(len(mean)))
    return np.concatenate([mean[None], mean + away, mean - away])


def transform(
    mean: Array,
    covariance: Array,
    model: Model,
    noise: Array,
    scaling: Scaling,
    difference: Difference = np.subtract,
) -> Transformed:
    """Mean and covariance of a model's outcome, and its covariance with the state.

    Parameters
    ----------
    mean, covariance : ndarray of float64, (n,) and (n, n)
        Belief about the state.
    model : callable
        Outcomes (p, m) of states (p, n).
    noise : ndarray of float64, (m, m)
        Covariance added to the outcome.
    scaling : Scaling
        Where the sigma points lie.
    difference : callable
        Of two outcomes; give one that wraps where an outcome is an angle.

    Raises
    ------
    DataError
        If the covariance has a negative variance or is not finite.
    """
    points = sigma_points(mean, covariance, scaling)
    outcomes = model(points)
    of_mean, of_covariance = scaling.weights(len(mean))
    apart = difference(outcomes, np.broadcast_to(outcomes[0], outcomes.shape))
    centre = outcomes[0] + of_mean @ apart
    apart = difference(outcomes, np.broadcast_to(centre, outcomes.shape))
    weighted = of_covariance[:, None] * apart
    spread = apart.T @ weighted + noise
    return Transformed(centre, 0.5 * (spread + spread.T), (points - mean).T @ weighted)


def predict(
    mean: Array,
    covariance: Array,
    motion: Model,
    noise: Array,
    scaling: Scaling,
    difference: Difference = np.subtract,
) -> tuple[Array, Array]:
    """Mean and covariance after a step of the motion; see `transform` for the parameters."""
    moved = transform(mean, covariance, motion, noise, scaling, difference)
    return moved.mean, moved.covariance


def update(
    mean: Array,
    covariance: Array,
    measurement: Array,
    observation: Model,
    noise: Array,
    scaling: Scaling,
    difference: Difference = np.subtract,
) -> Update:
    """Belief after m measurements taken at once.

    Sigma points are drawn anew from the belief, so that process noise is among them.

    Parameters
    ----------
    mean, covariance : ndarray of float64, (n,) and (n, n)
        The belief before.
    measurement : ndarray of float64, (m,)
        What was measured.
    observation : callable
        Predicted measurements (p, m) of states (p, n).
    noise : ndarray of float64, (m, m)
        Covariance R of the measurements.
    scaling : Scaling
        Where the sigma points lie.
    difference : callable
        Of two measurements; give one that wraps where one is an angle.

    Raises
    ------
    DataError
        If the covariance of the innovation is singular or not finite.
    """
    seen = transform(mean, covariance, observation, noise, scaling, difference)
    innovation = difference(measurement, seen.mean)
    whitening = inverse_factor(np.ascontiguousarray(seen.covariance))
    white = seen.cross @ whitening.T
    narrowed = covariance - white @ white.T
    return Update(
        mean + white @ (whitening @ innovation),
        0.5 * (narrowed + narrowed.T),
        innovation,
        seen.covariance,
    )
