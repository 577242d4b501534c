"""Positions by fingerprints: one from all channels together, or one from each channel.

After [1]_: the surveyed points are the map, Gaussian-process regression fills the gaps between
them. How far a position is off is learned from the survey: each surveyed point is located among
the others.

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.estimators.base import Need
from blesim.estimators.constant_velocity import Belief
from blesim.ranging.channels import channel_slot
from blesim.ranging.gaussian_process import GaussianProcessFill, filled_radio_map
from blesim.ranging.nearest_fingerprints import NearestFingerprints, SearchEllipse
from blesim.ranging.radio_map import (
    MapLayout,
    RadioMap,
    channel_radio_maps,
    joined_radio_maps,
    radio_map,
)
from blesim.ranging.survey_readings import SurveyReadings
from blesim.venue.venue import Venue

Array = NDArray[np.float64]
# Where all channels are together.
_TOGETHER = 0
# Of a fingerprint alone on its level: uniform over a square of 10 m.
_LONE_VARIANCE_M2 = 10.0**2 / 12.0
# No fingerprint tells a place better than this, nor two their difference.
_LEAST_VARIANCE_M2 = 0.1**2
_LEAST_APART_DB = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class FingerprintSettings:
    """How fingerprints are gathered, filled and searched.

    Parameters
    ----------
    separate : bool
        A map for each channel, or one for all.
    k : int
        Nearest fingerprints, weighted by the inverse of their distance.
    search_scale : float or None
        Semi-axes of the search ellipse in standard deviations; none to search everywhere. [-]
    cell_m : float or None
        Side of the cells that readings are gathered in; none for the spots the tester stood at. [m]
    grid_m : float or None
        Spacing of the places that gaps are filled at; none for no filling. [m]

    Raises
    ------
    UsageError
        If a value is out of its range.
    """

    separate: bool
    k: int
    search_scale: float | None
    cell_m: float | None
    grid_m: float | None

    def __post_init__(self) -> None:
        MapLayout(cell_m=self.cell_m)
        if self.k < 1:
            raise UsageError(f"k {self.k}: give 1 or more")
        if self.search_scale is not None and not 0 < self.search_scale <= 1000:
            raise UsageError(f"search_scale {self.search_scale:g}: give over 0 to 1000, or none")
        if self.grid_m is not None and not 0.1 <= self.grid_m <= 100:
            raise UsageError(f"grid_m {self.grid_m:g}: give 0.1 to 100 m, or none")

    @property
    def needs(self) -> frozenset[Need]:
        """A survey, and channels if they are kept apart."""
        return frozenset({Need.SURVEY, Need.CHANNELS} if self.separate else {Need.SURVEY})

    def ellipse(self, last: Belief | None) -> SearchEllipse | None:
        """Where to look after a last belief: Eq 10 to 13."""
        if last is None or self.search_scale is None:
            return None
        x_m, y_m = last.mean[:2].tolist()
        covariance_m2 = last.covariance[:2, :2]
        return SearchEllipse(x_m=x_m, y_m=y_m, covariance_m2=covariance_m2, scale=self.search_scale)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Places:
    """Positions by c maps that heard something, all on one level; c may be 0.

    Attributes
    ----------
    places_m : ndarray of float64, (c, 2)
        [m]
    variance_m2 : ndarray of float64, (c,)
        On either axis, as learned from the survey. [m2]
    level : int
        Level of the venue; 0 where there is no position.
    """

    places_m: Array
    variance_m2: Array
    level: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChannelMap:
    """Radio map of one channel, or of all together.

    Attributes
    ----------
    slot : int
        Of the channel, after `blesim.ranging.channels`.
    nearest : NearestFingerprints
        Finds positions in it.
    mapped : ndarray of bool, (beacons,)
        Beacons that were heard in the survey.
    variance_m2 : float
        Of a position, on either axis. [m2]
    """

    slot: int
    nearest: NearestFingerprints
    mapped: NDArray[np.bool_]
    variance_m2: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FingerprintMaps:
    """Radio maps of the channels, or the one of all together."""

    maps: tuple[ChannelMap, ...]
    settings: FingerprintSettings

    @property
    def known(self) -> NDArray[np.bool_]:
        """Beacons that are in any map, (beacons,)."""
        return np.asarray(np.any([each.mapped for each in self.maps], axis=0), np.bool_)

    def locate(self, signal_dbm: Array, last: Belief | None) -> Places:
        """Positions by every map that knows something of what is heard.

        Parameters
        ----------
        signal_dbm : ndarray of float64, (beacons,) or (beacons, SLOTS)
            NaN where nothing is heard. [dBm]
        last : Belief or None
            After the last epoch, about which to look.
        """
        within = self.settings.ellipse(last)
        found = [row for each in self.maps for row in _located(each, signal_dbm, within)]
        rows = np.array(found).reshape(-1, 4)
        level = rows[0, 2] if len(rows) else 0
        rows = rows[rows[:, 2] == level]
        return Places(places_m=rows[:, :2].copy(), variance_m2=rows[:, 3].copy(), level=int(level))


def _located(
    each: ChannelMap, signal_dbm: Array, within: SearchEllipse | None
) -> Iterator[tuple[float, float, float, float]]:
    """Yield place, level and variance by one map, if it knows anything that is heard."""
    own_dbm = signal_dbm if signal_dbm.ndim == 1 else signal_dbm[:, each.slot]
    measured_dbm = np.where(each.mapped, own_dbm, np.nan)
    if np.all(np.isnan(measured_dbm)):
        return
    at = each.nearest.locate(measured_dbm[None], within)
    yield float(at.x_m[0]), float(at.y_m[0]), float(at.level[0]), each.variance_m2


def fit_fingerprint_maps(
    survey: SurveyReadings, venue: Venue, settings: FingerprintSettings
) -> FingerprintMaps:
    """Radio maps of a survey.

    Raises
    ------
    DataError
        If the survey tells no channels and they are asked for, or has no place in the layout.
    """
    layout = MapLayout(cell_m=settings.cell_m)
    surveyed: dict[int, RadioMap] = (
        {
            int(channel_slot(np.array([channel]))[0]): each
            for channel, each in channel_radio_maps(survey, layout).items()
        }
        if settings.separate
        else {_TOGETHER: radio_map(survey, layout)}
    )
    maps = [_channel_map(slot, each, venue, settings) for slot, each in surveyed.items()]
    return FingerprintMaps(maps=tuple(maps), settings=settings)


def _channel_map(
    slot: int, surveyed: RadioMap, venue: Venue, settings: FingerprintSettings
) -> ChannelMap:
    whole = surveyed if settings.grid_m is None else _filled(surveyed, venue, settings.grid_m)
    return ChannelMap(
        slot=slot,
        nearest=NearestFingerprints(radio_map=whole, k=settings.k),
        mapped=np.any(surveyed.count > 0, axis=0),
        variance_m2=left_out_variance_m2(surveyed, settings.k),
    )


def _filled(surveyed: RadioMap, venue: Venue, grid_m: float) -> RadioMap:
    """Surveyed map with fingerprints in the gaps, level by level."""
    parts = [surveyed]
    for level in np.unique(surveyed.level).tolist():
        here = surveyed.rows(surveyed.level == level)
        gaps_m = gap_places(here, venue, level, grid_m)
        if len(gaps_m):
            parts.append(filled_radio_map(here, gaps_m, level, GaussianProcessFill()))
    return joined_radio_maps(parts)


def gap_places(surveyed: RadioMap, venue: Venue, level: int, grid_m: float) -> Array:
    """Crossings of a grid between the surveyed places of a level, (p, 2). [m].

    Those that can be walked on, inside the convex hull of the surveyed places, and at least half
    the spacing away from each of them.
    """
    points = shapely.MultiPoint(np.stack([surveyed.x_m, surveyed.y_m], axis=1))
    area = venue.floor_plan.walkable.get(level)
    inside = points.convex_hull if area is None else points.convex_hull.intersection(area)
    if inside.is_empty:
        return np.empty((0, 2))
    left_m, down_m, right_m, up_m = shapely.bounds(inside)
    x_m, y_m = np.meshgrid(_crossings(left_m, right_m, grid_m), _crossings(down_m, up_m, grid_m))
    crossings = shapely.points(x_m.ravel(), y_m.ravel())
    shapely.prepare(inside)
    kept = shapely.intersects(inside, crossings)
    kept &= shapely.distance(points, crossings) >= grid_m / 2
    return np.stack([x_m.ravel()[kept], y_m.ravel()[kept]], axis=1)


def _crossings(low_m: Any, high_m: Any, grid_m: float) -> Array:
    """Multiples of the spacing from low to high."""
    first, last = np.ceil(low_m / grid_m), np.floor(high_m / grid_m)
    return np.asarray(np.arange(first, last + 1) * grid_m, np.float64)


def left_out_variance_m2(surveyed: RadioMap, k: int) -> float:
    """Variance on either axis of a surveyed place located among the others of its level. [m2].

    Half the mean square of the distances; 10^2 / 12 where no level has two places.
    """
    squares = [
        _left_out_squares_m2(surveyed.rows(surveyed.level == level), k)
        for level in np.unique(surveyed.level)
    ]
    off_m2 = np.concatenate(squares)
    if not len(off_m2):
        return _LONE_VARIANCE_M2
    return max(float(np.mean(off_m2)) / 2.0, _LEAST_VARIANCE_M2)


def _left_out_squares_m2(here: RadioMap, k: int) -> Array:
    """Squared distance of each place to where the k most like it say it is, (p,). [m2]."""
    if len(here) < 2:
        return np.empty(0)
    # One more than k: the place itself is among the nearest, or they agree with it as well.
    more = NearestFingerprints(radio_map=here, k=k + 1).locate(here.mean_dbm)
    others = (more.fingerprint >= 0) & (more.fingerprint != np.arange(len(here))[:, None])
    others &= np.cumsum(others, axis=1) <= k
    apart_db = np.maximum(np.where(others, more.apart_db, 1.0), _LEAST_APART_DB)
    weight = np.where(others, 1.0 / apart_db, 0.0)
    weight /= weight.sum(axis=1, keepdims=True)
    x_m = (weight * here.x_m[more.fingerprint]).sum(axis=1)
    y_m = (weight * here.y_m[more.fingerprint]).sum(axis=1)
    return np.asarray((x_m - here.x_m) ** 2 + (y_m - here.y_m) ** 2)
