"""The nearest-beacon method: the user is beside the beacon that is heard strongest."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim.columns import NO_EDGE
from blesim.errors import UsageError
from blesim.estimators.base import Need, StartInfo, fitted, make_track
from blesim.ranging.smoothing import SignalKind, SignalWindow, refuse_bad_window
from blesim.recording import Observations, Recording
from blesim.tables import IntArray, Track
from blesim.venue.graph import SAME_PLACE_M
from blesim.venue.venue import Venue


@dataclass(frozen=True, slots=True, kw_only=True)
class NearestBeacon:
    """Nearest beacon of the aisle-graph paper: after every reading, the place of the strongest.

    The place is the one on the aisle graph beside the beacon, or the beacon's own where the venue
    has no graph on that level. Of beacons equally strong, the one heard last is taken.

    Parameters
    ----------
    signal : {"highest", "averaged"}
        Signal value of a beacon over the window, Eq 4 or Eq 3 of the paper.
    window_s : float
        Length of the window. [s]
    rate : float
        Weight of a new reading in the average. [-]

    Raises
    ------
    UsageError
        If a parameter is out of its range.
    """

    signal: SignalKind = "highest"
    window_s: float = 3.0
    rate: float = 0.25
    places: "BeaconPlaces | None" = field(default=None, init=False, repr=False, compare=False)
    needs: ClassVar[frozenset[Need]] = frozenset()

    def __post_init__(self) -> None:
        refuse_bad_window(self.signal, self.window_s, self.rate)

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:  # noqa: ARG002 (learns nothing)
        """Copy that knows the places of the venue's beacons."""
        return fitted(self, places=beacon_places(venue))

    def start(self, start: StartInfo | None, rng: np.random.Generator) -> "NearestBeaconTracker":  # noqa: ARG002 (needs neither)
        """Tracker of one walk.

        Raises
        ------
        UsageError
            If the estimator was not fitted.
        """
        if self.places is None:
            raise UsageError("nearest-beacon does not know the venue yet; call fit first")
        window = SignalWindow(
            beacons=len(self.places.x_m),
            signal=self.signal,
            window_s=self.window_s,
            rate=self.rate,
        )
        return NearestBeaconTracker(self.places, window)


class NearestBeaconTracker:
    """Tracker of `NearestBeacon`: one estimate after every reading."""

    def __init__(self, places: "BeaconPlaces", window: SignalWindow) -> None:
        self._places = places
        self._window = window

    def advance(self, block: Observations) -> Track:
        """Estimates after each reading of the block."""
        strongest = self._window.strongest(block.readings)
        return self._places.track(block.readings.time_us, strongest)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BeaconPlaces:
    """Where somebody beside each of n beacons is, all arrays (n,). [m], [m2]."""

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    level: IntArray
    variance_x_m2: NDArray[np.float64]
    variance_y_m2: NDArray[np.float64]
    edge: IntArray
    offset_m: NDArray[np.float64]

    def track(self, time_us: IntArray, beacon: NDArray[np.int64]) -> Track:
        """Track that is beside the given beacon at each time; both (m,). [us]."""
        return make_track(
            time_us=time_us,
            x_m=self.x_m[beacon],
            y_m=self.y_m[beacon],
            level=self.level[beacon],
            variance_x_m2=self.variance_x_m2[beacon],
            variance_y_m2=self.variance_y_m2[beacon],
            edge=self.edge[beacon],
            offset_m=self.offset_m[beacon],
        )


def beacon_places(venue: Venue) -> BeaconPlaces:
    """Places beside the beacons of a venue.

    Somebody beside a beacon may be anywhere until half way to the next place, at distance d: taken
    as uniform over a square of side d, variance d^2 / 12 on either axis. Where a level has one
    place only, uniform over the bounding box of the level.
    """
    edge, offset_m = _on_graph(venue)
    xy_m = venue.beacon_xyz_m[:, :2].copy()
    if venue.graph is not None:
        on_graph = edge != NO_EDGE
        xy_m[on_graph] = venue.graph.xy_m(edge[on_graph], offset_m[on_graph])
    variance_m2 = _variances_m2(venue, xy_m)
    return BeaconPlaces(
        x_m=xy_m[:, 0],
        y_m=xy_m[:, 1],
        level=venue.beacon_level,
        variance_x_m2=variance_m2[:, 0],
        variance_y_m2=variance_m2[:, 1],
        edge=edge,
        offset_m=offset_m,
    )


def _on_graph(venue: Venue) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Edge and offset beside each beacon; no edge where its level has none."""
    edge = np.full(len(venue.beacons), NO_EDGE, np.int64)
    offset_m = np.full(len(venue.beacons), np.nan)
    if venue.graph is not None:
        known = np.isin(venue.beacon_level, venue.graph.level)
        x_m, y_m, _ = venue.beacon_xyz_m[known].T
        edge[known], offset_m[known], _ = venue.graph.nearest(x_m, y_m, venue.beacon_level[known])
    return edge, offset_m


def _variances_m2(venue: Venue, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Variances in x and y of somebody beside each beacon, (n, 2). [m2]."""
    sides_m = np.empty((len(xy_m), 2))
    for row, level in enumerate(venue.beacon_level):
        next_m = _next_place_m(xy_m[venue.beacon_level == level], xy_m[row])
        sides_m[row] = _box_m(venue, int(level)) if np.isinf(next_m) else next_m
    variances: NDArray[np.float64] = sides_m**2 / 12.0
    return variances


def _next_place_m(places_m: NDArray[np.float64], here_m: NDArray[np.float64]) -> float:
    """Distance to the next other place, infinite if there is none. [m]."""
    distance_m = np.hypot(*(places_m - here_m).T)
    return float(np.min(distance_m, where=distance_m > SAME_PLACE_M, initial=np.inf))


def _box_m(venue: Venue, level: int) -> NDArray[Any]:
    """Width and depth of a level's bounding box, (2,). [m]."""
    corners = shapely.bounds(venue.floor_plan.bounds(level, f"venue '{venue.name}'"))
    return np.asarray(corners[2:] - corners[:2])
