"""Errors after every reading, against the true position at that time.

The estimate in force at a reading is the last one not later than the reading. A reading before the
first estimate has none: it is counted as unmatched, and never dropped in silence.

The error is horizontal: the distance between the two places on the map, whatever their levels. A
wrong level is reported apart, since metres do not measure it.

An estimate that names no edge of the aisle graph is taken to the nearest place on the graph. A
place at a node belongs to every branch that meets there; the aisle is wrong where estimate and
truth have no branch in common. Where the estimate's level has no aisles it is on no branch, and no
way leads to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blesim.columns import NO_EDGE
from blesim.errors import DataError
from blesim.tables import IntArray, Poses, Readings, Track, Trajectory
from blesim.venue.graph import AisleGraph

# True offsets are recorded to a micrometre and interpolated: closer than this to a node is at it.
AT_NODE_M = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PositionErrors:
    """Errors of n matched readings, all arrays (n,).

    Attributes
    ----------
    time_us : ndarray of int64
        Times of the readings. [us]
    error_m : ndarray of float64
        Horizontal distance between estimate and truth. [m]
    wrong_level : ndarray of float64
        1 where the estimate is on another level, else 0. [-]
    wrong_aisle : ndarray of float64
        1 where estimate and truth share no branch, else 0; NaN where the true one is not known. [-]
    graph_m : ndarray of float64
        Shortest way between them along the aisles; infinite where there is none, NaN where the true
        place on the graph is not known. [m]
    unmatched : int
        Readings before the first estimate.
    """

    time_us: IntArray
    error_m: NDArray[np.float64]
    wrong_level: NDArray[np.float64]
    wrong_aisle: NDArray[np.float64]
    graph_m: NDArray[np.float64]
    unmatched: int

    def __len__(self) -> int:
        """Count the matched readings."""
        return len(self.error_m)


def no_errors(unmatched: int) -> PositionErrors:
    """Errors of a walk on which no reading has an estimate."""
    nothing = np.empty(0)
    return PositionErrors(
        time_us=np.empty(0, np.int64),
        error_m=nothing,
        wrong_level=nothing,
        wrong_aisle=nothing,
        graph_m=nothing,
        unmatched=unmatched,
    )


def pooled(parts: Sequence[PositionErrors]) -> PositionErrors:
    """Errors of several walks, each reading counting once."""
    parts = [no_errors(0), *parts]
    return PositionErrors(
        time_us=np.concatenate([part.time_us for part in parts]),
        error_m=np.concatenate([part.error_m for part in parts]),
        wrong_level=np.concatenate([part.wrong_level for part in parts]),
        wrong_aisle=np.concatenate([part.wrong_aisle for part in parts]),
        graph_m=np.concatenate([part.graph_m for part in parts]),
        unmatched=sum(part.unmatched for part in parts),
    )


def position_errors(
    readings: Readings, trajectory: Trajectory, track: Track, graph: AisleGraph | None = None
) -> PositionErrors:
    """Errors of a track after every reading of its walk.

    Parameters
    ----------
    readings : Readings
        What the phone heard on the walk.
    trajectory : Trajectory
        Where it really was.
    track : Track
        What was estimated.
    graph : AisleGraph, optional
        Whose edges the trajectory and the track name; without it, errors on the map only.

    Returns
    -------
    PositionErrors

    Raises
    ------
    DataError
        If the track reaches outside the walk or holds no finite position, names an edge that the
        graph does not have, or the trajectory does not cover the readings.
    """
    _refuse_bad_track(track, trajectory)
    true = trajectory.at(readings.time_us)
    in_force = np.searchsorted(track.time_us, readings.time_us, side="right") - 1
    matched = in_force >= 0
    if not np.any(matched):
        return no_errors(len(readings))
    estimate, true = track.rows(in_force[matched]), _rows(true, matched)
    wrong_aisle, graph_m = _graph_errors(true, estimate, graph)
    return PositionErrors(
        time_us=readings.time_us[matched],
        error_m=np.hypot(estimate.x_m - true.x_m, estimate.y_m - true.y_m),
        wrong_level=(estimate.level != true.level).astype(np.float64),
        wrong_aisle=wrong_aisle,
        graph_m=graph_m,
        unmatched=int(np.count_nonzero(~matched)),
    )


def _refuse_bad_track(track: Track, trajectory: Trajectory) -> None:
    if not len(track):
        return
    if not len(trajectory):
        raise DataError("the walk has no true trajectory to hold the track against")
    begin_us, end_us = trajectory.time_us[0], trajectory.time_us[-1]
    if track.time_us[0] < begin_us or track.time_us[-1] > end_us:
        raise DataError(
            f"the track lasts from {track.time_us[0]} to {track.time_us[-1]} us, which reaches"
            f" outside the walk from {begin_us} to {end_us} us; is it a track of this walk?"
        )
    if not np.all(np.isfinite(track.x_m) & np.isfinite(track.y_m)):
        raise DataError("the track holds positions that are not finite numbers")


def _rows(poses: Poses, selected: NDArray[np.bool_]) -> Poses:
    return Poses(**{name: getattr(poses, name)[selected] for name in Poses.__slots__})


def _graph_errors(
    true: Poses, estimate: Track, graph: AisleGraph | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wrong aisle (n,) and distance along the aisles (n,), NaN where truth is on no edge."""
    wrong_aisle, graph_m = np.full(len(estimate), np.nan), np.full(len(estimate), np.nan)
    known = true.edge != NO_EDGE
    if graph is None or not np.any(known):
        return wrong_aisle, graph_m
    edge, offset_m = estimated_places(estimate, graph)
    there = known & (edge != NO_EDGE)
    # What has no place keeps these: on no common branch, and no way leads to it.
    wrong_aisle[known], graph_m[known] = 1.0, np.inf
    places = (true.edge[there], true.offset_m[there], edge[there], offset_m[there])
    common = _branches(graph, *places[:2]) & _branches(graph, *places[2:])
    wrong_aisle[there] = ~np.any(common, axis=1)
    graph_m[there] = graph.distance_m(*places)
    return wrong_aisle, graph_m


