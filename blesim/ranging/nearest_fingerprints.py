"""Position among the fingerprints most like what is heard.

After [1]_, where ``RSS_m`` is what is measured of N beacons and ``RSS_i`` fingerprint i:

- Eq 14: ``ED_i = sqrt(mean over N of (RSS_m - RSS_i)^2)``; the Euclidean distance of other papers
  is sqrt(N) of it, so it has the same neighbours and weights
- Eq 15: position = sum of ``w_i r_i`` over the k nearest, ``w_i`` proportional to ``1 / ED_i``
- Eq 10 to 13: only fingerprints in the ellipse of the last position's covariance, scaled, count

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
"""

from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError, UsageError
from blesim.kernels import kernel
from blesim.ranging.radio_map import RadioMap

Compared = Literal["heard", "all"]
NO_FINGERPRINT = -1
_NOWHERE = np.empty(0)
# Side of the square that a fingerprint stands for which is the only one of its level.
_LONE_SIDE_M = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchEllipse:
    """Where to look for fingerprints: Eq 10 to 13.

    Attributes
    ----------
    x_m, y_m : float
        Last position. [m]
    covariance_m2 : ndarray of float64, (2, 2)
        Of the last position. [m2]
    scale : float
        Semi-axes in standard deviations, s; the paper takes 5. [-]
    least_m : float
        Shortest semi-axis: a filter too sure of itself must not lock itself in. [m]
    """

    x_m: float
    y_m: float
    covariance_m2: NDArray[np.float64]
    scale: float = 5.0
    least_m: float = 1.0

    def axes(self) -> tuple[float, float, float]:
        """Major and minor semi-axis [m], heading of the major one from the x axis [rad].

        Eq 11 and 12: ``s sqrt((Vx + Vy)/2 +- sqrt((Vx - Vy)^2/4 + C^2))``; Eq 13: ``atan2(2 C,
        Vx - Vy)/2``, which the paper calls azimuth but counts from the east axis.
        """
        (vx_m2, c_m2), (_, vy_m2) = self.covariance_m2.tolist()
        middle, apart = (vx_m2 + vy_m2) / 2, np.hypot((vx_m2 - vy_m2) / 2, c_m2)
        major_m = self.scale * np.sqrt(max(middle + apart, 0.0))
        minor_m = self.scale * np.sqrt(max(middle - apart, 0.0))
        heading_rad = 0.5 * np.arctan2(2 * c_m2, vx_m2 - vy_m2)
        return max(major_m, self.least_m), max(minor_m, self.least_m), float(heading_rad)

    def numbers(self) -> NDArray[np.float64]:
        """Centre, inverse semi-axes, cosine and sine of the heading, for the kernel, (6,)."""
        major_m, minor_m, heading_rad = self.axes()
        turned = np.cos(heading_rad), np.sin(heading_rad)
        return np.array([self.x_m, self.y_m, 1.0 / major_m, 1.0 / minor_m, *turned])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FingerprintPositions:
    """Positions of n measured vectors; all NaN and `NO_FINGERPRINT` where nothing was heard.

    Attributes
    ----------
    x_m, y_m : ndarray of float64, (n,)
        [m]
    level : ndarray of int64, (n,)
        That of the nearest fingerprint; those on other levels weigh nothing. 0 where there is none.
    variance_x_m2, variance_y_m2, covariance_xy_m2 : ndarray of float64, (n,)
        Weighted covariance of the k places, each taken as a square as wide as it is far to the
        next place. [m2]
    fingerprint : ndarray of int64, (n, k)
        Rows of the radio map used, nearest first; `NO_FINGERPRINT` beyond those there are.
    apart_db : ndarray of float64, (n, k)
        Their distances ED, Eq 14; NaN beyond those there are. [dB]
    """

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    level: NDArray[np.int64]
    variance_x_m2: NDArray[np.float64]
    variance_y_m2: NDArray[np.float64]
    covariance_xy_m2: NDArray[np.float64]
    fingerprint: NDArray[np.int64]
    apart_db: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NearestFingerprints:
    """The k nearest fingerprints of a radio map.

    Attributes
    ----------
    radio_map : RadioMap
        Of one direction and channel, or of all together; not empty.
    k : int
        How many; the channel-separate paper takes 3.
    compared : {"heard", "all"}
        Compare the beacons that are heard at the moment, as Eq 14 does, or all of them, with the
        map's value for those that are not.

    Raises
    ------
    UsageError
        If a value is out of its range.
    DataError
        If the map is empty.
    """

    radio_map: RadioMap
    k: int = 3
    compared: Compared = "heard"
    _prints_dbm: NDArray[np.float64] = field(init=False, repr=False)
    _places: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.k < 1:
            raise UsageError(f"k {self.k}: give 1 or more")
        if self.compared not in get_args(Compared):
            raise UsageError(
                f"compared '{self.compared}': use one of {', '.join(get_args(Compared))}"
            )
        if not len(self.radio_map):
            raise DataError("the radio map is empty; survey the venue first")
        object.__setattr__(
            self, "_prints_dbm", np.ascontiguousarray(self.radio_map.fingerprints_dbm)
        )
        object.__setattr__(self, "_places", _places(self.radio_map))

    def locate(
        self, rssi_dbm: NDArray[np.float64], within: SearchEllipse | None = None
    ) -> FingerprintPositions:
        """Positions of measured vectors.

        Parameters
        ----------
        rssi_dbm : ndarray of float64, (n, beacons)
            Signal values, NaN for beacons that are not heard. [dBm]
        within : SearchEllipse, optional
            Where to look. If no fingerprint is inside, all are looked at; if fewer than k, those.

        Raises
        ------
        UsageError
            If the vectors do not have one value a beacon.
        """
        beacons = self._prints_dbm.shape[1]
        if rssi_dbm.ndim != 2 or rssi_dbm.shape[1] != beacons:
            raise UsageError(f"measured RSSI of shape {rssi_dbm.shape}: give (n, {beacons})")
        count = len(rssi_dbm)
        found = np.full((count, self.k), NO_FINGERPRINT, np.int64)
        apart_db = np.full((count, self.k), np.nan)
        position = np.full((count, 5), np.nan)
        _locate(
            self._prints_dbm,
            self._places,
            self._compared_dbm(rssi_dbm),
            _NOWHERE if within is None else within.numbers(),
            found,
            apart_db,
            position,
        )
        x_m, y_m, variance_x_m2, variance_y_m2, covariance_xy_m2 = position.T
        return FingerprintPositions(
            x_m=x_m,
            y_m=y_m,
            level=np.where(found[:, 0] >= 0, self.radio_map.level[found[:, 0]], 0),
            variance_x_m2=variance_x_m2,
            variance_y_m2=variance_y_m2,
            covariance_xy_m2=covariance_xy_m2,
            fingerprint=found,
            apart_db=apart_db,
        )

    def _compared_dbm(self, rssi_dbm: NDArray[np.float64]) -> NDArray[np.float64]:
        measured_dbm = np.ascontiguousarray(rssi_dbm, np.float64)
        if self.compared == "heard":
            return measured_dbm
        silent = np.isnan(measured_dbm)
        missing = silent & ~silent.all(axis=1, keepdims=True)
        return np.where(missing, self.radio_map.layout.missing_dbm, measured_dbm)


