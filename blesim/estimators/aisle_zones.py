"""Straight and non-linear zones of an aisle graph: where people walk on, and where they turn.

After section 4.1 of [1]_. A junction is a node where aisles of different directions meet; within a
radius of one, people turn (*non-linear zone*); on the edges elsewhere they walk straight (*linear
zone*). Where an aisle leaves a non-linear zone is the entry of its linear zone.

References
----------
.. [1] PDR with map-compensated heading; digest "map-heading-ekf".
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.kernels import kernel
from blesim.venue.graph import AisleGraph, read_only
from blesim.venue.venue import Venue

NO_JUNCTION = -1
# Aisles that differ by less are one straight way; assumed.
_SAME_WAY_RAD = math.radians(20.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AisleZones:
    """Zones of one level with e edges, j junctions and a arms: edges that leave a junction.

    Attributes
    ----------
    junction_m : float
        Radius of the non-linear zones. [m]
    edge_m : ndarray of float64, (e, 5)
        First node's x and y, unit vector, length of each edge. [m], [-], [m]
    junction_xy_m : ndarray of float64, (j, 2)
        [m]
    arm_m : ndarray of float64, (a, 3)
        Unit vector away from the junction, and length. [-], [m]
    arm_junction : ndarray of int64, (a,)
        Row of each arm's junction.
    """

    junction_m: float
    edge_m: NDArray[np.float64]
    junction_xy_m: NDArray[np.float64]
    arm_m: NDArray[np.float64]
    arm_junction: NDArray[np.int64]

    def junction_at(self, x_m: float, y_m: float) -> int:
        """Row of the nearest junction whose non-linear zone holds a position, or `NO_JUNCTION`."""
        return _junction_at(self.junction_xy_m, self.junction_m, x_m, y_m)

    def way_rad(
        self,
        x_m: float,
        y_m: float,
        heading_rad: float,
        *,
        reach_m: float,
        agree_rad: float,
        beside: bool = False,
    ) -> float:
        """Direction of the aisle that somebody walks along. [rad].

        Of the two directions of each edge the one nearer to the heading counts.

        Parameters
        ----------
        x_m, y_m : float
            Position. [m]
        heading_rad : float
            As measured. [rad]
        reach_m, agree_rad : float
            The nearest edge that is no farther away, and whose direction departs from the heading
            by no more, is taken; quarter of a turn for every edge. [m], [rad]
        beside : bool
            Whether the position must lie beside the straight part of the edge: not before or beyond
            its ends, nor beside its part in a non-linear zone.

        Returns
        -------
        float
            Heading in [-pi, pi], NaN if there is no such edge.
        """
        bends = self.junction_xy_m if beside else self.junction_xy_m[:0]
        return _way(
            self.edge_m,
            bends,
            self.junction_m,
            x_m,
            y_m,
            heading_rad,
            reach_m,
            agree_rad,
            beside,
        )

    def linear_at(self, x_m: float, y_m: float, reach_m: float) -> bool:
        """Whether a position is in a linear zone: beside the straight part of an edge. [m]."""
        way_rad = self.way_rad(x_m, y_m, 0.0, reach_m=reach_m, agree_rad=math.pi / 2, beside=True)
        return not math.isnan(way_rad)

    def entry_m(self, x_m: float, y_m: float, reach_m: float) -> tuple[float, float] | None:
        """Centre of the entry of the linear zone that somebody has come into. [m].

        It lies on an arm of the nearest junction, the arm nearest to the position, at the edge of
        the non-linear zone, or at the end of an arm that is shorter.

        Parameters
        ----------
        x_m, y_m : float
            Position now. [m]
        reach_m : float
            How far outside the non-linear zone the position may be. [m]

        Returns
        -------
        tuple of float or None
            None where no junction is as near.
        """
        junction = _junction_at(self.junction_xy_m, self.junction_m + reach_m, x_m, y_m)
        if junction == NO_JUNCTION:
            return None
        arms = self.arm_m[self.arm_junction == junction]
        centre = self.junction_xy_m[junction]
        apart = np.array([x_m, y_m]) - centre
        along = np.clip(arms[:, :2] @ apart, 0.0, arms[:, 2])
        off = np.hypot(*(apart - along[:, None] * arms[:, :2]).T)
        direction_x, direction_y, length_m = arms[np.argmin(off)].tolist()
        out_m = min(self.junction_m, length_m)
        return float(centre[0]) + out_m * direction_x, float(centre[1]) + out_m * direction_y


def zones_by_level(venue: Venue, junction_m: float) -> Mapping[int, AisleZones]:
    """Zones of each level that has aisles.

    Parameters
    ----------
    venue : Venue
        With an aisle graph.
    junction_m : float
        Radius of the non-linear zones. [m]

    Raises
    ------
    UsageError
        If the venue has no aisle graph.
    """
    graph = venue.graph
    if graph is None:
        raise UsageError(f"venue '{venue.name}' has no aisle graph, so no direction of an aisle")
    levels = np.unique(graph.level).tolist()
    return MappingProxyType({level: _zones(graph, level, junction_m) for level in levels})


def no_zones(junction_m: float) -> AisleZones:
    """Zones of a level without aisles: no direction is known there."""
    return AisleZones(
        junction_m=junction_m,
        edge_m=np.empty((0, 5)),
        junction_xy_m=np.empty((0, 2)),
        arm_m=np.empty((0, 3)),
        arm_junction=np.empty(0, np.int64),
    )


def _zones(graph: AisleGraph, level: int, junction_m: float) -> AisleZones:
    rows = np.flatnonzero(graph.level == level)
    arms, nodes, ends = _arms(graph, rows)
    junctions = [node for node in np.unique(nodes).tolist() if _bends(arms[nodes == node])]
    kept = np.flatnonzero(np.isin(nodes, junctions))
    long_m = [_straight_m(arm, arms, nodes, ends, set(junctions)) for arm in kept.tolist()]
    start_m = graph.node_xy_m[graph.ends[rows, 0]]
    edge_m = np.column_stack([start_m, graph.direction[rows], graph.length_m[rows]])
    return AisleZones(
        junction_m=junction_m,
        edge_m=read_only(np.ascontiguousarray(edge_m)),
        junction_xy_m=read_only(graph.node_xy_m[junctions].reshape(-1, 2)),
        arm_m=read_only(np.column_stack([arms[kept, :2], np.array(long_m)])),
        arm_junction=read_only(np.searchsorted(junctions, nodes[kept]).astype(np.int64)),
    )


def _arms(
    graph: AisleGraph, rows: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Edges as seen from either end: direction and length (2 e, 3), this and the other node."""
    direction, length_m = graph.direction[rows], graph.length_m[rows]
    arms = np.column_stack(
        [np.concatenate([direction, -direction]), np.concatenate([length_m, length_m])]
    )
    first, second = graph.ends[rows, 0], graph.ends[rows, 1]
    return arms, np.concatenate([first, second]), np.concatenate([second, first])


