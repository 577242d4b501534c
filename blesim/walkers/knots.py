"""From the strides of a visitor to the exact trajectory."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim import columns
from blesim.tables import Trajectory
from blesim.units import wrap_angle
from blesim.venue.graph import AisleGraph
from blesim.walkers.trip import (
    EDGE,
    FACE,
    FACING,
    HEADING,
    LENGTH,
    PLACE,
    TURN,
    Mover,
    X,
    Y,
)
from blesim.walkers.visit import Visit

Floats = NDArray[np.float64]
_STATE = dict(columns.STATES)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Walked:
    """What a visitor walked, leg by leg, n of them.

    Attributes
    ----------
    legs : ndarray of float64, (n, 17)
        As planned; see `trip.Plan`.
    place : ndarray of int64, (n,)
        Place of the list that each leg led to; -1 for none.
    start_us, end_us : ndarray of int64, (n,)
        When it began and ended. [us]
    from_m_s, held_m_s, to_m_s : ndarray of float64, (n,)
        Speeds at its start, between, at its end. [m/s]
    facing_us, turning_us : ndarray of int64, (n,)
        Turns on the spot: to the shelf after it, and before it. [us]
    first_x_m, first_y_m : float
        Where the walk begins. [m]
    """

    legs: Floats
    place: NDArray[np.int64]
    start_us: NDArray[np.int64]
    end_us: NDArray[np.int64]
    from_m_s: Floats
    held_m_s: Floats
    to_m_s: Floats
    facing_us: NDArray[np.int64]
    turning_us: NDArray[np.int64]
    first_x_m: float
    first_y_m: float

    @classmethod
    def of(cls, visit: Visit) -> Self:
        """Legs of a finished visit."""
        legs, motions = visit.legs(), visit.motions()
        start_us = np.array(visit.starts_us, np.int64)
        listed = visit.parts[0][1]
        place = legs[:, PLACE].astype(np.int64)
        place[listed:] = -1
        start = visit.parts[0][0].start
        return cls(
            legs=legs,
            place=place,
            start_us=start_us,
            end_us=start_us + motions[:, 0].astype(np.int64),
            from_m_s=motions[:, 1],
            held_m_s=motions[:, 2],
            to_m_s=motions[:, 3],
            facing_us=legs[:, FACE].astype(np.int64),
            turning_us=legs[:, TURN].astype(np.int64),
            first_x_m=start.x_m,
            first_y_m=start.y_m,
        )

    @property
    def next_us(self) -> NDArray[np.int64]:
        """When the turn before the next leg begins, and the end of the last, (n,). [us]."""
        return np.append(self.start_us[1:] - self.turning_us[1:], self.end_us[-1])

    @property
    def dwell_us(self) -> NDArray[np.int64]:
        """How long the visitor stood after each leg, turns left out, (n,). [us]."""
        return self.next_us - self.end_us - self.facing_us


def trajectory_of(walked: Walked, graph: AisleGraph, mover: Mover) -> Trajectory:
    """Knots of a walk: where the acceleration, the heading or the state changes.

    A walker beside the centre line is at the offset of the point of the edge nearest by.

    Parameters
    ----------
    walked : Walked
        Legs in order.
    graph : AisleGraph
        What they are on.
    mover : Mover
        How the visitor moves.

    Returns
    -------
    Trajectory
        From the first leg's start to the last one's end.
    """
    moving, moves = _moving(walked, mover.rate_m_s2, mover.turn_rate_rad_s)
    resting, rests = _resting(walked)
    knots = np.concatenate([moving, resting], axis=1).reshape(-1, _FIELDS)
    kept = np.concatenate([moves, rests], axis=1).reshape(-1)
    last = walked.legs[-1]
    end = [walked.end_us[-1], last[X], last[Y], last[HEADING], 0, 0, last[EDGE], 0]
    knots = np.concatenate([knots[kept], [end]])
    edge = knots[:, 6].astype(np.int64)
    offset_m, edge_speed_m_s = _beside(knots, edge, graph)
    return Trajectory(
        time_us=knots[:, 0].astype(np.int64),
        x_m=knots[:, 1],
        y_m=knots[:, 2],
        level=graph.level[edge],
        heading_rad=wrap_angle(knots[:, 3]),
        speed_m_s=knots[:, 4],
        acceleration_m_s2=knots[:, 5],
        edge=edge,
        offset_m=offset_m,
        edge_speed_m_s=edge_speed_m_s,
        state=knots[:, 7].astype(np.int64),
    )


# Time, x, y, heading, speed, acceleration, edge, state.
_FIELDS = 8


def _beside(knots: Floats, edge: NDArray[np.int64], graph: AisleGraph) -> tuple[Floats, Floats]:
    """Offset of each knot on its edge [m], and its mean rate until the next knot [m/s], (n,)."""
    offset_m = _along_m(knots[:, 1:3], edge, graph)
    span_s = np.diff(knots[:, 0]) * 1e-6
    # The next knot may be on another edge, but the walk to it is still on this one.
    rate_m_s = (_along_m(knots[1:, 1:3], edge[:-1], graph) - offset_m[:-1]) / span_s
    speed_m_s, change_m_s2 = knots[:-1, 4], knots[:-1, 5]
    # Times are whole microseconds: over a few of them a rate may come out above the speed.
    fastest_m_s = np.maximum(speed_m_s, speed_m_s + change_m_s2 * span_s)
    return offset_m, np.append(np.clip(rate_m_s, -fastest_m_s, fastest_m_s), 0.0)


def _along_m(xy_m: Floats, edge: NDArray[np.int64], graph: AisleGraph) -> Floats:
    """Offset of the place of each edge that is nearest to a map position, (n,). [m]."""
    way_m = (xy_m - graph.node_xy_m[graph.ends[edge, 0]]) * graph.direction[edge]
    return np.asarray(np.clip(way_m.sum(axis=1), 0.0, graph.length_m[edge]), np.float64)


def _moving(walked: Walked, rate_m_s2: float, turn_rate: float) -> tuple[Floats, NDArray[np.bool_]]:
    """Four knots a leg, (n, 4, fields), and which of them last, (n, 4)."""
    duration_us = walked.end_us - walked.start_us
    duration_s = duration_us * 1e-6
    before_rad = np.concatenate([[walked.legs[0, HEADING]], _heading_after(walked)[:-1]])
    # What was not turned on the spot is turned in walking.
    bend_rad = np.where(
        walked.turning_us > 0, 0.0, wrap_angle(walked.legs[:, HEADING] - before_rad)
    )
    speeding_s = np.minimum(np.abs(walked.held_m_s - walked.from_m_s) / rate_m_s2, duration_s)
    braking_s = np.minimum(np.abs(walked.held_m_s - walked.to_m_s) / rate_m_s2, duration_s)
    bending_s = np.minimum(np.abs(bend_rad) / turn_rate, duration_s)
    zero = np.zeros_like(duration_s)
    at_s = np.stack([zero, speeding_s, duration_s - braking_s, bending_s], axis=1)
    at_s = np.sort(np.maximum(at_s, 0.0), axis=1)
    at_us = np.minimum(np.round(at_s * 1e6).astype(np.int64), duration_us[:, None])
    way_m, speed_m_s, change_m_s2 = _profile(
        walked, at_s, speeding_s, duration_s - braking_s, rate_m_s2
    )
    share = np.divide(
        way_m, walked.legs[:, LENGTH, None], out=np.zeros_like(way_m), where=way_m > 0
    )
    share = np.clip(share, 0.0, 1.0)
    turned = np.divide(
        at_s, bending_s[:, None], out=np.ones_like(at_s), where=bending_s[:, None] > 0
    )
    heading = before_rad[:, None] + np.minimum(turned, 1.0) * bend_rad[:, None]
    heading[walked.turning_us > 0] = walked.legs[walked.turning_us > 0, HEADING, None]
    x_m, y_m = _between(walked, share)
    following_us = np.concatenate([at_us[:, 1:], duration_us[:, None]], axis=1)
    columns_ = (
        walked.start_us[:, None] + at_us, x_m, y_m, heading, speed_m_s, change_m_s2,
        np.broadcast_to(walked.legs[:, EDGE, None], x_m.shape),
        np.full_like(x_m, _STATE["walking"]),
    )  # fmt: skip
    return np.stack(columns_, axis=2), following_us > at_us


def _profile(
    walked: Walked, at_s: Floats, speeding_s: Floats, brakes_s: Floats, rate_m_s2: float
) -> tuple[Floats, Floats, Floats]:
    """Way [m], speed [m/s] and acceleration from then on [m/s2] at times of each leg, (n, 4)."""
    first = np.sign(walked.held_m_s - walked.from_m_s)[:, None] * rate_m_s2
    last = np.sign(walked.to_m_s - walked.held_m_s)[:, None] * rate_m_s2
    early = np.minimum(at_s, speeding_s[:, None])
    late = np.maximum(at_s - brakes_s[:, None], 0.0)
    middle = at_s - early - late
    start, held = walked.from_m_s[:, None], walked.held_m_s[:, None]
    way_m = (
        (start + 0.5 * first * early) * early + held * middle + (held + 0.5 * last * late) * late
    )
    speed_m_s = start + first * early + last * late
    change = np.where(at_s < speeding_s[:, None], first, 0.0)
    change = np.where(at_s >= brakes_s[:, None], last, change)
    return way_m, np.maximum(speed_m_s, 0.0), change


def _between(walked: Walked, share: Floats) -> tuple[Floats, Floats]:
    """Map positions at shares of the legs, two arrays (n, 4). [m]."""
    found = []
    for column, first_m in ((X, walked.first_x_m), (Y, walked.first_y_m)):
        to_m = walked.legs[:, column, None]
        from_m = np.concatenate([[first_m], walked.legs[:-1, column]])[:, None]
        found.append(from_m + share * (to_m - from_m))
    return found[0], found[1]


def _heading_after(walked: Walked) -> Floats:
    """Heading after each leg, once turned to the shelf, (n,). [rad]."""
    facing, heading = walked.legs[:, FACING], walked.legs[:, HEADING]
    return np.where(np.isnan(facing), heading, facing)


def _resting(walked: Walked) -> tuple[Floats, NDArray[np.bool_]]:
    """Three knots after each leg, (n, 3, fields): turning to the shelf, standing, turning away."""
    faced_us = walked.end_us + walked.facing_us
    time_us = np.stack([walked.end_us, faced_us, walked.next_us], axis=1)
    until_us = np.append(walked.start_us[1:], walked.end_us[-1])
    following_us = np.concatenate([time_us[:, 1:], until_us[:, None]], axis=1)
    knots = np.zeros((len(time_us), 3, _FIELDS))
    knots[:, :, 0] = time_us
    for field, column in ((1, X), (2, Y), (6, EDGE)):
        knots[:, :, field] = walked.legs[:, column, None]
    knots[:, 0, 3] = walked.legs[:, HEADING]
    knots[:, 1:, 3] = _heading_after(walked)[:, None]
    knots[:, :, 7] = (_STATE["turning"], _STATE["standing"], _STATE["turning"])
    return knots, following_us > time_us