def _places(radio_map: RadioMap) -> NDArray[np.float64]:
    """Place, level and variance of each fingerprint, (p, 4): uniform over a square, side^2 / 12."""
    from scipy.spatial import KDTree

    places = np.stack([radio_map.x_m, radio_map.y_m, radio_map.level], axis=1)
    side_m = np.full(len(places), _LONE_SIDE_M)
    for level in np.unique(radio_map.level):
        here = radio_map.level == level
        # The same place in four directions is one place.
        different = np.unique(np.round(places[here, :2], 2), axis=0)
        if len(different) > 1:
            apart_m, _ = KDTree(different).query(different, k=[2])
            _, own = KDTree(different).query(places[here, :2], k=[1])
            side_m[here] = np.asarray(apart_m)[np.asarray(own)[:, 0], 0]
    return np.column_stack([places, side_m**2 / 12.0])


@kernel
def _locate(
    prints_dbm: NDArray[np.float64],
    places: NDArray[np.float64],
    measured_dbm: NDArray[np.float64],
    ellipse: NDArray[np.float64],
    found: NDArray[np.int64],
    apart_db: NDArray[np.float64],
    position: NDArray[np.float64],
) -> None:
    """Fill rows (n, k), distances (n, k) and positions (n, 5) of measured (n, beacons) (kernel)."""
    heard = np.empty(measured_dbm.shape[1], np.int64)
    for row in range(len(measured_dbm)):
        count = 0
        for beacon in range(measured_dbm.shape[1]):
            if not np.isnan(measured_dbm[row, beacon]):
                heard[count] = beacon
                count += 1
        if count == 0:
            continue
        now = heard[:count]
        kept = _nearest(
            prints_dbm, places, measured_dbm[row], now, ellipse, found[row], apart_db[row]
        )
        if kept == 0:
            kept = _nearest(
                prints_dbm, places, measured_dbm[row], now, ellipse[:0], found[row], apart_db[row]
            )
        _weigh(places, found[row], apart_db[row], kept, position[row])


