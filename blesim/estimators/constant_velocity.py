"""Position and velocity on the map, moved at constant velocity, updated by places or ranges.

The state is ``[x y vx vy]``, Eq 20 of [1]_; it moves by Eq 21 to 23 and 26, the process noise being
on the velocity alone. Places measure x and y, ranges the distance in space to a beacon: Eq 24, 25
and 27, whose Jacobian is the unit vector from the beacon to the phone.

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.filters.kalman import predict, update_in_turn
from blesim.kernels import kernel

Array = NDArray[np.float64]
# Right under a beacon the unit vector to it has no length to be divided by.
_NEAREST_M = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Belief:
    """Where somebody is and how fast.

    Attributes
    ----------
    mean : ndarray of float64, (4,)
        x, y [m], vx, vy [m/s].
    covariance : ndarray of float64, (4, 4)
        Of the mean.
    level : int
        Level of the venue.
    """

    mean: Array
    covariance: Array
    level: int


def at_rest(place_m: Array, covariance_m2: Array, speed_m_s: float, level: int) -> Belief:
    """Belief at a place, (2,), known as its covariance (2, 2) says, without a known velocity.

    Parameters
    ----------
    place_m, covariance_m2 : ndarray of float64, (2,) and (2, 2)
        [m], [m2]
    speed_m_s : float
        Standard deviation of the velocity on either axis. [m/s]
    level : int
        Level of the venue.
    """
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = covariance_m2
    covariance[2, 2] = covariance[3, 3] = speed_m_s**2
    return Belief(mean=np.append(place_m, [0.0, 0.0]), covariance=covariance, level=level)


@kernel
def moved(
    mean: Array, covariance: Array, time_s: float, velocity_change_m_s: float
) -> tuple[Array, Array]:
    """Mean (4,) and covariance (4, 4) some time later, Eq 22, 23 and 26 (kernel).

    Parameters
    ----------
    mean, covariance : ndarray of float64, (4,) and (4, 4)
        Before.
    time_s : float
        How much later. [s]
    velocity_change_m_s : float
        Standard deviation of the change of either velocity in a second; its variance grows with
        time. [m/s]
    """
    transition, noise = np.eye(4), np.zeros((4, 4))
    for axis in range(2):
        transition[axis, axis + 2] = time_s
        noise[axis + 2, axis + 2] = velocity_change_m_s * velocity_change_m_s * time_s
    return predict(mean, covariance, transition, noise)


@kernel
def updated_by_places(
    mean: Array, covariance: Array, places_m: Array, variance_m2: Array
) -> tuple[Array, Array]:
    """Mean (4,) and covariance (4, 4) after places were measured independently (kernel).

    Parameters
    ----------
    mean, covariance : ndarray of float64, (4,) and (4, 4)
        Before.
    places_m : ndarray of float64, (c, 2)
        [m]
    variance_m2 : ndarray of float64, (c,)
        Of each place, on either axis. [m2]
    """
    count = len(places_m)
    innovation, model, variance = np.empty(2 * count), np.zeros((2 * count, 4)), np.empty(2 * count)
    for row in range(2 * count):
        place, axis = row // 2, row % 2
        innovation[row] = places_m[place, axis] - mean[axis]
        model[row, axis] = 1.0
        variance[row] = variance_m2[place]
    after = update_in_turn(mean, covariance, innovation, model, variance)
    return after.mean, after.covariance


@kernel
def updated_by_ranges(
    mean: Array,
    covariance: Array,
    beacons_m: Array,
    ranges_m: Array,
    variance_m2: Array,
    height_m: float,
    deviations: float,
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Mean, covariance and which ranges were believed, after ranges to k beacons (kernel).

    Parameters
    ----------
    mean, covariance : ndarray of float64, (4,) and (4, 4)
        Before.
    beacons_m : ndarray of float64, (k, 3)
        [m]
    ranges_m, variance_m2 : ndarray of float64, (k,)
        In space, and their variances; independent of each other. [m], [m2]
    height_m : float
        Of the phone above the floor. [m]
    deviations : float
        A range whose innovation is more standard deviations of its own, ``sqrt(H P H' + R)``, is
        left out: Eq 28 to 30. Infinite to take all. [-]
    """
    believed = np.zeros(len(ranges_m), np.bool_)
    innovation, jacobian = np.empty(len(ranges_m)), np.zeros((len(ranges_m), 4))
    variance, kept = np.empty(len(ranges_m)), 0
    for row in range(len(ranges_m)):
        right_m, up_m = mean[0] - beacons_m[row, 0], mean[1] - beacons_m[row, 1]
        above_m = height_m - beacons_m[row, 2]
        far_m = max(np.sqrt(right_m**2 + up_m**2 + above_m**2), _NEAREST_M)
        east, north, tau_m = right_m / far_m, up_m / far_m, ranges_m[row] - far_m
        spread_m2 = (
            east * east * covariance[0, 0]
            + 2.0 * east * north * covariance[0, 1]
            + north * north * covariance[1, 1]
            + variance_m2[row]
        )
        believed[row] = abs(tau_m) <= deviations * np.sqrt(spread_m2)
        if believed[row]:
            innovation[kept], variance[kept] = tau_m, variance_m2[row]
            jacobian[kept, 0], jacobian[kept, 1] = east, north
            kept += 1
    after = update_in_turn(mean, covariance, innovation[:kept], jacobian[:kept], variance[:kept])
    return after.mean, after.covariance, believed
