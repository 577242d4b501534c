"""The particle filter on beacon proximity and a floor map.

References
----------
.. [1] Particle filter on beacon proximity and a floor map; digest "proximity-particle-filter".
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, Self, get_args

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim.estimators.base import Need, StartInfo, fitted
from blesim.estimators.clocked_tracker import ClockedTracker
from blesim.estimators.floors import Floors
from blesim.estimators.kept_likelihoods import KeptLikelihoods
from blesim.estimators.refusals import not_fitted, refuse_other
from blesim.estimators.walked_steps import StepReading, step_need
from blesim.filters.plan_motion import PlanMotion
from blesim.ranging.proximity import (
    Proximity,
    ProximityRule,
    ProximityWindow,
    announced_power_dbm,
    surveyed_classes,
)
from blesim.ranging.proximity_likelihood import (
    PUBLISHED_NEAR,
    ProximityLikelihood,
    distance_shares,
    fit_proximity_likelihood,
)
from blesim.ranging.survey_readings import survey_readings
from blesim.recording import Recording
from blesim.tables import Readings
from blesim.venue.line_of_sight import TOUCH_M, LineOfSight
from blesim.venue.venue import Venue

Array = NDArray[np.float64]
Likelihood = Literal["published", "learned"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProximityParticleFilter(KeptLikelihoods):
    """Proximity particle filter [1]_: an estimate every t_s, of beacons Near, steps and the map.

    ``dw_b`` is the sum over the beacons reported Near of ``P(d_ij)`` (Eq 5 to 8), 0 for a beacon
    behind a wall or an obstacle as seen from the particle. Without the map (``use_map=False``) it
    is the paper's algorithm C. See `blesim.estimators.kept_likelihoods` for the filter.

    The covariance is that of the particles, weighted by likelihood as the estimate is. Likelihoods
    are sums, not probabilities, and are resampled by every t_s: it says how the cloud is spread,
    not how far it may be off.

    Parameters
    ----------
    use_map, particles, interval_s, step_m, step_spread_m, heading_spread_deg, spread, penalty
        See `KeptLikelihoods`, as `source`, `system_heading`, `window_s`, `phone_height_m`.
    likelihood : {"published", "learned"}
        P(d) of Eq 5, or a line learned from the survey in the same way.
    clipped : bool
        Whether P(d) keeps to 0 .. 1; the printed line does not, see `ProximityLikelihood`.
    immediate_counts : bool
        Whether a beacon reported Immediate counts as one reported Near. In Eq 7 it does not; with
        the paper's beacons on floor or ceiling it never occurs.
    believe_phone : bool
        Take the class that the phone tells, where it tells one; else it is made of RSSI.
    exponent : float
        Path loss exponent of classes made of RSSI, beside the power announced; assumed. [-]
    near_m : float
        Up to which range a beacon is Near. [m]

    Raises
    ------
    UsageError
        If a parameter is out of its range.

    References
    ----------
    .. [1] Digest "proximity-particle-filter".
    """

    likelihood: Likelihood = "published"
    clipped: bool = True
    immediate_counts: bool = False
    believe_phone: bool = True
    exponent: float = 2.0
    near_m: float = 3.0
    learned: "Surroundings | None" = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        KeptLikelihoods.__post_init__(self)
        _ = self.rule
        refuse_other("likelihood", self.likelihood, get_args(Likelihood))

    @property
    def needs(self) -> frozenset[Need]:
        """Step events or the IMU; a survey if P(d) is learned."""
        survey = {Need.SURVEY} if self.likelihood == "learned" else set()
        return frozenset({step_need(self.source)}) | survey

    @property
    def rule(self) -> ProximityRule:
        """How RSSI is made a class."""
        return ProximityRule(
            immediate_m=min(1.0, self.near_m),
            near_m=self.near_m,
            exponent=self.exponent,
            window_s=self.window_s,
            believe_phone=self.believe_phone,
        )

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that knows the venue, and P(d) if it is to be learned.

        Raises
        ------
        DataError
            If P(d) is to be learned, and the survey does not show the class getting rarer with
            distance.
        """
        learned = Surroundings(
            floors=Floors.of(venue, use_map=self.use_map),
            power_dbm=announced_power_dbm(venue),
            beacon_xyz_m=venue.beacon_xyz_m,
            near=self._near(venue, surveys),
            views=_views(venue) if self.use_map else {},
            steps=self.steps(venue, surveys),
        )
        return fitted(self, learned=learned)

    def _near(self, venue: Venue, surveys: Sequence[Recording]) -> ProximityLikelihood:
        if self.likelihood == "published":
            line = PUBLISHED_NEAR
            return ProximityLikelihood(
                intercept=line.intercept, slope_per_m=line.slope_per_m, clipped=self.clipped
            )
        survey = survey_readings(surveys)
        classes = surveyed_classes(survey, announced_power_dbm(venue), self.rule)
        shares = distance_shares(survey.horizontal_distance_m(venue), self.counts(classes))
        return fit_proximity_likelihood(shares, clipped=self.clipped)

    def counts(self, classes: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Which classes, of any shape, are those of a beacon that counts."""
        near: NDArray[np.bool_] = classes == Proximity.NEAR
        return near | (classes == Proximity.IMMEDIATE) if self.immediate_counts else near

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> ClockedTracker:  # noqa: ARG002 (begins anywhere)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.learned is None:
            raise not_fitted("proximity-pf")
        sense = ProximitySense(self, self.learned)
        return ClockedTracker(self, self.learned.floors, self.learned.steps.start(), sense, rng)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surroundings:
    """What the filter knows of a venue.

    Attributes
    ----------
    floors : Floors
        Where one may walk.
    power_dbm : ndarray of float64, (beacons,)
        RSSI at one metre as announced. [dBm]
    beacon_xyz_m : ndarray of float64, (beacons, 3)
        [m]
    near : ProximityLikelihood
        P(d).
    views : dict of int to View
        What stands between particles and beacons, by level; empty without the map.
    steps : StepReading
        How steps are read.
    """

    floors: Floors
    power_dbm: Array
    beacon_xyz_m: Array
    near: ProximityLikelihood
    views: "dict[int, View]"
    steps: StepReading


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """What hides beacons from places on one level.

    Attributes
    ----------
    obstacles : LineOfSight
        In space: a shelf lower than phone and beacon hides nothing.
    bounds : PlanMotion or None
        Of the level, beyond which is wall; none where they are convex and hide nothing.
    """

    obstacles: LineOfSight
    bounds: PlanMotion | None

    def hidden(self, x_m: Array, y_m: Array, z_m: float, beacon_m: Array) -> NDArray[np.bool_]:
        """Whether a beacon at (3,) is behind a wall or obstacle, seen from places (n,). [m]."""
        eyes_m = np.stack([x_m, y_m, np.full_like(x_m, z_m)], axis=1)
        target_m = np.broadcast_to(beacon_m, eyes_m.shape).copy()
        through_m = self.obstacles.lengths_m(eyes_m, target_m).sum(axis=1)
        hidden: NDArray[np.bool_] = through_m > TOUCH_M
        if self.bounds is not None:
            hidden |= self.bounds.blocked(x_m, y_m, target_m[:, 0].copy(), target_m[:, 1].copy())
        return hidden


def _views(venue: Venue) -> dict[int, View]:
    """View of each level."""
    plan = venue.floor_plan
    return {
        level.level: View(
            obstacles=LineOfSight.through([o for o in plan.obstacles if o.level == level.level]),
            bounds=None if _convex(level.bounds) else PlanMotion.on(level.bounds),
        )
        for level in plan.levels
    }


def _convex(outline: shapely.Polygon) -> bool:
    return bool(outline.convex_hull.area - outline.area <= 1e-9 * outline.area)


class ProximitySense:
    """The live dw_b of one phone."""

    def __init__(self, settings: ProximityParticleFilter, learned: Surroundings) -> None:
        self._settings, self._learned = settings, learned
        self._window = ProximityWindow(learned.power_dbm, settings.rule)

    def feed(self, readings: Readings) -> None:
        """Take the next readings."""
        self._window.classes(readings)

    def increments(self, now_us: int, level: int, x_m: Array, y_m: Array) -> Array:
        """Sum over the level's beacons that count of P(d) to places (n,), Eq 8. [-]."""
        counts = self._settings.counts(self._window.at(now_us))
        here = self._learned.floors.beacon_level == level
        total = np.zeros(len(x_m))
        for beacon in np.flatnonzero(counts & here).tolist():
            total += self._of_beacon(beacon, level, x_m, y_m)
        return total

    def _of_beacon(self, beacon: int, level: int, x_m: Array, y_m: Array) -> Array:
        """P(d) of one beacon that counts, 0 where it is hidden, (n,): Eq 5 to 7. [-]."""
        place_m = self._learned.beacon_xyz_m[beacon]
        share = self._learned.near.share(np.hypot(x_m - place_m[0], y_m - place_m[1]))
        view = self._learned.views.get(level)
        asked = np.flatnonzero(share)
        if view is not None and len(asked):
            height_m = self._settings.phone_height_m
            hidden = view.hidden(x_m[asked], y_m[asked], height_m, place_m)
            share[asked[hidden]] = 0.0
        return share
