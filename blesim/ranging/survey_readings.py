"""The readings of surveys with the places they were made at, as the testers' marks tell them.

Between two successive marks at the same place the tester stands there, facing the heading of the
first mark where it tells one. Between marks at different places the tester walks straight at
constant speed, heading along the way. Before the first and after the last mark of a walk, and on
the way to another level, the place is not known.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError, VenueError
from blesim.recording import Recording, WalkKind
from blesim.tables import Marks, Readings
from blesim.venue.venue import Venue

WALKING = -1
# Two presses this near to each other were made at one spot.
_SAME_SPOT_M = 0.01


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurveyReadings:
    """Readings with their places, in the order of the surveys; all arrays (n,).

    Attributes
    ----------
    beacons : int
        How many beacons the venue has.
    time_us : ndarray of int64
        Since the start of its own walk. [us]
    beacon, channel, proximity : ndarray of int
        As in `blesim.tables.Readings`.
    rssi_dbm : ndarray of float64
        [dBm]
    x_m, y_m : ndarray of float64
        Where the tester was. [m]
    level : ndarray of int
        Level of the venue.
    heading_rad : ndarray of float64
        Which way the tester looked or walked, NaN where not known. [rad]
    spot : ndarray of int64
        Number of the place the tester stood at, the same at each visit; `WALKING` on the way.
    walk : ndarray of int64
        Number of the survey walk, from 0.
    """

    beacons: int
    time_us: NDArray[np.int64]
    beacon: NDArray[np.int64]
    channel: NDArray[np.int64]
    proximity: NDArray[np.int64]
    rssi_dbm: NDArray[np.float64]
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    level: NDArray[np.int64]
    heading_rad: NDArray[np.float64]
    spot: NDArray[np.int64]
    walk: NDArray[np.int64]

    def __post_init__(self) -> None:
        for name in _columns():
            getattr(self, name).flags.writeable = False

    def __len__(self) -> int:
        """Count the readings."""
        return len(self.time_us)

    def rows(self, selection: NDArray[Any] | slice) -> "SurveyReadings":
        """Return the selected readings; spots keep their numbers."""
        chosen = {name: getattr(self, name)[selection] for name in _columns()}
        return SurveyReadings(beacons=self.beacons, **chosen)

    def horizontal_distance_m(self, venue: Venue) -> NDArray[np.float64]:
        """Distance on the map between each place and the beacon heard, (n,).

        NaN where the beacon is on another level. [m]
        """
        apart_m = venue.beacon_xyz_m[self.beacon, :2] - np.stack([self.x_m, self.y_m], axis=1)
        here = venue.beacon_level[self.beacon] == self.level
        return np.where(here, np.hypot(apart_m[:, 0], apart_m[:, 1]), np.nan)

    def distance_m(self, venue: Venue, phone_height_m: float) -> NDArray[np.float64]:
        """Distance in space between the phone and the beacon heard, (n,).

        NaN where the beacon is on another level. [m]

        Parameters
        ----------
        venue : Venue
            As surveyed.
        phone_height_m : float
            At which the tester carried the phone above the floor. [m]
        """
        up_m = venue.beacon_xyz_m[self.beacon, 2] - phone_height_m
        distance_m: NDArray[np.float64] = np.hypot(self.horizontal_distance_m(venue), up_m)
        return distance_m

    def same_branch(self, venue: Venue) -> NDArray[np.bool_]:
        """Whether tester and beacon are on the same branch of the aisle graph, (n,).

        Raises
        ------
        VenueError
            If the venue has no aisle graph, or none on a level of the survey.
        """
        if venue.graph is None:
            raise VenueError(f"venue '{venue.name}' has no aisle graph, so it has no branches")
        edge, _, _ = venue.graph.nearest(self.x_m, self.y_m, self.level)
        branch, (beside, _) = venue.graph.branch, venue.beacon_places
        same: NDArray[np.bool_] = branch[edge] == branch[beside[self.beacon]]
        return same


def _columns() -> list[str]:
    return [field.name for field in fields(SurveyReadings) if field.name != "beacons"]


def survey_readings(surveys: Sequence[Recording]) -> SurveyReadings:
    """Readings of all survey walks whose places are known.

    Parameters
    ----------
    surveys : sequence of Recording
        Of one venue; walks of another kind are passed over.

    Returns
    -------
    SurveyReadings
        Never empty.

    Raises
    ------
    DataError
        If no reading has a known place, or the recordings have different beacons.
    """
    _refuse_other_beacons(surveys)
    walks = [walk for survey in surveys for walk in survey.walks if walk.kind == WalkKind.SURVEY]
    parts = [_placed(walk.observations.readings, walk.observations.marks) for walk in walks]
    columns = {name: np.concatenate(arrays) for name, arrays in _by_column(parts).items()}
    if not parts or not len(columns["time_us"]):
        raise DataError("no reading of a survey lies between two marks; record a survey walk first")
    columns["spot"] = _numbered(columns)
    columns["walk"] = np.repeat(np.arange(len(parts)), [len(part["time_us"]) for part in parts])
    return SurveyReadings(beacons=len(surveys[0].venue.beacons), **columns)


def _by_column(parts: Sequence[dict[str, NDArray[Any]]]) -> dict[str, list[NDArray[Any]]]:
    return {name: [part[name] for part in parts] for name in (parts[0] if parts else ())}


def _refuse_other_beacons(surveys: Sequence[Recording]) -> None:
    names = {tuple(beacon.id for beacon in survey.venue.beacons) for survey in surveys}
    if len(names) > 1:
        raise DataError("the surveys are of venues with different beacons; give those of one venue")


def _placed(readings: Readings, marks: Marks) -> dict[str, NDArray[Any]]:
    """Columns of the readings of one walk whose place is known; the spot only says: standing."""
    if len(marks) < 2:
        return _columns_of(readings.rows(slice(0)), Marks.empty(), np.empty(0, np.int64))
    inside = (readings.time_us >= marks.time_us[0]) & (readings.time_us <= marks.time_us[-1])
    readings = readings.rows(inside)
    begin = np.searchsorted(marks.time_us, readings.time_us, side="right") - 1
    begin = np.minimum(begin, len(marks) - 2)
    known = marks.level[begin] == marks.level[begin + 1]
    return _columns_of(readings.rows(known), marks, begin[known])


def _columns_of(
    readings: Readings, marks: Marks, begin: NDArray[np.int64]
) -> dict[str, NDArray[Any]]:
    """Columns of readings made between the mark `begin` and the next."""
    end = begin + 1
    span_us = np.maximum(marks.time_us[end] - marks.time_us[begin], 1)
    share = np.minimum((readings.time_us - marks.time_us[begin]) / span_us, 1.0)
    way_x_m, way_y_m = marks.x_m[end] - marks.x_m[begin], marks.y_m[end] - marks.y_m[begin]
    stands = np.hypot(way_x_m, way_y_m) < _SAME_SPOT_M
    share = np.where(stands, 0.0, share)
    return {
        "time_us": readings.time_us.astype(np.int64),
        "beacon": readings.beacon.astype(np.int64),
        "channel": readings.channel.astype(np.int64),
        "proximity": readings.proximity.astype(np.int64),
        "rssi_dbm": readings.rssi_dbm.astype(np.float64),
        "x_m": marks.x_m[begin] + share * way_x_m,
        "y_m": marks.y_m[begin] + share * way_y_m,
        "level": marks.level[begin].astype(np.int64),
        "heading_rad": np.where(stands, marks.heading_rad[begin], np.arctan2(way_y_m, way_x_m)),
        "spot": np.where(stands, 0, WALKING),
    }


def _numbered(columns: dict[str, NDArray[Any]]) -> NDArray[np.int64]:
    """Spot of each reading: places that agree to a centimetre are one."""
    stands = columns["spot"] != WALKING
    centimetres = (columns[axis][stands] / _SAME_SPOT_M for axis in ("x_m", "y_m"))
    places = [np.round(axis).astype(np.int64) for axis in centimetres]
    spot = np.full(len(stands), WALKING, np.int64)
    spot[stands] = group_of([columns["level"][stands], *places])
    return spot


def calibration_points(
    survey: SurveyReadings, *, by_channel: bool, cell_m: float = 1.0
) -> SurveyReadings:
    """Mean RSSI of each beacon at each calibration point, a reading each, in no known order.

    A point is a spot the tester stood at, whichever way it looked; readings on the way from one to
    the next do not count. If nobody ever stood, points are the cells of a grid about the map's
    origin. Headings and walks are no longer known.

    Parameters
    ----------
    survey : SurveyReadings
        n readings.
    by_channel : bool
        Whether to keep channels apart; together they have channel 0.
    cell_m : float
        Side of a cell. [m]
    """
    stood = survey.spot != WALKING
    if np.any(stood):
        survey = survey.rows(stood)
        point = [survey.spot]
    else:
        cells = (np.floor(axis / cell_m) for axis in (survey.x_m, survey.y_m))
        point = [survey.level, *(cell.astype(np.int64) for cell in cells)]
    channel = survey.channel if by_channel else np.zeros_like(survey.channel)
    group = group_of([*point, survey.beacon, channel])
    _, first = np.unique(group, return_index=True)
    count = np.bincount(group)
    nothing = np.zeros(len(first), np.int64)
    return SurveyReadings(
        beacons=survey.beacons,
        time_us=survey.time_us[first],
        beacon=survey.beacon[first],
        channel=channel[first],
        proximity=nothing,
        rssi_dbm=np.bincount(group, survey.rssi_dbm) / count,
        x_m=np.bincount(group, survey.x_m) / count,
        y_m=np.bincount(group, survey.y_m) / count,
        level=survey.level[first],
        heading_rad=np.full(len(first), np.nan),
        spot=survey.spot[first],
        walk=nothing,
    )


def group_of(columns: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    """Number of each row's combination of values, (n,): from 0, in the order of the values.

    Examples
    --------
    >>> group_of([np.array([2, 1, 1, 2]), np.array([5, 9, 7, 5])]).tolist()
    [2, 1, 0, 2]
    """
    group = np.zeros(len(columns[0]), np.int64)
    for values in columns:
        # Column by column: sorting rows as wholes takes ten times as long.
        _, number = np.unique(values, return_inverse=True)
        _, group = np.unique(group * (number.max(initial=0) + 1) + number, return_inverse=True)
    return group
