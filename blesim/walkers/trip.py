"""A trip as planned: the legs that lead through its places, beside the centre lines."""

from dataclasses import dataclass
from functools import cache
from math import isnan, nan, pi, sqrt
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel
from blesim.rng import philox, uniform
from blesim.venue.graph import AisleGraph, GraphPosition
from blesim.venue.routes import Routes
from blesim.walkers.clearance import Clearance
from blesim.walkers.motion import free_motion, limits_m_s

# Columns of a plan, after the four of a route.
EDGE, START, END, PLACE, X, Y, LENGTH, HEADING, TURN, RESTS, FACING, FACE, LIMIT = range(13)
# Then what `motion.free_motion` tells.
FREE = 13
_COLUMNS = 17
# Up to this angle people turn while they walk on, if there is time to; assumed.
WALKED_THROUGH_RAD = pi / 3
# Legs along one line but for rounding.
_STRAIGHT_ON = 1.0 - 1e-6
_NO_LENGTH_M = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ground:
    """What a trip is planned on: routes, and room beside the centre lines."""

    routes: Routes
    clearance: Clearance

    @property
    def graph(self) -> AisleGraph:
        """The aisle graph."""
        return self.routes.graph


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Places:
    """Places that a trip leads through, n of them.

    Attributes
    ----------
    edge : ndarray of int64, (n,)
        Rows of edges.
    offset_m : ndarray of float64, (n,)
        Distances from their first nodes. [m]
    rests : ndarray of bool, (n,)
        Whether the walker stands there; others are walked through.
    aside_m : ndarray of float64, (n, 2)
        Where somebody who rests stands, from the centre line; NaN where it is drawn. [m]
    facing_rad : ndarray of float64, (n,)
        Where somebody who rests looks; NaN for straight on. [rad]
    """

    edge: NDArray[np.int64]
    offset_m: NDArray[np.float64]
    rests: NDArray[np.bool_]
    aside_m: NDArray[np.float64]
    facing_rad: NDArray[np.float64]

    @classmethod
    def at(cls, places: list[GraphPosition], rests: list[bool]) -> Self:
        """Places on the graph, to stand anywhere and look anywhere."""
        aside_m, facing_rad = _anywhere(len(places))
        return cls(
            edge=np.array([place.edge for place in places], np.int64),
            offset_m=np.array([place.offset_m for place in places]),
            rests=np.array(rests, dtype=np.bool_),
            aside_m=aside_m.copy(),
            facing_rad=facing_rad.copy(),
        )


