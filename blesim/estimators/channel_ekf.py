"""Polynomial ranges and fingerprints of each channel in an extended Kalman filter."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.estimators.base import Need, StartInfo, fitted, part_of
from blesim.estimators.constant_velocity import Belief, updated_by_ranges
from blesim.estimators.enhanced_ranges import enhanced_ranges
from blesim.estimators.epochs import EpochSettings, EpochTracker, refuse_bad_height
from blesim.estimators.fingerprint_ekf import at_first_places
from blesim.estimators.fingerprint_maps import (
    FingerprintMaps,
    FingerprintSettings,
    Places,
    fit_fingerprint_maps,
)
from blesim.filters.gating import SeparateGate
from blesim.ranging.channels import SLOTS
from blesim.ranging.curves import ENOUGH_POINTS
from blesim.ranging.polynomial_range import (
    PolynomialRange,
    fit_polynomial_ranges,
    refuse_bad_degree,
)
from blesim.ranging.survey_readings import SurveyReadings, calibration_points, survey_readings
from blesim.recording import Recording
from blesim.venue.venue import Venue

Array = NDArray[np.float64]
# No range is better known than this.
_LEAST_VARIANCE_M2 = 0.1**2


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelEkf(EpochSettings):
    """Channel-separate regression, fingerprints and EKF [1]_: one estimate after every epoch.

    Each channel of a beacon gives a distance by its polynomial, Eq 2, and each channel's radio map
    a position, Eq 10 to 15, and so a distance to every beacon heard, Eq 16. Of these up to six the
    outliers are dropped and the rest averaged, Eq 18 and 19; an extended Kalman filter at constant
    velocity takes the averages, Eq 20 to 27, but leaves out those whose innovation is too large,
    Eq 28 to 30. In the aggregate mode the channels are taken together: one polynomial, one map.

    The noise of a range is the mean of the variances of its distances: of polynomials, that of the
    survey about the curve; of fingerprints, what locating each surveyed place among the others
    shows. The covariance told is the filter's. The first state is the mean of the first fingerprint
    positions. Beacons that the survey did not hear are skipped.

    Parameters
    ----------
    separate : bool
        The paper's separate mode, which needs the channels of the readings, or its aggregate mode.
    degree : int
        Of the polynomials, 2 in the paper.
    outliers_1, outliers_2 : bool
        Outlier detection 1, on the distances to a beacon, and 2, on the innovations.
    confidence : float
        Share of true ranges that outlier detection 2 lets pass, assumed. [-]
    k : int
        Nearest fingerprints, 3 in the paper.
    search_scale : float or None
        Semi-axes of the search ellipse in standard deviations, 5 in the paper; none to search
        everywhere. [-]
    cell_m : float or None
        Side of the cells that survey readings are gathered in, assumed; none for the spots the
        tester stood at. [m]
    grid_m : float or None
        Spacing of the places that Gaussian-process regression fills gaps at, assumed; none for the
        surveyed places alone. [m]
    phone_height_m : float
        At which the phone is carried above the floor, assumed. [m]
    epoch_s, every_reading, silence_s, velocity_change_m_s, start_speed_m_s
        As in `EpochSettings`, all assumed.
    smoothing, last, rate, window_s
        As in `EpochSettings`: the paper names a smoother, but not which.

    Raises
    ------
    UsageError
        If a parameter is out of its range.

    References
    ----------
    .. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
    """

    separate: bool = True
    degree: int = 2
    outliers_1: bool = True
    outliers_2: bool = True
    confidence: float = 0.95
    k: int = 3
    search_scale: float | None = 5.0
    cell_m: float | None = 1.0
    grid_m: float | None = 1.0
    phone_height_m: float = 1.2
    ranges: "ChannelRanges | None" = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        EpochSettings.__post_init__(self)
        refuse_bad_degree(self.degree)
        refuse_bad_height(self.phone_height_m)
        part_of(FingerprintSettings, self)  # checks them
        if not 0 < self.confidence <= 1:
            raise UsageError(f"confidence {self.confidence:g}: give a number above 0, up to 1")

    @property
    def needs(self) -> frozenset[Need]:
        """A survey, and channels if they are kept apart."""
        return part_of(FingerprintSettings, self).needs

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that has the polynomials and radio maps of the survey.

        Raises
        ------
        DataError
            If the survey makes no polynomial or no radio map.
        """
        survey = survey_readings(surveys)
        ranges = ChannelRanges(
            beacons_m=venue.beacon_xyz_m,
            levels=venue.beacon_level,
            curves=self._curves(survey, venue),
            maps=fit_fingerprint_maps(survey, venue, part_of(FingerprintSettings, self)),
            estimator=self,
        )
        return fitted(self, ranges=ranges)

    def _curves(self, survey: SurveyReadings, venue: Venue) -> tuple[PolynomialRange, ...]:
        """Polynomials of all beacons, for each slot of the signal from which one is made.

        Fitted on the mean RSSI at each calibration point, as in Eq 3.
        """
        points = calibration_points(survey, by_channel=self.separate)
        found = fit_polynomial_ranges(
            points,
            points.distance_m(venue, self.phone_height_m),
            degree=self.degree,
            enough=ENOUGH_POINTS,
            by="beacon and channel" if self.separate else "beacon",
        )
        slots = range(1, SLOTS) if self.separate else (0,)
        return tuple(_of_rows(found.curves, found.rows.row[:, slot]) for slot in slots)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> EpochTracker:  # noqa: ARG002 (needs neither)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.ranges is None:
            raise UsageError("channel-ekf has no radio map yet; call fit first")
        return EpochTracker(
            self.epoch_settings(), self.ranges.maps.known, self.ranges, by_channel=self.separate
        )


