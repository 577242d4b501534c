"""Dead reckoning matched to the map, its position overwritten by beacons at key points.

References
----------
.. [1] PDR with map-compensated heading, section 4.1 and solution III; digest "map-heading-ekf".
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.estimators.aisle_zones import AisleZones, no_zones, zones_by_level
from blesim.estimators.base import Need, StartInfo, fitted
from blesim.estimators.beacon_fixes import BeaconFixes, only, zone_thresholds_dbm
from blesim.estimators.gait_settings import GaitSettings
from blesim.estimators.heading_pdr import reckoned
from blesim.estimators.nearest_beacon import BeaconPlaces, beacon_places
from blesim.estimators.refusals import not_fitted, refuse_outside, required
from blesim.estimators.step_track import State, StepTracker
from blesim.estimators.walked_steps import step_need
from blesim.pdr.dead_reckoning import DeadReckoning, StepErrors
from blesim.ranging.smoothing import SignalKind, SignalWindow, refuse_bad_window
from blesim.recording import Recording
from blesim.venue.venue import Venue

_NO_BEACONS = np.empty(0, np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class BeaconMatchedPdr(GaitSettings):
    """Dead reckoning matched to the map and to beacons at key points: BEPDR, solution III.

    - In a linear zone a straight step has the direction of the nearest aisle, of its two the one
      nearer to the measured heading; else the measured heading of its gait cycle. Linear is what
      lies beside the part of an aisle that is away from junctions; beyond its end it is not.
    - On entering a linear zone from elsewhere the position becomes the centre of its entry, if that
      belongs to a junction nearby.
    - A fix of a beacon at a key point, looked for once a second, overwrites the position by the
      place beside the beacon. Key points are the junctions, each with its nearest beacon.

    There is an estimate after every step and every reading. The covariance is that of dead
    reckoning since the start, the last entry (uniform over the non-linear zone) or the last fix
    (uniform over the beacon's zone); of a disk of radius r, r^2 / 4 on either axis.

    Parameters
    ----------
    source, system_heading, amplitude_m_s2, interval_s, compass_weight, turning_deg, offset_deg
        Steps, as of `GaitSettings`.
    start_m : float
        Standard deviation of the start. [m]
    length_scale : float
        Relative error of all lengths together; assumed. [-]
    heading_bias_deg : float
        Error that all headings since the last entry or fix share; assumed. [degree]
    junction_m : float
        Radius of the non-linear zones; assumed. [m]
    reach_m : float
        Half the width of the linear zones, and how far from a non-linear zone a linear one may be
        entered; assumed. [m]
    key_m : float
        How far from its junction a beacon at a key point may be; assumed. [m]
    zone_dbm : float or None
        Signal value from which the phone is in a beacon's zone; none for that of its announced
        power at `zone_m`. [dBm]
    zone_m : float
        Radius of the zones. [m]
    fix_s : float
        Time between two looks for a fix. [s]
    signal : {"highest", "averaged"}
        Signal value of a beacon over a window of `fix_s`; assumed.
    rate : float
        Weight of a new reading in the average; assumed. [-]
    every_fix : bool
        Whether each fix overwrites the position, so that it stays until the zone is left, or only
        the first of a beacon until there is one of another; [1]_ leaves it open.

    References
    ----------
    .. [1] PDR with map-compensated heading; digest "map-heading-ekf".
    """

    length_scale: float = 0.05
    heading_bias_deg: float = 3.8
    junction_m: float = 2.0
    reach_m: float = 5.0
    key_m: float = 5.0
    zone_dbm: float | None = -74.0
    zone_m: float = 5.0
    fix_s: float = 1.0
    signal: SignalKind = "averaged"
    rate: float = 0.25
    every_fix: bool = True
    key_map: "KeyPointMap | None" = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        GaitSettings.__post_init__(self)
        refuse_outside(
            length_scale=(self.length_scale, 0.0, 1.0),
            heading_bias_deg=(self.heading_bias_deg, 0.0, 180.0),
            junction_m=(self.junction_m, 0.0, 100.0),
            reach_m=(self.reach_m, 0.0, 1e4),
            key_m=(self.key_m, 0.0, 1e4),
            zone_dbm=(-74.0 if self.zone_dbm is None else self.zone_dbm, -127.0, 20.0),
            zone_m=(self.zone_m, 0.1, 1e3),
        )
        refuse_bad_window(self.signal, self.fix_s, self.rate)

    @property
    def needs(self) -> frozenset[Need]:
        """The start, the aisle graph, and where the steps come from."""
        return frozenset({Need.START, Need.GRAPH, step_need(self.source)})

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that knows the zones, the key points and what the surveys teach of the steps.

        Raises
        ------
        UsageError
            If the venue has no aisle graph.
        """
        zones = zones_by_level(venue, self.junction_m)
        threshold_dbm = zone_thresholds_dbm(venue, zone_dbm=self.zone_dbm, zone_m=self.zone_m)
        places = beacon_places(venue)
        keys = {level: key_beacons(zones[level], places, level, self.key_m) for level in zones}
        known = KeyPointMap(zones=zones, keys=keys, threshold_dbm=threshold_dbm, places=places)
        return fitted(self, steps=self.learned_steps(venue, surveys), key_map=known)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> StepTracker:  # noqa: ARG002 (draws nothing)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted, or the start is not known.
        """
        if self.steps is None or self.key_map is None:
            raise not_fitted("bepdr")
        begin = required(start, "bepdr")
        zones = self.key_map.zones.get(begin.level, no_zones(self.junction_m))
        motion = MatchedReckoning(self, zones, self.key_map.places, begin)
        fixes = BeaconFixes(
            SignalWindow(
                beacons=len(self.key_map.threshold_dbm),
                signal=self.signal,
                window_s=self.fix_s,
                rate=self.rate,
            ),
            only(self.key_map.threshold_dbm, self.key_map.keys.get(begin.level, _NO_BEACONS)),
            self.fix_s,
        )
        steps = self.steps.start(begin.heading_rad)
        return StepTracker(steps, motion, level=begin.level, fixes=fixes)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KeyPointMap:
    """What `BeaconMatchedPdr` knows of a venue with n beacons.

    Attributes
    ----------
    zones : mapping of int to AisleZones
        By level.
    keys : mapping of int to ndarray of int64
        Rows of the beacons at key points, by level.
    threshold_dbm : ndarray of float64, (n,)
        Signal value at the edge of each beacon's zone. [dBm]
    places : BeaconPlaces
        Where somebody beside each beacon is.
    """

    zones: Mapping[int, AisleZones]
    keys: Mapping[int, NDArray[np.int64]]
    threshold_dbm: NDArray[np.float64]
    places: BeaconPlaces


def key_beacons(
    zones: AisleZones, places: BeaconPlaces, level: int, key_m: float
) -> NDArray[np.int64]:
    """Rows of the beacons of a level that are the nearest to a junction, within a distance. [m]."""
    here = np.flatnonzero(places.level == level)
    if not len(here):
        return here
    apart_m = np.hypot(
        places.x_m[here] - zones.junction_xy_m[:, :1], places.y_m[here] - zones.junction_xy_m[:, 1:]
    )
    nearest = np.argmin(apart_m, axis=1)
    near_enough = apart_m[np.arange(len(nearest)), nearest] <= key_m
    return np.unique(here[nearest[near_enough]])


class MatchedReckoning:
    """The matched position of one walker; see `blesim.estimators.step_track.Motion`.

    Parameters
    ----------
    settings : BeaconMatchedPdr
        Zones and errors.
    zones : AisleZones
        Of the level.
    places : BeaconPlaces
        Where somebody beside each beacon is.
    start : StartInfo
        Where the walk begins.
    """

    def __init__(
        self,
        settings: BeaconMatchedPdr,
        zones: AisleZones,
        places: BeaconPlaces,
        start: StartInfo,
    ) -> None:
        self._zones = zones
        self._places = places
        self._every_fix = settings.every_fix
        self._reach_m = settings.reach_m
        self._errors = {
            spread_m: StepErrors(
                start_m=spread_m,
                scale=settings.length_scale,
                heading_bias_rad=math.radians(settings.heading_bias_deg),
            )
            for spread_m in (settings.start_m, settings.zone_m / 2, settings.junction_m / 2)
        }
        self._fix_m, self._entry_m = settings.zone_m / 2, settings.junction_m / 2
        self._last_beacon = -1
        self._linear = True
        self._state: State = (start.x_m, start.y_m, 0.0, 0.0, 0.0)
        self._place(start.x_m, start.y_m, settings.start_m)

    @property
    def state(self) -> State:
        """Position and its covariance."""
        return self._state

    def step(self, length_m: float, heading_rad: float, turning: bool) -> None:
        """Take a step, along the aisle if it is straight and in a linear zone."""
        if self._linear and not turning:
            heading_rad = self._along_rad(heading_rad)
        self._state = reckoned(self._reckoning, length_m, heading_rad)
        was_linear, self._linear = self._linear, self._linear_here()
        if self._linear and not was_linear:
            entry_m = self._zones.entry_m(*self._state[:2], self._reach_m)
            if entry_m is not None:
                self._place(*entry_m, self._entry_m)
                # On the very border, the entry is of the zone that was entered.
                self._linear = True

    def _along_rad(self, heading_rad: float) -> float:
        """Direction of the aisle, or the measured heading where there is none. [rad]."""
        way_rad = self._zones.way_rad(
            *self._state[:2],
            heading_rad,
            reach_m=self._reach_m,
            agree_rad=math.pi / 2,
            beside=True,
        )
        return heading_rad if math.isnan(way_rad) else way_rad

    def _linear_here(self) -> bool:
        return self._zones.linear_at(*self._state[:2], self._reach_m)

    def fix(self, beacon: int) -> None:
        """Go to the place beside a beacon."""
        if self._every_fix or beacon != self._last_beacon:
            x_m, y_m = float(self._places.x_m[beacon]), float(self._places.y_m[beacon])
            self._place(x_m, y_m, self._fix_m)
        self._last_beacon = beacon

    def _place(self, x_m: float, y_m: float, spread_m: float) -> None:
        self._reckoning = DeadReckoning(x_m=x_m, y_m=y_m, errors=self._errors[spread_m])
        self._state = (x_m, y_m, spread_m**2, spread_m**2, 0.0)
        self._linear = self._linear_here()
