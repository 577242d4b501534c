"""A walker as a SimPy process on a clock of whole microseconds, and the log it leaves."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Self

import numpy as np
import simpy

from blesim import columns
from blesim.errors import InvariantError
from blesim.tables import Marks, Trajectory
from blesim.units import MICROSECONDS_PER_SECOND, to_us, wrap_angle
from blesim.venue.graph import SAME_PLACE_M, AisleGraph, GraphPosition, Leg
from blesim.walkers.itinerary import Itinerary
from blesim.walkers.landmarks import Landmarks
from blesim.walkers.motion import limits_m_s
from blesim.walkers.phases import Phase, passed_us, phases, steady

_STATE = dict(columns.STATES)
_STRAIGHT_ON_RAD = 1e-9
_NOWHERE = -1

Process = Generator[simpy.Event, Any, None]


@dataclass(slots=True)
class WalkLog:
    """Knots and marks of one walker, written down as they happen."""

    knots: list[tuple[float, ...]] = field(default_factory=list)
    marks: list[tuple[float, ...]] = field(default_factory=list)

    def trajectory(self) -> Trajectory:
        """The finished walk."""
        return Trajectory(**_by_field(columns.TRAJECTORY.columns, self.knots))

    def pressed(self) -> Marks:
        """The way points the tester marked."""
        time_us, x_m, y_m, level = np.array(self.marks, np.float64).reshape(-1, 4).T
        whole = time_us.astype(np.int64), level.astype(np.int64)
        return Marks(time_us=whole[0], x_m=x_m, y_m=y_m, level=whole[1])


def _by_field(named: tuple[columns.Column, ...], rows: list[tuple[float, ...]]) -> dict[str, Any]:
    values = zip(*rows, strict=True) if rows else [() for _ in named]
    return {column.field: np.array(v) for column, v in zip(named, values, strict=True)}


@dataclass(slots=True)
class Walker:
    """Somebody on the graph: place, heading, speed, and what they are told to do.

    Attributes
    ----------
    landmarks : Landmarks
        Of the graph; may be shared with others.
    present : list of int
        How many people are on each edge, and nowhere as the last; the walker counts among them.
    """

    landmarks: Landmarks
    itinerary: Itinerary
    present: list[int]
    log: WalkLog = field(default_factory=WalkLog)
    heading_rad: float = 0.0
    speed_m_s: float = 0.0
    here: int = _NOWHERE

    @property
    def graph(self) -> AisleGraph:
        """Where they walk."""
        return self.landmarks.graph

    def walk(self, env: simpy.Environment) -> Process:
        """The process: wait for the start, then stop after stop to the end of the route."""
        stops = self.itinerary.stops
        ways = [self.graph.route(a.place, b.place) for a, b in pairwise(stops)]
        limits = self._limits(ways)
        first_leg = next((leg for way in ways for leg in way), None)
        if first_leg is not None:
            self.heading_rad = self._heading_of(first_leg)
        yield env.timeout(to_us(self.itinerary.start_s))
        self._go_to(stops[0].place.edge)
        self._press(env, stops[0].place)
        yield from self._stand(env, stops[0].place, stops[0].pause_s)
        for stop, way in zip(stops[1:], ways, strict=True):
            for leg in way:
                yield from self._turn(env, leg)
                yield from self._stride(env, leg, limits.pop(0))
            yield from self._stand(env, stop.place, stop.pause_s)
        self._knot(env, stops[-1].place, "standing")
        self._go_to(_NOWHERE)

    def _limits(self, ways: Sequence[Sequence[Leg]]) -> list[float]:
        """Speed permitted at the end of each leg; the walker stops for pauses and bends. [m/s]."""
        rate_m_s2 = self.itinerary.acceleration_m_s2
        legs = [leg for way in ways for leg in way]
        if rate_m_s2 is None or not legs:
            return [np.inf] * len(legs)
        at_end = np.full(len(legs), np.inf)
        at_end[-1] = 0.0
        for row, (a, b) in enumerate(pairwise(legs)):
            if self._angle_rad(self._heading_of(a), self._heading_of(b)) > _STRAIGHT_ON_RAD:
                at_end[row] = 0.0
        done = 0
        for stop, way in zip(self.itinerary.stops[1:], ways, strict=True):
            done += len(way)
            if stop.pause_s > 0 and done:
                at_end[done - 1] = 0.0
        lengths_m = np.array([leg.length_m for leg in legs])
        found: list[float] = limits_m_s(lengths_m, at_end, rate_m_s2).tolist()
        return found

    def _stand(self, env: simpy.Environment, place: GraphPosition, pause_s: float) -> Process:
        if pause_s > 0:
            self.speed_m_s = 0.0
            self._knot(env, place, "standing")
            yield env.timeout(to_us(pause_s))

    def _turn(self, env: simpy.Environment, leg: Leg) -> Process:
        new_rad = self._heading_of(leg)
        angle_rad = self._angle_rad(self.heading_rad, new_rad)
        if angle_rad > _STRAIGHT_ON_RAD:
            self.speed_m_s = 0.0
            self._knot(env, GraphPosition(leg.edge, leg.start_m), "turning")
            yield env.timeout(to_us(angle_rad / self.itinerary.turn_rate_rad_s))
        self.heading_rad = new_rad

    def _stride(self, env: simpy.Environment, leg: Leg, limit_m_s: float) -> Process:
        self._go_to(leg.edge)
        parts = self._phases(leg, limit_m_s)
        duration_us = sum(part.duration_us for part in parts)
        sign = 1.0 if leg.end_m > leg.start_m else -1.0
        for way_point_m, share in self.landmarks.passed(self.itinerary.way_points, leg):
            time_us = env.now + passed_us(parts, share * leg.length_m, share * duration_us)
            self.log.marks.append((time_us, *way_point_m, self._level(leg.edge)))
        ends_m = [part.way_m for part in parts[1:]] + [leg.length_m]
        since_us = 0
        for part, end_m in zip(parts, ends_m, strict=True):
            place = GraphPosition(leg.edge, leg.start_m + sign * part.way_m)
            mean_m_s = (end_m - part.way_m) / part.duration_us * MICROSECONDS_PER_SECOND
            self._knot(env, place, "walking", part, sign * mean_m_s, since_us)
            since_us += part.duration_us
        yield env.timeout(duration_us)

    def _phases(self, leg: Leg, limit_m_s: float) -> list[Phase]:
        pace_m_s, rate_m_s2 = self.itinerary.speed_m_s, self.itinerary.acceleration_m_s2
        if rate_m_s2 is None:
            return steady(leg.length_m, pace_m_s)
        found, self.speed_m_s = phases(self.speed_m_s, pace_m_s, limit_m_s, leg.length_m, rate_m_s2)
        return found

    def _knot(
        self,
        env: simpy.Environment,
        place: GraphPosition,
        state: str,
        part: Phase | None = None,
        edge_speed_m_s: float = 0.0,
        since_us: int = 0,
    ) -> None:
        x_m, y_m = self.landmarks.xy_m(place)
        self.log.knots.append(
            (
                env.now + since_us,
                x_m,
                y_m,
                self._level(place.edge),
                self.heading_rad,
                0.0 if part is None else part.speed_m_s,
                0.0 if part is None else part.acceleration_m_s2,
                place.edge,
                place.offset_m,
                edge_speed_m_s,
                _STATE[state],
            )
        )

    def _go_to(self, edge: int) -> None:
        self.present[self.here] -= 1
        self.present[edge] += 1
        self.here = edge

    def _press(self, env: simpy.Environment, place: GraphPosition) -> None:
        """Mark the start of the route, if it is a way point."""
        x_m, y_m = self.landmarks.xy_m(place)
        points = self.itinerary.way_points
        here = np.hypot(points.xy_m[:, 0] - x_m, points.xy_m[:, 1] - y_m) <= SAME_PLACE_M
        level = self._level(place.edge)
        if np.any(here & (points.level == level)):
            self.log.marks.append((env.now, x_m, y_m, level))

    def _heading_of(self, leg: Leg) -> float:
        x, y = self.graph.direction[leg.edge] * (1.0 if leg.end_m > leg.start_m else -1.0)
        return float(np.arctan2(y, x))

    @staticmethod
    def _angle_rad(old_rad: float, new_rad: float) -> float:
        return abs(float(wrap_angle(new_rad - old_rad)))

    def _level(self, edge: int) -> int:
        return int(self.graph.level[edge])


@dataclass(frozen=True, slots=True, kw_only=True)
class Tour:
    """Scripted walks on a clock that others may share."""

    walkers: tuple[Walker, ...]
    processes: tuple[simpy.Process, ...]

    @classmethod
    def start(
        cls,
        env: simpy.Environment,
        graph: AisleGraph,
        itineraries: tuple[Itinerary, ...],
        present: list[int],
    ) -> Self:
        """Walkers who wait for their time to come; `present` as in `Walker`."""
        landmarks = Landmarks(graph=graph)
        walkers = tuple(
            Walker(landmarks=landmarks, itinerary=itinerary, present=present)
            for itinerary in itineraries
        )
        return cls(
            walkers=walkers,
            processes=tuple(env.process(walker.walk(env)) for walker in walkers),
        )

    def logs(self) -> tuple[WalkLog, ...]:
        """Logs in the order of the itineraries, once all have arrived.

        Raises
        ------
        InvariantError
            If a walker did not arrive.
        """
        for walker, process in zip(self.walkers, self.processes, strict=True):
            if not process.processed:
                raise InvariantError(f"walker '{walker.itinerary.walker}' never arrived")
        return tuple(walker.log for walker in self.walkers)


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
    tour = Tour.start(env, graph, itineraries, [0] * (len(graph.edges) + 1))
    env.run()
    return tour.logs()