def _of_rows(curves: PolynomialRange, rows: NDArray[np.int64]) -> PolynomialRange:
    return PolynomialRange(
        scaled=curves.scaled[rows],
        lowest_dbm=curves.lowest_dbm[rows],
        highest_dbm=curves.highest_dbm[rows],
        spread_m=curves.spread_m[rows],
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChannelRanges:
    """Distances by the polynomials and the fingerprints of each channel.

    Attributes
    ----------
    beacons_m : ndarray of float64, (n, 3)
        [m]
    levels : ndarray of int, (n,)
        Level of each beacon.
    curves : tuple of PolynomialRange
        Of the n beacons, for each channel.
    maps : FingerprintMaps
        Radio map of each channel.
    estimator : ChannelEkf
        Its settings.
    """

    beacons_m: Array
    levels: NDArray[np.integer]
    curves: tuple[PolynomialRange, ...]
    maps: FingerprintMaps
    estimator: ChannelEkf

    def found(self, signal_dbm: Array) -> Belief | None:
        """Belief at rest at the mean of the fingerprint positions; none if there is none."""
        return at_first_places(self.maps.locate(signal_dbm, None), self.estimator.start_speed_m_s)

    def updated(self, last: Belief, predicted: Belief, signal_dbm: Array) -> Belief:
        """Belief after the ranges of an epoch."""
        places = self.maps.locate(signal_dbm, last)
        level = places.level if len(places.places_m) else predicted.level
        range_m, variance_m2 = self.ranges(signal_dbm, places)
        taken = ~np.isnan(range_m) & (self.levels == level)
        mean, covariance, _ = updated_by_ranges(
            predicted.mean,
            predicted.covariance,
            self.beacons_m[taken],
            range_m[taken],
            variance_m2[taken],
            self.estimator.phone_height_m,
            self._deviations(),
        )
        return Belief(mean=mean, covariance=covariance, level=level)

    def ranges(self, signal_dbm: Array, places: Places) -> tuple[Array, Array]:
        """Enhanced range to each beacon and its variance, two (n,), NaN where not heard.

        Parameters
        ----------
        signal_dbm : ndarray of float64, (n,) or (n, SLOTS)
            Smoothed. [dBm]
        places : Places
            Fingerprint positions of the channels.
        """
        by_channel = signal_dbm[:, None] if signal_dbm.ndim == 1 else signal_dbm[:, 1:]
        heard = ~np.all(np.isnan(by_channel), axis=1)
        distances_m = np.column_stack(
            [
                *(
                    curve.distance_m(rssi)
                    for curve, rssi in zip(self.curves, by_channel.T, strict=True)
                ),
                *(self._from_place(place_m, heard) for place_m in places.places_m),
            ]
        )
        variances_m2 = np.column_stack(
            [
                *(curve.spread_m**2 for curve in self.curves),
                *(np.full(len(heard), variance_m2) for variance_m2 in places.variance_m2),
            ]
        )
        return enhanced_ranges(
            distances_m,
            np.maximum(variances_m2, _LEAST_VARIANCE_M2),
            self.estimator.outliers_1,
        )

    def _from_place(self, place_m: Array, heard: NDArray[np.bool_]) -> Array:
        """Distance in space from a position to each beacon heard, (n,): Eq 16 and 17. [m]."""
        phone_m = np.append(place_m, self.estimator.phone_height_m)
        distance_m = np.linalg.norm(phone_m - self.beacons_m, axis=1)
        return np.where(heard, distance_m, np.nan)

    def _deviations(self) -> float:
        """Standard deviations that outlier detection 2 lets an innovation have. [-]."""
        if not self.estimator.outliers_2:
            return np.inf
        return SeparateGate(confidence=self.estimator.confidence).deviations
