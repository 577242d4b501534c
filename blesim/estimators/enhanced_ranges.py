"""One range of several for each beacon: those that agree, averaged.

Outlier detection 1 of [1]_: of up to six distances to a beacon, three by the polynomials of its
channels and three from the fingerprint positions of the channels, those outside the mean plus or
minus one standard deviation are dropped and the rest averaged, Eq 16 to 19. The paper does not say
which standard deviation; it is that of a sample, n - 1, so that two distances are always kept.

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
"""

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel

Array = NDArray[np.float64]


@kernel
def enhanced_ranges(
    distances_m: Array, variances_m2: Array, drop_outliers: bool
) -> tuple[Array, Array]:
    """Range to each beacon and its variance, two (n,), NaN for a beacon without one (kernel).

    Parameters
    ----------
    distances_m, variances_m2 : ndarray of float64, (n, c)
        Distances to n beacons and their variances, NaN where there is none. [m], [m2]
    drop_outliers : bool
        Drop outliers, or average all.

    Returns
    -------
    ranges_m, range_variances_m2 : ndarray of float64, (n,)
        The variance is the mean of those averaged: the walls and people between a phone and a
        beacon put all its distances off together, and one variance for all is what is then left.
        [m], [m2]
    """
    ranges_m, range_variances_m2 = np.full((2, len(distances_m)), np.nan)
    for row in range(len(distances_m)):
        middle_m, limit_m = _interval(distances_m[row], drop_outliers)
        total_m, total_m2, kept = 0.0, 0.0, 0
        for column in range(distances_m.shape[1]):
            if abs(distances_m[row, column] - middle_m) <= limit_m:
                total_m += distances_m[row, column]
                total_m2 += variances_m2[row, column]
                kept += 1
        if kept > 0:
            ranges_m[row], range_variances_m2[row] = total_m / kept, total_m2 / kept
    return ranges_m, range_variances_m2


@kernel
def _interval(distances_m: Array, drop_outliers: bool) -> tuple[float, float]:
    """Mean, and how far off it a distance may be, Eq 18 (kernel)."""
    total_m, count = 0.0, 0
    for distance_m in distances_m:
        if not np.isnan(distance_m):
            total_m += distance_m
            count += 1
    if count == 0:
        return np.nan, np.nan
    middle_m, square_m2 = total_m / count, 0.0
    if not drop_outliers or count == 1:
        return middle_m, np.inf
    for distance_m in distances_m:
        if not np.isnan(distance_m):
            square_m2 += (distance_m - middle_m) ** 2
    return middle_m, np.sqrt(square_m2 / (count - 1))
