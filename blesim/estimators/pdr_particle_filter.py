"""The particle filter on steps, RSSI and a floor plan.

References
----------
.. [1] F. Gustafsson et al., "Particle filters for positioning, navigation, and tracking", IEEE
   Transactions on Signal Processing, 2002. doi:10.1109/78.978396
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from blesim.estimators.base import Need, StartInfo, fitted
from blesim.estimators.believed_path_loss import PathLossBelief
from blesim.estimators.clocked_tracker import walked
from blesim.estimators.floors import Floors
from blesim.estimators.heard import known_readings, moments_track
from blesim.estimators.refusals import not_fitted, refuse_other, refuse_outside
from blesim.estimators.surveyed_steps import learned_steps
from blesim.estimators.walked_steps import (
    StepReading,
    StepSource,
    StepWatch,
    SystemHeading,
    step_need,
)
from blesim.estimators.walking_cloud import CloudSettings, WalkingCloud
from blesim.ranging.path_loss_fit import PathLossFit
from blesim.ranging.smoothing import SignalWindow
from blesim.recording import Observations, Recording
from blesim.tables import Track
from blesim.units import to_us
from blesim.venue.venue import Venue

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class PdrParticleFilter(CloudSettings):
    """Particle filter of steps and RSSI: after every reading, the weighted mean of the particles.

    The usual one [1]_: each step moves every particle by its length and heading with noise and a
    slowly changing heading error of the particle's own; walls are in the way; each reading
    multiplies the weights by its likelihood on the beacon's path loss curve,
    ``exp(-trust min(|z|, outlier)^2 / 2)`` with z the departure in spreads. Systematic resampling
    where the effective sample size falls below a share of the particles; copies are then moved
    apart a little. The cloud begins at places of the enterable area that the first reading makes
    likely, and anew after a long silence or on another level.

    The curves are fitted on the survey. Without one, the power that each beacon announces for one
    metre, `exponent` and `spread_db` stand in.

    The covariance is that of the weighted particles, 0.1 m squared added.

    Parameters
    ----------
    particles, length_share, heading_spread_deg, heading_bias_deg, bias_steps, walls, trust
        See `CloudSettings`, as `outlier`, `resample_below`, `roughening_m`, `phone_height_m`.
    source : {"system", "imu"}
        Step events of the phone's system with their lengths, or detection from the IMU, with what a
        survey teaches of lengths and headings; see `blesim.estimators.walked_steps`.
    system_heading : {"step", "stream"}
        Heading of the step event, or the latest of the system's headings.
    silence_s : float
        After which the cloud begins anew; assumed. [s]
    window_s : float
        Window of the strongest beacon, which tells the level; assumed. [s]
    curves : {"all", "beacon"}
        One path loss curve for all beacons, or one for each.
    exponent, spread_db : float
        Path loss exponent and spread about the curve without a survey; assumed. [-], [dB]

    Raises
    ------
    UsageError
        If a parameter is out of its range.

    References
    ----------
    .. [1] doi:10.1109/78.978396
    """

    source: StepSource = "system"
    system_heading: SystemHeading = "step"
    silence_s: float = 30.0
    window_s: float = 3.0
    curves: Literal["all", "beacon"] = "beacon"
    exponent: float = 2.0
    spread_db: float = 6.0
    learned: "PlanAndCurves | None" = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        CloudSettings.__post_init__(self)
        _ = self._belief
        refuse_other("source", self.source, ("system", "imu"))
        refuse_other("system_heading", self.system_heading, ("step", "stream"))
        refuse_outside(
            silence_s=(self.silence_s, 0.01, 1e6),
            window_s=(self.window_s, 0.01, 3600),
        )

    @property
    def needs(self) -> frozenset[Need]:
        """Where the steps come from."""
        return frozenset({step_need(self.source)})

    @property
    def _belief(self) -> PathLossBelief:
        return PathLossBelief(
            by=self.curves,
            exponent=self.exponent,
            spread_db=self.spread_db,
            phone_height_m=self.phone_height_m,
        )

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that knows the venue and its path loss."""
        how = StepReading(source=self.source, heading=self.system_heading)
        learned = PlanAndCurves(
            floors=Floors.of(venue, use_map=self.walls != "ignore"),
            beacon_xyz_m=venue.beacon_xyz_m,
            curves=curve_table(self._belief.curves(venue, surveys)),
            steps=learned_steps(how, venue, surveys, None),
        )
        return fitted(self, learned=learned)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> "PdrTracker":  # noqa: ARG002 (begins anywhere)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.learned is None:
            raise not_fitted("pdr-particle-filter")
        return PdrTracker(self, self.learned, self.learned.steps.start(), rng)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanAndCurves:
    """What the filter knows of a venue.

    Attributes
    ----------
    floors : Floors
        Where one may walk.
    beacon_xyz_m : ndarray of float64, (beacons, 3)
        [m]
    curves : ndarray of float64, (beacons, 3)
        See `curve_table`.
    steps : StepReading
        How steps are read.
    """

    floors: Floors
    beacon_xyz_m: Array
    curves: Array
    steps: StepReading


