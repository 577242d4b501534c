"""A walker as a SimPy process on a clock of whole microseconds, and the log it leaves."""

from collections.abc import Generator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import simpy
from numpy.typing import NDArray

from blesim import columns
from blesim.errors import InvariantError
from blesim.tables import Marks, Trajectory
from blesim.units import MICROSECONDS_PER_SECOND, to_us, wrap_angle
from blesim.venue.graph import SAME_PLACE_M, AisleGraph, GraphPosition, Leg
from blesim.walkers.itinerary import Itinerary

_STATE = dict(columns.STATES)
_STRAIGHT_ON_RAD = 1e-9

Process = Generator[simpy.Event, Any, None]


@dataclass(slots=True)
class WalkLog:
    """Knots and marks of one walker, written down as they happen."""

    knots: list[tuple[float, ...]] = field(default_factory=list)
    marks: list[tuple[float, ...]] = field(default_factory=list)

    def trajectory(self) -> Trajectory:
        """The finished walk."""
        return Trajectory(**_by_field(columns.TRAJECTORY, self.knots))

    def pressed(self) -> Marks:
        """The way points the tester marked."""
        return Marks(**_by_field(columns.MARKS, self.marks))


def _by_field(stream: columns.Stream, rows: list[tuple[float, ...]]) -> dict[str, Any]:
    values = zip(*rows, strict=True) if rows else [() for _ in stream.columns]
    return {column.field: np.array(v) for column, v in zip(stream.columns, values, strict=True)}


@dataclass(slots=True)
class Walker:
    """Somebody on the graph: place, heading, and what they are told to do."""

    graph: AisleGraph
    itinerary: Itinerary
    log: WalkLog = field(default_factory=WalkLog)
    heading_rad: float = 0.0

    def walk(self, env: simpy.Environment) -> Process:
        """The process: wait for the start, then stop after stop to the end of the route."""
        stops = self.itinerary.stops
        ways = [self.graph.route(a.place, b.place) for a, b in pairwise(stops)]
        first_leg = next((leg for way in ways for leg in way), None)
        if first_leg is not None:
            self.heading_rad = self._heading_of(first_leg)
        yield env.timeout(to_us(self.itinerary.start_s))
        self._press(env, stops[0].place)
        yield from self._stand(env, stops[0].place, stops[0].pause_s)
        for stop, way in zip(stops[1:], ways, strict=True):
            for leg in way:
                yield from self._turn(env, leg)
                yield from self._stride(env, leg)
            yield from self._stand(env, stop.place, stop.pause_s)
        self._knot(env, stops[-1].place, "standing")

    def _stand(self, env: simpy.Environment, place: GraphPosition, pause_s: float) -> Process:
        if pause_s > 0:
            self._knot(env, place, "standing")
            yield env.timeout(to_us(pause_s))

    def _turn(self, env: simpy.Environment, leg: Leg) -> Process:
        new_rad = self._heading_of(leg)
        angle_rad = abs(float(wrap_angle(new_rad - self.heading_rad)))
        if angle_rad > _STRAIGHT_ON_RAD:
            self._knot(env, GraphPosition(leg.edge, leg.start_m), "turning")
            yield env.timeout(to_us(angle_rad / self.itinerary.turn_rate_rad_s))
        self.heading_rad = new_rad

    def _stride(self, env: simpy.Environment, leg: Leg) -> Process:
        duration_us = max(1, to_us(leg.length_m / self.itinerary.speed_m_s))
        speed_m_s = leg.length_m / duration_us * MICROSECONDS_PER_SECOND
        sign = 1.0 if leg.end_m > leg.start_m else -1.0
        self._knot(env, GraphPosition(leg.edge, leg.start_m), "walking", speed_m_s, sign)
        for way_point_m, share in self._way_points_on(leg):
            time_us = env.now + round(share * duration_us)
            self.log.marks.append((time_us, *way_point_m, self._level(leg.edge)))
        yield env.timeout(duration_us)

    def _knot(
        self,
        env: simpy.Environment,
        place: GraphPosition,
        state: str,
        speed_m_s: float = 0.0,
        sign: float = 0.0,
    ) -> None:
        x_m, y_m = self.graph.xy_m([place.edge], [place.offset_m])[0]
        self.log.knots.append(
            (
                env.now,
                x_m,
                y_m,
                self._level(place.edge),
                self.heading_rad,
                speed_m_s,
                0.0,
                place.edge,
                place.offset_m,
                sign * speed_m_s,
                _STATE[state],
            )
        )

    def _press(self, env: simpy.Environment, place: GraphPosition) -> None:
        """Mark the start of the route, if it is a way point."""
        x_m, y_m = self.graph.xy_m([place.edge], [place.offset_m])[0]
        points = self.itinerary.way_points
        here = np.hypot(points.xy_m[:, 0] - x_m, points.xy_m[:, 1] - y_m) <= SAME_PLACE_M
        level = self._level(place.edge)
        if np.any(here & (points.level == level)):
            self.log.marks.append((env.now, x_m, y_m, level))

    def _way_points_on(self, leg: Leg) -> list[tuple[NDArray[np.float64], float]]:
        """Way points passed on a leg, its start left out, with the share of the leg before them."""
        start_m, end_m = self.graph.xy_m([leg.edge, leg.edge], [leg.start_m, leg.end_m])
        along = (end_m - start_m) / leg.length_m
        points = self.itinerary.way_points
        relative = points.xy_m - start_m
        ahead_m = relative @ along
        aside_m = np.abs(relative @ np.array([-along[1], along[0]]))
        passed = (aside_m <= SAME_PLACE_M) & (ahead_m > SAME_PLACE_M)
        passed &= ahead_m <= leg.length_m + SAME_PLACE_M
        passed &= points.level == self._level(leg.edge)
        found = [
            (points.xy_m[row], min(float(ahead_m[row]) / leg.length_m, 1.0))
            for row in np.flatnonzero(passed)
        ]
        return sorted(found, key=lambda pair: pair[1])

    def _heading_of(self, leg: Leg) -> float:
        x, y = self.graph.direction[leg.edge] * (1.0 if leg.end_m > leg.start_m else -1.0)
        return float(np.arctan2(y, x))

    def _level(self, edge: int) -> int:
        return int(self.graph.level[edge])


def simulate_walkers(graph: AisleGraph, itineraries: tuple[Itinerary, ...]) -> tuple[WalkLog, ...]:
    """Logs of all walkers, simulated together until the last has arrived.

    Parameters
    ----------
    graph : AisleGraph
        Where they walk.
    itineraries : tuple of Itinerary
        One a walker.

    Returns
    -------
    tuple of WalkLog
        In the order of the itineraries.

    Raises
    ------
    VenueError
        If a route does not connect.
    InvariantError
        If a walker did not arrive.
    """
    env = simpy.Environment()
    walkers = [Walker(graph=graph, itinerary=itinerary) for itinerary in itineraries]
    processes = [env.process(walker.walk(env)) for walker in walkers]
    env.run()
    for walker, process in zip(walkers, processes, strict=True):
        if not process.processed:
            raise InvariantError(f"walker '{walker.itinerary.walker}' never arrived")
    return tuple(walker.log for walker in walkers)
