"""Compass azimuths made right by what a map knows: the direction of the corridor.

The error of a compass in its carrier's iron is, with the measured azimuth xi (Eq 10 of [1]_):

``delta = A + B sin xi + C cos xi + D sin 2 xi + E cos 2 xi``

A Kalman filter learns A to E on the first straight steps after each turn, from the azimuth of the
map less the measured one.

References
----------
.. [1] PDR with map-compensated heading, Eq 10 to 15; digest "map-heading-ekf".
"""

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from blesim.errors import DataError
from blesim.kernels import kernel
from blesim.settings import Settings
from blesim.units import wrap_angle

_COEFFICIENTS = 5
_DEGREE_RAD = math.radians(1.0)


class CompassCorrection(Settings):
    """Parameters of the correction; the defaults are those of [1]_.

    The paper gives P_0 and Q as plain numbers beside R = (5 deg)^2: here they are squared degrees
    as well. Read as rad^2, P_0 = 1000 is 3.28e6 deg^2: least squares with hardly a pull to zero.

    Attributes
    ----------
    initial_variance_deg2, drift_variance_deg2 : float
        Diagonals of P_0, and of Q, added with each step of training. [deg^2]
    noise_deg : float
        Standard deviation of a measured error; R is its square. [deg]
    training_steps : int
        Straight steps after each turn from which it learns.
    untrained : {"measured", "mean", "model"}
        What a straight step gets until then: the measured azimuth as in [1]_, the mean correction,
        or the model as far as it has learned.
    afresh : bool
        Whether the training after a turn begins with A to E = 0 and P_0, or goes on from the last.
    """

    initial_variance_deg2: float = Field(default=1000.0, gt=0, le=1e12)
    drift_variance_deg2: float = Field(default=1e-4, ge=0, le=1e6)
    noise_deg: float = Field(default=5.0, gt=0, le=180)
    training_steps: int = Field(default=10, ge=1, le=1000)
    untrained: Literal["measured", "mean", "model"] = "measured"
    afresh: bool = True


def error_terms(azimuth_rad: ArrayLike) -> NDArray[np.float64]:
    """Terms of the error model: ``1, sin xi, cos xi, sin 2 xi, cos 2 xi``, (n, 5) or (5,). [-].

    Parameters
    ----------
    azimuth_rad : array_like of float, (n,) or ()
        Measured azimuths, clockwise from north. [rad]
    """
    xi = np.asarray(azimuth_rad, np.float64)
    terms = [np.ones_like(xi), np.sin(xi), np.cos(xi), np.sin(2 * xi), np.cos(2 * xi)]
    return np.stack(terms, axis=-1)


class CompassErrorFilter:
    """Kalman filter whose state is A to E of Eq 10, (5,), in rad.

    Each update: ``P <- P + Q``, ``K = P h / (h . P h + R)``, ``x <- x + K (z - h . x)``, and in
    Joseph form ``P <- (I - K h) P (I - K h)' + K R K'``, with h the row of `error_terms` and z the
    map's azimuth less the measured one, wrapped.

    Parameters
    ----------
    settings : CompassCorrection
        P_0, Q and R.
    """

    def __init__(self, settings: CompassCorrection) -> None:
        self._drift = settings.drift_variance_deg2 * _DEGREE_RAD**2
        self._noise = (settings.noise_deg * _DEGREE_RAD) ** 2
        self.coefficients_rad = np.zeros(_COEFFICIENTS)
        self.covariance_rad2 = (
            settings.initial_variance_deg2 * _DEGREE_RAD**2 * np.eye(_COEFFICIENTS)
        )

    def update(self, azimuth_rad: float, map_azimuth_rad: float) -> None:
        """Learn from one straight step.

        Parameters
        ----------
        azimuth_rad, map_azimuth_rad : float
            What the compass told, and where the way leads. [rad]
        """
        error_rad = float(wrap_angle(map_azimuth_rad - azimuth_rad))
        row = error_terms(azimuth_rad)
        _update(
            row, error_rad, self._drift, self._noise, self.coefficients_rad, self.covariance_rad2
        )

    def error_rad(self, azimuth_rad: float) -> float:
        """Delta of Eq 10 at a measured azimuth. [rad]."""
        return _dot(error_terms(azimuth_rad), self.coefficients_rad)


