"""Dead reckoning with the heading as measured, and with the heading that a map corrects.

References
----------
.. [1] PDR with map-compensated heading, solutions I and II; digest "map-heading-ekf".
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from blesim.estimators.aisle_zones import AisleZones, no_zones, zones_by_level
from blesim.estimators.base import Need, StartInfo, fitted
from blesim.estimators.gait_settings import GaitSettings
from blesim.estimators.map_headings import MapHeadings, map_headings
from blesim.estimators.refusals import not_fitted, refuse_outside, required
from blesim.estimators.step_track import State, StepTracker
from blesim.estimators.walked_steps import step_need
from blesim.pdr.dead_reckoning import DeadReckoning, StepErrors
from blesim.recording import Recording
from blesim.venue.venue import Venue


@dataclass(frozen=True, slots=True, kw_only=True)
class RawHeadingPdr(GaitSettings):
    """Dead reckoning with the raw smoothed heading: OHPDR, solution I of the paper.

    From the start on, each step moves the position by Eq 1. There is an estimate after every step,
    and after every reading too, though readings tell it nothing. Its covariance is that of dead
    reckoning: the start, and errors of the steps of their own and in common.

    Parameters
    ----------
    source, system_heading, amplitude_m_s2, interval_s, compass_weight, turning_deg, offset_deg
        Steps, as of `GaitSettings`.
    start_m : float
        Standard deviation of the start. [m]
    length_scale : float
        Relative error of all lengths together; assumed. [-]
    heading_bias_deg : float
        Error that all headings share: 12.7 deg is the mean of table 3. [degree]

    References
    ----------
    .. [1] PDR with map-compensated heading; digest "map-heading-ekf".
    """

    length_scale: float = 0.05
    heading_bias_deg: float = 12.7

    def __post_init__(self) -> None:
        GaitSettings.__post_init__(self)
        refuse_outside(
            length_scale=(self.length_scale, 0.0, 1.0),
            heading_bias_deg=(self.heading_bias_deg, 0.0, 180.0),
        )

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that knows the compass and the step lengths of the surveys, if there are any."""
        return fitted(self, steps=self.learned_steps(venue, surveys))

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> StepTracker:  # noqa: ARG002 (draws nothing)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted, or the start is not known.
        """
        if self.steps is None:
            raise not_fitted("ohpdr")
        begin = required(start, "ohpdr")
        reckoning = DeadReckoning(x_m=begin.x_m, y_m=begin.y_m, errors=self.errors)
        motion = Reckoning(reckoning, _start_state(begin, self.start_m), None)
        return StepTracker(self.steps.start(begin.heading_rad), motion, level=begin.level)

    @property
    def errors(self) -> StepErrors:
        """Errors of the steps."""
        return StepErrors(
            start_m=self.start_m,
            scale=self.length_scale,
            heading_bias_rad=math.radians(self.heading_bias_deg),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class CompensatedHeadingPdr(GaitSettings):
    """Dead reckoning with the map-compensated heading: AHPDR, solution II of the paper.

    As OHPDR, but the compass's error is learned from the directions of the aisles, on the first
    straight steps after each turn (Eq 10 to 15). There is an estimate after every step and every
    reading, with the covariance of dead reckoning.

    Parameters
    ----------
    source, system_heading, amplitude_m_s2, interval_s, compass_weight, turning_deg, offset_deg
        Steps, as of `GaitSettings`.
    start_m : float
        Standard deviation of the start. [m]
    length_scale : float
        Relative error of all lengths together; assumed. [-]
    heading_bias_deg : float
        Error that all compensated headings share: 3.8 deg is the mean of table 3. [degree]
    training_steps : int
        Straight steps after a turn from which the compass's error is learned.
    junction_m : float
        Radius about junctions within which no step is taken to follow an aisle; assumed. [m]
    reach_m, agree_deg : float
        The nearest aisle within this distance, and this near in direction, is the one walked along;
        assumed. [m], [degree]

    References
    ----------
    .. [1] PDR with map-compensated heading; digest "map-heading-ekf".
    """

    length_scale: float = 0.05
    heading_bias_deg: float = 3.8
    training_steps: int = 10
    junction_m: float = 2.0
    reach_m: float = 5.0
    agree_deg: float = 45.0
    zones: Mapping[int, AisleZones] | None = field(
        default=None, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        GaitSettings.__post_init__(self)
        refuse_outside(
            length_scale=(self.length_scale, 0.0, 1.0),
            heading_bias_deg=(self.heading_bias_deg, 0.0, 180.0),
            training_steps=(self.training_steps, 1, 1000),
            junction_m=(self.junction_m, 0.0, 100.0),
            reach_m=(self.reach_m, 0.0, 1e4),
            agree_deg=(self.agree_deg, 0.0, 90.0),
        )

    @property
    def needs(self) -> frozenset[Need]:
        """The start, the aisle graph, and where the steps come from."""
        return frozenset({Need.START, Need.GRAPH, step_need(self.source)})

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that knows the aisles, and what the surveys teach of compass and lengths.

        Raises
        ------
        UsageError
            If the venue has no aisle graph.
        """
        steps = self.learned_steps(venue, surveys)
        return fitted(self, steps=steps, zones=zones_by_level(venue, self.junction_m))

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> StepTracker:  # noqa: ARG002 (draws nothing)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted, or the start is not known.
        """
        if self.steps is None or self.zones is None:
            raise not_fitted("ahpdr")
        begin = required(start, "ahpdr")
        errors = StepErrors(
            start_m=self.start_m,
            scale=self.length_scale,
            heading_bias_rad=math.radians(self.heading_bias_deg),
        )
        headings = map_headings(
            self.zones.get(begin.level, no_zones(self.junction_m)),
            training_steps=self.training_steps,
            reach_m=self.reach_m,
            agree_deg=self.agree_deg,
        )
        reckoning = DeadReckoning(x_m=begin.x_m, y_m=begin.y_m, errors=errors)
        motion = Reckoning(reckoning, _start_state(begin, self.start_m), headings)
        return StepTracker(self.steps.start(begin.heading_rad), motion, level=begin.level)


def _start_state(start: StartInfo, start_m: float) -> State:
    return start.x_m, start.y_m, start_m**2, start_m**2, 0.0


class Reckoning:
    """The dead-reckoned position of one walker; see `blesim.estimators.step_track.Motion`.

    Parameters
    ----------
    reckoning : DeadReckoning
        At the start.
    state : State
        The same, until the first step.
    headings : MapHeadings or None
        What corrects the headings, if anything does.
    """

    def __init__(
        self, reckoning: DeadReckoning, state: State, headings: MapHeadings | None
    ) -> None:
        self._reckoning = reckoning
        self._headings = headings
        self._state = state

    @property
    def state(self) -> State:
        """Position and its covariance."""
        return self._state

    def step(self, length_m: float, heading_rad: float, turning: bool) -> None:
        """Take a step along its heading, corrected if anything corrects it."""
        if self._headings is not None:
            x_m, y_m = self._state[:2]
            heading_rad = self._headings.corrected_rad(heading_rad, turning, x_m, y_m)
        self._state = reckoned(self._reckoning, length_m, heading_rad)

    def fix(self, beacon: int) -> None:
        """Nothing: dead reckoning takes no fixes."""


def reckoned(reckoning: DeadReckoning, length_m: float, heading_rad: float) -> State:
    """State after one more step. [m], [rad]."""
    now = reckoning.advance(np.array([length_m]), np.array([heading_rad]))
    return (
        float(now.x_m[0]),
        float(now.y_m[0]),
        float(now.variance_x_m2[0]),
        float(now.variance_y_m2[0]),
        float(now.covariance_xy_m2[0]),
    )
