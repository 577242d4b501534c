"""Lateration: the place that fits the ranges to the beacons heard best."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.estimators.base import Need, StartInfo, fitted, make_track
from blesim.estimators.believed_path_loss import PathLossBelief
from blesim.estimators.heard import SignalTracker, boxes_m, strongest
from blesim.estimators.refusals import not_fitted
from blesim.ranging.lateration import LaterationFix, Loss, Outcome, laterate
from blesim.ranging.path_loss_fit import PathLossFit
from blesim.ranging.smoothing import SignalKind, SignalWindow, refuse_bad_window
from blesim.recording import Recording
from blesim.tables import IntArray, Track
from blesim.venue.venue import Venue

_SHORTEST_SPREAD_M = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Lateration:
    """Lateration by weighted least squares: after every reading, from log-distance ranges.

    A beacon's range is that of its signal value on the path loss curve, in space, and never longer
    than the level is across; its weight is the inverse variance that the spread of the curve gives
    it. Beacons of the level of the strongest one count. The search begins at the last fix, and the
    fix is held inside the box around the level.

    The curves are fitted on the survey. Without one, the power that each beacon announces for one
    metre and `exponent` stand in.

    The covariance is that of the fit, see `blesim.ranging.lateration`: the inverse information of
    the ranges if they are as far off as their spreads say, independently.

    Parameters
    ----------
    curves : {"all", "beacon"}
        One curve for all beacons, or one for each.
    most : int
        Of the beacons heard, how many of the strongest are used at most; assumed.
    loss : {"linear", "soft_l1"}
        Least squares, or less weight for ranges far off.
    signal : {"averaged", "highest"}
        Signal value of a beacon over the window.
    window_s : float
        Length of the window; assumed. [s]
    rate : float
        Weight of a new reading in the average. [-]
    exponent, spread_db : float
        Path loss exponent and spread about the curve without a survey; assumed. [-], [dB]
    phone_height_m : float
        Above the floor; assumed. [m]

    Raises
    ------
    UsageError
        If a parameter is out of its range.
    """

    curves: Literal["all", "beacon"] = "beacon"
    most: int = 8
    loss: Loss = "linear"
    signal: SignalKind = "averaged"
    window_s: float = 3.0
    rate: float = 0.25
    exponent: float = 2.0
    spread_db: float = 6.0
    phone_height_m: float = 1.1
    ranging: "Ranging | None" = field(default=None, init=False, repr=False, compare=False)
    needs: ClassVar[frozenset[Need]] = frozenset()

    def __post_init__(self) -> None:
        refuse_bad_window(self.signal, self.window_s, self.rate)
        _ = self._belief
        if self.most < 1:
            raise UsageError(f"most {self.most}: give 1 or more beacons")
        if self.loss not in ("linear", "soft_l1"):
            raise UsageError(f"loss '{self.loss}': use linear or soft_l1")

    @property
    def _belief(self) -> PathLossBelief:
        return PathLossBelief(
            by=self.curves,
            exponent=self.exponent,
            spread_db=self.spread_db,
            phone_height_m=self.phone_height_m,
        )

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that knows the beacons and their path loss."""
        curves = self._belief.curves(venue, surveys)
        ranging = Ranging.of(venue, curves, self.phone_height_m, self.most, self.loss)
        return fitted(self, ranging=ranging)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> SignalTracker:  # noqa: ARG002 (needs neither)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.ranging is None:
            raise not_fitted("lateration")
        beacons = len(self.ranging.level)
        window = SignalWindow(
            beacons=beacons, signal=self.signal, window_s=self.window_s, rate=self.rate
        )
        return SignalTracker(window, np.ones(beacons, np.bool_), LiveLateration(self.ranging))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ranging:
    """Beacons of a venue with their path loss, and the boxes around the levels.

    Attributes
    ----------
    xyz_m : ndarray of float64, (beacons, 3)
        [m]
    level : ndarray of int64, (beacons,)
        Level of the venue.
    curves : PathLossFit
        Each field (beacons,).
    box_m : dict of int to ndarray of float64, (4,)
        West, south, east and north of each level. [m]
    phone_height_m : float
        Above the floor. [m]
    most : int
        How many of the strongest beacons are used.
    loss : {"linear", "soft_l1"}
        See `blesim.ranging.lateration.laterate`.
    """

    xyz_m: NDArray[np.float64]
    level: NDArray[np.int64]
    curves: PathLossFit
    box_m: dict[int, NDArray[np.float64]]
    phone_height_m: float
    most: int
    loss: Loss

    @classmethod
    def of(
        cls, venue: Venue, curves: PathLossFit, phone_height_m: float, most: int, loss: Loss
    ) -> Self:
        """Ranging in a venue, with the curves of its beacons, each field (beacons,)."""
        return cls(
            xyz_m=venue.beacon_xyz_m,
            level=venue.beacon_level.astype(np.int64),
            curves=curves,
            box_m=boxes_m(venue),
            phone_height_m=phone_height_m,
            most=most,
            loss=loss,
        )

    def used(self, signal_dbm: NDArray[np.float64], level: int) -> NDArray[np.int64]:
        """Rows of the strongest beacons of a level, strongest first; those that are heard."""
        here = np.flatnonzero(~np.isnan(signal_dbm) & (self.level == level))
        order = np.argsort(-signal_dbm[here], kind="stable")
        return here[order[: self.most]]

    def curve(self, rows: int | NDArray[np.int64]) -> PathLossFit:
        """Curve of one beacon, or of several."""
        level_dbm, exponent, spread_db = (
            np.asarray(column)[rows]
            for column in (self.curves.level_dbm, self.curves.exponent, self.curves.spread_db)
        )
        return PathLossFit(level_dbm=level_dbm, exponent=exponent, spread_db=spread_db)

    def fix(
        self, signal_dbm: NDArray[np.float64], level: int, last_xy_m: NDArray[np.float64] | None
    ) -> LaterationFix:
        """Fix of the signal values of all beacons, (beacons,), inside the level's box. [dBm]."""
        rows = self.used(signal_dbm, level)
        west, south, east, north = self.box_m[level].tolist()
        curves = self.curve(rows)
        across_m = np.hypot(east - west, north - south)
        range_m = np.minimum(curves.distance_m(signal_dbm[rows]), across_m)
        found = laterate(
            self.xyz_m[rows],
            range_m,
            phone_height_m=self.phone_height_m,
            spread_m=np.maximum(curves.distance_spread_m(range_m), _SHORTEST_SPREAD_M),
            start_xy_m=last_xy_m,
            loss=self.loss,
        )
        if found.outcome == Outcome.NOTHING:
            return found
        x_m, y_m = min(max(found.x_m, west), east), min(max(found.y_m, south), north)
        return replace(found, x_m=x_m, y_m=y_m)


