"""Signal characteristics in the aisle: what figures 5 to 7 of the aisle-graph paper show."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from blesim.ranging.survey_readings import survey_readings
from blesim.recording import Recording, WalkKind
from blesim.reruns.base import Numbers

# The paper's: RSSI at 1 m, and a beacon's height above the phone, which is carried 1 m high.
LEVEL_DBM = -77.0
PHONE_HEIGHT_M = 1.0
# An aisle's centre is 2.1 m from a beacon; farther than this, runs have few readings to a bin.
_NEAR_M, _FAR_M = 2, 16
_LEAST_READINGS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class AisleSignals:
    """Readings of a run with their ranges, all arrays (n,).

    Attributes
    ----------
    distance_m : ndarray of float64
        In space, between the way points' interpolation and the beacon. [m]
    rssi_dbm : ndarray of float64
        [dBm]
    """

    distance_m: Numbers
    rssi_dbm: Numbers

    def rows(self, selection: NDArray[np.bool_]) -> "AisleSignals":
        """Some of the readings."""
        return AisleSignals(
            distance_m=self.distance_m[selection], rssi_dbm=self.rssi_dbm[selection]
        )

    def within(self, band_m: tuple[int, int]) -> Numbers:
        """RSSI at ranges of a band, (m,). [dBm]."""
        low_m, high_m = band_m
        return self.rssi_dbm[(self.distance_m >= low_m) & (self.distance_m < high_m)]


def aisle_signals(recording: Recording, run: str) -> tuple[AisleSignals, AisleSignals]:
    """Readings of a run in the aisle of their beacon, and those in others."""
    surveyed = replace(recording.by_name[run], kind=WalkKind.SURVEY)
    readings = survey_readings([replace(recording, walks=(surveyed,))])
    venue = recording.venue
    signals = AisleSignals(
        distance_m=readings.distance_m(venue, PHONE_HEIGHT_M), rssi_dbm=readings.rssi_dbm
    )
    same = readings.same_branch(venue)
    return signals.rows(same), signals.rows(~same)


def mean_curve(signals: AisleSignals) -> tuple[Numbers, Numbers]:
    """Mean range and mean RSSI in 1 m bins, (b,): of 2 to 16 m, with ten readings or more.

    [m], [dBm]
    """
    metre = np.floor(signals.distance_m).astype(np.int64)
    bins = [metre == start for start in range(_NEAR_M, _FAR_M)]
    filled = [chosen for chosen in bins if np.count_nonzero(chosen) >= _LEAST_READINGS]
    return (
        np.array([signals.distance_m[chosen].mean() for chosen in filled]),
        np.array([signals.rssi_dbm[chosen].mean() for chosen in filled]),
    )


def expected_dbm(distance_m: Numbers, exponent: float) -> Numbers:
    """RSSI at ranges by Eq 1, (n,). [dBm]."""
    return LEVEL_DBM - 10.0 * exponent * np.log10(distance_m)


def fitted_exponent(signals: AisleSignals) -> float:
    """Path loss exponent with the level at 1 m given, least squares over the mean curve. [-]."""
    distance_m, mean_dbm = mean_curve(signals)
    decades = 10.0 * np.log10(distance_m)
    return float(np.sum((LEVEL_DBM - mean_dbm) * decades) / np.sum(decades**2))


def bump(signals: AisleSignals) -> tuple[float, float]:
    """Range at which the mean curve lies highest above its own Eq 1, and by how much. [m], [dB]."""
    distance_m, mean_dbm = mean_curve(signals)
    excess_db = mean_dbm - expected_dbm(distance_m, fitted_exponent(signals))
    highest = int(np.argmax(excess_db))
    return float(distance_m[highest]), float(excess_db[highest])
