"""Nearest fingerprints: the mean of the surveyed places where the same was heard.

References
----------
.. [1] P. Bahl, V. N. Padmanabhan, "RADAR: an in-building RF-based user location and tracking
   system", INFOCOM 2000. doi:10.1109/INFCOM.2000.832252
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.estimators.base import Need, StartInfo, fitted, make_track
from blesim.estimators.heard import SignalTracker
from blesim.estimators.refusals import not_fitted
from blesim.ranging.nearest_fingerprints import Compared, NearestFingerprints
from blesim.ranging.radio_map import MapLayout, radio_map
from blesim.ranging.smoothing import SignalKind, SignalWindow, refuse_bad_window
from blesim.ranging.survey_readings import WALKING, SurveyReadings, survey_readings
from blesim.recording import Recording
from blesim.tables import IntArray, Track
from blesim.venue.venue import Venue

# Cells of a survey in which nobody stood still.
_CELL_M = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class NearestFingerprintEstimator:
    """k nearest fingerprints [1]_: after every reading, their mean weighted by likeness.

    Signal values over a window are compared with the means of the survey, see
    `blesim.ranging.nearest_fingerprints`. Beacons that the survey did not hear are skipped.

    The covariance is the weighted one of the k places, each taken as a square as wide as it is far
    to the next place.

    Parameters
    ----------
    k : int
        How many fingerprints.
    compared : {"heard", "all"}
        Compare the beacons heard at the moment, or all of them.
    cell_m : float or None
        Side of the cells into which the survey is gathered; none for the spots the tester stood
        at, or cells of 2 m if nobody stood; assumed. [m]
    missing_dbm : float
        What a beacon counts at a place where it was not heard. [dBm]
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
    .. [1] doi:10.1109/INFCOM.2000.832252
    """

    k: int = 4
    compared: Compared = "heard"
    cell_m: float | None = None
    missing_dbm: float = -100.0
    signal: SignalKind = "averaged"
    window_s: float = 3.0
    rate: float = 0.25
    fingerprints: "Fingerprints | None" = field(default=None, init=False, repr=False, compare=False)
    needs: ClassVar[frozenset[Need]] = frozenset({Need.SURVEY})

    def __post_init__(self) -> None:
        refuse_bad_window(self.signal, self.window_s, self.rate)
        _ = MapLayout(cell_m=self.cell_m, missing_dbm=self.missing_dbm)
        if self.k < 1:
            raise UsageError(f"k {self.k}: give 1 or more")
        if self.compared not in ("heard", "all"):
            raise UsageError(f"compared '{self.compared}': use heard or all")

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:  # noqa: ARG002 (the survey knows it)
        """Copy that knows the radio map.

        Raises
        ------
        DataError
            If no reading of a survey lies between two marks.
        """
        survey = survey_readings(surveys)
        surveyed = radio_map(survey, self._layout(survey))
        nearest = NearestFingerprints(radio_map=surveyed, k=self.k, compared=self.compared)
        heard = np.any(surveyed.count > 0, axis=0)
        return fitted(self, fingerprints=Fingerprints(nearest=nearest, heard=heard))

    def _layout(self, survey: SurveyReadings) -> MapLayout:
        nobody_stood = bool(np.all(survey.spot == WALKING))
        cell_m = _CELL_M if self.cell_m is None and nobody_stood else self.cell_m
        return MapLayout(cell_m=cell_m, missing_dbm=self.missing_dbm)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> SignalTracker:  # noqa: ARG002 (needs neither)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.fingerprints is None:
            raise not_fitted("nearest-fingerprints")
        window = SignalWindow(
            beacons=len(self.fingerprints.heard),
            signal=self.signal,
            window_s=self.window_s,
            rate=self.rate,
        )
        return SignalTracker(window, self.fingerprints.heard, self.fingerprints)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fingerprints:
    """What a survey heard where.

    Attributes
    ----------
    nearest : NearestFingerprints
        Finds the most alike.
    heard : ndarray of bool, (beacons,)
        Beacons that the survey heard.
    """

    nearest: NearestFingerprints
    heard: NDArray[np.bool_]

    def track(self, time_us: IntArray, signal_dbm: NDArray[np.float64]) -> Track:
        """Positions of signal values (n, beacons) at times (n,). [us], [dBm]."""
        found = self.nearest.locate(signal_dbm)
        return make_track(
            time_us=time_us,
            x_m=found.x_m,
            y_m=found.y_m,
            level=found.level,
            variance_x_m2=found.variance_x_m2,
            variance_y_m2=found.variance_y_m2,
            covariance_xy_m2=found.covariance_xy_m2,
        )
