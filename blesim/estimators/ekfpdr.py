"""Map-compensated dead reckoning and beacon fixes in an error-state extended Kalman filter.

With the map's x and y in place of north and east, headings from the x axis, and the dead-reckoned
position p that nothing ever corrects, the state ``X = [dx dy ds dh]`` is what has to be added to
p, to the length s and to the heading h of a step (Eq 16 of [1]_):

- step: ``X <- F X``, ``P <- F P F' + Q`` with F of Eq 18 and Q of Eq 21
- fix b: ``Z = b - p`` (Eq 19), ``H = [1 0 0 0; 0 1 0 0]``, ``R = R_w I`` (Eq 20, 22)
- step without a fix since the last: ``Z = q - p`` with
  ``q = p_before + [dx dy] + (s + ds) [cos(h + dh) sin(h + dh)]`` (Eq 23, 24)

The position is ``p + [dx dy]``.

References
----------
.. [1] PDR with map-compensated heading, section 4.2 and solution IV; digest "map-heading-ekf".
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from blesim.estimators.aisle_zones import AisleZones, no_zones, zones_by_level
from blesim.estimators.base import Need, StartInfo, fitted
from blesim.estimators.beacon_fixes import BeaconFixes, only, zone_thresholds_dbm
from blesim.estimators.gait_settings import GaitSettings
from blesim.estimators.map_headings import MapHeadings, map_headings
from blesim.estimators.nearest_beacon import BeaconPlaces, beacon_places
from blesim.estimators.refusals import not_fitted, refuse_other, refuse_outside, required
from blesim.estimators.step_track import State, StepTracker
from blesim.estimators.walked_steps import step_need
from blesim.filters.kalman import predict_covariance, update
from blesim.kernels import kernel
from blesim.ranging.smoothing import SignalKind, SignalWindow, refuse_bad_window
from blesim.recording import Recording
from blesim.venue.venue import Venue

Array = NDArray[np.float64]
FixHeading = Literal["map", "raw"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorStatePdr(GaitSettings):
    """Dead reckoning and beacon fixes in an error-state Kalman filter: EKFPDR, solution IV.

    Steps as of AHPDR; once a second the first reading asks for a fix, which is the place beside the
    strongest beacon if the phone is in its zone. A fix is taken at its reading. There is an
    estimate after every step and every reading; its covariance is that of the filter, which the
    self-made observations between fixes keep smaller than the error.

    Parameters
    ----------
    source, system_heading, amplitude_m_s2, interval_s, compass_weight, turning_deg, offset_deg
        Steps, as of `GaitSettings`.
    start_m : float
        Standard deviation of the start. [m]
    heading : {"map", "raw"}
        Compensated by the map as in AHPDR, or raw as in OHPDR, which asks for no aisle graph.
    training_steps, junction_m, reach_m, agree_deg
        Compensation, as of `CompensatedHeadingPdr`. [-], [m], [m], [degree]
    position_variance_m2, step_variance_m2 : float
        Q of a step: of either axis, and of the step's length. [m2]
    straight_deg, turning_noise_deg : float
        Q of a step: standard deviation of the heading, walking straight and turning. [degree]
    fix_noise : float
        R_w: 10, which [1]_ calls a measurement noise; see `fix_noise_is`.
    fix_noise_is : {"variance", "deviation"}
        Whether R_w is the variance of a fix [m2], or its standard deviation [m].
    predicts_itself : bool
        Whether a step without a fix observes the filter's own prediction (Eq 23, 24).
    errors : {"reset", "kept"}
        Whether q of Eq 24 is taken over as dead-reckoned position, after which all errors begin at
        zero, as an error-state filter does; or the errors of length and heading stay for all steps
        to come, as Eq 17 reads to the letter: with Q of 1 m2 a step, one fix then changes every
        later step, and errors double (4.0 m against 2.2 m on walks like the paper's, ten seeds).
    zone_dbm, zone_m, fix_s, signal, rate
        Zones and fixes, as of `BeaconMatchedPdr`. [dBm], [m], [s], [-], [-]
    first_step_m, first_heading_deg : float
        Standard deviations of ds and dh at the start; assumed. [m], [degree]

    References
    ----------
    .. [1] PDR with map-compensated heading; digest "map-heading-ekf".
    """

    heading: FixHeading = "map"
    training_steps: int = 10
    junction_m: float = 2.0
    reach_m: float = 5.0
    agree_deg: float = 45.0
    position_variance_m2: float = 2.0
    step_variance_m2: float = 1.0
    straight_deg: float = 2.0
    turning_noise_deg: float = 15.0
    fix_noise: float = 10.0
    fix_noise_is: Literal["variance", "deviation"] = "variance"
    predicts_itself: bool = True
    errors: Literal["reset", "kept"] = "reset"
    zone_dbm: float | None = -74.0
    zone_m: float = 5.0
    fix_s: float = 1.0
    signal: SignalKind = "averaged"
    rate: float = 0.25
    first_step_m: float = 0.1
    first_heading_deg: float = 10.0
    zones: Mapping[int, AisleZones] | None = field(
        default=None, init=False, repr=False, compare=False
    )
    places: BeaconPlaces | None = field(default=None, init=False, repr=False, compare=False)
    threshold_dbm: Array | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        GaitSettings.__post_init__(self)
        refuse_other("heading", self.heading, ("map", "raw"))
        refuse_other("errors", self.errors, ("reset", "kept"))
        refuse_other("fix_noise_is", self.fix_noise_is, ("variance", "deviation"))
        refuse_outside(
            training_steps=(self.training_steps, 1, 1000),
            junction_m=(self.junction_m, 0.0, 100.0),
            reach_m=(self.reach_m, 0.0, 1e4),
            agree_deg=(self.agree_deg, 0.0, 90.0),
            position_variance_m2=(self.position_variance_m2, 0.0, 1e4),
            step_variance_m2=(self.step_variance_m2, 0.0, 1e2),
            straight_deg=(self.straight_deg, 0.0, 180.0),
            turning_noise_deg=(self.turning_noise_deg, 0.0, 180.0),
            fix_noise=(self.fix_noise, 1e-6, 1e6),
            zone_dbm=(-74.0 if self.zone_dbm is None else self.zone_dbm, -127.0, 20.0),
            zone_m=(self.zone_m, 0.1, 1e3),
            first_step_m=(self.first_step_m, 0.0, 10.0),
            first_heading_deg=(self.first_heading_deg, 0.0, 180.0),
        )
        refuse_bad_window(self.signal, self.fix_s, self.rate)

    @property
    def needs(self) -> frozenset[Need]:
        """The start, where the steps come from, and for compensated headings the aisle graph."""
        graph = {Need.GRAPH} if self.heading == "map" else set()
        return frozenset({Need.START, step_need(self.source), *graph})

    @property
    def fix_variance_m2(self) -> float:
        """Variance of a fix in x and in y. [m2]."""
        return self.fix_noise if self.fix_noise_is == "variance" else self.fix_noise**2

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that knows beacons, aisles, and what the surveys teach of the steps.

        Raises
        ------
        UsageError
            If headings are compensated, and the venue has no aisle graph.
        """
        return fitted(
            self,
            steps=self.learned_steps(venue, surveys),
            zones=zones_by_level(venue, self.junction_m) if self.heading == "map" else {},
            places=beacon_places(venue),
            threshold_dbm=zone_thresholds_dbm(venue, zone_dbm=self.zone_dbm, zone_m=self.zone_m),
        )

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> StepTracker:  # noqa: ARG002 (draws nothing)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted, or the start is not known.
        """
        if self.steps is None or self.places is None:
            raise not_fitted("ekfpdr")
        begin = required(start, "ekfpdr")
        motion = ErrorStateMotion(self, self._headings(begin.level), self.places, begin)
        return StepTracker(
            self.steps.start(begin.heading_rad),
            motion,
            level=begin.level,
            fixes=self._fixes(self.places, begin.level),
        )

    def _headings(self, level: int) -> MapHeadings | None:
        if self.heading == "raw" or self.zones is None:
            return None
        return map_headings(
            self.zones.get(level, no_zones(self.junction_m)),
            training_steps=self.training_steps,
            reach_m=self.reach_m,
            agree_deg=self.agree_deg,
        )

    def _fixes(self, places: BeaconPlaces, level: int) -> BeaconFixes | None:
        if self.threshold_dbm is None:
            return None
        window = SignalWindow(
            beacons=len(self.threshold_dbm),
            signal=self.signal,
            window_s=self.fix_s,
            rate=self.rate,
        )
        here = np.flatnonzero(places.level == level)
        return BeaconFixes(window, only(self.threshold_dbm, here), self.fix_s)


class ErrorStateMotion:
    """The filtered position of one walker; see `blesim.estimators.step_track.Motion`.

    Parameters
    ----------
    settings : ErrorStatePdr
        Noises.
    headings : MapHeadings or None
        What corrects the headings, if anything does.
    places : BeaconPlaces
        Where somebody beside each beacon is.
    start : StartInfo
        Where the walk begins.
    """

    def __init__(
        self,
        settings: ErrorStatePdr,
        headings: MapHeadings | None,
        places: BeaconPlaces,
        start: StartInfo,
    ) -> None:
        self._headings = headings
        self._places = places
        self._self_made = settings.predicts_itself
        self._reset = settings.errors == "reset"
        self._noise = {
            turning: process_noise(
                settings.position_variance_m2, settings.step_variance_m2, math.radians(deviation)
            )
            for turning, deviation in (
                (False, settings.straight_deg),
                (True, settings.turning_noise_deg),
            )
        }
        self._fix_noise = settings.fix_variance_m2 * np.eye(2)
        self._reckoned_m = np.array([start.x_m, start.y_m])
        self.error = np.zeros(4)
        first_rad = math.radians(settings.first_heading_deg)
        spread = np.array([settings.start_m, settings.start_m, settings.first_step_m, first_rad])
        self.covariance = np.diag(spread**2)
        self._fixed = False

    @property
    def state(self) -> State:
        """Position and its covariance."""
        x_m, y_m = (self._reckoned_m + self.error[:2]).tolist()
        (variance_x_m2, covariance_m2), (_, variance_y_m2) = self.covariance[:2, :2].tolist()
        return x_m, y_m, variance_x_m2, variance_y_m2, covariance_m2

    def step(self, length_m: float, heading_rad: float, turning: bool) -> None:
        """Predict one step, and observe the prediction if there was no fix since the last."""
        if self._headings is not None:
            x_m, y_m = (self._reckoned_m + self.error[:2]).tolist()
            heading_rad = self._headings.corrected_rad(heading_rad, turning, x_m, y_m)
        predicted_m = predicted(self._reckoned_m, self.error, length_m, heading_rad)
        way_m = length_m * np.array([math.cos(heading_rad), math.sin(heading_rad)])
        self._reckoned_m = self._reckoned_m + way_m
        transition = transition_of(length_m, heading_rad)
        self.error = _moved(transition, self.error)
        if self._reset:
            self._reckoned_m, self.error = predicted_m, np.zeros(4)
        self.covariance = predict_covariance(self.covariance, transition, self._noise[turning])
        if self._self_made and not self._fixed:
            self._observe(predicted_m)
        self._fixed = False

    def fix(self, beacon: int) -> None:
        """Observe the place beside a beacon."""
        self._observe(np.array([self._places.x_m[beacon], self._places.y_m[beacon]]))
        self._fixed = True

    def _observe(self, place_m: Array) -> None:
        innovation = place_m - self._reckoned_m - self.error[:2]
        self.error, self.covariance, _, _ = update(
            self.error, self.covariance, innovation, _OBSERVED, self._fix_noise
        )


# H of Eq 20.
_OBSERVED = np.eye(2, 4)


@kernel
def transition_of(length_m: float, heading_rad: float) -> Array:
    """Transition F of Eq 18, (4, 4) (kernel). [m], [rad]."""
    transition = np.eye(4)
    transition[0, 2], transition[0, 3] = math.cos(heading_rad), -length_m * math.sin(heading_rad)
    transition[1, 2], transition[1, 3] = math.sin(heading_rad), length_m * math.cos(heading_rad)
    return transition


@kernel
def predicted(reckoned_m: Array, error: Array, length_m: float, heading_rad: float) -> Array:
    """Position q of Eq 24 after a step from the dead-reckoned one, (2,) (kernel). [m], [rad]."""
    length_m += error[2]
    heading_rad += error[3]
    ahead = np.array([length_m * math.cos(heading_rad), length_m * math.sin(heading_rad)])
    place_m: Array = reckoned_m + error[:2] + ahead
    return place_m


@kernel
def _moved(transition: Array, error: Array) -> Array:
    """``F X``, (4,), whose lower half stays (kernel)."""
    moved = error.copy()
    for row in range(2):
        moved[row] += transition[row, 2] * error[2] + transition[row, 3] * error[3]
    return moved


def process_noise(position_m2: float, step_m2: float, heading_rad: float) -> Array:
    """Q of Eq 21, (4, 4), of variances and the standard deviation of the heading."""
    return np.diag([position_m2, position_m2, step_m2, heading_rad**2])