def estimated_places(
    track: Track, graph: AisleGraph
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Edge and offset [m] of each estimate, two arrays (n,): its own, or the nearest on its level.

    The edge is -1 where the graph has none on the level.

    Raises
    ------
    DataError
        If the track names an edge that the graph does not have, or no offset on its edge.
    """
    edge, offset_m = track.edge.astype(np.int64), track.offset_m.astype(np.float64)
    if np.any((edge < NO_EDGE) | (edge >= len(graph.edges))) or np.any(
        np.isnan(offset_m[edge != NO_EDGE])
    ):
        raise DataError("the track names an edge that the aisle graph lacks, or no offset on it")
    lost = (edge == NO_EDGE) & np.isin(track.level, graph.level)
    edge[lost], offset_m[lost], _ = graph.nearest(
        track.x_m[lost], track.y_m[lost], track.level[lost]
    )
    return edge, np.clip(offset_m, 0.0, graph.length_m[edge])


def _branches(graph: AisleGraph, edge: IntArray, offset_m: NDArray[Any]) -> NDArray[np.bool_]:
    """Which branches each place belongs to, (n, branches): at a node, those of all its edges."""
    of_node = np.zeros((len(graph.nodes), len(graph.branches)), bool)
    of_node[graph.ends, graph.branch[:, None]] = True
    belongs = np.zeros((len(edge), len(graph.branches)), bool)
    belongs[np.arange(len(edge)), graph.branch[edge]] = True
    for end, distance_m in enumerate((offset_m, graph.length_m[edge] - offset_m)):
        at_node = distance_m <= AT_NODE_M
        belongs[at_node] |= of_node[graph.ends[edge[at_node], end]]
    return belongs