@kernel
def _nearest(
    prints_dbm: NDArray[np.float64],
    places: NDArray[np.float64],
    measured_dbm: NDArray[np.float64],
    heard: NDArray[np.int64],
    ellipse: NDArray[np.float64],
    found: NDArray[np.int64],
    apart_db: NDArray[np.float64],
) -> int:
    """How many nearest fingerprints were found, and which (k,), how far apart (k,) (kernel)."""
    k, kept = len(found), 0
    for row in range(len(prints_dbm)):
        if len(ellipse) and not _inside(ellipse, places[row, 0], places[row, 1]):
            continue
        worst = apart_db[k - 1] if kept == k else np.inf
        square = 0.0
        for beacon in heard:
            difference = measured_dbm[beacon] - prints_dbm[row, beacon]
            square += difference * difference
            if square >= worst:
                break
        if square >= worst:
            continue
        kept = min(kept + 1, k)
        at = kept - 1
        while at > 0 and apart_db[at - 1] > square:
            apart_db[at], found[at] = apart_db[at - 1], found[at - 1]
            at -= 1
        apart_db[at], found[at] = square, row
    for at in range(kept):
        apart_db[at] = np.sqrt(apart_db[at] / len(heard))
    return kept


@kernel
def _inside(ellipse: NDArray[np.float64], x_m: float, y_m: float) -> bool:
    right_m, up_m = x_m - ellipse[0], y_m - ellipse[1]
    along = (right_m * ellipse[4] + up_m * ellipse[5]) * ellipse[2]
    across = (up_m * ellipse[4] - right_m * ellipse[5]) * ellipse[3]
    return bool(along * along + across * across <= 1.0)


@kernel
def _weigh(
    places: NDArray[np.float64],
    found: NDArray[np.int64],
    apart_db: NDArray[np.float64],
    kept: int,
    position: NDArray[np.float64],
) -> None:
    """Fill x, y and the covariance of the k nearest places, (5,) (kernel).

    As in scikit-learn, a fingerprint that agrees exactly leaves no weight to those that do not.
    """
    exact, level = apart_db[0] == 0.0, places[found[0], 2]
    weight = np.zeros(kept)
    for i in range(kept):
        if places[found[i], 2] == level:
            weight[i] = (1.0 if apart_db[i] == 0.0 else 0.0) if exact else 1.0 / apart_db[i]
    weight /= weight.sum()
    position[:] = 0.0
    for i in range(kept):
        position[0] += weight[i] * places[found[i], 0]
        position[1] += weight[i] * places[found[i], 1]
    for i in range(kept):
        right_m, up_m = places[found[i], 0] - position[0], places[found[i], 1] - position[1]
        position[2] += weight[i] * (right_m * right_m + places[found[i], 3])
        position[3] += weight[i] * (up_m * up_m + places[found[i], 3])
        position[4] += weight[i] * right_m * up_m
