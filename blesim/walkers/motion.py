"""How people move: a trapezoid of speed on every stretch, slower where others are.

A person's desired speed is slowed by the density of others on the stretch by the relation of Kladek
as Weidmann fitted it to pedestrians [1]_: ``v = v0 (1 - exp(-1.913 (1/rho - 1/5.4)))``. With
``v0 = 1.34`` m/s the largest flow is 1.22 persons a second and metre, at 1.75 persons/m2.

References
----------
.. [1] U. Weidmann, "Transporttechnik der Fussgaenger", Schriftenreihe des IVT 90, ETH Zurich,
   second edition, 1993. doi:10.3929/ethz-a-000687810
"""

from collections.abc import Callable
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from blesim.kernels import kernel

FREE_SPEED_M_S = 1.34
_FIT_PER_M2 = 1.913
_JAM_PER_M2 = 5.4
# Nobody stops for ever: a jam dissolves at this share of the desired speed; assumed.
SLOWEST = 0.1
# Thousandths are enough, and a steady walker stays steady while few others are about.
_DECIMALS = 3


def crowd_factor(density_per_m2: ArrayLike) -> NDArray[np.float64]:
    """Share of the desired speed that is left among others, any shape.

    Parameters
    ----------
    density_per_m2 : array_like of float
        Others on the stretch over its area; not negative. [1/m2]

    Returns
    -------
    ndarray of float64
        From `SLOWEST` to 1; Weidmann 1993, see the module. [-]
    """
    density = np.maximum(np.asarray(density_per_m2, dtype=np.float64), 1e-9)
    factor = 1.0 - np.exp(-_FIT_PER_M2 * (1.0 / density - 1.0 / _JAM_PER_M2))
    return np.asarray(np.round(np.maximum(factor, SLOWEST), _DECIMALS), np.float64)


def crowd_factors(area_m2: NDArray[np.float64]) -> list[list[float]]:
    """Factors of stretches by the number of others there, up to the number that jams each.

    Parameters
    ----------
    area_m2 : ndarray of float64, (n,)
        Area of each stretch. [m2]

    Returns
    -------
    list of list of float
        One list a stretch; beyond its end `SLOWEST` holds. [-]
    """
    counts = np.ceil(_JAM_PER_M2 * area_m2).astype(int) + 1
    return [
        crowd_factor(np.arange(count) / area).tolist()
        for count, area in zip(counts, area_m2, strict=True)
    ]


def stretch_walked(
    speed_m_s: float, wish_m_s: float, limit_m_s: float, length_m: float, rate_m_s2: float
) -> tuple[float, float, float]:
    """Duration of a stretch, the speed held on it, and the speed at its end.

    The walker speeds up or slows down at a constant rate to the speed wished for, holds it, and
    brakes to be no faster at the end than permitted. What is too short for that is walked with as
    much of it as there is room for.

    Parameters
    ----------
    speed_m_s : float
        At the start; slow enough to brake to `limit_m_s`. [m/s]
    wish_m_s : float
        Speed wished for, positive. [m/s]
    limit_m_s : float
        Permitted at the end. [m/s]
    length_m : float
        [m]
    rate_m_s2 : float
        Acceleration and deceleration, positive. [m/s2]

    Returns
    -------
    tuple of float
        Duration [s], held speed [m/s], speed at the end [m/s]. Between start, held speed and end
        the speed changes at the rate, so the three tell the whole motion.
    """
    goal_m_s = wish_m_s if wish_m_s < limit_m_s else limit_m_s
    if speed_m_s == wish_m_s == goal_m_s:
        return length_m / wish_m_s, wish_m_s, wish_m_s
    square, held, goal = speed_m_s * speed_m_s, wish_m_s * wish_m_s, goal_m_s * goal_m_s
    room = 2.0 * rate_m_s2 * length_m
    if speed_m_s <= wish_m_s:
        rest = room - (held - square) - (held - goal)
        if rest >= 0.0:
            changes_s = (2.0 * wish_m_s - speed_m_s - goal_m_s) / rate_m_s2
            return changes_s + rest / (2.0 * rate_m_s2 * wish_m_s), wish_m_s, goal_m_s
        if square + room <= goal:
            end_m_s = sqrt(square + room)
            return (end_m_s - speed_m_s) / rate_m_s2, end_m_s, end_m_s
        peak_square = 0.5 * (room + square + goal)
        # Where the walker must brake at once, rounding may put the peak below both ends.
        peak_m_s = max(sqrt(peak_square), speed_m_s, goal_m_s)
        return (2.0 * peak_m_s - speed_m_s - goal_m_s) / rate_m_s2, peak_m_s, goal_m_s
    rest = room - (square - goal)
    if rest >= 0.0:
        changes_s = (speed_m_s - goal_m_s) / rate_m_s2
        return changes_s + rest / (2.0 * rate_m_s2 * wish_m_s), wish_m_s, goal_m_s
    end_m_s = sqrt(max(square - room, 0.0))
    return (speed_m_s - end_m_s) / rate_m_s2, end_m_s, end_m_s


@kernel
def limits_m_s(
    length_m: NDArray[np.float64], at_end_m_s: NDArray[np.float64], rate_m_s2: float
) -> NDArray[np.float64]:
    """Speeds permitted at the ends of stretches so that later limits can be kept (kernel).

    Parameters
    ----------
    length_m : ndarray of float64, (n,)
        Stretches in the order in which they are walked. [m]
    at_end_m_s : ndarray of float64, (n,)
        What each end itself permits; infinite where it does not care. [m/s]
    rate_m_s2 : float
        Deceleration. [m/s2]

    Returns
    -------
    ndarray of float64, (n,)
        [m/s]
    """
    limits = at_end_m_s.copy()
    for row in range(len(limits) - 2, -1, -1):
        following = limits[row + 1]
        before = sqrt(following * following + 2.0 * rate_m_s2 * length_m[row + 1])
        limits[row] = min(limits[row], before)
    return limits


_stretch: Callable[[float, float, float, float, float], tuple[float, float, float]] = kernel(
    stretch_walked
)


@kernel
def free_motion(
    length_m: NDArray[np.float64],
    limit_m_s: NDArray[np.float64],
    rests: NDArray[np.bool_],
    wish_m_s: float,
    rate_m_s2: float,
    out: NDArray[np.float64],
) -> None:
    """Motion along stretches with nobody in the way (kernel).

    Parameters
    ----------
    length_m, limit_m_s : ndarray of float64, (n,)
        Stretches, and speeds permitted at their ends. [m], [m/s]
    rests : ndarray of bool, (n,)
        Whether the walker is at rest after each.
    wish_m_s, rate_m_s2 : float
        Desired speed [m/s] and acceleration [m/s2].
    out : ndarray of float64, (n, 4)
        Filled with duration in whole microseconds [us] and the speeds at the start, held, and at
        the end [m/s].
    """
    speed_m_s = 0.0
    for row in range(len(length_m)):
        seconds, held_m_s, end_m_s = _stretch(
            speed_m_s, wish_m_s, limit_m_s[row], length_m[row], rate_m_s2
        )
        out[row, 0] = np.floor(seconds * 1e6 + 0.5)
        out[row, 1], out[row, 2], out[row, 3] = speed_m_s, held_m_s, end_m_s
        speed_m_s = 0.0 if rests[row] else end_m_s
