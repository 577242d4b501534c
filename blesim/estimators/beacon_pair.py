"""The beacon-pair method: the user is between the two strongest beacons of an aisle.

References
----------
.. [1] The aisle-graph particle filter in a wholesale store, 2016;
   digest "aisle-graph-particle-filter".
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self, get_args

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
from blesim.estimators.graph_tunings import refuse_outside, refuse_unknown
from blesim.estimators.graph_updates import OFF_CENTRE_M2
from blesim.estimators.nearest_beacon import BeaconPlaces, beacon_places
from blesim.kernels import kernel
from blesim.ranging.path_loss_fit import AISLE_GRAPH
from blesim.ranging.smoothing import SignalKind, SignalWindow, refuse_bad_window
from blesim.recording import Observations, Recording
from blesim.tables import Readings, Track
from blesim.units import to_us
from blesim.venue.venue import Venue

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# Rows of signal values held at a time.
_CHUNK = 4096
# What a smoothed place consists of: x, y, variances, covariance. [m], [m2]
_COLUMNS = 5
NEVER_US = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class BeaconPair:
    """Beacon pair of the aisle-graph paper: after every reading, a place between two beacons.

    The two are the strongest beacon and the next strongest on the same branch. The place divides
    the way between the places beside them as their ranges do (Eq 5, 6), and is smoothed. Of
    several beacons equally strong each is taken in turn, and the places are averaged. Open in the
    paper, and assumed: without a second beacon on the branch the place is that beside the first;
    of seconds equally strong the nearest is taken; smoothing begins anew on another level and
    after a silence as long as the window.

    Anywhere between the two beacons is equally likely, L^2 / 12 along the way, half a metre off
    it; beside a single beacon, as for the nearest beacon. Smoothing averages the covariances:
    an upper bound, as successive estimates share most of their readings.

    Parameters
    ----------
    signal : {"highest", "averaged"}
        Signal value of a beacon over the window, Eq 4 or Eq 3 of the paper.
    window_s : float
        Length of the window, table 1. [s]
    rate : float
        Weight of a new reading in the average, alpha of table 1. [-]
    output_rate : float
        Weight of a new place in the estimate, alpha_p of table 1; 1 does not smooth. [-]
    curve : {"paper", "survey"}
        s_0 as each beacon announces it and n as below, or both fitted on the survey.
    exponent : float
        n of the paper's curve. [-]
    phone_height_m : float
        Above the floor in the survey. [m]

    Raises
    ------
    UsageError
        If a parameter is out of its range.
    """

    signal: SignalKind = "averaged"
    window_s: float = 3.0
    rate: float = 0.75
    output_rate: float = 0.5
    curve: CurveKind = "paper"
    exponent: float = float(AISLE_GRAPH.same.exponent)
    phone_height_m: float = 1.0
    known: GraphMap | None = field(default=None, init=False, repr=False, compare=False)
    places: BeaconPlaces | None = field(default=None, init=False, repr=False, compare=False)
    curves: BranchCurves | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        refuse_bad_window(self.signal, self.window_s, self.rate)
        refuse_outside("output_rate", self.output_rate, 1e-6, 1.0)
        refuse_unknown("curve", self.curve, get_args(CurveKind))
        refuse_outside("exponent", self.exponent, 0.1, 10.0)
        refuse_outside("phone_height_m", self.phone_height_m, 0.0, 10.0)

    @property
    def needs(self) -> frozenset[Need]:
        """The aisle graph; a survey only for the curve fitted on it."""
        return frozenset({Need.GRAPH} | ({Need.SURVEY} if self.curve == "survey" else set()))

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that knows the map, and with ``curve="survey"`` its path loss.

        Raises
        ------
        UsageError
            If the venue has no aisle graph.
        DataError
            If the survey does not make a curve.
        """
        known, exponents = graph_map(venue), (self.exponent, self.exponent)
        curves = branch_curves(venue, surveys, self.curve, exponents, self.phone_height_m)
        return fitted(self, known=known, places=beacon_places(venue), curves=curves)

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> "BeaconPairTracker":  # noqa: ARG002 (needs neither)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.known is None or self.places is None or self.curves is None:
            raise UsageError("beacon-pair does not know the venue yet; call fit first")
        return BeaconPairTracker(self, self.known, self.places, self.curves)


class BeaconPairTracker:
    """Tracker of `BeaconPair`: one estimate after every reading."""

    def __init__(
        self, settings: BeaconPair, known: GraphMap, places: BeaconPlaces, curves: BranchCurves
    ) -> None:
        self._settings, self._known, self._curves = settings, known, curves
        self._beside = np.stack(
            [places.x_m, places.y_m, places.variance_x_m2, places.variance_y_m2], axis=1
        )
        self._window = SignalWindow(
            beacons=len(places.x_m),
            signal=settings.signal,
            window_s=settings.window_s,
            rate=settings.rate,
        )
        self._smoothed = np.full(_COLUMNS, np.nan)
        # Time and level of the last estimate.
        self._last = np.array([NEVER_US, 0])

    def advance(self, block: Observations) -> Track:
        """Estimates after each reading of the block."""
        readings = block.readings
        places, level = np.empty((len(readings), _COLUMNS)), np.empty(len(readings), np.int64)
        for first in range(0, len(readings), _CHUNK):
            part = slice(first, first + _CHUNK)
            self._fill(readings.rows(part), places[part], level[part])
        x_m, y_m, variance_x_m2, variance_y_m2, covariance_xy_m2 = places.T
        edge, offset_m = self._known.lines.nearest(x_m.copy(), y_m.copy(), level)
        return make_track(
            time_us=readings.time_us,
            x_m=x_m,
            y_m=y_m,
            variance_x_m2=variance_x_m2,
            variance_y_m2=variance_y_m2,
            covariance_xy_m2=covariance_xy_m2,
            level=level,
            edge=edge,
            offset_m=offset_m,
        )

    def _fill(self, readings: Readings, places: Array, level: Rows) -> None:
        """Fill smoothed places (n, 5) and levels (n,)."""
        _fill_places(
            readings.time_us.astype(np.int64),
            self._window.signals(readings),
            self._beside,
            self._known.beacon_branch,
            self._known.beacon_level,
            self._curves.level_dbm,
            float(self._curves.exponents[0]),
            self._settings.output_rate,
            to_us(self._settings.window_s),
            self._last,
            self._smoothed,
            places,
            level,
        )


