"""The particle filter on RSSI trilateration that the proximity paper compares itself with.

References
----------
.. [1] Particle filter on beacon proximity and a floor map; digest "proximity-particle-filter".
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from blesim.estimators.base import StartInfo, fitted
from blesim.estimators.believed_path_loss import PathLossBelief
from blesim.estimators.clocked_tracker import ClockedTracker
from blesim.estimators.floors import Floors
from blesim.estimators.kept_likelihoods import KeptLikelihoods
from blesim.estimators.lateration import LiveLateration, Ranging
from blesim.estimators.refusals import not_fitted, refuse_outside
from blesim.estimators.walked_steps import StepReading
from blesim.ranging.lateration import LaterationFix, Outcome
from blesim.ranging.smoothing import SignalWindow
from blesim.recording import Recording
from blesim.tables import Readings
from blesim.venue.venue import Venue

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrilaterationParticleFilter(KeptLikelihoods):
    """Trilateration particle filter [1]_: an estimate every t_s, of RSSI fixes, steps and the map.

    Algorithm A of the paper, and B without the map (``use_map=False``). Every t_s a position is
    laterated from the RSSI of the window, see `blesim.estimators.lateration`. The paper does not
    say how particles are weighed by it; assumed, in [0, 1] as P(d) is: ``dw_b = exp(-q / 2)`` with
    ``q = (p_i - p)' C^-1 (p_i - p)`` of the fix p. See `blesim.estimators.kept_likelihoods` for the
    filter.

    The path loss is fitted on the survey. Without one, the power that each beacon announces for one
    metre and `exponent` stand in.

    The covariance is that of the particles, weighted by likelihood as the estimate is. Likelihoods
    are sums, not probabilities, and are resampled by every t_s: it says how the cloud is spread,
    not how far it may be off.

    Parameters
    ----------
    use_map, particles, interval_s, step_m, step_spread_m, heading_spread_deg, spread, penalty
        See `KeptLikelihoods`, as `source`, `system_heading`, `window_s`, `phone_height_m`.
    fix_spread_m : float or None
        Standard deviation of a fix in x and in y, for C; none for the covariance of the fit;
        assumed. [m]
    curves : {"all", "beacon"}
        One path loss curve for all beacons, or one for each; assumed.
    most : int
        Of the beacons heard, how many of the strongest are used at most; assumed.
    rate : float
        Weight of a new reading in the averaged RSSI; assumed. [-]
    exponent, spread_db : float
        Path loss exponent and spread about the curve without a survey; assumed. [-], [dB]

    Raises
    ------
    UsageError
        If a parameter is out of its range.

    References
    ----------
    .. [1] Digest "proximity-particle-filter".
    """

    fix_spread_m: float | None = None
    curves: Literal["all", "beacon"] = "beacon"
    most: int = 8
    rate: float = 0.25
    exponent: float = 2.0
    spread_db: float = 6.0
    learned: "FixesAndFloors | None" = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        KeptLikelihoods.__post_init__(self)
        _ = self._belief
        refuse_outside(
            fix_spread_m=(self.fix_spread_m or 1.0, 0.01, 1000),
            most=(self.most, 1, 1_000_000),
            rate=(self.rate, 1e-6, 1),
        )

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
        curves = self._belief.curves(venue, surveys)
        learned = FixesAndFloors(
            floors=Floors.of(venue, use_map=self.use_map),
            ranging=Ranging.of(venue, curves, self.phone_height_m, self.most, "linear"),
            steps=self.steps(venue, surveys),
        )
        return fitted(self, learned=learned)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> ClockedTracker:  # noqa: ARG002 (begins anywhere)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.learned is None:
            raise not_fitted("trilateration-pf")
        sense = FixSense(self, self.learned.ranging)
        return ClockedTracker(self, self.learned.floors, self.learned.steps.start(), sense, rng)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FixesAndFloors:
    """What the filter knows of a venue.

    Attributes
    ----------
    floors : Floors
        Where one may walk.
    ranging : Ranging
        Beacons and their path loss.
    steps : StepReading
        How steps are read.
    """

    floors: Floors
    ranging: Ranging
    steps: StepReading


class FixSense:
    """The live dw_b of one phone."""

    def __init__(self, settings: TrilaterationParticleFilter, ranging: Ranging) -> None:
        self._spread_m = settings.fix_spread_m
        self._lateration = LiveLateration(ranging)
        self._window = SignalWindow(
            beacons=len(ranging.level),
            signal="averaged",
            window_s=settings.window_s,
            rate=settings.rate,
        )

    def feed(self, readings: Readings) -> None:
        """Take the next readings."""
        self._window.signals(readings)

    def increments(self, now_us: int, level: int, x_m: Array, y_m: Array) -> Array:
        """``exp(-q / 2)`` of places (n,) about the fix; 0 where there is none. [-]."""
        fix = self._lateration.fix(self._window.at(now_us), level)
        if fix.outcome == Outcome.NOTHING:
            return np.zeros(len(x_m))
        right_m, up_m = x_m - fix.x_m, y_m - fix.y_m
        xx, xy, yy = self._information(fix)
        squared = xx * right_m**2 + 2.0 * xy * right_m * up_m + yy * up_m**2
        return np.asarray(np.exp(-0.5 * squared))

    def _information(self, fix: LaterationFix) -> tuple[float, float, float]:
        """Inverse covariance of a fix, xx, xy and yy. [1/m2]."""
        if self._spread_m is not None:
            return self._spread_m**-2.0, 0.0, self._spread_m**-2.0
        # A centimetre squared, so that it can be inverted whatever the fit says.
        (xx, xy), (_, yy) = (fix.covariance_m2 + 1e-4 * np.eye(2)).tolist()
        determinant = xx * yy - xy * xy
        return yy / determinant, -xy / determinant, xx / determinant
