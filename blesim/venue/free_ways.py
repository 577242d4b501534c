"""Ways on foot over a level, around whatever stands there."""

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.base import BaseGeometry

from blesim.errors import VenueError
from blesim.venue.floor_plan import FloorPlan
from blesim.venue.graph import SAME_PLACE_M, AisleGraph, GraphPosition

Floats = NDArray[np.float64]
# How far from a corner one walks around it, and where the gaps are too narrow for that; assumed.
_CLEARANCES_M = (0.2, 0.01)


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeWays:
    """Ways over one level that touch no obstacle and do not leave its bounds.

    Attributes
    ----------
    plan : FloorPlan
        Levels and obstacles.
    level : int
        Of all the ways; one that the plan has.
    graph : AisleGraph or None
        The aisles, which are taken where they lead.
    """

    plan: FloorPlan
    level: int
    graph: AisleGraph | None = None

    def are_free(self, starts_m: ArrayLike, ends_m: ArrayLike) -> NDArray[np.bool_]:
        """Whether the straight ways from n places to n others are free, (n,).

        Parameters
        ----------
        starts_m, ends_m : array_like of float, (n, 2)
            [m]
        """
        lines_m = np.stack([starts_m, ends_m], axis=1)
        stays = _lengths_m(lines_m[:, 1] - lines_m[:, 0]) <= SAME_PLACE_M
        return np.asarray(stays | shapely.covers(self._free, shapely.linestrings(lines_m)))

    def bends_m(self, start_m: Sequence[float], end_m: Sequence[float]) -> Floats:
        """Where a way from one place to another bends, (bends, 2): nowhere if it can be straight.

        It follows the aisles from the nearest place on them to the nearest one at the end; where
        they do not lead there, it is the shortest way from corner to corner (visibility graph,
        searched by A*).

        Parameters
        ----------
        start_m, end_m : sequence of two float
            Places where somebody can stand. [m]

        Returns
        -------
        ndarray of float64, (bends, 2)
            Without the places themselves. [m]

        Raises
        ------
        VenueError
            If no way leads there.
        """
        ends_m = np.array([start_m, end_m], np.float64)
        for way_m in self._candidates(ends_m):
            if way_m is not None and self.are_free(way_m[:-1], way_m[1:]).all():
                return np.round(_bends(way_m), 6)
        start, end = (f"({x_m:g}, {y_m:g})" for x_m, y_m in ends_m)
        raise VenueError(f"no way leads from {start} to {end} around what stands between")

    def _candidates(self, ends_m: Floats) -> Iterator[Floats | None]:
        yield ends_m
        yield self._along_aisles(ends_m)
        if self._in_one_piece(ends_m):
            for clearance_m in _CLEARANCES_M:
                yield self._around_corners(ends_m, clearance_m)

    @cached_property
    def _free(self) -> BaseGeometry:
        area = shapely.buffer(self.plan.walkable[self.level], SAME_PLACE_M)
        shapely.prepare(area)
        return area

    def _in_one_piece(self, ends_m: Floats) -> bool:
        pieces = shapely.get_parts(self._free)
        ends = [shapely.Point(*end_m) for end_m in ends_m.tolist()]
        return any(all(shapely.covers(piece, end) for end in ends) for piece in pieces)

    def _along_aisles(self, ends_m: Floats) -> Floats | None:
        if self.graph is None or self.level not in self.graph.level:
            return None
        edges, offsets_m, _ = self.graph.nearest(ends_m[:, 0], ends_m[:, 1], [self.level] * 2)
        start, end = map(GraphPosition, edges.tolist(), offsets_m.tolist())
        try:
            legs = self.graph.route(start, end)
        except VenueError:
            return None
        places = [start, *(GraphPosition(leg.edge, leg.end_m) for leg in legs)]
        on_aisles_m = self.graph.xy_m([p.edge for p in places], [p.offset_m for p in places])
        return np.concatenate([ends_m[:1], on_aisles_m, ends_m[1:]])

    def _around_corners(self, ends_m: Floats, clearance_m: float) -> Floats | None:
        """Places of the shortest way from corner to corner, (n, 2); none without any. [m]."""
        corners_m = self._corners_m(clearance_m)
        places_m = np.concatenate([corners_m, ends_m])
        goal = len(places_m) - 1
        rest_m = _lengths_m(places_m - places_m[goal])
        before = {goal - 1: goal - 1}
        walked_m = {goal - 1: 0.0}
        # In whole micrometres, so that ways of the same length tie on every processor.
        waiting = [(_micrometres(rest_m[goal - 1]), goal - 1)]
        done: set[int] = set()
        while waiting:
            _, here = heapq.heappop(waiting)
            if here == goal:
                return places_m[_traced(before, goal)]
            if here in done:
                continue
            done.add(here)
            steps_m = _lengths_m(places_m - places_m[here])
            for there in self._seen_from(places_m, here).tolist():
                way_m = walked_m[here] + float(steps_m[there])
                if _micrometres(way_m) < _micrometres(walked_m.get(there, 1e9)):
                    walked_m[there], before[there] = way_m, here
                    heapq.heappush(waiting, (_micrometres(way_m + rest_m[there]), there))
        return None

    def _seen_from(self, places_m: Floats, row: int) -> NDArray[np.intp]:
        """Rows of the places to which the straight way from one of them is free; not itself."""
        others = np.flatnonzero(_lengths_m(places_m - places_m[row]) > SAME_PLACE_M)
        here_m = np.broadcast_to(places_m[row], (len(others), 2))
        return others[self.are_free(here_m, places_m[others])]

    def _corners_m(self, clearance_m: float) -> Floats:
        """Corners of obstacles and bounds, pushed away from them by a clearance, (n, 2). [m]."""
        inside = shapely.buffer(
            self.plan.walkable[self.level], -clearance_m, join_style="mitre", mitre_limit=2.0
        )
        found = np.unique(np.round(shapely.get_coordinates(inside), 6), axis=0)
        return found[shapely.covers(self._free, shapely.points(found))]


def _lengths_m(along_m: Floats) -> Floats:
    # Not hypot, whose last bit differs from machine to machine.
    lengths_m: Floats = np.sqrt((along_m**2).sum(axis=1))
    return lengths_m


def _micrometres(length_m: float) -> int:
    return round(float(length_m) * 1e6)


def _traced(before: dict[int, int], goal: int) -> list[int]:
    rows = [goal]
    while before[rows[-1]] != rows[-1]:
        rows.append(before[rows[-1]])
    return rows[::-1]


def _bends(way_m: Floats) -> Floats:
    """Places of a way between its ends where it changes its direction, (bends, 2). [m]."""
    moves = np.append(_lengths_m(np.diff(way_m, axis=0)) > SAME_PLACE_M, True)
    way_m = way_m[moves]
    along = np.diff(way_m, axis=0)
    before, after = along[:-1], along[1:]
    across = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    ahead = (before * after).sum(axis=1)
    # Less than a micrometre aside in a metre is straight.
    bends: Floats = way_m[1:-1][(np.abs(across) > 1e-6 * np.abs(ahead)) | (ahead <= 0)]
    return bends