@kernel
def _fill_places(
    time_us: Rows,
    signals: Array,
    beside: Array,
    branch: Rows,
    beacon_level: Rows,
    level_dbm: Array,
    exponent: float,
    output_rate: float,
    silence_us: int,
    last: Rows,
    smoothed: Array,
    places: Array,
    level: Rows,
) -> None:
    """Fill the smoothed place and the level after each reading (kernel).

    Signals are (n, beacons), NaN where not heard; what is beside the beacons is (beacons, 4): x,
    y and variances. `last` and `smoothed` go from block to block.
    """
    place = np.empty(_COLUMNS)
    for row in range(len(time_us)):
        here = _place(signals[row], beside, branch, beacon_level, level_dbm, exponent, place)
        anew = time_us[row] - last[0] > silence_us or here != last[1]
        if last[0] == NEVER_US or anew:
            smoothed[:] = place
        else:
            for column in range(_COLUMNS):
                old = smoothed[column]
                smoothed[column] = output_rate * place[column] + (1.0 - output_rate) * old
        last[0], last[1] = time_us[row], here
        places[row], level[row] = smoothed, here


@kernel
def _place(
    signal_dbm: Array,
    beside: Array,
    branch: Rows,
    beacon_level: Rows,
    level_dbm: Array,
    exponent: float,
    place: Array,
) -> int:
    """Level of the strongest beacon; fills the place of one moment, not smoothed (kernel).

    Ties with beacons on other levels than the first of the strongest do not count.
    """
    strongest = -1
    for b in range(len(signal_dbm)):
        heard = not np.isnan(signal_dbm[b])
        if heard and (strongest < 0 or signal_dbm[b] > signal_dbm[strongest]):
            strongest = b
    ties, xx, yy, xy = 0, 0.0, 0.0, 0.0
    place[:] = 0.0
    pair = np.empty(_COLUMNS)
    for b in range(len(signal_dbm)):
        tied = signal_dbm[b] == signal_dbm[strongest]
        if tied and beacon_level[b] == beacon_level[strongest]:
            _fill_pair(b, signal_dbm, beside, branch, level_dbm, exponent, pair)
            ties += 1
            place += pair
            xx += pair[0] * pair[0]
            yy += pair[1] * pair[1]
            xy += pair[0] * pair[1]
    place /= ties
    if ties > 1:
        # The covariance of a mixture has the scatter of its parts.
        place[2] += max(xx / ties - place[0] * place[0], 0.0)
        place[3] += max(yy / ties - place[1] * place[1], 0.0)
        place[4] += xy / ties - place[0] * place[1]
    return int(beacon_level[strongest])


@kernel
def _fill_pair(
    first: int,
    signal_dbm: Array,
    beside: Array,
    branch: Rows,
    level_dbm: Array,
    exponent: float,
    pair: Array,
) -> None:
    """Fill place and covariance of a beacon and the next strongest on its branch (kernel)."""
    second = _second(first, signal_dbm, beside, branch)
    if second < 0:
        pair[:4], pair[4] = beside[first], 0.0
        return
    # Eq 5 and 6. The share needs the ratio of the ranges alone.
    loss_db = (level_dbm[second] - signal_dbm[second]) - (level_dbm[first] - signal_dbm[first])
    share = 1.0 / (1.0 + 10.0 ** (loss_db / (10.0 * exponent)))
    way_x_m, way_y_m = beside[second, 0] - beside[first, 0], beside[second, 1] - beside[first, 1]
    pair[0] = beside[first, 0] + share * way_x_m
    pair[1] = beside[first, 1] + share * way_y_m
    pair[2] = way_x_m * way_x_m / 12.0 + OFF_CENTRE_M2
    pair[3] = way_y_m * way_y_m / 12.0 + OFF_CENTRE_M2
    pair[4] = way_x_m * way_y_m / 12.0


@kernel
def _second(first: int, signal_dbm: Array, beside: Array, branch: Rows) -> int:
    """Next strongest beacon on the branch of the first, -1 if none is heard (kernel)."""
    best, best_m2 = -1, np.inf
    for b in range(len(signal_dbm)):
        if b == first or np.isnan(signal_dbm[b]) or branch[b] < 0 or branch[b] != branch[first]:
            continue
        east_m, north_m = beside[b, 0] - beside[first, 0], beside[b, 1] - beside[first, 1]
        apart_m2 = east_m * east_m + north_m * north_m
        stronger = best < 0 or signal_dbm[b] > signal_dbm[best]
        if stronger or (signal_dbm[b] == signal_dbm[best] and apart_m2 < best_m2):
            best, best_m2 = b, apart_m2
    return best
