"""Radio maps: what is heard where, as surveys tell it.

A fingerprint is what was heard of every beacon at one place, or at one place looking one way. The
places are the spots the tester stood at, or the cells of a grid, into which readings made while
walking fall as well.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from blesim.columns import CHANNEL_NOT_TOLD
from blesim.errors import DataError, UsageError
from blesim.ranging.survey_readings import WALKING, SurveyReadings, group_of

ANY_DIRECTION = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class MapLayout:
    """How readings are gathered into fingerprints.

    Attributes
    ----------
    cell_m : float or None
        Side of the cells of a grid about the map's origin; none for the spots of a standing
        survey. [m]
    directions : int
        How many directions have fingerprints of their own, from the map's x axis counter-clockwise:
        4 for 0, 90, 180 and 270 degrees; 0 for one fingerprint whichever way the tester looked.
    missing_dbm : float
        What a beacon counts that was not heard. [dBm]
    fewest_readings : int
        A beacon heard less often at a place counts as not heard there.

    Raises
    ------
    UsageError
        If a value is out of its range.
    """

    cell_m: float | None = None
    directions: int = 0
    missing_dbm: float = -100.0
    fewest_readings: int = 1

    def __post_init__(self) -> None:
        if self.cell_m is not None and not 0.05 <= self.cell_m <= 1000:
            raise UsageError(f"cell_m {self.cell_m:g}: give 0.05 to 1000 m, or none for spots")
        if not 0 <= self.directions <= 360:
            raise UsageError(f"directions {self.directions}: give 0 for none, up to 360")
        if not -127 <= self.missing_dbm <= 0:
            raise UsageError(f"missing_dbm {self.missing_dbm:g}: give -127 to 0")
        if self.fewest_readings < 1:
            raise UsageError(f"fewest_readings {self.fewest_readings}: give 1 or more")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RadioMap:
    """Fingerprints of p places and directions of b beacons.

    Attributes
    ----------
    layout : MapLayout
        How they were gathered.
    x_m, y_m : ndarray of float64, (p,)
        Mean place of the readings: for a spot the spot itself. [m]
    level : ndarray of int64, (p,)
        Level of the venue.
    direction : ndarray of int64, (p,)
        Number of the direction, `ANY_DIRECTION` where the layout has none.
    mean_dbm : ndarray of float64, (p, b)
        NaN where not heard. [dBm]
    spread_db : ndarray of float64, (p, b)
        Standard deviation of the readings, NaN for fewer than two. [dB]
    count : ndarray of int64, (p, b)
        Readings; 0 where not heard, or where a filled map was not surveyed.
    """

    layout: MapLayout
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    level: NDArray[np.int64]
    direction: NDArray[np.int64]
    mean_dbm: NDArray[np.float64]
    spread_db: NDArray[np.float64]
    count: NDArray[np.int64]

    def __post_init__(self) -> None:
        for name in _ARRAYS:
            getattr(self, name).flags.writeable = False

    def __len__(self) -> int:
        """Count the fingerprints."""
        return len(self.x_m)

    @property
    def fingerprints_dbm(self) -> NDArray[np.float64]:
        """Means with the layout's value for what was not heard, (p, b). [dBm]."""
        return np.where(np.isnan(self.mean_dbm), self.layout.missing_dbm, self.mean_dbm)

    def rows(self, selection: NDArray[Any]) -> "RadioMap":
        """Return the selected fingerprints."""
        return replace(self, **{name: getattr(self, name)[selection] for name in _ARRAYS})

    def facing(self, direction: int) -> "RadioMap":
        """Return the fingerprints of one direction, as of `direction_of`.

        Raises
        ------
        DataError
            If nobody looked that way.
        """
        chosen = self.rows(self.direction == direction)
        if not len(chosen):
            raise DataError(
                f"the survey has nothing in direction {direction} of {self.layout.directions};"
                " survey every spot in all directions, or use a map without directions"
            )
        return chosen


_ARRAYS = ("x_m", "y_m", "level", "direction", "mean_dbm", "spread_db", "count")


def joined_radio_maps(parts: Sequence[RadioMap]) -> RadioMap:
    """Radio map with the fingerprints of one or more maps of one layout and the same beacons."""
    columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
    return RadioMap(layout=parts[0].layout, **columns)


