"""FP + EKF: positions by fingerprints in a Kalman filter."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.estimators.base import Need, StartInfo, fitted, part_of
from blesim.estimators.constant_velocity import Belief, at_rest, updated_by_places
from blesim.estimators.epochs import EpochSettings, EpochTracker
from blesim.estimators.fingerprint_maps import (
    FingerprintMaps,
    FingerprintSettings,
    Places,
    fit_fingerprint_maps,
)
from blesim.ranging.survey_readings import survey_readings
from blesim.recording import Recording
from blesim.venue.venue import Venue


@dataclass(frozen=True, slots=True, kw_only=True)
class FingerprintEkf(EpochSettings):
    """FP + EKF, baseline of the channel-separate paper: one estimate after every epoch.

    Smoothed RSSI is compared with the fingerprints of the survey, Eq 10 to 15 of [1]_; a Kalman
    filter at constant velocity takes the position as its measurement. With a map for each channel,
    up to three positions are taken together as if they were independent. The noise of a position is
    what locating each surveyed place among the others shows; the covariance told is the filter's.
    The first state is the first position. Beacons that the survey did not hear are skipped.

    Parameters
    ----------
    separate : bool
        A map for each channel; the baseline has one for all, assumed.
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

    separate: bool = False
    k: int = 3
    search_scale: float | None = 5.0
    cell_m: float | None = 1.0
    grid_m: float | None = 1.0
    maps: FingerprintMaps | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        EpochSettings.__post_init__(self)
        part_of(FingerprintSettings, self)  # checks them

    @property
    def needs(self) -> frozenset[Need]:
        """A survey, and channels if they are kept apart."""
        return part_of(FingerprintSettings, self).needs

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that has the radio map of the survey.

        Raises
        ------
        DataError
            If the survey makes no radio map.
        """
        survey = survey_readings(surveys)
        return fitted(
            self, maps=fit_fingerprint_maps(survey, venue, part_of(FingerprintSettings, self))
        )

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> EpochTracker:  # noqa: ARG002 (needs neither)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.maps is None:
            raise UsageError("fp-ekf has no radio map yet; call fit first")
        measured = FingerprintFixes(maps=self.maps, start_speed_m_s=self.start_speed_m_s)
        return EpochTracker(
            self.epoch_settings(), self.maps.known, measured, by_channel=self.separate
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FingerprintFixes:
    """What fingerprint positions say of a place; fields as in `FingerprintEkf`."""

    maps: FingerprintMaps
    start_speed_m_s: float

    def found(self, signal_dbm: NDArray[np.float64]) -> Belief | None:
        """Belief at rest at the mean of the positions; none if there is none."""
        return at_first_places(self.maps.locate(signal_dbm, None), self.start_speed_m_s)

    def updated(self, last: Belief, predicted: Belief, signal_dbm: NDArray[np.float64]) -> Belief:
        """Belief after the positions of an epoch."""
        places = self.maps.locate(signal_dbm, last)
        if not len(places.places_m):
            return predicted
        mean, covariance = updated_by_places(
            predicted.mean, predicted.covariance, places.places_m, places.variance_m2
        )
        return Belief(mean=mean, covariance=covariance, level=places.level)


def at_first_places(places: Places, speed_m_s: float) -> Belief | None:
    """Belief at rest at the mean of positions, as little known as one of them; none of none."""
    if not len(places.places_m):
        return None
    variance_m2 = np.eye(2) * places.variance_m2.mean()
    return at_rest(places.places_m.mean(axis=0), variance_m2, speed_m_s, places.level)
