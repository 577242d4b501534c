"""Which of several fitted curves holds for which beacon and channel."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError, UsageError
from blesim.ranging.channels import SLOTS, channel_slot
from blesim.ranging.survey_readings import SurveyReadings

T = TypeVar("T")
CurvesBy = Literal["beacon and channel", "beacon", "all"]
# The curve of all readings together is always the first.
POOLED = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CurveRows:
    """Row of the curve for each beacon and channel.

    Attributes
    ----------
    row : ndarray of int64, (beacons, SLOTS)
        Slots of the channels after `blesim.ranging.channels`; the first is for readings that do
        not tell their channel.
    """

    row: NDArray[np.int64]

    def __post_init__(self) -> None:
        self.row.flags.writeable = False

    def of(
        self, beacon: NDArray[np.integer[Any]], channel: NDArray[np.integer[Any]]
    ) -> NDArray[np.int64]:
        """Row of the curve of each reading, (n,)."""
        rows: NDArray[np.int64] = self.row[beacon, channel_slot(channel)]
        return rows

    @property
    def fallen_back(self) -> NDArray[np.bool_]:
        """Whether a beacon has no curve of its own, (beacons,)."""
        fallen_back: NDArray[np.bool_] = np.all(self.row == POOLED, axis=1)
        return fallen_back


@dataclass(frozen=True, slots=True, kw_only=True)
class Enough:
    """What a beacon, or a channel of one, needs for a curve of its own.

    A channel with less takes the curve of its beacon, a beacon with less the one of all readings.

    Attributes
    ----------
    readings : int
        How many at least.
    distances : int
        At how many different distances, counted in steps of 10 cm.
    """

    readings: int = 20
    distances: int = 3

    def __post_init__(self) -> None:
        if self.readings < 1 or self.distances < 1:
            raise UsageError(
                f"readings {self.readings}, distances {self.distances}: give 1 or more of each"
            )

    def kept(self, distance_m: NDArray[np.float64]) -> bool:
        """Whether readings at these distances, (n,), are enough. [m]."""
        different = len(np.unique(np.round(distance_m, 1)))
        return len(distance_m) >= self.readings and different >= self.distances


# Of means at calibration points, which scatter less than readings.
ENOUGH_POINTS = Enough(readings=10)


def fit_curves(
    survey: SurveyReadings,
    distance_m: NDArray[np.float64],
    fit: Callable[[NDArray[np.float64], NDArray[np.float64]], T | None],
    by: CurvesBy,
    enough: Enough,
) -> tuple[list[T], CurveRows]:
    """Curves of the readings of a survey, the pooled one first, and which holds for whom.

    Parameters
    ----------
    survey : SurveyReadings
        n readings.
    distance_m : ndarray of float64, (n,)
        From the phone to the beacon; readings at NaN are left out. [m]
    fit : callable
        Makes a curve of distances [m] and RSSI [dBm]; None if they do not make sense.
    by : {"beacon and channel", "beacon", "all"}
        For whom a curve of its own is fitted.
    enough : Enough
        What it takes.

    Raises
    ------
    UsageError
        If `by` is none of these, or the distances are not one for each reading.
    DataError
        If not even all readings together make a curve.
    """
    if by not in get_args(CurvesBy):
        raise UsageError(f"curves by '{by}': use one of {', '.join(get_args(CurvesBy))}")
    if len(distance_m) != len(survey):
        raise UsageError(f"{len(distance_m)} distances for {len(survey)} readings; give one each")
    known = np.isfinite(distance_m)
    survey, distance_m = survey.rows(known), distance_m[known]
    pooled = fit(distance_m, survey.rssi_dbm) if len(survey) else None
    if pooled is None:
        raise DataError(
            f"the {len(survey)} survey readings at known distances make no curve of RSSI and"
            " distance; survey more places, near and far"
        )
    curves, row = [pooled], np.full((survey.beacons, SLOTS), POOLED, np.int64)

    def own(rows: NDArray[np.intp], otherwise: int) -> int:
        """Row of the curve of some readings, a new one if they are enough for it."""
        near_m = distance_m[rows]
        curve = fit(near_m, survey.rssi_dbm[rows]) if enough.kept(near_m) else None
        if curve is None:
            return otherwise
        curves.append(curve)
        return len(curves) - 1

    slot = channel_slot(survey.channel)
    for beacon in range(survey.beacons if by != "all" else 0):
        rows = np.flatnonzero(survey.beacon == beacon)
        row[beacon] = own(rows, POOLED)
        for each in range(1, SLOTS) if by == "beacon and channel" else ():
            row[beacon, each] = own(rows[slot[rows] == each], int(row[beacon, 0]))
    return curves, CurveRows(row=row)
