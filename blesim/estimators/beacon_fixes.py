"""Beacon fixes by proximity: once a second, the beacon in whose zone the phone is.

The signal value of a beacon that reaches a threshold says that the phone is within the beacon's
zone, not how far away it is. After [1]_, where a power of -74 dBm, given to the phone's system as
that of one metre, makes beacons known up to about 5 m.

References
----------
.. [1] PDR with map-compensated heading, section 2; digest "map-heading-ekf".
"""

import math

import numpy as np
from numpy.typing import NDArray

from blesim.ranging.proximity import announced_power_dbm
from blesim.ranging.smoothing import SignalWindow
from blesim.tables import Readings
from blesim.units import to_us
from blesim.venue.venue import Venue

# Of free space, where nothing else is known.
_EXPONENT = 2.0


class BeaconFixes:
    """The live fixes of one phone; how its readings are cut into blocks changes none.

    The first reading, and from then on the first that comes an interval or more after the last one
    looked at, asks for the beacon with the highest signal value over the threshold; there may be
    none. Of several the first in the venue.

    Parameters
    ----------
    window : SignalWindow
        Signal values, of a phone that has heard nothing yet.
    threshold_dbm : ndarray of float64, (beacons,)
        Signal value at the edge of each beacon's zone; infinite for one that is never a fix. [dBm]
    interval_s : float
        Between two looks. [s]
    """

    def __init__(
        self, window: SignalWindow, threshold_dbm: NDArray[np.float64], interval_s: float
    ) -> None:
        self._window = window
        self._threshold_dbm = threshold_dbm
        self._interval_us = to_us(interval_s)
        self._next_us: int | None = None

    def advance(self, readings: Readings) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Fixes in the next block: row of the reading each follows, row of its beacon, (k,) each.

        Raises
        ------
        DataError
            If the block begins before the end of the last one.
        """
        fixes: list[tuple[int, int]] = []
        begin = 0
        while (row := self._next_row(readings, begin)) < len(readings):
            now_us = int(readings.time_us[row])
            self._window.strongest(readings.rows(slice(begin, row + 1)))
            beacon = self._beacon(now_us)
            if beacon is not None:
                fixes.append((row, beacon))
            begin, self._next_us = row + 1, now_us + self._interval_us
        self._window.strongest(readings.rows(slice(begin, None)))
        rows, beacons = np.array(fixes, np.int64).reshape(-1, 2).T
        return rows, beacons

    def _next_row(self, readings: Readings, begin: int) -> int:
        if self._next_us is None:
            return begin
        return max(begin, int(np.searchsorted(readings.time_us, self._next_us)))

    def _beacon(self, now_us: int) -> int | None:
        over_db = self._window.at(now_us) - self._threshold_dbm
        over_db[np.isnan(over_db)] = -np.inf
        best = int(np.argmax(over_db))
        return best if over_db[best] >= 0 else None


def zone_thresholds_dbm(
    venue: Venue, *, zone_dbm: float | None, zone_m: float
) -> NDArray[np.float64]:
    """Signal value at the edge of each beacon's zone, (beacons,). [dBm].

    Parameters
    ----------
    venue : Venue
        As surveyed.
    zone_dbm : float or None
        The same for all; none for what the announced power of each becomes at the radius with the
        exponent of free space, 2: -74 dBm for -60 dBm and 5 m. [dBm]
    zone_m : float
        Radius of the zones. [m]
    """
    if zone_dbm is not None:
        return np.full(len(venue.beacons), zone_dbm)
    return announced_power_dbm(venue) - 10.0 * _EXPONENT * math.log10(zone_m)


def only(threshold_dbm: NDArray[np.float64], beacons: NDArray[np.int64]) -> NDArray[np.float64]:
    """Thresholds at which nothing but the given rows of beacons is a fix, same shape. [dBm]."""
    limited = np.full(len(threshold_dbm), np.inf)
    limited[beacons] = threshold_dbm[beacons]
    return limited
