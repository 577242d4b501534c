"""PM + EKF: ranges of a path loss model in an extended Kalman filter."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.estimators.base import Need, StartInfo, fitted
from blesim.estimators.constant_velocity import Belief, at_rest, updated_by_ranges
from blesim.estimators.epochs import EpochSettings, EpochTracker, refuse_bad_height
from blesim.ranging.curves import ENOUGH_POINTS
from blesim.ranging.lateration import laterate
from blesim.ranging.path_loss_fit import PathLossCurves, PathLossFit, fit_path_loss
from blesim.ranging.survey_readings import calibration_points, survey_readings
from blesim.recording import Recording
from blesim.venue.venue import Venue

# No range is better known than this.
_LEAST_SPREAD_M = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class PathLossEkf(EpochSettings):
    """PM + EKF, baseline of the channel-separate paper: one estimate after every epoch.

    The smoothed RSSI of each beacon gives a range by its path loss curve, Eq 1 of [1]_; an extended
    Kalman filter at constant velocity takes the ranges of an epoch together, Eq 20 to 27. Curves
    are fitted on the survey, one a beacon; a beacon without enough readings takes the curve of all.
    The noise of a range is that of its curve's residuals, to first order; the covariance told is
    the filter's. The first state is found by least squares from the first epoch's ranges. Somebody
    is on the level of the beacon heard strongest, and only beacons of that level are used.

    Parameters
    ----------
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

    phone_height_m: float = 1.2
    ranges: "PathLossRanges | None" = field(default=None, init=False, repr=False, compare=False)
    needs: ClassVar[frozenset[Need]] = frozenset({Need.SURVEY})

    def __post_init__(self) -> None:
        EpochSettings.__post_init__(self)
        refuse_bad_height(self.phone_height_m)

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that has a path loss curve for every beacon.

        Raises
        ------
        DataError
            If the survey tells no curve.
        """
        points = calibration_points(survey_readings(surveys), by_channel=False)
        distance_m = points.distance_m(venue, self.phone_height_m)
        curves = fit_path_loss(points, distance_m, enough=ENOUGH_POINTS)
        ranges = PathLossRanges(
            beacons_m=venue.beacon_xyz_m,
            levels=venue.beacon_level,
            curve=_of_each_beacon(curves, len(venue.beacons)),
            phone_height_m=self.phone_height_m,
            start_speed_m_s=self.start_speed_m_s,
        )
        return fitted(self, ranges=ranges)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> EpochTracker:  # noqa: ARG002 (needs neither)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.ranges is None:
            raise UsageError("pm-ekf knows no path loss yet; call fit first")
        known = np.ones(len(self.ranges.levels), bool)
        return EpochTracker(self.epoch_settings(), known, self.ranges)


def _of_each_beacon(curves: PathLossCurves, beacons: int) -> PathLossFit:
    rows = np.arange(beacons)
    return curves.of(rows, np.zeros(beacons, np.int64))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathLossRanges:
    """Ranges by the path loss of each of n beacons, and what they say of a place.

    Attributes
    ----------
    beacons_m : ndarray of float64, (n, 3)
        [m]
    levels : ndarray of int, (n,)
        Level of each beacon.
    curve : PathLossFit
        Each field (n,).
    phone_height_m, start_speed_m_s : float
        As in `PathLossEkf`. [m], [m/s]
    """

    beacons_m: NDArray[np.float64]
    levels: NDArray[np.integer]
    curve: PathLossFit
    phone_height_m: float
    start_speed_m_s: float

    def ranges(
        self, signal_dbm: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Ranges and their standard deviations, two (n,), NaN for beacons not heard. [m]."""
        range_m = self.curve.distance_m(signal_dbm)
        return range_m, np.maximum(self.curve.distance_spread_m(range_m), _LEAST_SPREAD_M)

    def found(self, signal_dbm: NDArray[np.float64]) -> Belief | None:
        """Belief at rest where the ranges meet best; none if nothing is heard."""
        heard = _heard_on_one_level(signal_dbm, self.levels)
        if not len(heard):
            return None
        range_m, spread_m = self.ranges(signal_dbm)
        fix = laterate(
            self.beacons_m[heard],
            range_m[heard],
            phone_height_m=self.phone_height_m,
            spread_m=spread_m[heard],
        )
        place_m, level = np.array([fix.x_m, fix.y_m]), int(self.levels[heard[0]])
        return at_rest(place_m, fix.covariance_m2, self.start_speed_m_s, level)

    def updated(
        self,
        last: Belief,  # noqa: ARG002 (the ranges do not depend on it)
        predicted: Belief,
        signal_dbm: NDArray[np.float64],
    ) -> Belief:
        """Belief after the ranges of an epoch."""
        heard = _heard_on_one_level(signal_dbm, self.levels)
        if not len(heard):
            return predicted
        range_m, spread_m = self.ranges(signal_dbm)
        mean, covariance, _ = updated_by_ranges(
            predicted.mean,
            predicted.covariance,
            self.beacons_m[heard],
            range_m[heard],
            spread_m[heard] ** 2,
            self.phone_height_m,
            np.inf,
        )
        return Belief(mean=mean, covariance=covariance, level=int(self.levels[heard[0]]))


def _heard_on_one_level(
    signal_dbm: NDArray[np.float64], levels: NDArray[np.integer]
) -> NDArray[np.intp]:
    """Rows of the beacons heard that are on the level of the strongest."""
    heard = np.flatnonzero(~np.isnan(signal_dbm))
    if not len(heard):
        return heard
    strongest = heard[np.argmax(signal_dbm[heard])]
    return np.asarray(heard[levels[heard] == levels[strongest]], np.intp)
