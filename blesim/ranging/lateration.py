"""Position from ranges by least squares.

The sum of ``((|p - b_i| - r_i) / s_i)^2`` is made least over the position p on the map, the height
of the phone being known: distances are in space. The covariance is ``(J' J)^-1`` of the weighted
Jacobian J at the solution, the inverse of the Fisher information of Gaussian ranges; see S. M. Kay,
"Fundamentals of Statistical Signal Processing: Estimation Theory", 1993, chapter 3.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.kernels import kernel

Loss = Literal["linear", "soft_l1"]
# Beacons less than this off one line cannot tell its two sides apart.
_ON_A_LINE_M = 0.1
# An eigenvalue of the information below this share of all of it is none.
_NO_INFORMATION = 1e-4
# The search ends with a shorter step, or after so many.
_ENOUGH_M, _MOST_STEPS = 1e-9, 200
# No range is better known than this.
_LEAST_SPREAD_M = 0.1


class Outcome(StrEnum):
    """What a fix is worth."""

    DETERMINED = "determined"
    MIRRORED = "mirrored"
    CENTROID = "centroid"
    NOTHING = "nothing"


@dataclass(frozen=True, slots=True, kw_only=True)
class LaterationFix:
    """A position and how sure it is.

    Attributes
    ----------
    x_m, y_m : float
        [m]
    covariance_m2 : ndarray of float64, (2, 2)
        [m2]
    residual_m : float
        Root mean square of the ranges' departures. [m]
    outcome : Outcome
        ``determined``: three ranges or more to beacons that are not on one line. ``mirrored``: the
        beacons are within 0.1 m of one line, so the position on its other side fits as well; this
        is the one on the side of the start, its covariance that of this side alone. ``centroid``:
        fewer than three ranges, the mean of the beacons weighted by 1 / range; the variance on
        either axis is half the weighted mean of the squared horizontal ranges. ``nothing``: no
        range; all NaN.
    """

    x_m: float
    y_m: float
    covariance_m2: NDArray[np.float64]
    residual_m: float
    outcome: Outcome


def laterate(
    beacon_xyz_m: NDArray[np.float64],
    range_m: NDArray[np.float64],
    *,
    phone_height_m: float,
    spread_m: NDArray[np.float64] | None = None,
    start_xy_m: NDArray[np.float64] | None = None,
    loss: Loss = "linear",
) -> LaterationFix:
    """Position that fits ranges to beacons best.

    Parameters
    ----------
    beacon_xyz_m : ndarray of float64, (k, 3)
        [m]
    range_m : ndarray of float64, (k,)
        In space; NaN for a beacon without one. [m]
    phone_height_m : float
        Above the floor. [m]
    spread_m : ndarray of float64, (k,), optional
        Standard deviation of each range. Without it all weigh alike, and the covariance is scaled
        by the mean square of what is left over, k - 2 degrees of freedom, at least 0.1 m. [m]
    start_xy_m : ndarray of float64, (2,), optional
        Where the search begins, such as the last position; without it the mean of the beacons
        weighted by 1 / range. [m]
    loss : {"linear", "soft_l1"}
        Squares z, or less for ranges far off, ``2 (sqrt(1 + z) - 1)``: see
        `scipy.optimize.least_squares`.

    Returns
    -------
    LaterationFix
        Never an exception for ranges that do not tell a position: see its outcome.

    Raises
    ------
    UsageError
        If shapes differ, a range is negative, a spread is not positive, or the loss is unknown.
    """
    _refuse_bad(beacon_xyz_m, range_m, spread_m, loss)
    known = np.isfinite(range_m)
    beacons_m, ranges_m = beacon_xyz_m[known], range_m[known]
    if not len(ranges_m):
        return _nothing()
    if len(ranges_m) < 3:
        return _centroid_fix(beacons_m, ranges_m, phone_height_m)
    spreads_m = np.ones(len(ranges_m)) if spread_m is None else spread_m[known]
    start_m = _centroid_m(beacons_m, ranges_m) if start_xy_m is None else start_xy_m
    on_a_line = _off_line_m(beacons_m) < _ON_A_LINE_M
    if on_a_line:
        start_m = _beside_line(beacons_m, start_m)
    links = _Links(beacons_m, ranges_m, spreads_m, phone_height_m)
    place_m = links.solved(start_m, loss)
    left_m = links.residuals(place_m) * spreads_m
    scale = 1.0 if spread_m is not None else _left_over_m2(left_m)
    return LaterationFix(
        x_m=float(place_m[0]),
        y_m=float(place_m[1]),
        covariance_m2=links.covariance_m2(place_m, scale),
        residual_m=float(np.sqrt(np.mean(left_m**2))),
        outcome=Outcome.MIRRORED if on_a_line else Outcome.DETERMINED,
    )


@dataclass(frozen=True, slots=True)
class _Links:
    """Ranges to k beacons with their spreads."""

    beacons_m: NDArray[np.float64]
    ranges_m: NDArray[np.float64]
    spreads_m: NDArray[np.float64]
    height_m: float

    def _apart_m(self, place_m: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.array([*place_m, self.height_m]) - self.beacons_m

    def residuals(self, place_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Departures of the distances from the ranges, in spreads, (k,). [-]."""
        distance_m = np.linalg.norm(self._apart_m(place_m), axis=1)
        return np.asarray((distance_m - self.ranges_m) / self.spreads_m)

    def jacobian(self, place_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Derivatives of the residuals: unit vectors from the beacons in spreads, (k, 2). [1/m]."""
        apart_m = self._apart_m(place_m)
        distance_m = np.maximum(np.linalg.norm(apart_m, axis=1), 1e-9)
        return np.asarray(apart_m[:, :2] / (distance_m * self.spreads_m)[:, None])

    def solved(self, start_m: NDArray[np.float64], loss: Loss) -> NDArray[np.float64]:
        """Place of the least squares near a start, (2,). [m]."""
        # One layout and one type, or the kernel is compiled anew.
        return _descended(
            np.ascontiguousarray(self.beacons_m, np.float64),
            np.ascontiguousarray(self.ranges_m, np.float64),
            np.ascontiguousarray(self.spreads_m, np.float64),
            np.ascontiguousarray(start_m, np.float64),
            self.height_m,
            loss == "soft_l1",
        )

    def covariance_m2(self, place_m: NDArray[np.float64], scale: float) -> NDArray[np.float64]:
        """Inverse of the information, scaled, (2, 2). [m2].

        Along a direction the ranges do not tell, as across a line of beacons for a place on it, the
        variance is the mean squared range.
        """
        jacobian = self.jacobian(place_m)
        information, axes = np.linalg.eigh(jacobian.T @ jacobian)
        # Unit vectors all along one axis are information 1 / spread^2 each.
        told = information > _NO_INFORMATION * np.sum(self.spreads_m**-2.0)
        widest_m2 = float(np.mean(self.ranges_m**2))
        variance_m2 = np.where(told, scale / np.where(told, information, 1.0), widest_m2)
        return np.asarray((axes * variance_m2) @ axes.T)


@kernel
def _descended(
    beacons_m: NDArray[np.float64],
    ranges_m: NDArray[np.float64],
    spreads_m: NDArray[np.float64],
    start_m: NDArray[np.float64],
    height_m: float,
    soft: bool,
) -> NDArray[np.float64]:
    """Place where the loss is least near a start, (2,), by Levenberg and Marquardt (kernel). [m].

    The damping is Nielsen's (H. B. Nielsen, "Damping parameter in Marquardt's method", report
    IMM-REP-1999-05, DTU). The soft loss is descended with weights ``1 / sqrt(1 + z)``, its
    derivative.
    """
    x, y, damping, growth = start_m[0], start_m[1], 1e-3, 2.0
    best = _normal_equations(beacons_m, ranges_m, spreads_m, x, y, height_m, soft)
    for _ in range(_MOST_STEPS):
        _, xx, xy, yy, right, up = best
        more = damping * (xx + yy)
        determinant = (xx + more) * (yy + more) - xy * xy
        if not determinant > 0.0:
            break
        step_x = (xy * up - (yy + more) * right) / determinant
        step_y = (xy * right - (xx + more) * up) / determinant
        tried = _normal_equations(
            beacons_m, ranges_m, spreads_m, x + step_x, y + step_y, height_m, soft
        )
        # Of the decrease that the linear model promises, the share that came.
        promised = step_x * (more * step_x - right) + step_y * (more * step_y - up)
        gain = (best[0] - tried[0]) / promised if promised > 0.0 else 0.0
        if gain > 0.0:
            x, y, best, growth = x + step_x, y + step_y, tried, 2.0
            damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
        else:
            damping, growth = damping * growth, 2.0 * growth
        if abs(step_x) + abs(step_y) < _ENOUGH_M:
            break
    return np.array([x, y])


@kernel
def _normal_equations(
    beacons_m: NDArray[np.float64],
    ranges_m: NDArray[np.float64],
    spreads_m: NDArray[np.float64],
    x: float,
    y: float,
    height_m: float,
    soft: bool,
) -> tuple[float, float, float, float, float, float]:
    """Loss at a place, J'WJ (xx, xy, yy) and J'Wr (x, y) of the residuals r there (kernel)."""
    loss, xx, xy, yy, right, up = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(ranges_m)):
        along, across = x - beacons_m[k, 0], y - beacons_m[k, 1]
        above = height_m - beacons_m[k, 2]
        far = np.sqrt(along * along + across * across + above * above)
        residual = (far - ranges_m[k]) / spreads_m[k]
        square, weight = residual * residual, 1.0
        if soft:
            root = np.sqrt(1.0 + square)
            square, weight = 2.0 * (root - 1.0), 1.0 / root
        scale = 1.0 / (max(far, 1e-9) * spreads_m[k])
        along, across = along * scale, across * scale
        loss += square
        xx += weight * along * along
        xy += weight * along * across
        yy += weight * across * across
        right += weight * along * residual
        up += weight * across * residual
    return loss, xx, xy, yy, right, up


def _refuse_bad(
    beacon_xyz_m: NDArray[np.float64],
    range_m: NDArray[np.float64],
    spread_m: NDArray[np.float64] | None,
    loss: str,
) -> None:
    count = len(range_m)
    if beacon_xyz_m.shape != (count, 3) or (spread_m is not None and len(spread_m) != count):
        raise UsageError(
            f"{count} ranges need {count} beacons with x, y and z, and as many spreads"
        )
    if np.any(range_m < 0) or (spread_m is not None and not np.all(spread_m > 0)):
        raise UsageError("a range is negative or a spread not positive; mend them first")
    if loss not in get_args(Loss):
        raise UsageError(f"loss '{loss}': use one of {', '.join(get_args(Loss))}")


def _nothing() -> LaterationFix:
    return LaterationFix(
        x_m=np.nan,
        y_m=np.nan,
        covariance_m2=np.full((2, 2), np.nan),
        residual_m=np.nan,
        outcome=Outcome.NOTHING,
    )


def _left_over_m2(left_m: NDArray[np.float64]) -> float:
    """Variance of ranges that depart from the fix so far, (k,), two of them used up. [m2]."""
    return max(float(np.sum(left_m**2)) / (len(left_m) - 2), _LEAST_SPREAD_M**2)


def _weights(range_m: NDArray[np.float64]) -> NDArray[np.float64]:
    weights = 1.0 / np.maximum(range_m, _LEAST_SPREAD_M)
    return np.asarray(weights / weights.sum())


def _centroid_m(
    beacons_m: NDArray[np.float64], range_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.asarray(_weights(range_m) @ beacons_m[:, :2])


def _centroid_fix(
    beacons_m: NDArray[np.float64], range_m: NDArray[np.float64], phone_height_m: float
) -> LaterationFix:
    """Fix of one or two ranges: somewhere about, as far off as the ranges say."""
    place_m = _centroid_m(beacons_m, range_m)
    apart_m = np.array([*place_m, phone_height_m]) - beacons_m
    left_m = np.linalg.norm(apart_m, axis=1) - range_m
    # On a circle of radius r about the beacon, the variance on either axis is r^2 / 2.
    across_m2 = np.maximum(range_m**2 - apart_m[:, 2] ** 2, 0.0)
    variance_m2 = max(float(_weights(range_m) @ across_m2) / 2.0, _LEAST_SPREAD_M**2)
    return LaterationFix(
        x_m=float(place_m[0]),
        y_m=float(place_m[1]),
        covariance_m2=np.eye(2) * variance_m2,
        residual_m=float(np.sqrt(np.mean(left_m**2))),
        outcome=Outcome.CENTROID,
    )


def _line(beacons_m: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Middle of the beacons on the map, and the unit vector across their line, two (2,)."""
    middle_m = beacons_m[:, :2].mean(axis=0)
    _, _, axes = np.linalg.svd(beacons_m[:, :2] - middle_m)
    along = axes[0] if axes[0] @ [1.0, 1e-3] > 0 else -axes[0]
    return middle_m, np.array([-along[1], along[0]])


def _off_line_m(beacons_m: NDArray[np.float64]) -> float:
    """How far the beacons are off the line through them, at most. [m]."""
    middle_m, across = _line(beacons_m)
    return float(np.abs((beacons_m[:, :2] - middle_m) @ across).max())


def _beside_line(
    beacons_m: NDArray[np.float64], start_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Start that is not on the line of the beacons, where the search would be stuck.

    A start on it is moved to its left, seen along the x axis.
    """
    middle_m, across = _line(beacons_m)
    if abs((start_m - middle_m) @ across) >= _ON_A_LINE_M:
        return start_m
    return np.asarray(start_m + across)
