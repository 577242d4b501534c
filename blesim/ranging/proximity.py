"""Proximity classes of beacons: as the phone's system tells them, or made of RSSI as it does.

The system takes the range ``d = 10^((P - S) / (10 n))`` from the RSSI S, averaged over a window,
and the power P that the beacon announces for one metre. The classes of the proximity paper [1]_:
Immediate up to about 1 m, Near from 1 to 3 m, Far beyond, Unknown when nothing is received.

References
----------
.. [1] Particle filter on beacon proximity and a floor map, about 2017;
   digest "proximity-particle-filter".
"""

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from blesim import columns
from blesim.errors import UsageError
from blesim.ranging.smoothers import RecentReadings
from blesim.ranging.smoothing import SignalKind, SignalWindow, refuse_bad_window
from blesim.ranging.survey_readings import SurveyReadings
from blesim.tables import Readings
from blesim.venue.venue import Venue

_CLASSES = dict(columns.PROXIMITIES)
# Rows classified at a time where only the reading's own beacon is wanted of every row.
_CHUNK = 4096


class Proximity(IntEnum):
    """Classes, numbered as recordings number them."""

    UNKNOWN = columns.PROXIMITY_NOT_TOLD
    IMMEDIATE = _CLASSES["immediate"]
    NEAR = _CLASSES["near"]
    FAR = _CLASSES["far"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProximityRule:
    """How RSSI is made a class.

    Attributes
    ----------
    immediate_m, near_m : float
        Up to which range a beacon is Immediate or Near. [m]
    exponent : float
        Path loss exponent the system believes in; nobody publishes it, 2 is that of free space. [-]
    signal : {"averaged", "highest"}
        Which signal value the range is taken from.
    window_s : float
        A beacon not heard for as long is Unknown. [s]
    rate : float
        Weight of a new reading in the average. [-]
    believe_phone : bool
        Take the class that the phone tells, where it tells one.

    Raises
    ------
    UsageError
        If a value is out of its range.
    """

    immediate_m: float = 1.0
    near_m: float = 3.0
    exponent: float = 2.0
    signal: SignalKind = "averaged"
    window_s: float = 3.0
    rate: float = 0.25
    believe_phone: bool = True

    def __post_init__(self) -> None:
        if not 0 < self.immediate_m <= self.near_m:
            raise UsageError(
                f"immediate_m {self.immediate_m:g}, near_m {self.near_m:g}: give positive metres,"
                " in this order"
            )
        if not 0 < self.exponent <= 8:
            raise UsageError(f"exponent {self.exponent:g}: give a number above 0, up to 8")
        refuse_bad_window(self.signal, self.window_s, self.rate)

    def classes(
        self, signal_dbm: NDArray[np.float64], measured_power_dbm: NDArray[np.float64]
    ) -> NDArray[np.uint8]:
        """Classes of signal values of any shape; Unknown where they are NaN."""
        range_m = 10.0 ** ((measured_power_dbm - signal_dbm) / (10.0 * self.exponent))
        near = np.where(range_m <= self.near_m, Proximity.NEAR, Proximity.FAR)
        heard = np.where(range_m <= self.immediate_m, Proximity.IMMEDIATE, near)
        return np.where(np.isnan(signal_dbm), Proximity.UNKNOWN, heard).astype(np.uint8)


class ProximityWindow:
    """The live proximity classes of one phone: fed block by block, in order of time.

    How the readings are cut into blocks never changes a result. All methods raise `DataError`
    where time goes back behind what was fed before.

    Parameters
    ----------
    measured_power_dbm : ndarray of float64, (beacons,)
        RSSI at one metre that each beacon announces. [dBm]
    rule : ProximityRule
        How RSSI is made a class.
    """

    def __init__(self, measured_power_dbm: NDArray[np.float64], rule: ProximityRule) -> None:
        beacons = len(measured_power_dbm)
        self._power_dbm = measured_power_dbm
        self._rule = rule
        self._window = SignalWindow(
            beacons=beacons, signal=rule.signal, window_s=rule.window_s, rate=rule.rate
        )
        # The class told last is the mean over the last one.
        self._told = RecentReadings(keys=beacons, last=1, forget_s=rule.window_s)

    def classes(self, readings: Readings) -> NDArray[np.uint8]:
        """Class of every beacon after each reading of the next block, (n, beacons)."""
        told = self._told.signals(replace(readings, rssi_dbm=readings.proximity))
        return self._joined(told, self._window.signals(readings))

    def own_classes(self, readings: Readings) -> NDArray[np.uint8]:
        """Class of each reading's own beacon right after it, (n,)."""
        own = np.empty(len(readings), np.uint8)
        for first in range(0, len(readings), _CHUNK):
            rows = slice(first, first + _CHUNK)
            part = readings.rows(rows)
            own[rows] = self.classes(part)[np.arange(len(part)), part.beacon]
        return own

    def at(self, now_us: int) -> NDArray[np.uint8]:
        """Class of every beacon at a moment not before the last reading, (beacons,)."""
        return self._joined(self._told.at(now_us), self._window.at(now_us))

    def _joined(
        self, told: NDArray[np.float64], signal_dbm: NDArray[np.float64]
    ) -> NDArray[np.uint8]:
        classes = self._rule.classes(signal_dbm, self._power_dbm)
        if not self._rule.believe_phone:
            return classes
        return np.where(told > 0, np.nan_to_num(told), classes).astype(np.uint8)


def announced_power_dbm(venue: Venue) -> NDArray[np.float64]:
    """RSSI at one metre as each beacon of a venue announces it, (beacons,). [dBm]."""
    return np.array([beacon.measured_power_dbm for beacon in venue.beacons], np.float64)


def surveyed_classes(
    survey: SurveyReadings, measured_power_dbm: NDArray[np.float64], rule: ProximityRule
) -> NDArray[np.uint8]:
    """Class of each survey reading's own beacon right after it, walk by walk, (n,)."""
    classes = np.empty(len(survey), np.uint8)
    for walk in np.unique(survey.walk):
        rows = np.flatnonzero(survey.walk == walk)
        readings = Readings(
            time_us=survey.time_us[rows],
            beacon=survey.beacon[rows],
            rssi_dbm=survey.rssi_dbm[rows].astype(np.int64),
            channel=survey.channel[rows],
            proximity=survey.proximity[rows],
        )
        classes[rows] = ProximityWindow(measured_power_dbm, rule).own_classes(readings)
    return classes
