"""The unscented Kalman filter on RSSI, with a walker of constant velocity.

References
----------
.. [1] E. A. Wan, R. van der Merwe, "The unscented Kalman filter for nonlinear estimation",
   AS-SPCC 2000. doi:10.1109/ASSPCC.2000.882463
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from blesim.estimators.base import Need, StartInfo, fitted
from blesim.estimators.believed_path_loss import PathLossBelief
from blesim.estimators.constant_velocity import moved
from blesim.estimators.heard import chunks, known_readings, moments_track, strongest
from blesim.estimators.lateration import Ranging
from blesim.estimators.refusals import not_fitted, refuse_outside
from blesim.filters import unscented
from blesim.filters.gating import JointGate
from blesim.filters.unscented import Scaling
from blesim.ranging.lateration import Outcome
from blesim.ranging.smoothing import SignalWindow
from blesim.recording import Observations, Recording
from blesim.tables import Readings, Track
from blesim.units import to_us
from blesim.venue.venue import Venue

Array = NDArray[np.float64]
_MOST = 8
_NEVER_US = -(2**60)


@dataclass(frozen=True, slots=True, kw_only=True)
class UnscentedKalman:
    """Unscented Kalman filter [1]_ on RSSI: after every reading, the position of [x y vx vy].

    Between readings the walker keeps a constant velocity, as in
    `blesim.estimators.constant_velocity`; each reading is measured in dBm on the beacon's path loss
    curve, with the curve's spread. Begins with laterations, see `blesim.estimators.lateration`,
    until three beacons are in the window or it is full, and anew after a long silence or on another
    level. The position is held inside the box around the level.

    The curves are fitted on the survey. Without one, the power that each beacon announces for one
    metre, `exponent` and `spread_db` stand in.

    The covariance is the filter's own.

    Parameters
    ----------
    velocity_change_m_s : float
        Standard deviation of the change of either velocity in a second; assumed. [m/s]
    speed_m_s : float
        Standard deviation of the first velocity, in x and in y; assumed. [m/s]
    trust : float
        The variance of a reading is that of the curve divided by it, for readings that are not
        independent: those of one beacon within a metre share their shadowing; assumed. [-]
    confidence : float
        Share of true readings that pass the gate; 1 lets all pass; assumed. [-]
    alpha : float
        Spread of the sigma points, as in `blesim.filters.unscented.Scaling`. 1 puts them two
        standard deviations off: of an unsure belief, where the curves are flat on all sides and a
        reading tells nothing. [-]
    silence_s : float
        After which the filter begins anew; assumed. [s]
    window_s : float
        Window of the laterations, and of the strongest beacon, which tells the level; assumed. [s]
    curves : {"all", "beacon"}
        One path loss curve for all beacons, or one for each.
    exponent, spread_db : float
        Path loss exponent and spread about the curve without a survey; assumed. [-], [dB]
    phone_height_m : float
        Above the floor; assumed. [m]

    Raises
    ------
    UsageError
        If a parameter is out of its range.

    References
    ----------
    .. [1] doi:10.1109/ASSPCC.2000.882463
    """

    velocity_change_m_s: float = 0.3
    speed_m_s: float = 1.0
    trust: float = 0.3
    confidence: float = 0.999
    alpha: float = 0.1
    silence_s: float = 10.0
    window_s: float = 3.0
    curves: Literal["all", "beacon"] = "beacon"
    exponent: float = 2.0
    spread_db: float = 6.0
    phone_height_m: float = 1.1
    learned: "Ranging | None" = field(default=None, init=False, repr=False, compare=False)
    needs: ClassVar[frozenset[Need]] = frozenset()

    def __post_init__(self) -> None:
        _ = self._belief
        refuse_outside(
            velocity_change_m_s=(self.velocity_change_m_s, 0, 100),
            speed_m_s=(self.speed_m_s, 0, 100),
            trust=(self.trust, 0.001, 1),
            confidence=(self.confidence, 0.5, 1),
            alpha=(self.alpha, 1e-3, 1),
            silence_s=(self.silence_s, 0.01, 1000),
            window_s=(self.window_s, 0.01, 3600),
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
        """Copy that knows the beacons and their path loss."""
        curves = self._belief.curves(venue, surveys)
        learned = Ranging.of(venue, curves, self.phone_height_m, _MOST, "linear")
        return fitted(self, learned=learned)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> "UnscentedTracker":  # noqa: ARG002 (needs neither)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.learned is None:
            raise not_fitted("ukf")
        return UnscentedTracker(self, self.learned)


class UnscentedTracker:
    """Tracker of `UnscentedKalman`: one estimate after every reading."""

    def __init__(self, settings: UnscentedKalman, learned: Ranging) -> None:
        self._settings, self._learned = settings, learned
        self._known = np.ones(len(learned.level), np.bool_)
        self._window = SignalWindow(
            beacons=len(learned.level), signal="averaged", window_s=settings.window_s, rate=0.25
        )
        self._scaling = Scaling(alpha=settings.alpha)
        self._gate = JointGate(confidence=settings.confidence)
        self._silence_us = to_us(settings.silence_s)
        self._window_us = to_us(settings.window_s)
        self._time_us = self._begin_until_us = _NEVER_US
        self._level: int | None = None
        self._mean, self._covariance = np.zeros(4), np.eye(4)

    def advance(self, block: Observations) -> Track:
        """Estimates after each reading of the block."""
        parts = [self._track(part) for part in chunks(known_readings(block.readings, self._known))]
        return parts[0] if len(parts) == 1 else Track.concatenate(parts)

    def _track(self, readings: Readings) -> Track:
        signal_dbm = self._window.signals(readings)
        found = np.empty((len(readings), 5))
        level = np.empty(len(readings), np.int64)
        for row in range(len(readings)):
            level[row] = self._learned.level[strongest(signal_dbm[row])]
            self._hear(readings, row, int(level[row]), signal_dbm[row])
            (xx, xy), (_, yy) = self._covariance[:2, :2].tolist()
            found[row] = *self._mean[:2], xx, yy, xy
        return moments_track(readings.time_us, level, found)

    def _hear(self, readings: Readings, row: int, level: int, signal_dbm: Array) -> None:
        """Take one reading, after which the signal values are those given, (beacons,). [dBm]."""
        time_us, beacon = int(readings.time_us[row]), int(readings.beacon[row])
        elapsed_us, self._time_us = time_us - self._time_us, time_us
        if level != self._level or elapsed_us > self._silence_us:
            self._level, self._begin_until_us = level, time_us + self._window_us
        if time_us < self._begin_until_us:
            self._begin(level, signal_dbm)
            return
        self._mean, self._covariance = moved(
            self._mean, self._covariance, elapsed_us * 1e-6, self._settings.velocity_change_m_s
        )
        if self._learned.level[beacon] == level:
            self._measure(beacon, float(readings.rssi_dbm[row]))
        self._hold_inside()

    def _begin(self, level: int, signal_dbm: Array) -> None:
        """Begin at the fix of the signal values, (beacons,), which may not be the last. [dBm]."""
        fix = self._learned.fix(signal_dbm, level, None)
        self._mean = np.array([fix.x_m, fix.y_m, 0.0, 0.0])
        self._covariance = np.eye(4) * self._settings.speed_m_s**2
        # A place is never better known than to a metre or so from RSSI.
        self._covariance[:2, :2] = fix.covariance_m2 + np.eye(2)
        if fix.outcome in (Outcome.DETERMINED, Outcome.MIRRORED):
            self._begin_until_us = _NEVER_US

    def _measure(self, beacon: int, rssi_dbm: float) -> None:
        curve, beacon_m = self._learned.curve(beacon), self._learned.xyz_m[beacon]
        up_m = beacon_m[2] - self._settings.phone_height_m

        def expected_dbm(states: Array) -> Array:
            right_m, ahead_m = states[:, 0] - beacon_m[0], states[:, 1] - beacon_m[1]
            return curve.rssi_dbm(np.sqrt(right_m**2 + ahead_m**2 + up_m**2))[:, None]

        variance_db2 = float(curve.spread_db) ** 2 / self._settings.trust
        update = unscented.update(
            self._mean,
            self._covariance,
            np.array([rssi_dbm]),
            expected_dbm,
            np.array([[variance_db2]]),
            self._scaling,
        )
        if self._gate.passes(update.innovation, update.innovation_covariance):
            self._mean, self._covariance = update.mean, update.covariance

    def _hold_inside(self) -> None:
        """Stop at the box of the level."""
        if self._level is None:
            return
        west, south, east, north = self._learned.box_m[self._level].tolist()
        for axis, low, high in ((0, west, east), (1, south, north)):
            if not low <= self._mean[axis] <= high:
                self._mean[axis] = min(max(self._mean[axis], low), high)
                self._mean[axis + 2] = 0.0
