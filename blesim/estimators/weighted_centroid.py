"""The weighted centroid: the mean place of the beacons that are heard, stronger ones count more.

References
----------
.. [1] J. Blumenthal, R. Grossmann, F. Golatowski, D. Timmermann, "Weighted centroid localization in
   Zigbee-based sensor networks", WISP 2007. doi:10.1109/WISP.2007.4447528
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.estimators.base import Need, StartInfo, fitted
from blesim.estimators.heard import SignalTracker, moments_track, strongest
from blesim.estimators.nearest_beacon import beacon_places
from blesim.estimators.refusals import not_fitted
from blesim.kernels import kernel
from blesim.ranging.smoothing import SignalKind, SignalWindow, refuse_bad_window
from blesim.recording import Recording
from blesim.tables import IntArray, Track
from blesim.venue.venue import Venue


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightedCentroid:
    """Weighted centroid of the beacons heard: after every reading, those of the strongest's level.

    The weight is the received power to an exponent, ``w = 10^(exponent RSSI / 10)``: 1 is the power
    itself. Weights ``1 / d^g`` [1]_ are, with the path loss exponent n, an exponent of ``g / n``.

    The covariance is the weighted one of the beacons' places about the centroid, each taken as a
    square as wide as it is far to the next, as in `nearest_beacon`. It needs no survey.

    Parameters
    ----------
    exponent : float
        0 for the plain centroid of what is heard; the larger, the nearer to the strongest. [-]
    signal : {"averaged", "highest"}
        Signal value of a beacon over the window.
    window_s : float
        Length of the window; assumed. [s]
    rate : float
        Weight of a new reading in the average. [-]

    Raises
    ------
    UsageError
        If a parameter is out of its range.

    References
    ----------
    .. [1] doi:10.1109/WISP.2007.4447528
    """

    exponent: float = 1.0
    signal: SignalKind = "averaged"
    window_s: float = 3.0
    rate: float = 0.25
    places: "CentroidPlaces | None" = field(default=None, init=False, repr=False, compare=False)
    needs: ClassVar[frozenset[Need]] = frozenset()

    def __post_init__(self) -> None:
        refuse_bad_window(self.signal, self.window_s, self.rate)
        if not 0 <= self.exponent <= 10:
            raise UsageError(f"exponent {self.exponent:g}: give 0 to 10")

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:  # noqa: ARG002 (learns nothing)
        """Copy that knows the places of the venue's beacons."""
        around = beacon_places(venue)
        places = CentroidPlaces(
            xy_m=np.ascontiguousarray(venue.beacon_xyz_m[:, :2]),
            variance_m2=np.stack([around.variance_x_m2, around.variance_y_m2], axis=1),
            level=venue.beacon_level.astype(np.int64),
            exponent=self.exponent,
        )
        return fitted(self, places=places)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> SignalTracker:  # noqa: ARG002 (needs neither)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.places is None:
            raise not_fitted("weighted-centroid")
        beacons = len(self.places.level)
        window = SignalWindow(
            beacons=beacons, signal=self.signal, window_s=self.window_s, rate=self.rate
        )
        return SignalTracker(window, np.ones(beacons, np.bool_), self.places)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CentroidPlaces:
    """The beacons of a venue, and how much more the stronger ones count.

    Attributes
    ----------
    xy_m, variance_m2 : ndarray of float64, (beacons, 2)
        Places, and variances of somebody beside each. [m], [m2]
    level : ndarray of int64, (beacons,)
        Level of the venue.
    exponent : float
        Of the received power. [-]
    """

    xy_m: NDArray[np.float64]
    variance_m2: NDArray[np.float64]
    level: NDArray[np.int64]
    exponent: float

    def track(self, time_us: IntArray, signal_dbm: NDArray[np.float64]) -> Track:
        """Centroids of signal values (n, beacons) at times (n,). [us], [dBm]."""
        found = np.empty((len(time_us), 5))
        level = np.empty(len(time_us), np.int64)
        _centroids(signal_dbm, self.xy_m, self.variance_m2, self.level, self.exponent, found, level)
        return moments_track(time_us, level, found)


@kernel
def _centroids(
    signal_dbm: NDArray[np.float64],
    xy_m: NDArray[np.float64],
    variance_m2: NDArray[np.float64],
    level: NDArray[np.int64],
    exponent: float,
    found: NDArray[np.float64],
    found_level: NDArray[np.int64],
) -> None:
    """Fill means and covariances (n, 5) and levels (n,) of signal values (n, beacons) (kernel)."""
    weight = np.empty(len(level))
    for row in range(len(signal_dbm)):
        best = strongest(signal_dbm[row])
        total, x, y = 0.0, 0.0, 0.0
        for beacon in range(len(level)):
            weight[beacon] = 0.0
            if not np.isnan(signal_dbm[row, beacon]) and level[beacon] == level[best]:
                above_db = signal_dbm[row, beacon] - signal_dbm[row, best]
                weight[beacon] = 10.0 ** (exponent * above_db / 10.0)
            total += weight[beacon]
            x += weight[beacon] * xy_m[beacon, 0]
            y += weight[beacon] * xy_m[beacon, 1]
        found[row, 0], found[row, 1] = x / total, y / total
        found[row, 2:] = 0.0
        for beacon in range(len(level)):
            share = weight[beacon] / total
            right, up = xy_m[beacon, 0] - found[row, 0], xy_m[beacon, 1] - found[row, 1]
            found[row, 2] += share * (right * right + variance_m2[beacon, 0])
            found[row, 3] += share * (up * up + variance_m2[beacon, 1])
            found[row, 4] += share * right * up
        found_level[row] = level[best]
