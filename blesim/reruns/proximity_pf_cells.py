"""The preliminary experiment of the proximity paper [1]_: where a beacon on the floor is Near.

The tester stands in each cell of 30 cm; of the cells at a distance, the share that measures Near
is P(d), and a line is drawn through the shares (section III-B, figures 3 and 4, Eq 5).

References
----------
.. [1] Particle filter on beacon proximity and a floor map; digest "proximity-particle-filter".
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.columns import PROXIMITIES
from blesim.ranging.proximity import Proximity
from blesim.ranging.survey_readings import WALKING, survey_readings
from blesim.recording import Recording
from blesim.reruns.base import Key
from blesim.reruns.proximity_pf_numbers import (
    CELL_M,
    CELLS,
    IMMEDIATE,
    INTERCEPT,
    RINGS_M,
    SLOPE,
    share_key,
)
from blesim.venue.venue import Venue

# The beacon on the floor amid the cells.
BEACON = "hall"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cells:
    """What the phone measured in each cell, all arrays (n,).

    Attributes
    ----------
    x_m, y_m : ndarray of float64
        Middle of the cell. [m]
    distance_m : ndarray of float64
        On the map, to the beacon. [m]
    proximity : ndarray of int64
        Class that the phone told most often there; where two did, the nearer one.
    """

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    distance_m: NDArray[np.float64]
    proximity: NDArray[np.int64]

    @property
    def near(self) -> NDArray[np.bool_]:
        """Which cells measure Near."""
        near: NDArray[np.bool_] = self.proximity == Proximity.NEAR
        return near


def cells_of(surveys: Sequence[Recording], venue: Venue) -> Cells:
    """Cells that a survey stood in.

    Raises
    ------
    DataError
        If a survey is of another venue.
    """
    survey = survey_readings(surveys)
    survey = survey.rows(survey.spot != WALKING)
    _, first, cell = np.unique(survey.spot, return_index=True, return_inverse=True)
    told = np.zeros((len(first), len(PROXIMITIES)), np.int64)
    row = venue.beacon_row[BEACON]
    of_beacon = survey.beacon == row
    np.add.at(told, (cell[of_beacon], survey.proximity[of_beacon]), 1)
    to_beacon_m = venue.beacon_xyz_m[row, :2]
    return Cells(
        x_m=survey.x_m[first],
        y_m=survey.y_m[first],
        distance_m=np.hypot(survey.x_m[first] - to_beacon_m[0], survey.y_m[first] - to_beacon_m[1]),
        # Numbered from Unknown, which a cell without a reading is, over Immediate to Far.
        proximity=np.argmax(told, axis=1).astype(np.int64),
    )


def ring_of(distance_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """Number of the ring that a cell belongs to, from d up to d + 0.3 m.

    So 56 cells are at 2.4 m, as printed; rings about d would have 48.
    """
    # Distances are of cells of 0.3 m, sums of squares of whole numbers: a hair decides nothing.
    return np.floor(distance_m / CELL_M + 1e-6).astype(np.int64)


def numbers_of_cells(cells: Cells) -> dict[Key, float]:
    """P(d) of each ring, the line through it, and what the paper counts beside."""
    ring = ring_of(cells.distance_m)
    shares = [float(np.mean(cells.near[ring == number])) for number in range(len(RINGS_M))]
    slope_per_m, intercept = np.polyfit(RINGS_M, shares, 1).tolist()
    return {
        CELLS: float(np.count_nonzero(ring == RINGS_M.index(2.4))),
        IMMEDIATE: float(np.mean(cells.proximity == Proximity.IMMEDIATE)),
        INTERCEPT: intercept,
        SLOPE: slope_per_m,
    } | {share_key(ring_m): share for ring_m, share in zip(RINGS_M, shares, strict=True)}
