"""Dead-reckoned positions, and how unsure they become from step to step.

References
----------
.. [1] PDR with map-compensated heading, Eq 1; digest "map-heading-ekf".
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.errors import DataError
from blesim.kernels import kernel
from blesim.settings import Settings

# Rows of the state: place, way from the start, covariance of independent errors.
_X, _Y, _WAY_X, _WAY_Y, _VARIANCE_X, _VARIANCE_Y, _COVARIANCE = range(7)
_X_OUT, _Y_OUT, _VARIANCE_X_OUT, _VARIANCE_Y_OUT, _COVARIANCE_OUT = range(5)


class StepErrors(Settings):
    """How far lengths and headings of steps are off, standard deviations.

    Errors that a whole walk shares make its error grow with the distance, those of their own for
    each step with its square root.

    Attributes
    ----------
    length_share : float
        Of each step's length, independent; assumed. [-]
    heading_rad : float
        Of each step's heading, independent: 5.8 deg within straight stretches of recorded
        walks. [rad]
    scale : float
        Of all lengths together, relative; assumed. [-]
    heading_bias_rad : float
        Of all headings together: 11 to 14 deg from stretch to stretch of recorded walks. [rad]
    start_m : float
        Of the start, in x and in y. [m]
    """

    length_share: float = Field(default=0.1, ge=0, le=1)
    heading_rad: float = Field(default=0.1, ge=0, le=math.pi)
    scale: float = Field(default=0.05, ge=0, le=1)
    heading_bias_rad: float = Field(default=0.2, ge=0, le=math.pi)
    start_m: float = Field(default=0.0, ge=0, le=1e4)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reckoned:
    """Positions after each of n steps; arrays (n,).

    Attributes
    ----------
    x_m, y_m : ndarray of float64
        [m]
    variance_x_m2, variance_y_m2, covariance_xy_m2 : ndarray of float64
        [m^2]
    """

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    variance_x_m2: NDArray[np.float64]
    variance_y_m2: NDArray[np.float64]
    covariance_xy_m2: NDArray[np.float64]

    def __len__(self) -> int:
        """Count the steps."""
        return len(self.x_m)


class DeadReckoning:
    """The live position of one walker; how blocks are cut changes no bit.

    Eq 1 of [1]_, ``X += SL sin alpha, Y += SL cos alpha`` with the azimuth alpha, is with the
    heading h = pi / 2 - alpha: ``x += L cos h, y += L sin h``.

    To first order in the errors, after the way d = (dx, dy) from the start, with d' = (-dy, dx):

    ``P = start^2 I + sum_i R(h_i) diag((share L_i)^2, (heading L_i)^2) R(h_i)^T
    + scale^2 d d^T + bias^2 d' d'^T``

    Parameters
    ----------
    x_m, y_m : float
        Start. [m]
    errors : StepErrors
        Standard deviations.
    """

    def __init__(self, *, x_m: float, y_m: float, errors: StepErrors) -> None:
        start_m2 = errors.start_m**2
        self._state = np.array([x_m, y_m, 0.0, 0.0, start_m2, start_m2, 0.0])
        self._variances = (
            np.array(
                [errors.length_share, errors.heading_rad, errors.scale, errors.heading_bias_rad]
            )
            ** 2
        )

    def advance(
        self, length_m: NDArray[np.floating], heading_rad: NDArray[np.floating]
    ) -> Reckoned:
        """Positions after each of the next n steps.

        Parameters
        ----------
        length_m, heading_rad : ndarray of float, (n,)
            Of the steps. [m], [rad]

        Raises
        ------
        DataError
            If the lengths of the arrays differ, or a value is not a number.
        """
        lengths = np.ascontiguousarray(length_m, dtype=np.float64)
        headings = np.ascontiguousarray(heading_rad, dtype=np.float64)
        if lengths.shape != headings.shape:
            raise DataError(f"{len(lengths)} lengths for {len(headings)} headings; give one each")
        if not (np.all(np.isfinite(lengths)) and np.all(np.isfinite(headings))):
            raise DataError("a step has no length or no heading; leave it out")
        reckoned = np.empty((5, len(lengths)))
        _advance(lengths, headings, self._variances, self._state, reckoned)
        return Reckoned(
            x_m=reckoned[_X_OUT],
            y_m=reckoned[_Y_OUT],
            variance_x_m2=reckoned[_VARIANCE_X_OUT],
            variance_y_m2=reckoned[_VARIANCE_Y_OUT],
            covariance_xy_m2=reckoned[_COVARIANCE_OUT],
        )


@kernel
def _advance(
    length: NDArray[np.float64],
    heading: NDArray[np.float64],
    variances: NDArray[np.float64],
    state: NDArray[np.float64],
    reckoned: NDArray[np.float64],
) -> None:
    """Fill the positions and covariances (5, n); the state is carried on (kernel)."""
    share2, heading2, scale2, bias2 = variances[0], variances[1], variances[2], variances[3]
    for i in range(len(length)):
        dx, dy = length[i] * math.cos(heading[i]), length[i] * math.sin(heading[i])
        state[_X] += dx
        state[_Y] += dy
        state[_WAY_X] += dx
        state[_WAY_Y] += dy
        state[_VARIANCE_X] += share2 * dx * dx + heading2 * dy * dy
        state[_VARIANCE_Y] += share2 * dy * dy + heading2 * dx * dx
        state[_COVARIANCE] += (share2 - heading2) * dx * dy
        way_x, way_y = state[_WAY_X], state[_WAY_Y]
        reckoned[_X_OUT, i], reckoned[_Y_OUT, i] = state[_X], state[_Y]
        reckoned[_VARIANCE_X_OUT, i] = (
            state[_VARIANCE_X] + scale2 * way_x * way_x + bias2 * way_y * way_y
        )
        reckoned[_VARIANCE_Y_OUT, i] = (
            state[_VARIANCE_Y] + scale2 * way_y * way_y + bias2 * way_x * way_x
        )
        reckoned[_COVARIANCE_OUT, i] = state[_COVARIANCE] + (scale2 - bias2) * way_x * way_y
