"""What `pdr-fingerprint` learns of a survey: fingerprints by direction, their error, ranges."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError
from blesim.ranging.nearest_fingerprints import Compared, NearestFingerprints
from blesim.ranging.path_loss_fit import fit_path_loss
from blesim.ranging.proximity import announced_power_dbm
from blesim.ranging.radio_map import MapLayout, direction_of, radio_map
from blesim.ranging.smoothers import Smoothing
from blesim.ranging.survey_readings import WALKING, SurveyReadings, survey_readings
from blesim.recording import Recording
from blesim.tables import Readings
from blesim.units import MICROSECONDS_PER_SECOND
from blesim.venue.venue import Venue

_FREE_SPACE_EXPONENT = 2.0
# Error of fingerprints that a survey too short for a trial is taken to have; assumed. [m2]
_UNTRIED_VARIANCE_M2 = 4.0
# No fix is better than this: a quarter of a metre either way. [m2]
_LEAST_VARIANCE_M2 = 0.06
# Vectors tried of a long survey.
_MOST_TRIALS = 2000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DirectedMaps:
    """Nearest fingerprints among those of one direction.

    Attributes
    ----------
    whole : NearestFingerprints
        Of all directions together.
    by_direction : tuple of NearestFingerprints
        Of each direction; the whole where nobody looked that way. Empty for one map alone.
    """

    whole: NearestFingerprints
    by_direction: tuple[NearestFingerprints, ...]

    def locate(
        self, signal_dbm: NDArray[np.float64], heading_rad: float | None
    ) -> tuple[float, float, int]:
        """Place and level of the fingerprints nearest to a vector, NaN if nothing is heard. [m].

        Parameters
        ----------
        signal_dbm : ndarray of float64, (beacons,)
            NaN for a beacon that is not heard. [dBm]
        heading_rad : float or None
            Of the walker; none if not known. [rad]
        """
        nearest = self.whole
        if heading_rad is not None and self.by_direction:
            nearest = self.by_direction[int(direction_of(heading_rad, len(self.by_direction)))]
        found = nearest.locate(signal_dbm[None])
        return float(found.x_m[0]), float(found.y_m[0]), int(found.level[0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FingerprintSurvey:
    """What a survey of a venue with b beacons tells.

    Attributes
    ----------
    maps : DirectedMaps
        Fingerprints.
    fix_variance_m2 : float
        Mean square of their error in x and in y. [m2]
    beacon_xy_m : ndarray of float64, (b, 2)
        [m]
    beacon_level : ndarray of int, (b,)
        Levels of the beacons.
    level_dbm, exponent : ndarray of float64, (b,)
        Path loss of each beacon: RSSI at one metre on the map, and exponent. [dBm], [-]
    """

    maps: DirectedMaps
    fix_variance_m2: float
    beacon_xy_m: NDArray[np.float64]
    beacon_level: NDArray[np.integer]
    level_dbm: NDArray[np.float64]
    exponent: NDArray[np.float64]

    @property
    def beacons(self) -> int:
        """How many beacons the venue has."""
        return len(self.beacon_xy_m)

    def strongest(self, signal_dbm: NDArray[np.float64], level: int) -> int | None:
        """Row of the strongest beacon on a level, if one is heard there."""
        heard = np.isfinite(signal_dbm) & (self.beacon_level == level)
        return int(np.argmax(np.where(heard, signal_dbm, -np.inf))) if heard.any() else None

    def range_m(self, beacon: int, rssi_dbm: float) -> float:
        """Range d of Eq 7, ``10^((RSSI_1m - RSSI) / (10 n))``. [m]."""
        loss_db = float(self.level_dbm[beacon]) - rssi_dbm
        return float(10.0 ** (loss_db / (10.0 * float(self.exponent[beacon]))))


def learned_survey(
    venue: Venue,
    surveys: Sequence[Recording],
    *,
    smoothing: Smoothing,
    cell_m: float,
    directions: int,
    k: int,
    compared: Compared,
    exponent: float | None,
) -> FingerprintSurvey:
    """Fingerprints, their error and the path loss of surveys.

    Parameters
    ----------
    venue : Venue
        As surveyed.
    surveys : sequence of Recording
        With marks.
    smoothing : Smoothing
        Of what is heard later, with which the fingerprints are tried.
    cell_m : float
        Grid for readings made walking; if the tester stood anywhere, those places alone are
        fingerprints. [m]
    directions : int
        As of `MapLayout`.
    k, compared
        As of `NearestFingerprints`.
    exponent : float or None
        Path loss exponent, with the announced powers; none to fit both. [-]

    Raises
    ------
    DataError
        If no reading has a known place, or a direction where there are any.
    """
    survey = survey_readings(surveys)
    stood = np.any(_stood(survey, directions))
    layout = MapLayout(cell_m=None if stood else cell_m, directions=directions)
    level_dbm, exponents = _path_loss(venue, survey, exponent)
    return FingerprintSurvey(
        maps=_maps(survey, layout, k, compared),
        fix_variance_m2=_tried_variance_m2(survey, layout, smoothing, k, compared),
        beacon_xy_m=venue.beacon_xyz_m[:, :2],
        beacon_level=venue.beacon_level,
        level_dbm=level_dbm,
        exponent=exponents,
    )


def _stood(survey: SurveyReadings, directions: int) -> NDArray[np.bool_]:
    told = ~np.isnan(survey.heading_rad) if directions else np.ones(len(survey), bool)
    stood: NDArray[np.bool_] = (survey.spot != WALKING) & told
    return stood


def _maps(survey: SurveyReadings, layout: MapLayout, k: int, compared: Compared) -> DirectedMaps:
    everywhere = radio_map(survey, layout)
    whole = NearestFingerprints(radio_map=everywhere, k=k, compared=compared)

    def facing(direction: int) -> NearestFingerprints:
        if not np.any(everywhere.direction == direction):
            return whole
        return NearestFingerprints(radio_map=everywhere.facing(direction), k=k, compared=compared)

    return DirectedMaps(
        whole=whole, by_direction=tuple(facing(each) for each in range(layout.directions))
    )


def _tried_variance_m2(
    survey: SurveyReadings, layout: MapLayout, smoothing: Smoothing, k: int, compared: Compared
) -> float:
    """Mean square error in x and y of fingerprints of even seconds at odd seconds."""
    odd = survey.time_us // MICROSECONDS_PER_SECOND % 2 == 1
    try:
        maps = _maps(survey.rows(~odd), layout, k, compared)
    except DataError:
        return _UNTRIED_VARIANCE_M2
    squares = [
        error_m2
        for walk in np.unique(survey.walk[odd]).tolist()
        for error_m2 in _squares_m2(survey.rows(odd & (survey.walk == walk)), maps, smoothing)
    ]
    if not squares:
        return _UNTRIED_VARIANCE_M2
    return max(float(np.mean(squares)) / 2.0, _LEAST_VARIANCE_M2)


def _squares_m2(tried: SurveyReadings, maps: DirectedMaps, smoothing: Smoothing) -> list[float]:
    """Squared errors of fixes at the readings of one survey walk. [m2]."""
    readings = Readings(
        time_us=tried.time_us,
        beacon=tried.beacon,
        rssi_dbm=tried.rssi_dbm.astype(np.int64),
        channel=tried.channel,
    )
    signals_dbm = smoothing.start(tried.beacons).signals(readings)
    squares = []
    for row in range(0, len(tried), 1 + len(tried) // _MOST_TRIALS):
        heading_rad = float(tried.heading_rad[row])
        known = None if np.isnan(heading_rad) else heading_rad
        x_m, y_m, level = maps.locate(signals_dbm[row], known)
        if level == tried.level[row]:
            squares.append((x_m - tried.x_m[row]) ** 2 + (y_m - tried.y_m[row]) ** 2)
    return squares


def _path_loss(
    venue: Venue, survey: SurveyReadings, exponent: float | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """RSSI at one metre and exponent of each beacon; distances on the map, as in Eq 8."""
    beacons = np.arange(len(venue.beacons))
    if exponent is None:
        try:
            curves = fit_path_loss(survey, survey.horizontal_distance_m(venue), by="beacon")
        except DataError:
            return _path_loss(venue, survey, _FREE_SPACE_EXPONENT)
        found = curves.of(beacons, np.zeros(len(beacons), np.int64))
        return np.asarray(found.level_dbm), np.asarray(found.exponent)
    return announced_power_dbm(venue), np.full(len(beacons), exponent)