class LiveLateration:
    """The live lateration of one phone: each search begins where the last one ended."""

    def __init__(self, ranging: Ranging) -> None:
        self._ranging = ranging
        self._last_xy_m: NDArray[np.float64] | None = None
        self._level: int | None = None

    def fix(self, signal_dbm: NDArray[np.float64], level: int) -> LaterationFix:
        """Fix on a level of the signal values of all beacons, (beacons,). [dBm]."""
        if level != self._level:
            self._level, self._last_xy_m = level, None
        found = self._ranging.fix(signal_dbm, level, self._last_xy_m)
        if found.outcome != Outcome.NOTHING:
            self._last_xy_m = np.array([found.x_m, found.y_m])
        return found

    def track(self, time_us: IntArray, signal_dbm: NDArray[np.float64]) -> Track:
        """Fixes of signal values (n, beacons) at times (n,). [us], [dBm]."""
        level = [int(self._ranging.level[strongest(row)]) for row in signal_dbm]
        fixes = [self.fix(row, each) for row, each in zip(signal_dbm, level, strict=True)]
        covariance_m2 = np.array([fix.covariance_m2 for fix in fixes]).reshape(-1, 2, 2)
        return make_track(
            time_us=time_us,
            x_m=[fix.x_m for fix in fixes],
            y_m=[fix.y_m for fix in fixes],
            level=level,
            variance_x_m2=covariance_m2[:, 0, 0],
            variance_y_m2=covariance_m2[:, 1, 1],
            covariance_xy_m2=covariance_m2[:, 0, 1],
        )