class CompassCorrector:
    """The live correction of one phone's azimuths, step by step [1]_.

    - A straight step whose way is known trains the filter, until it has enough.
    - Straight, trained: measured azimuth plus delta (Eq 11); untrained: as the settings say.
    - Turning: plus the mean of the deltas of the last trained straight stretch (Eq 12), 0 before
      there was one. Training starts again after every turn.

    Parameters
    ----------
    settings : CompassCorrection
        Filter and training.
    """

    def __init__(self, settings: CompassCorrection) -> None:
        self._settings = settings
        self._filter = CompassErrorFilter(settings)
        self._trained_steps = 0
        self._delta_sum_rad = 0.0
        self._delta_count = 0
        self._mean_rad = 0.0

    @property
    def trained(self) -> bool:
        """Whether it has learned enough since the last turn."""
        return self._trained_steps >= self._settings.training_steps

    @property
    def mean_error_rad(self) -> float:
        """Mean delta of the last trained straight stretch; 0 before there was one. [rad]."""
        return self._mean_rad

    def advance(
        self,
        azimuth_rad: NDArray[np.floating],
        map_azimuth_rad: NDArray[np.floating],
        turning: NDArray[np.bool_],
    ) -> NDArray[np.float64]:
        """Corrected azimuths of the next steps, (n,), in [-pi, pi). [rad].

        Parameters
        ----------
        azimuth_rad : ndarray of float, (n,)
            What the compass told; NaN stays NaN and teaches nothing. [rad]
        map_azimuth_rad : ndarray of float, (n,)
            Where the way leads, NaN where not known. [rad]
        turning : ndarray of bool, (n,)
            As `blesim.pdr.turns.TurnDetector` tells it.

        Raises
        ------
        DataError
            If the lengths differ.
        """
        if not len(azimuth_rad) == len(map_azimuth_rad) == len(turning):
            raise DataError("give one azimuth, map azimuth and turning flag for each step")
        deltas = [
            self._delta_rad(float(measured), float(known), bool(turns))
            for measured, known, turns in zip(azimuth_rad, map_azimuth_rad, turning, strict=True)
        ]
        return wrap_angle(np.asarray(azimuth_rad, np.float64) + np.array(deltas))

    def _delta_rad(self, measured_rad: float, known_rad: float, turning: bool) -> float:
        if turning:
            self._turn()
            return self._mean_rad
        if math.isnan(measured_rad):
            return 0.0
        if not self.trained and not math.isnan(known_rad):
            self._filter.update(measured_rad, known_rad)
            self._trained_steps += 1
            return self._untrained_delta_rad(measured_rad)
        if not self.trained:
            return self._untrained_delta_rad(measured_rad)
        delta_rad = self._filter.error_rad(measured_rad)
        self._delta_sum_rad += delta_rad
        self._delta_count += 1
        self._mean_rad = self._delta_sum_rad / self._delta_count
        return delta_rad

    def _untrained_delta_rad(self, measured_rad: float) -> float:
        if self._settings.untrained == "measured":
            return 0.0
        if self._settings.untrained == "mean":
            return self._mean_rad
        return self._filter.error_rad(measured_rad)

    def _turn(self) -> None:
        """Begin anew; the mean stays until another stretch is trained."""
        if self._settings.afresh and self._trained_steps:
            self._filter = CompassErrorFilter(self._settings)
        self._trained_steps, self._delta_sum_rad, self._delta_count = 0, 0.0, 0


@kernel
def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Scalar product of two vectors, added in order (kernel)."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@kernel
def _update(
    row: NDArray[np.float64],
    error: float,
    drift: float,
    noise: float,
    state: NDArray[np.float64],
    covariance: NDArray[np.float64],
) -> None:
    """Update the state (5,) and its covariance (5, 5) with one measured error (kernel)."""
    size = len(row)
    spread, kept, half = np.empty(size), np.empty((size, size)), np.empty((size, size))
    for i in range(size):
        covariance[i, i] += drift
    for i in range(size):
        spread[i] = _dot(covariance[i], row)
    innovation, variance = error - _dot(row, state), _dot(row, spread) + noise
    for i in range(size):
        state[i] += spread[i] / variance * innovation
        for j in range(size):
            kept[i, j] = (1.0 if i == j else 0.0) - spread[i] / variance * row[j]
    for i in range(size):
        for j in range(size):
            half[i, j] = _dot(kept[i], covariance[j])
    for i in range(size):
        for j in range(size):
            gains = spread[i] / variance * (spread[j] / variance)
            covariance[i, j] = _dot(half[i], kept[j]) + noise * gains
