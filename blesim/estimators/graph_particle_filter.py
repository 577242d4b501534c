"""The particle filter on the aisle graph, fed with readings, and with steps if there are any.

References
----------
.. [1] The aisle-graph particle filter in a wholesale store, 2016;
   digest "aisle-graph-particle-filter".
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise
from typing import Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.estimators.base import Need, StartInfo, fitted, make_track
from blesim.estimators.graph_map import (
    BranchCurves,
    CurveKind,
    GraphMap,
    branch_curves,
    graph_map,
)
from blesim.estimators.graph_tunings import PRESETS, Preset, Tuning, refuse_outside, refuse_unknown
from blesim.estimators.graph_updates import NEVER_US, STEP, UNTOLD, follow_events
from blesim.filters.graph_motion import motion_key
from blesim.filters.resampling import Scheme
from blesim.ranging.path_loss_fit import AISLE_GRAPH
from blesim.ranging.smoothing import SignalWindow
from blesim.recording import Observations, Recording
from blesim.tables import Readings, Steps, Track
from blesim.venue.venue import Venue

Motion = Literal["velocity", "steps"]
EstimateTime = Literal["predicted", "updated"]
# No level of a venue.
_NO_LEVEL = -1000


@dataclass(frozen=True, slots=True, kw_only=True)
class GraphParticleFilter:
    """Graph particle filter of the aisle-graph paper: after every reading, the mean of particles.

    Particles are on the edges of the aisle graph. Each walks on with its velocity (Eq 7), is
    weighed by the reading (Eq 8, 9) and resampled, and its velocity is changed at random. They
    begin anywhere on the graph at any velocity. The estimate is their mean on the map, with the
    place on the graph nearest to it; its covariance is that of the particles, and half a metre
    off the aisle's centre line, which is assumed.

    The paper has one level; on several, particles are on the level of the beacon that was heard
    strongest in the last ``level_window_s``, and begin anew when it changes. Readings of beacons
    on other levels move the particles but do not weigh them; those of beacons on levels without
    aisles are passed over, without an estimate.

    Parameters
    ----------
    preset : {"table-1-500", "table-3-250", "table-3-1000"}
        Row of the paper's tables that gives the parameters which are not given by themselves.
    particles : int or None
        How many.
    spread_same_db, spread_other_db : float or None
        sigma_p of Eq 8, for a particle on the beacon's branch and for others. [dB]
    velocity_spread_m_s, velocity_limit_m_s : float or None
        V_d and V_max. [m/s]
    curve : {"paper", "survey"}
        Eq 1 with the RSSI at one metre that each beacon announces and the exponents below, or
        fitted on the survey, one RSSI at one metre for all beacons.
    exponent_same, exponent_other : float
        Path loss exponents of the paper's curve. [-]
    phone_height_m : float
        Above the floor: beacons of 2 m are about 1 m above it in the paper. [m]
    turn_back : bool
        Whether, at a node, the edge a particle came along is among those it draws from. The paper
        says "all edges".
    scheme : {"multinomial", "stratified", "systematic", "residual"}
        Of resampling; the paper draws each particle by itself.
    resample_below : float
        Resample if the effective sample size is under this share of the particles; 1 is always,
        as in the paper. [-]
    estimate : {"predicted", "updated"}
        Whether the mean is taken right after the prediction, Eq 10, or once the reading has
        weighed the particles.
    motion : {"velocity", "steps"}
        With ``steps``, what the paper wished for: each step event moves the particles by its
        length, on their edge to the side of its heading, at a node along the edge nearest to its
        heading. V_d and V_max are not used.
    step_spread : float
        ``steps``: standard deviation of a step's length over the length told. Assumed. [-]
    heading_spread_rad : float
        ``steps``: standard deviation of a step's heading, about 20 degrees. Assumed. [rad]
    wander_m_s : float
        ``steps``: standard deviation of the way a particle makes in a second besides the steps,
        which keeps particles apart while somebody stands; grows with the root of time. Assumed.
    level_window_s : float
        Where the venue has aisles on several levels. Assumed. [s]

    Raises
    ------
    UsageError
        If a parameter is out of its range.
    """

    preset: Preset = "table-1-500"
    particles: int | None = None
    spread_same_db: float | None = None
    spread_other_db: float | None = None
    velocity_spread_m_s: float | None = None
    velocity_limit_m_s: float | None = None
    curve: CurveKind = "paper"
    exponent_same: float = float(AISLE_GRAPH.same.exponent)
    exponent_other: float = float(AISLE_GRAPH.other.exponent)
    phone_height_m: float = 1.0
    turn_back: bool = True
    scheme: Scheme = "multinomial"
    resample_below: float = 1.0
    estimate: EstimateTime = "predicted"
    motion: Motion = "velocity"
    step_spread: float = 0.15
    heading_spread_rad: float = 0.35
    wander_m_s: float = 0.1
    level_window_s: float = 10.0
    known: GraphMap | None = field(default=None, init=False, repr=False, compare=False)
    curves: BranchCurves | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        refuse_unknown("preset", self.preset, get_args(Preset))
        refuse_unknown("curve", self.curve, get_args(CurveKind))
        refuse_unknown("scheme", self.scheme, get_args(Scheme))
        refuse_unknown("estimate", self.estimate, get_args(EstimateTime))
        refuse_unknown("motion", self.motion, get_args(Motion))
        _ = self.tuning
        refuse_outside("exponent_same", self.exponent_same, 0.1, 10.0)
        refuse_outside("exponent_other", self.exponent_other, 0.1, 10.0)
        refuse_outside("phone_height_m", self.phone_height_m, 0.0, 10.0)
        refuse_outside("resample_below", self.resample_below, 0.0, 1.0)
        refuse_outside("step_spread", self.step_spread, 0.0, 1.0)
        refuse_outside("heading_spread_rad", self.heading_spread_rad, 0.0, np.pi)
        refuse_outside("wander_m_s", self.wander_m_s, 0.0, 10.0)
        refuse_outside("level_window_s", self.level_window_s, 0.001, 3600.0)

    @property
    def tuning(self) -> Tuning:
        """Tuned parameters: those given, and those of the preset for the others."""
        given = {each.name: getattr(self, each.name) for each in fields(Tuning)}
        return replace(PRESETS[self.preset], **{k: v for k, v in given.items() if v is not None})

    @property
    def needs(self) -> frozenset[Need]:
        """The aisle graph; steps and a survey only at the settings that use them."""
        needs = {Need.GRAPH}
        if self.motion == "steps":
            needs.add(Need.STEPS)
        if self.curve == "survey":
            needs.add(Need.SURVEY)
        return frozenset(needs)

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that knows the map, and with ``curve="survey"`` its path loss.

        Raises
        ------
        UsageError
            If the venue has no aisle graph.
        DataError
            If the survey does not make a curve.
        """
        exponents = (self.exponent_same, self.exponent_other)
        curves = branch_curves(venue, surveys, self.curve, exponents, self.phone_height_m)
        return fitted(self, known=graph_map(venue), curves=curves)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> "GraphTracker":  # noqa: ARG002 (begins anywhere)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.known is None or self.curves is None:
            raise UsageError("graph-particle-filter does not know the venue yet; call fit first")
        return GraphTracker(self, self.known, self.curves, rng)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Particles:
    """A cloud of n particles on the aisle graph, all arrays (n,).

    Attributes
    ----------
    edge : ndarray of int64
        Rows of edges.
    offset_m : ndarray of float64
        From their first nodes. [m]
    velocity_m_s : ndarray of float64
        Along the edge, positive from its first node to its second. [m/s]
    log_weights, weights : ndarray of float64
        Since the last resampling; the weights add up to one. [-]
    """

    edge: NDArray[np.int64]
    offset_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    log_weights: NDArray[np.float64]
    weights: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Events:
    """Readings, and steps between them, in order of time, all arrays (m,)."""

    time_us: NDArray[np.int64]
    beacon: NDArray[np.int64]
    first_value: NDArray[np.float64]
    second_value: NDArray[np.float64]