def _straight_m(
    arm: int,
    arms: NDArray[np.float64],
    nodes: NDArray[np.int64],
    ends: NDArray[np.int64],
    junctions: set[int],
) -> float:
    """Length of the straight way that begins with an arm, up to a junction or its end. [m]."""
    length_m = float(arms[arm, 2])
    # A round way without a bend would never end.
    for _ in range(len(arms)):
        onward = np.flatnonzero((nodes == ends[arm]) & (arms[:, :2] @ arms[arm, :2] > 0))
        if int(ends[arm]) in junctions or not len(onward):
            break
        # A node that is no junction has its arms on one line: of those that go on, the first.
        arm = int(onward[0])
        length_m += float(arms[arm, 2])
    return length_m


def _bends(arms: NDArray[np.float64]) -> bool:
    """Whether two of the arms of a node, (k, 3), are not on one line."""
    x, y = arms[:, 0], arms[:, 1]
    across = np.abs(np.outer(x, y) - np.outer(y, x))
    return bool(np.any(across > math.sin(_SAME_WAY_RAD)))


@kernel
def _junction_at(junction_xy_m: NDArray[np.float64], within_m: float, x: float, y: float) -> int:
    """Row of the nearest junction within a distance, -1 for none (kernel)."""
    best, best_m = -1, within_m
    for row in range(len(junction_xy_m)):
        apart_m = math.hypot(x - junction_xy_m[row, 0], y - junction_xy_m[row, 1])
        if apart_m < best_m:
            best, best_m = row, apart_m
    return best


@kernel
def _way(
    edge_m: NDArray[np.float64],
    bends: NDArray[np.float64],
    bend_m: float,
    x: float,
    y: float,
    heading: float,
    reach_m: float,
    agree: float,
    beside: bool,
) -> float:
    """Direction of the nearest edge that agrees with the heading, NaN for none (kernel)."""
    best, best_m = np.nan, np.inf
    ahead_x, ahead_y = math.cos(heading), math.sin(heading)
    # Rounding must not let a quarter of a turn exclude an edge square to the heading.
    least = math.cos(agree) - 1e-12
    for row in range(len(edge_m)):
        start_x, start_y, along_x, along_y, length = edge_m[row]
        agreement = ahead_x * along_x + ahead_y * along_y
        if abs(agreement) < least:
            continue
        foot_m = (x - start_x) * along_x + (y - start_y) * along_y
        along_m = min(max(foot_m, 0.0), length)
        foot_x, foot_y = start_x + along_m * along_x, start_y + along_m * along_y
        if beside and abs(foot_m - along_m) > 1e-6:
            continue
        if _junction_at(bends, bend_m, foot_x, foot_y) >= 0:
            continue
        off_m = math.hypot(x - foot_x, y - foot_y)
        # Edges that meet in a node are equally near it but for rounding: take the first of them.
        if off_m <= reach_m and off_m < best_m - 1e-6:
            sign = 1.0 if agreement >= 0 else -1.0
            best, best_m = math.atan2(sign * along_y, sign * along_x), off_m
    return best
