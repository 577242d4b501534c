"""What trackers ask of readings: which beacons are known, on which level one is, chunk by chunk."""

from collections.abc import Iterator
from typing import Protocol

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim.estimators.base import make_track
from blesim.kernels import kernel
from blesim.ranging.smoothing import SignalWindow
from blesim.recording import Observations
from blesim.tables import IntArray, Readings, Track
from blesim.venue.venue import Venue

# Rows at a time of what has a value for every beacon.
_CHUNK = 4096


def known_readings(readings: Readings, known: NDArray[np.bool_]) -> Readings:
    """Readings of the beacons that are known, (beacons,); the others are skipped."""
    inside = (readings.beacon >= 0) & (readings.beacon < len(known))
    if not inside.all():
        readings = readings.rows(inside)
    kept = known[readings.beacon]
    return readings if kept.all() else readings.rows(kept)


def chunks(readings: Readings) -> Iterator[Readings]:
    """Yield the readings of a block in parts that are not too long."""
    for first in range(0, len(readings), _CHUNK):
        yield readings.rows(slice(first, first + _CHUNK))


@kernel
def strongest(signal_dbm: NDArray[np.float64]) -> int:
    """Beacon with the highest of the signal values (beacons,); -1 if all are NaN (kernel)."""
    best = -1
    for beacon in range(len(signal_dbm)):
        if not np.isnan(signal_dbm[beacon]) and (best < 0 or signal_dbm[beacon] > signal_dbm[best]):
            best = beacon
    return best


def boxes_m(venue: Venue) -> dict[int, NDArray[np.float64]]:
    """West, south, east and north of each level, (4,). [m]."""
    return {
        level.level: np.asarray(shapely.bounds(level.bounds), np.float64)
        for level in venue.floor_plan.levels
    }


class Locator(Protocol):
    """What makes positions of signal values."""

    def track(self, time_us: IntArray, signal_dbm: NDArray[np.float64]) -> Track:
        """Estimates at times (n,) [us] of signal values (n, beacons), NaN where silent [dBm]."""
        ...


class SignalTracker:
    """Tracker of what needs signal values alone: one estimate after every reading.

    Parameters
    ----------
    window : SignalWindow
        Of all beacons of the venue.
    known : ndarray of bool, (beacons,)
        Readings of other beacons are skipped.
    locator : Locator
        Of this phone alone.
    """

    def __init__(self, window: SignalWindow, known: NDArray[np.bool_], locator: Locator) -> None:
        self._window = window
        self._known = known
        self._locator = locator

    def advance(self, block: Observations) -> Track:
        """Estimates after each reading of the block."""
        parts = [
            self._locator.track(part.time_us, self._window.signals(part))
            for part in chunks(known_readings(block.readings, self._known))
        ]
        return parts[0] if len(parts) == 1 else Track.concatenate(parts)


def moments_track(time_us: IntArray, level: IntArray, moments: NDArray[np.float64]) -> Track:
    """Track of means and covariances.

    Parameters
    ----------
    time_us, level : ndarray of int, (n,)
        [us], [-]
    moments : ndarray of float64, (n, 5)
        Mean in x and y [m], covariance xx, yy and xy [m2].
    """
    x_m, y_m, variance_x_m2, variance_y_m2, covariance_xy_m2 = moments.T
    return make_track(
        time_us=time_us,
        x_m=x_m,
        y_m=y_m,
        level=level,
        variance_x_m2=variance_x_m2,
        variance_y_m2=variance_y_m2,
        covariance_xy_m2=covariance_xy_m2,
    )