class GraphTracker:
    """Tracker of `GraphParticleFilter`: one estimate after every reading.

    Attributes
    ----------
    cloud : Particles or None
        The particles after the last block; none before the first reading.
    """

    def __init__(
        self,
        settings: GraphParticleFilter,
        known: GraphMap,
        curves: BranchCurves,
        rng: np.random.Generator,
    ) -> None:
        self.cloud: Particles | None = None
        self._settings, self._known, self._curves, self._rng = settings, known, curves, rng
        self._tuning = settings.tuning
        self._keys = np.stack([motion_key(rng), motion_key(rng)])
        self._clock = np.array([NEVER_US, 0])
        self._level = _NO_LEVEL
        self._heard = SignalWindow(
            beacons=len(known.beacon_level),
            signal="highest",
            window_s=settings.level_window_s,
            rate=1.0,
        )
        self._spreads_db = np.array([self._tuning.spread_same_db, self._tuning.spread_other_db])
        self._motion = np.array(
            [
                self._tuning.velocity_spread_m_s,
                self._tuning.velocity_limit_m_s,
                settings.wander_m_s,
                settings.step_spread,
                settings.heading_spread_rad,
            ]
        )

    def advance(self, block: Observations) -> Track:
        """Estimates after each reading of the block."""
        readings = self._known.usable(block.readings)
        level = self._levels(readings)
        events = self._events(readings, block.steps, level)
        moments, offset_m = np.empty((len(readings), 5)), np.empty(len(readings))
        edge = np.empty(len(readings), np.int64)
        before = np.concatenate([[self._level], level])[:-1]
        reading = np.flatnonzero(events.beacon != STEP)
        cuts = [0, *reading[level != before], len(events.beacon)]
        for turn, (first, last) in enumerate(pairwise(cuts)):
            rows = slice(*np.searchsorted(reading, [first, last]))
            if turn > 0:
                self._begin(int(level[rows.start]))
            if self.cloud is not None:
                here = slice(first, last)
                self._follow(self.cloud, events, here, moments[rows], edge[rows], offset_m[rows])
        return make_track(
            time_us=readings.time_us,
            x_m=moments[:, 0],
            y_m=moments[:, 1],
            variance_x_m2=moments[:, 2],
            variance_y_m2=moments[:, 3],
            covariance_xy_m2=moments[:, 4],
            level=level,
            edge=edge,
            offset_m=offset_m,
        )

    def _levels(self, readings: Readings) -> NDArray[np.int64]:
        """Level of the phone after each reading: that of the beacon heard strongest of late."""
        beacon = readings.beacon if self._known.levels == 1 else self._heard.strongest(readings)
        return self._known.beacon_level[beacon]

    def _events(self, readings: Readings, steps: Steps, level: NDArray[np.int64]) -> _Events:
        """Readings, and the steps if they are used, in order of time."""
        here = self._known.beacon_level[readings.beacon] == level
        beacon = np.where(here, readings.beacon, UNTOLD)
        rssi_dbm = readings.rssi_dbm.astype(np.float64)
        by_steps = self._settings.motion == "steps"
        told = np.isfinite(steps.length_m) & np.isfinite(steps.heading_rad) & (steps.length_m >= 0)
        steps = steps.rows(told if by_steps else slice(0))
        # At one moment steps come before readings.
        place = np.searchsorted(readings.time_us, steps.time_us)
        return _Events(
            time_us=np.insert(readings.time_us, place, steps.time_us),
            beacon=np.insert(beacon.astype(np.int64), place, STEP),
            first_value=np.insert(rssi_dbm, place, steps.length_m),
            second_value=np.insert(np.zeros(len(readings)), place, steps.heading_rad),
        )

    def _begin(self, level: int) -> None:
        """Spread the particles over all aisles of a level, with all velocities."""
        count, limit_m_s = self._tuning.particles, self._tuning.velocity_limit_m_s
        edge, offset_m = self._known.arrays.uniform_places(
            self._rng.random(count), self._known.lines.level == level
        )
        self.cloud = Particles(
            edge=edge,
            offset_m=offset_m,
            velocity_m_s=self._rng.uniform(-limit_m_s, limit_m_s, count),
            log_weights=np.zeros(count),
            weights=np.full(count, 1.0 / count),
        )
        self._level = level

    def _follow(
        self,
        cloud: Particles,
        events: _Events,
        here: slice,
        moments: NDArray[np.float64],
        edge: NDArray[np.int64],
        offset_m: NDArray[np.float64],
    ) -> None:
        """Take the particles through events on one level; fill the rows of its readings."""
        arrays, lines, settings = self._known.arrays, self._known.lines, self._settings
        follow_events(
            events.time_us[here],
            events.beacon[here],
            events.first_value[here],
            events.second_value[here],
            cloud.edge,
            cloud.offset_m,
            cloud.velocity_m_s,
            cloud.log_weights,
            cloud.weights,
            self._clock,
            self._keys,
            arrays.length_m,
            arrays.ends,
            arrays.one_way,
            arrays.first,
            arrays.door,
            lines.start_x_m,
            lines.start_y_m,
            lines.along_x,
            lines.along_y,
            lines.level,
            lines.branch,
            self._known.beacon_xyz_m,
            self._known.beacon_branch,
            self._curves.level_dbm,
            settings.phone_height_m,
            self._curves.exponents,
            self._spreads_db,
            settings.turn_back,
            settings.motion == "steps",
            self._motion,
            get_args(Scheme).index(settings.scheme),
            settings.resample_below,
            settings.estimate == "updated",
            self._level,
            moments,
            edge,
            offset_m,
        )