@cache
def _anywhere(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """`Places.aside_m` and `Places.facing_rad` of so many places where both are free."""
    return np.full((count, 2), np.nan), np.full(count, np.nan)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mover:
    """How somebody moves: desired speed [m/s], acceleration [m/s2], turning [rad/s]."""

    speed_m_s: float
    rate_m_s2: float
    turn_rate_rad_s: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stance:
    """Where a plan begins: map position, heading, how many turns have been drawn before."""

    x_m: float
    y_m: float
    heading_rad: float
    ordinal: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """Legs of a trip.

    Attributes
    ----------
    start : Stance
        Where it begins.
    legs : ndarray of float64, (legs, 17)
        Edge; offsets where it is entered and left [m]; place it leads to or -1; map position of its
        end [m]; length [m]; heading [rad]; duration of a turn on the spot before it [us]; 1 where
        the walker is at rest at its end; where the walker then looks, NaN for straight on [rad];
        duration of the turn to there [us]; speed permitted at the end [m/s]; motion with nobody in
        the way, see `motion.free_motion`.
    end : Stance
        From where the walker could be sent elsewhere.
    """

    start: Stance
    legs: NDArray[np.float64]
    end: Stance

    def stance(self, row: int) -> Stance:
        """Where the walker stands after leg `row`."""
        leg = self.legs[row].tolist()
        return Stance(
            x_m=leg[X],
            y_m=leg[Y],
            heading_rad=leg[HEADING] if isnan(leg[FACING]) else leg[FACING],
            ordinal=self.end.ordinal,
        )

    def place(self, row: int) -> GraphPosition:
        """Place on the graph at the end of leg `row`."""
        return GraphPosition(int(self.legs[row, EDGE]), float(self.legs[row, END]))


def planned(
    ground: Ground,
    places: Places,
    address: NDArray[np.uint64],
    mover: Mover,
    start: Stance | None = None,
) -> Plan:
    """Plan of a trip through places.

    Each node passed straight on keeps the walker's lane; a turn draws a new one, evenly in the
    disc that all edges there leave free. So no leg comes nearer to a shelf than half a body.

    Parameters
    ----------
    ground : Ground
        Where it happens.
    places : Places
        In order; the first is where the trip begins.
    address : ndarray of uint64, (4,)
        Of the draws for the lanes; see `Draws.address`.
    mover : Mover
        How the walker moves.
    start : Stance or None
        Where the walker stands and looks; drawn, and looking ahead, where not given.

    Raises
    ------
    VenueError
        If no way leads from one place to the next.
    """
    graph = ground.graph
    route = ground.routes.legs(places.edge, places.offset_m)
    stance = np.array([nan, nan, nan, 0.0])
    if start is not None:
        stance = np.array([start.x_m, start.y_m, start.heading_rad, start.ordinal])
    legs, began, ended = _displaced(
        route, places.rests, places.aside_m, places.facing_rad, stance, address,
        graph.ends, graph.node_xy_m, graph.direction,
        ground.clearance.edge_m, ground.clearance.node_m,
        mover.speed_m_s, mover.rate_m_s2, mover.turn_rate_rad_s,
    )  # fmt: skip
    return Plan(start=_stance(began), legs=legs, end=_stance(ended))


def _stance(words: NDArray[np.float64]) -> Stance:
    x_m, y_m, heading_rad, ordinal = words.tolist()
    return Stance(x_m=x_m, y_m=y_m, heading_rad=heading_rad, ordinal=int(ordinal))


@kernel
def _rounded(value: float, decimals: float) -> float:
    return float(np.floor(value * decimals + 0.5) / decimals)


@kernel
def _drawn_aside(address: NDArray[np.uint64], ordinal: int, radius_m: float) -> tuple[float, float]:
    """A place in the disc, evenly; rounded, so that every machine draws the same (kernel)."""
    words = philox(address, np.uint64(ordinal))
    away_m = radius_m * sqrt(uniform(words[0]))
    angle = 2.0 * pi * uniform(words[1])
    # Towards zero, to stay in the disc.
    return (
        np.trunc(away_m * np.cos(angle) * 1e6) / 1e6,
        np.trunc(away_m * np.sin(angle) * 1e6) / 1e6,
    )


@kernel
def _held(aside_x: float, aside_y: float, radius_m: float) -> tuple[float, float]:
    """A displacement, shortened to fit into the disc (kernel)."""
    square = aside_x * aside_x + aside_y * aside_y
    if square <= radius_m * radius_m:
        return aside_x, aside_y
    share = radius_m / sqrt(square)
    return np.trunc(aside_x * share * 1e6) / 1e6, np.trunc(aside_y * share * 1e6) / 1e6


@kernel
def _turned(new_rad: float, old_rad: float) -> float:
    """Angle from one heading to another, -pi to pi (kernel)."""
    turn = new_rad - old_rad
    if turn > pi:
        return turn - 2.0 * pi
    if turn < -pi:
        return turn + 2.0 * pi
    return turn


@kernel
def _turn_us(turn_rad: float, rate_rad_s: float) -> float:
    """Whole microseconds that a turn takes (kernel)."""
    return float(np.floor(abs(turn_rad) * (1e6 / rate_rad_s) + 0.5))


@kernel
def _displaced(
    route: NDArray[np.float64],
    rests: NDArray[np.bool_],
    aside_m: NDArray[np.float64],
    facing_rad: NDArray[np.float64],
    stance: NDArray[np.float64],
    address: NDArray[np.uint64],
    ends: NDArray[np.int64],
    node_xy_m: NDArray[np.float64],
    direction: NDArray[np.float64],
    edge_clear_m: NDArray[np.float64],
    node_clear_m: NDArray[np.float64],
    wish_m_s: float,
    rate_m_s2: float,
    turn_rate_rad_s: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Legs with the ends where the walker passes, stance before and after (kernel)."""
    legs = np.zeros((len(route), _COLUMNS))
    legs[:, :4] = route
    began = stance.copy()
    ordinal = int(stance[3])
    lane_x, lane_y = 0.0, 0.0
    x, y, heading = stance[0], stance[1], stance[2]
    if len(route) == 0:
        return legs, began, stance.copy()
    if np.isnan(x):
        edge = int(route[0, 0])
        lane_x, lane_y = _drawn_aside(address, ordinal, _radius(
            edge, route[0, 1], ends, node_xy_m, direction, edge_clear_m, node_clear_m
        ))  # fmt: skip
        ordinal += 1
        x = _rounded(node_xy_m[ends[edge, 0], 0] + route[0, 1] * direction[edge, 0] + lane_x, 1e6)
        y = _rounded(node_xy_m[ends[edge, 0], 1] + route[0, 1] * direction[edge, 1] + lane_y, 1e6)
    for row in range(len(route)):
        edge, place = int(route[row, 0]), int(route[row, 3])
        at_m = route[row, 2]
        radius_m = _radius(edge, at_m, ends, node_xy_m, direction, edge_clear_m, node_clear_m)
        stops = place >= 0 and rests[place]
        if stops and not np.isnan(aside_m[place, 0]):
            to_x, to_y = _held(aside_m[place, 0], aside_m[place, 1], radius_m)
        else:
            if stops or not _straight_on(route, row, direction):
                lane_x, lane_y = _drawn_aside(address, ordinal, radius_m)
                ordinal += 1
            to_x, to_y = _held(lane_x, lane_y, radius_m)
        end_x = _rounded(node_xy_m[ends[edge, 0], 0] + at_m * direction[edge, 0] + to_x, 1e6)
        end_y = _rounded(node_xy_m[ends[edge, 0], 1] + at_m * direction[edge, 1] + to_y, 1e6)
        dx, dy = end_x - x, end_y - y
        length_m = sqrt(dx * dx + dy * dy)
        if length_m <= _NO_LENGTH_M:
            end_x, end_y, length_m = x, y, 0.0
            ahead = heading
            if np.isnan(ahead):
                ahead = _rounded(np.arctan2(direction[edge, 1], direction[edge, 0]), 1e9)
        else:
            ahead = _rounded(np.arctan2(dy, dx), 1e9)
        if np.isnan(heading):
            heading = ahead
        turn = _turned(ahead, heading)
        first = row == 0
        # Nobody walks the leg faster than wished for: is that time enough to turn?
        walked_through = abs(turn) <= WALKED_THROUGH_RAD
        walked_through &= abs(turn) * wish_m_s <= length_m * turn_rate_rad_s
        if first or legs[row - 1, RESTS] > 0 or not walked_through:
            legs[row, TURN] = _turn_us(turn, turn_rate_rad_s)
            if not first:
                legs[row - 1, RESTS] = 1.0
        if first and np.isnan(began[2]):
            began[0], began[1], began[2] = x, y, ahead
        legs[row, X], legs[row, Y] = end_x, end_y
        legs[row, LENGTH], legs[row, HEADING] = length_m, ahead
        legs[row, RESTS] = 1.0 if stops or row == len(route) - 1 else 0.0
        x, y, heading = end_x, end_y, ahead
        legs[row, FACING] = facing_rad[place] if stops else np.nan
        if stops and not np.isnan(facing_rad[place]):
            heading = facing_rad[place]
            legs[row, FACE] = _turn_us(_turned(heading, ahead), turn_rate_rad_s)
    rest = legs[:, RESTS] > 0.0
    lengths_m = legs[:, LENGTH].copy()
    limits = limits_m_s(lengths_m, np.where(rest, 0.0, np.inf), rate_m_s2)
    legs[:, LIMIT] = limits
    free_motion(lengths_m, limits, rest, wish_m_s, rate_m_s2, legs[:, FREE:])
    return legs, began, np.array([x, y, heading, float(ordinal)])


@kernel
def _radius(
    edge: int,
    at_m: float,
    ends: NDArray[np.int64],
    node_xy_m: NDArray[np.float64],
    direction: NDArray[np.float64],
    edge_clear_m: NDArray[np.float64],
    node_clear_m: NDArray[np.float64],
) -> float:
    """Room around a place of an edge: less at its nodes, where other edges join (kernel)."""
    first, second = ends[edge, 0], ends[edge, 1]
    along_x = node_xy_m[second, 0] - node_xy_m[first, 0]
    along_y = node_xy_m[second, 1] - node_xy_m[first, 1]
    length_m = along_x * direction[edge, 0] + along_y * direction[edge, 1]
    if at_m <= _NO_LENGTH_M:
        return float(node_clear_m[first])
    if at_m >= length_m - _NO_LENGTH_M:
        return float(node_clear_m[second])
    return float(edge_clear_m[edge])


@kernel
def _straight_on(route: NDArray[np.float64], row: int, direction: NDArray[np.float64]) -> bool:
    """Whether the leg after `row` goes the same way, or there is none (kernel)."""
    if row + 1 >= len(route):
        return False
    a, b = int(route[row, 0]), int(route[row + 1, 0])
    ahead = direction[a, 0] * direction[b, 0] + direction[a, 1] * direction[b, 1]
    if route[row, 2] < route[row, 1]:
        ahead = -ahead
    if route[row + 1, 2] < route[row + 1, 1]:
        ahead = -ahead
    return bool(ahead > _STRAIGHT_ON)
