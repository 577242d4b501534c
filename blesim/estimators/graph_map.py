"""What the estimators of the aisle-graph paper know of a venue: its aisles and its path loss.

References
----------
.. [1] The aisle-graph particle filter in a wholesale store, 2016;
   digest "aisle-graph-particle-filter".
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError, UsageError
from blesim.filters.graph_lines import GraphLines
from blesim.filters.graph_motion import GraphArrays
from blesim.ranging.path_loss_fit import fit_path_loss_by_branch, log_distance_fit
from blesim.ranging.survey_readings import survey_readings
from blesim.recording import Recording
from blesim.tables import Readings
from blesim.venue.graph import read_only
from blesim.venue.venue import Venue

CurveKind = Literal["paper", "survey"]
NO_BRANCH = -1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BranchCurves:
    """Eq 1 of the paper for each of b beacons: ``RSSI = s_0 - 10 n log10(d / 1 m)``.

    Attributes
    ----------
    level_dbm : ndarray of float64, (b,)
        s_0. [dBm]
    exponents : ndarray of float64, (2,)
        n of links within a branch, and of others. [-]
    """

    level_dbm: NDArray[np.float64]
    exponents: NDArray[np.float64]


def branch_curves(
    venue: Venue,
    surveys: Sequence[Recording],
    curve: CurveKind,
    exponents: tuple[float, float],
    phone_height_m: float,
) -> BranchCurves:
    """Path loss of the beacons of a venue.

    Parameters
    ----------
    venue : Venue
        With an aisle graph.
    surveys : sequence of Recording
        Looked at for ``survey`` alone.
    curve : {"paper", "survey"}
        With ``paper``, s_0 is what each beacon announces as its RSSI at one metre: in the paper
        all announce -77 dBm. With ``survey``, s_0, the same for all, and n are fitted.
    exponents : tuple of float
        n of the paper's curve within a branch and otherwise; the second also holds after a survey
        that never left the beacons' branches. [-]
    phone_height_m : float
        [m]

    Raises
    ------
    DataError
        If there is no survey, or it makes no curve.
    """
    if curve == "paper":
        level_dbm = [beacon.measured_power_dbm for beacon in venue.beacons]
        return _curves(np.array(level_dbm, np.float64), exponents)
    survey = survey_readings(surveys)
    distance_m = survey.distance_m(venue, phone_height_m)
    same = survey.same_branch(venue)
    if np.all(same):
        here = np.isfinite(distance_m)
        alone = log_distance_fit(distance_m[here], survey.rssi_dbm[here])
        if alone is None:
            raise DataError("RSSI does not fall with distance in the survey; survey more places")
        fit, found = alone, (float(alone.exponent), exponents[1])
    else:
        both = fit_path_loss_by_branch(distance_m, survey.rssi_dbm, same)
        fit, found = both.same, (float(both.same.exponent), float(both.other.exponent))
    return _curves(np.full(len(venue.beacons), float(fit.level_dbm)), found)


def _curves(level_dbm: NDArray[np.float64], exponents: tuple[float, float]) -> BranchCurves:
    return BranchCurves(level_dbm=read_only(level_dbm), exponents=read_only(np.array(exponents)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GraphMap:
    """Aisles of a venue, and b beacons beside them.

    Attributes
    ----------
    arrays, lines : GraphArrays, GraphLines
        The aisle graph for kernels.
    beacon_xyz_m : ndarray of float64, (b, 3)
        [m]
    beacon_level : ndarray of int64, (b,)
        Level of the venue.
    beacon_branch : ndarray of int64, (b,)
        Branch of the edge beside it; `NO_BRANCH` where its level has no aisles.
    """

    arrays: GraphArrays
    lines: GraphLines
    beacon_xyz_m: NDArray[np.float64]
    beacon_level: NDArray[np.int64]
    beacon_branch: NDArray[np.int64]

    @property
    def levels(self) -> int:
        """On how many levels there are aisles."""
        return len(np.unique(self.lines.level))

    def usable(self, readings: Readings) -> Readings:
        """Readings of beacons on levels with aisles."""
        beside_aisle = self.beacon_branch[readings.beacon] != NO_BRANCH
        return readings if np.all(beside_aisle) else readings.rows(beside_aisle)


def graph_map(venue: Venue) -> GraphMap:
    """Aisles and beacons of a venue.

    Raises
    ------
    UsageError
        If the venue has no aisle graph.
    """
    if venue.graph is None:
        raise UsageError(f"venue '{venue.name}' has no aisle graph; draw one first")
    lines = GraphLines.of(venue.graph)
    level = venue.beacon_level.astype(np.int64)
    x_m, y_m = (np.ascontiguousarray(axis) for axis in venue.beacon_xyz_m[:, :2].T)
    edge, _ = lines.nearest(x_m, y_m, level)
    return GraphMap(
        arrays=GraphArrays.of(venue.graph),
        lines=lines,
        beacon_xyz_m=venue.beacon_xyz_m,
        beacon_level=read_only(level),
        beacon_branch=read_only(np.where(edge < 0, NO_BRANCH, lines.branch[edge])),
    )
