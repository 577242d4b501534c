"""Rerun of the paper on dead reckoning and four-direction fingerprints in a Kalman filter [1]_.

One survey and two walks are simulated a seed; the same estimator, fitted once, follows both walks
with and without the distance-based correction.

References
----------
.. [1] PDR and four-direction fingerprints in a Kalman filter; digest "pdr-fingerprint-kalman".
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from blesim.errors import InvariantError
from blesim.estimators.base import fitted
from blesim.estimators.fingerprint_survey import FingerprintSurvey
from blesim.estimators.pdr_fingerprint import PdrFingerprint
from blesim.estimators.run import surveys_of
from blesim.metrics.position_error import PositionErrors
from blesim.metrics.score import track_errors
from blesim.recording import Recording, Truth
from blesim.reruns import pdr_fingerprint_numbers as paper
from blesim.reruns.base import Expected, Key, Numbers, Picture, Published, Trial
from blesim.reruns.followed import followed
from blesim.reruns.pdr_fingerprint_pictures import error_overview, pictures_of
from blesim.reruns.sites import scenario_of
from blesim.scenario.reading import NOTHING_ELSE
from blesim.simulate import Simulation
from blesim.tables import Track, Trajectory
from blesim.units import to_us

SCENARIO = "room-two-pairs"
TakenAt = Literal["readings", "stands"]
# The published defaults; the correction is switched on and off below.
ESTIMATOR = PdrFingerprint()
# The point (8, 9) of section 3.3.1, in our survey. The room is 8 cells of 0.6 m wide, so that the
# 9 counts along it and the 8 across; that both count from 1 at the south-western corner is assumed.
_CELL_M = ESTIMATOR.cell_m
POINT_M = ((9 - 0.5) * _CELL_M, (8 - 0.5) * _CELL_M)
_SAME_PLACE_M = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Room:
    """One seed: recording, truth, what the survey taught, tracks and errors by path and mode."""

    recording: Recording
    truth: Truth
    survey: FingerprintSurvey
    tracks: Mapping[tuple[str, str], Track]
    errors: Mapping[tuple[str, str], PositionErrors]


@dataclass(frozen=True, slots=True, kw_only=True)
class PdrFingerprintExperiment:
    """The experiment; see `blesim.reruns.base.Experiment`.

    Attributes
    ----------
    values : mapping of str to object
        Laid into the scenario, by path; see `blesim.scenario.other_values`.
    estimator : PdrFingerprint
        Settings of the filter; the correction is switched on and off beside them.
    taken_at : {"readings", "stands"}
        Where the errors of table 3 are taken: after every reading of a walk, or only at the end of
        each stand.
    """

    paper: ClassVar[str] = "pdr-fingerprint"
    title: ClassVar[str] = "dead reckoning and four-direction fingerprints in a Kalman filter"
    values: Mapping[str, Any] = field(default_factory=dict)
    estimator: PdrFingerprint = ESTIMATOR
    taken_at: TakenAt = "readings"

    @property
    def published(self) -> Sequence[Published]:
        """Table 3, and the sample vectors of section 3.3.1."""
        return paper.PUBLISHED

    @property
    def expected(self) -> Sequence[Expected]:
        """With the correction less than without it, on both paths."""
        return paper.EXPECTED

    def trial(self, seed: int, *, pictures: bool = False) -> Trial:
        """Numbers of one seed, and its pictures if asked for."""
        room = walked(seed, self.values, self.estimator)
        point_dbm = point_signals_dbm(room.survey)
        numbers = {**error_numbers(room, self.taken_at), **signal_numbers(point_dbm)}
        if not pictures:
            return Trial(numbers=numbers)
        drawn = pictures_of(room.recording, room.truth, room.tracks, room.errors, point_dbm)
        return Trial(numbers=numbers, pictures=tuple(drawn))

    def overview(self, numbers: Mapping[Key, Numbers]) -> Sequence[Picture]:
        """Mean and largest errors of all seeds, beside the published ones."""
        return error_overview(numbers)


def walked(
    seed: int,
    values: Mapping[str, Any] = NOTHING_ELSE,
    estimator: PdrFingerprint = ESTIMATOR,
) -> Room:
    """The room of one seed, both paths followed in both modes."""
    recording, truth = Simulation.run(scenario_of(SCENARIO, values), seed).recording()
    learned = estimator.fit(recording.venue, surveys_of(recording))
    if learned.survey is None:
        raise InvariantError("pdr-fingerprint was fitted, and knows no fingerprints")
    tracks, errors = {}, {}
    for mode in paper.MODES:
        ready = with_correction(learned, correction=mode == paper.WITH)
        for path in paper.PATHS:
            walk = recording.by_name[path]
            track = followed(ready, recording, walk, seed, "pdr-fingerprint")
            tracks[path, mode] = track
            errors[path, mode] = track_errors(recording, truth, walk, track)
    return Room(
        recording=recording, truth=truth, survey=learned.survey, tracks=tracks, errors=errors
    )


def with_correction(learned: PdrFingerprint, *, correction: bool) -> PdrFingerprint:
    """Copy of a fitted estimator that corrects or not, and knows what it knew."""
    settings = replace(learned, correction=correction)
    return fitted(settings, steps=learned.steps, survey=learned.survey)


def error_numbers(room: Room, taken_at: TakenAt = "readings") -> dict[Key, float]:
    """Table 3, and the mean and maximum at the ends of the stands alone."""
    numbers = {}
    for (path, mode), errors in room.errors.items():
        end_us = stand_ends_us(room.truth.walks[path].trajectory, ESTIMATOR.still_s)
        at_ends = statistics_of(errors_at_m(errors, end_us))
        told = at_ends if taken_at == "stands" else statistics_of(errors.error_m)
        for statistic, value in told.items():
            numbers[paper.error_key(path, mode, statistic)] = value
        for statistic in (paper.MAX, paper.MEAN):
            numbers[paper.stand_key(path, mode, statistic)] = at_ends[statistic]
    return numbers


def statistics_of(error_m: NDArray[np.float64]) -> dict[str, float]:
    """Maximum, mean, variance about the mean and mean square of some errors. [m], [m2].

    The mean square is the variance and the square of the mean, as in table 3.
    """
    return {
        paper.MAX: float(np.max(error_m)),
        paper.MEAN: float(np.mean(error_m)),
        paper.VARIANCE: float(np.var(error_m)),
        paper.MSE: float(np.mean(error_m**2)),
    }


def stand_ends_us(trajectory: Trajectory, still_s: float) -> NDArray[np.int64]:
    """When stands of at least so many seconds end. [us]."""
    moved_m = np.hypot(np.diff(trajectory.x_m), np.diff(trajectory.y_m))
    long_enough = np.diff(trajectory.time_us) >= to_us(still_s)
    rows = np.flatnonzero(long_enough & (moved_m < _SAME_PLACE_M)) + 1
    return np.asarray(trajectory.time_us[rows], np.int64)


def errors_at_m(errors: PositionErrors, time_us: NDArray[np.int64]) -> NDArray[np.float64]:
    """Errors after the last reading not later than each time. [m]."""
    rows = np.searchsorted(errors.time_us, time_us, side="right") - 1
    return errors.error_m[rows]


def point_signals_dbm(survey: FingerprintSurvey) -> NDArray[np.float64]:
    """Fingerprints of the sample point, (4 directions, 4 beacons). [dBm]."""
    whole = survey.maps.whole.radio_map
    away_m = np.hypot(whole.x_m - POINT_M[0], whole.y_m - POINT_M[1])
    here = whole.rows(away_m < _CELL_M / 2)
    return here.fingerprints_dbm[np.argsort(here.direction)]


def signal_numbers(point_dbm: NDArray[np.float64]) -> dict[Key, float]:
    """The sample vectors, and by how much direction changes a beacon at most."""
    numbers = {
        paper.signal_key(direction, beacon): float(point_dbm[row, column])
        for row, direction in enumerate(paper.DIRECTIONS)
        for column, beacon in enumerate(paper.BEACONS)
    }
    return {**numbers, paper.TURNED: float(np.max(np.ptp(point_dbm, axis=0)))}


EXPERIMENT = PdrFingerprintExperiment()