def curve_table(curves: PathLossFit) -> Array:
    """Level at a metre [dBm], exponent [-] and spread [dB] of each curve, (beacons, 3)."""
    columns = (curves.level_dbm, curves.exponent, curves.spread_db)
    return np.stack([np.asarray(column, np.float64) for column in columns], axis=1)


class PdrTracker:
    """Tracker of `PdrParticleFilter`: one estimate after every reading."""

    def __init__(
        self,
        settings: PdrParticleFilter,
        learned: PlanAndCurves,
        watch: StepWatch,
        rng: np.random.Generator,
    ) -> None:
        self._settings, self._learned, self._watch, self._rng = settings, learned, watch, rng
        floors = learned.floors
        self._known = np.isin(floors.beacon_level, list(floors.motion))
        self._window = SignalWindow(
            beacons=len(self._known), signal="highest", window_s=settings.window_s, rate=1.0
        )
        self._silence_us = to_us(settings.silence_s)
        self._heard_us = 0
        self._level = 0
        self._cloud: WalkingCloud | None = None

    def advance(self, block: Observations) -> Track:
        """Estimates after each reading of the block."""
        readings = known_readings(block.readings, self._known)
        steps = walked(self._watch, block)
        level = self._learned.floors.beacon_level[self._window.strongest(readings)]
        before = np.searchsorted(steps.time_us, readings.time_us, side="right").tolist()
        ways = list(zip(steps.length_m.tolist(), steps.heading_rad.tolist(), strict=True))
        found = np.empty((len(readings), 5))
        taken = 0
        events = zip(
            readings.time_us.tolist(),
            readings.beacon.tolist(),
            readings.rssi_dbm.tolist(),
            level.tolist(),
            before,
            strict=True,
        )
        for row, (time_us, beacon, rssi_dbm, here, gone) in enumerate(events):
            self._walk(ways[taken:gone])
            taken = gone
            found[row] = self._hear(time_us, beacon, float(rssi_dbm), here)
        self._walk(ways[taken:])
        return moments_track(readings.time_us, level, found)

    def _walk(self, ways: list[tuple[float, float]]) -> None:
        if self._cloud is not None:
            for length_m, heading_rad in ways:
                self._cloud.walk(length_m, heading_rad)

    def _hear(
        self, time_us: int, beacon: int, rssi_dbm: float, level: int
    ) -> tuple[float, float, float, float, float]:
        """Mean and covariance after a reading. [m], [m2]."""
        silent = time_us - self._heard_us > self._silence_us
        self._heard_us = time_us
        learned = self._learned
        if self._cloud is None or silent or level != self._level:
            self._level = level
            self._cloud = WalkingCloud(self._settings, learned.floors.motion[level], self._rng)
        if learned.floors.beacon_level[beacon] != level:
            return self._cloud.moments()
        return self._cloud.hear(learned.beacon_xyz_m[beacon], learned.curves[beacon], rssi_dbm)
