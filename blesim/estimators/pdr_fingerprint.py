"""Dead reckoning and fingerprints of four directions in a Kalman filter.

References
----------
.. [1] PDR and four-direction fingerprints in a Kalman filter; digest "pdr-fingerprint-kalman".
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from blesim.estimators.base import Need, StartInfo, fitted
from blesim.estimators.fingerprint_survey import (
    DirectedMaps,
    FingerprintSurvey,
    learned_survey,
)
from blesim.estimators.refusals import not_fitted, refuse_other, refuse_outside, required
from blesim.estimators.step_track import HeldStates, State, merged
from blesim.estimators.surveyed_steps import learned_steps
from blesim.estimators.walked_steps import (
    StepReading,
    StepSource,
    StepWatch,
    SystemHeading,
    step_need,
)
from blesim.filters.kalman import update
from blesim.pdr.double_threshold import DoubleThreshold
from blesim.pdr.step_length import FixedLength
from blesim.ranging.nearest_fingerprints import Compared
from blesim.ranging.smoothers import Smoothing
from blesim.recording import Observations, Recording
from blesim.tables import Readings, Track
from blesim.units import to_us
from blesim.venue.venue import Venue

Array = NDArray[np.float64]
Begin = Literal["fingerprint", "mark"]
# Readings looked at together.
_CHUNK = 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class PdrFingerprint:
    """Dead reckoning and nearest fingerprints of four directions in a Kalman filter.

    - RSSI is the mean of the last readings of each beacon (Eq 1).
    - A step moves the position by ``[delta cos theta, delta sin theta]`` (Eq 2, 3) and its
      covariance by Q; then the fingerprint nearest to what is heard, of those surveyed in the
      direction of the step, is measured with R: ``K = P (P + R)^-1``, ``I <- I + K (z - I)``.
    - Correction, after 6 s without a step: with the range d of the strongest beacon B (Eq 7), if it
      is at most 3 m, and the position farther than d from B (Eq 8), the position moves to the point
      at distance d on the way to it. P is left as it is.

    Until the first step it is at the fingerprint of what is heard, whatever the direction, with
    covariance R; or at the mark of the start. There is an estimate after every step and every
    reading, with the covariance P of the filter.

    Parameters
    ----------
    correction : bool
        Distance-based correction.
    source : {"imu", "system"}
        IMU samples, whose vertical acceleration shows the steps, or the system's step events.
    system_heading : {"step", "stream"}
        Heading of the step event, or the latest of the system's headings.
    begin : {"fingerprint", "mark"}
        Where it begins.
    start_m : float
        Standard deviation of the mark of the start; assumed. [m]
    step_m : float
        Length of every step. [m]
    lower_m_s2, upper_m_s2, least_s : float
        The thresholds a_1 and a_2, and the least time between steps; assumed. [m/s2], [s]
    compass_weight : float
        Share of the compass in the heading: 1 is the magnetic heading alone. [-]
    offset_deg : float or None
        From the compass's frame into the map's, counter-clockwise; none for that of the survey, or
        without one of the venue's georeference. [degree]
    last : int
        n of Eq 1; assumed.
    forget_s : float
        A beacon not heard for as long is not heard; assumed. [s]
    cell_m : float
        Grid of a survey made walking; places where the tester stood are taken as they are. [m]
    directions : int
        Databases; 0 for one, whatever the direction.
    k : int
        Nearest fingerprints, weighted by 1 / distance.
    compared : {"all", "heard"}
        Compare all beacons, those not heard at -100 dBm, or only those heard.
    step_variance_m2 : float
        Q, of either axis; assumed. [m2]
    fix_variance_m2 : float or None
        R, of either axis; none for that of the survey: fingerprints of one half of its seconds
        tried on the other half. [m2]
    still_s : float
        b: time without a step. [s]
    near_m : float
        Range up to which RSSI is believed. [m]
    every_reading : bool
        Whether the correction goes on with each reading while standing, or is made once in a stop,
        with the first range that is near enough; [1]_ leaves it open.
    exponent : float or None
        n of Eq 7, with the announced power at one metre; none for the path loss of the survey. [-]

    Raises
    ------
    UsageError
        If a parameter is out of its range.
    """

    correction: bool = True
    source: StepSource = "imu"
    system_heading: SystemHeading = "step"
    begin: Begin = "fingerprint"
    start_m: float = 1.0
    step_m: float = 0.6
    lower_m_s2: float = 1.0
    upper_m_s2: float = 30.0
    least_s: float = 0.3
    compass_weight: float = 1.0
    offset_deg: float | None = None
    last: int = 10
    forget_s: float = 3.0
    cell_m: float = 0.6
    directions: int = 4
    k: int = 1
    compared: Compared = "all"
    step_variance_m2: float = 0.02
    fix_variance_m2: float | None = None
    still_s: float = 6.0
    near_m: float = 3.0
    every_reading: bool = False
    exponent: float | None = None
    steps: StepReading | None = field(default=None, init=False, repr=False, compare=False)
    survey: FingerprintSurvey | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        refuse_other("source", self.source, ("imu", "system"))
        refuse_other("system_heading", self.system_heading, ("step", "stream"))
        refuse_other("begin", self.begin, ("fingerprint", "mark"))
        refuse_other("compared", self.compared, ("all", "heard"))
        refuse_outside(
            start_m=(self.start_m, 0.0, 1e4),
            step_m=(self.step_m, 0.01, 3.0),
            lower_m_s2=(self.lower_m_s2, 0.0, 100.0),
            upper_m_s2=(self.upper_m_s2, self.lower_m_s2, 1000.0),
            least_s=(self.least_s, 0.0, 10.0),
            compass_weight=(self.compass_weight, 1e-6, 1.0),
            offset_deg=(self.offset_deg or 0.0, -360.0, 360.0),
            cell_m=(self.cell_m, 0.05, 1000.0),
            directions=(self.directions, 0, 360),
            k=(self.k, 1, 1000),
            step_variance_m2=(self.step_variance_m2, 0.0, 1e4),
            fix_variance_m2=(_or(self.fix_variance_m2, 1.0), 1e-6, 1e6),
            still_s=(self.still_s, 0.0, 1e5),
            near_m=(self.near_m, 0.0, 1e4),
            exponent=(_or(self.exponent, 2.0), 0.3, 8.0),
        )
        _ = self.smoothing

    @property
    def needs(self) -> frozenset[Need]:
        """A survey, where the steps come from, and the start if it begins there."""
        mark = {Need.START} if self.begin == "mark" else set()
        return frozenset({Need.SURVEY, step_need(self.source), *mark})

    @property
    def smoothing(self) -> Smoothing:
        """How RSSI is smoothed."""
        return Smoothing(kind="moving", last=self.last, window_s=self.forget_s)

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that knows the fingerprints, their errors, the compass's offset and the path loss.

        Raises
        ------
        DataError
            If no survey reading has a place, or a direction.
        """
        how = StepReading(
            source=self.source,
            heading=self.system_heading,
            detector=DoubleThreshold(
                lower_m_s2=self.lower_m_s2, upper_m_s2=self.upper_m_s2, interval_s=self.least_s
            ),
            length=FixedLength(step_m=self.step_m),
            compass_weight=self.compass_weight,
            step_m=self.step_m,
        )
        known_rad = None if self.offset_deg is None else math.radians(self.offset_deg)
        survey = learned_survey(
            venue,
            surveys,
            smoothing=self.smoothing,
            cell_m=self.cell_m,
            directions=self.directions,
            k=self.k,
            compared=self.compared,
            exponent=self.exponent,
        )
        steps = learned_steps(how, venue, surveys, known_rad, lengths=False)
        return fitted(self, steps=steps, survey=survey)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> "PdrFingerprintTracker":  # noqa: ARG002 (draws nothing)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted, or begins at a start that is not known.
        """
        if self.steps is None or self.survey is None:
            raise not_fitted("pdr-fingerprint")
        begin = required(start, "pdr-fingerprint") if self.begin == "mark" else None
        return PdrFingerprintTracker(self, self.steps.start(), self.survey, begin)


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value


class PdrFingerprintTracker:
    """Tracker of `PdrFingerprint`: one estimate after every step and every reading.

    Parameters
    ----------
    settings : PdrFingerprint
        Noises and thresholds.
    steps : StepWatch
        The walker's steps.
    survey : FingerprintSurvey
        What was learned.
    start : StartInfo or None
        Where the walk begins, if that is to be believed.
    """

    def __init__(
        self,
        settings: PdrFingerprint,
        steps: StepWatch,
        survey: FingerprintSurvey,
        start: StartInfo | None,
    ) -> None:
        self._settings = settings
        self._steps = steps
        self._survey = survey
        self._maps: DirectedMaps = survey.maps
        self._smoother = settings.smoothing.start(survey.beacons)
        self._still_us = to_us(settings.still_s)
        variance_m2 = _or(settings.fix_variance_m2, survey.fix_variance_m2)
        self._fix_noise = variance_m2 * np.eye(2)
        self._mean = np.full(2, np.nan) if start is None else np.array([start.x_m, start.y_m])
        self._covariance = self._fix_noise if start is None else settings.start_m**2 * _UNIT
        self._level = 0 if start is None else start.level
        # Whether it still goes to every fingerprint, and since when it has stood.
        self._beginning = start is None
        self._since_us: int | None = None
        self._corrected = False

    def advance(self, block: Observations) -> Track:
        """Estimates after each step and each reading of the block, from the first position on."""
        walked, readings = self._steps.advance(block), block.readings
        time_us, step_at, reading_at = merged(walked.time_us, readings.time_us)
        states = HeldStates(len(time_us), self._state, self._level)
        heard = 0
        for step in range(len(walked)):
            until = int(step_at[step]) - step
            self._hear(readings, heard, until, reading_at, states)
            heard = until
            self._step(
                int(walked.time_us[step]),
                float(walked.length_m[step]),
                float(walked.heading_rad[step]),
            )
            states.put(int(step_at[step]), self._state, self._level)
        self._hear(readings, heard, len(readings), reading_at, states)
        return states.track(time_us)

    @property
    def _state(self) -> State:
        x_m, y_m = self._mean.tolist()
        (variance_x_m2, covariance_m2), (_, variance_y_m2) = self._covariance.tolist()
        return x_m, y_m, variance_x_m2, variance_y_m2, covariance_m2

    def _hear(
        self,
        readings: Readings,
        begin: int,
        end: int,
        reading_at: NDArray[np.int64],
        states: HeldStates,
    ) -> None:
        """Take the readings from row `begin` until before row `end`."""
        for first in range(begin, end, _CHUNK):
            part = readings.rows(slice(first, min(first + _CHUNK, end)))
            signals_dbm = self._smoother.signals(part)
            if self._since_us is None:
                self._since_us = int(part.time_us[0])
            if not (self._beginning or self._may_correct(int(part.time_us[-1]))):
                continue
            for row, now_us in enumerate(part.time_us.tolist()):
                self._stand(now_us, signals_dbm[row])
                states.put(int(reading_at[first + row]), self._state, self._level)

    def _stand(self, now_us: int, signal_dbm: Array) -> None:
        """Take one reading that may change the position without a step."""
        if self._beginning:
            x_m, y_m, self._level = self._maps.locate(signal_dbm, None)
            self._mean = np.array([x_m, y_m])
        if self._may_correct(now_us):
            self._correct(signal_dbm)

    def _may_correct(self, now_us: int) -> bool:
        """Whether the walker has stood long enough, and may still be corrected."""
        if not self._settings.correction or self._since_us is None:
            return False
        again = self._settings.every_reading or not self._corrected
        return again and now_us - self._since_us >= self._still_us

    def _correct(self, signal_dbm: Array) -> None:
        """Draw the position to the strongest beacon, if it is near (Eq 7, 8)."""
        beacon = self._survey.strongest(signal_dbm, self._level)
        if beacon is None:
            return
        range_m = self._survey.range_m(beacon, float(signal_dbm[beacon]))
        if range_m > self._settings.near_m:
            return
        self._mean = drawn_to(self._mean, self._survey.beacon_xy_m[beacon], range_m)
        self._corrected, self._beginning = True, False

    def _step(self, now_us: int, length_m: float, heading_rad: float) -> None:
        """Predict by a step, and measure the fingerprint of its direction."""
        self._since_us, self._corrected = now_us, False
        if np.isnan(self._mean[0]):
            return
        self._beginning = False
        ahead = np.array([math.cos(heading_rad), math.sin(heading_rad)])
        self._mean = self._mean + length_m * ahead
        self._covariance = self._covariance + self._settings.step_variance_m2 * _UNIT
        x_m, y_m, level = self._maps.locate(self._smoother.at(now_us), heading_rad)
        if np.isnan(x_m):
            return
        innovation = np.array([x_m, y_m]) - self._mean
        self._mean, self._covariance, _, _ = update(
            self._mean, self._covariance, innovation, _UNIT, self._fix_noise
        )
        self._level = level


_UNIT = np.eye(2)


def drawn_to(place_m: Array, beacon_m: Array, range_m: float) -> Array:
    """Point C of the correction: P, or on the way from B to P at the range from B, (2,). [m].

    Parameters
    ----------
    place_m, beacon_m : ndarray of float64, (2,)
        P and B. [m]
    range_m : float
        d of Eq 7; P stays where it is nearer to B (Eq 8). [m]
    """
    apart_m = float(np.hypot(*(place_m - beacon_m)))
    return place_m if apart_m <= range_m else beacon_m + (place_m - beacon_m) * (range_m / apart_m)
