"""Tests of innovations: which measurements a Kalman filter should leave out.

If the filter's noises are right, the innovation tau is ``N(0, C)`` with ``C = H P H' + R`` [1]_, so
that

- ``tau' C^-1 tau`` is chi-squared with as many degrees of freedom as measurements [2]_
- each ``tau_i / sqrt(C_ii)`` is N(0, 1)

A measurement that a true one would exceed too seldom is an outlier.

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016, Eq 28 to 30; digest
   "channel-separate-ekf". It gives no confidence; 0.95 is assumed.
.. [2] Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
   Navigation", 2001, Eq 5.4.2-5. doi:10.1002/0471221279
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.filters.matrices import applied, inverse_factor, refuse_bad_shape
from blesim.kernels import kernel
from blesim.settings import Settings

Array = NDArray[np.float64]


@kernel
def squared_innovation(innovation: Array, covariance: Array) -> float:
    """Normalised innovation squared, ``tau' C^-1 tau`` (kernel). [-].

    Parameters
    ----------
    innovation, covariance : ndarray of float64, (m,) and (m, m)
        tau and C; nothing measured gives 0.

    Raises
    ------
    DataError
        If the covariance is singular or not finite.
    ValueError
        If shapes do not fit.
    """
    refuse_bad_shape(covariance, len(innovation), len(innovation))
    total = 0.0
    for value in applied(inverse_factor(covariance), innovation):
        total += value * value
    return total


@cache
def chi_square_limit(confidence: float, measurements: int) -> float:
    """Value that a chi-squared number stays below with a probability, infinite for 1. [-]."""
    from scipy.special import chdtri

    return float(chdtri(measurements, 1.0 - confidence)) if measurements else 0.0


@cache
def deviations_limit(confidence: float) -> float:
    """Standard deviations that a Gaussian number stays within with a probability. [-]."""
    from scipy.special import ndtri

    return float(ndtri(0.5 + 0.5 * confidence))


class JointGate(Settings):
    """Test of all measurements of one moment together.

    Attributes
    ----------
    confidence : float
        Share of true measurements that pass; 1 lets everything pass. [-]
    """

    confidence: float = Field(default=0.99, gt=0, le=1)

    def passes(self, innovation: Array, covariance: Array) -> bool:
        """Whether the measurements are believable.

        Parameters
        ----------
        innovation, covariance : ndarray of float64, (m,) and (m, m)
            As `kalman.update` gives them.

        Raises
        ------
        DataError
            If the covariance is singular or not finite.
        """
        limit = chi_square_limit(self.confidence, len(innovation))
        return squared_innovation(innovation, covariance) <= limit


class SeparateGate(Settings):
    """Test of each measurement by itself, Eq 28 to 30 of the channel-separate EKF [1]_.

    Attributes
    ----------
    confidence : float
        Share of true measurements that pass; 1 lets everything pass. [-]

    References
    ----------
    .. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
    """

    confidence: float = Field(default=0.95, gt=0, le=1)

    @property
    def deviations(self) -> float:
        """Standard deviations that an innovation may have. [-]."""
        return deviations_limit(self.confidence)

    def passes(self, innovation: Array, covariance: Array) -> NDArray[np.bool_]:
        """Which measurements are believable.

        Parameters
        ----------
        innovation : ndarray of float64, (m,)
            Measured minus predicted.
        covariance : ndarray of float64, (m, m) or (m,)
            C, or its diagonal alone.

        Returns
        -------
        ndarray of bool, (m,)
            False where the innovation is NaN.
        """
        variance = covariance if covariance.ndim == 1 else np.diagonal(covariance)
        within: NDArray[np.bool_] = np.abs(innovation) <= self.deviations * np.sqrt(variance)
        return within