def direction_of(heading_rad: ArrayLike, directions: int) -> NDArray[np.int64]:
    """Number of the nearest of evenly spaced directions, any shape, the first along the x axis.

    Examples
    --------
    >>> direction_of([0.1, 1.5, 3.0, -1.5, -0.1], 4).tolist()
    [0, 1, 2, 3, 0]
    """
    turns = np.asarray(heading_rad, np.float64) / (2.0 * np.pi)
    return np.rint(turns * directions).astype(np.int64) % directions


def radio_map(survey: SurveyReadings, layout: MapLayout) -> RadioMap:
    """Radio map of all channels together.

    Parameters
    ----------
    survey : SurveyReadings
        Readings with their places.
    layout : MapLayout
        How they are gathered.

    Raises
    ------
    DataError
        If no reading has a place in the layout: no spot, or no direction, was told.
    """
    survey = survey.rows(_usable(survey, layout))
    if not len(survey):
        raise DataError(_why_empty(layout))
    group = group_of([*_places(survey, layout), _directions(survey, layout)])
    return _gathered(survey, layout, group)


def channel_radio_maps(survey: SurveyReadings, layout: MapLayout) -> Mapping[int, RadioMap]:
    """Radio map of each channel that the survey tells, by channel.

    Raises
    ------
    DataError
        If the phone of the survey did not tell channels, or as for `radio_map`.
    """
    told = np.unique(survey.channel[survey.channel != CHANNEL_NOT_TOLD]).tolist()
    if not told:
        raise DataError("the survey tells no channels; survey with a phone that does")
    return {channel: radio_map(survey.rows(survey.channel == channel), layout) for channel in told}


def _usable(survey: SurveyReadings, layout: MapLayout) -> NDArray[np.bool_]:
    usable = np.ones(len(survey), bool) if layout.cell_m else survey.spot != WALKING
    return usable & ~np.isnan(survey.heading_rad) if layout.directions else usable


def _why_empty(layout: MapLayout) -> str:
    if layout.directions:
        return "no survey reading tells which way the tester looked; survey with headings"
    return "nobody stood still in the survey; give a cell size to map walks"


def _places(survey: SurveyReadings, layout: MapLayout) -> list[NDArray[np.int64]]:
    if layout.cell_m is None:
        return [survey.spot]
    cells = [np.floor(axis / layout.cell_m).astype(np.int64) for axis in (survey.x_m, survey.y_m)]
    return [survey.level, *cells]


def _directions(survey: SurveyReadings, layout: MapLayout) -> NDArray[np.int64]:
    if not layout.directions:
        return np.full(len(survey), ANY_DIRECTION, np.int64)
    return direction_of(survey.heading_rad, layout.directions)


def _gathered(survey: SurveyReadings, layout: MapLayout, group: NDArray[np.int64]) -> RadioMap:
    """Fingerprints of readings by their group, 0 to the number of fingerprints - 1."""
    shape = int(group.max()) + 1, survey.beacons
    cell = group * survey.beacons + survey.beacon

    def total(values: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        return np.bincount(cell, values, minlength=shape[0] * shape[1]).astype(np.float64)

    count = total()
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_dbm = total(survey.rssi_dbm) / count
        squares = total((survey.rssi_dbm - mean_dbm[cell]) ** 2)
        spread_db = np.where(count > 1, np.sqrt(squares / (count - 1)), np.nan)
    few = count < layout.fewest_readings
    mean_dbm[few], spread_db[few], count[few] = np.nan, np.nan, 0
    _, first = np.unique(group, return_index=True)
    whole = RadioMap(
        layout=layout,
        x_m=np.bincount(group, survey.x_m) / np.bincount(group),
        y_m=np.bincount(group, survey.y_m) / np.bincount(group),
        level=survey.level[first],
        direction=_directions(survey, layout)[first],
        mean_dbm=mean_dbm.reshape(shape),
        spread_db=spread_db.reshape(shape),
        count=count.reshape(shape).astype(np.int64),
    )
    return whole.rows(np.any(whole.count > 0, axis=1))
