"""Laws that every finished day obeys; one that does not is a fault of blesim."""

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim import columns
from blesim.errors import InvariantError
from blesim.tables import Trajectory
from blesim.units import wrap_angle
from blesim.venue.graph import AisleGraph
from blesim.venue.venue import Venue
from blesim.walkers.clearance import graph_of
from blesim.walkers.person import PersonLog
from blesim.walkers.shop_floor import ShopFloor
from blesim.walkers.visit import Visit

# Recorded positions are rounded to a micrometre.
_ROUNDING_M = 1e-5
_WALKING = dict(columns.STATES)["walking"]


def check_visits(floor: ShopFloor) -> None:
    """Raise `InvariantError` unless everybody who came has left and all counts add up."""
    inside = [visit for visit in floor.visits if visit.came_us >= 0]
    staying = [visit.visitor.name for visit in inside if visit.left_us < visit.came_us]
    if staying:
        raise InvariantError(f"'{staying[0]}' and {len(staying) - 1} more came but never left")
    away = [visit for visit in floor.visits if visit.came_us < 0]
    if len(inside) + len(away) != floor.gone:
        raise InvariantError(f"{floor.gone} are gone, but {len(inside)} left, {len(away)} waited")
    if floor.door.count or any(till.bound or till.desk.count for till in floor.tills):
        raise InvariantError("somebody who is gone still holds a place in the store or at a till")
    if any(floor.present[:-1]):
        edge = next(row for row, count in enumerate(floor.present[:-1]) if count)
        raise InvariantError(f"edge {edge} is left with {floor.present[edge]} people on it")
    for visit in inside:
        _check_order(visit)


def _check_order(visit: Visit) -> None:
    start_us, duration_us = np.array(visit.starts_us), visit.motions()[:, 0].astype(np.int64)
    ended_us = np.concatenate([[visit.came_us], (start_us + duration_us)[:-1]])
    name = visit.visitor.name
    if np.any(start_us < ended_us) or np.any(duration_us < 0):
        raise InvariantError(f"'{name}' walks before having arrived")
    if visit.came_us < visit.visitor.comes_us:
        raise InvariantError(f"'{name}' came in before being at the door")
    if start_us[-1] + duration_us[-1] > visit.left_us:
        raise InvariantError(f"'{name}' walks on after having left")


def check_people(people: Sequence[PersonLog], venue: Venue) -> None:
    """Raise `InvariantError` if somebody left the walkable area, the route or the limits of pace.

    Parameters
    ----------
    people : sequence of PersonLog
        Everybody.
    venue : Venue
        Where they were.
    """
    graph = graph_of(venue)
    for person in people:
        _check_walk(person)
        _refuse_other_edges(person, graph)
    lines = [_line(person.trajectory) for person in people]
    levels = np.array([person.trajectory.level[0] for person in people])
    for level in np.unique(levels):
        rows = np.flatnonzero(levels == level)
        area = shapely.buffer(venue.floor_plan.walkable[int(level)], _ROUNDING_M)
        shapely.prepare(area)
        outside = rows[~shapely.covers(area, np.array([lines[row] for row in rows], object))]
        if len(outside):
            name = people[outside[0]].name
            raise InvariantError(f"'{name}' walked through a shelf or a wall of level {level}")


def _line(trajectory: Trajectory) -> shapely.LineString:
    xy_m = np.stack([trajectory.x_m, trajectory.y_m], axis=1)
    moves = np.append(np.any(np.diff(xy_m, axis=0) != 0, axis=1), True)
    # A line needs two ends, even where somebody never moved.
    kept = xy_m[moves] if moves.sum() > 1 else xy_m[[0, -1]]
    return shapely.LineString(kept)


def _check_walk(person: PersonLog) -> None:
    trajectory = person.trajectory
    if np.any(np.diff(trajectory.time_us) <= 0):
        raise InvariantError(f"'{person.name}': times do not ascend")
    way_m = np.hypot(np.diff(trajectory.x_m), np.diff(trajectory.y_m))
    _refuse_other_length(person, float(way_m.sum()), len(trajectory))
    # On the line of speed between two knots the fastest moment is at one of its ends.
    span_s = np.diff(trajectory.time_us) * 1e-6
    if _fastest_m_s(trajectory).max() > person.speed_m_s + 1e-5:
        raise InvariantError(f"'{person.name}' walked faster than desired")
    turned_rad = np.abs(wrap_angle(np.diff(trajectory.heading_rad)))
    # Times are rounded to a microsecond, headings to a millionth.
    if np.any(turned_rad > person.turn_rate_rad_s * (span_s + 2e-6) + 1e-5):
        raise InvariantError(f"'{person.name}' turned faster than a person of that pace does")
    if (trajectory.time_us[0], trajectory.time_us[-1]) != (person.came_us, person.left_us):
        raise InvariantError(f"'{person.name}': the walk does not last from door to door")
    if np.any(way_m[trajectory.state[:-1] != _WALKING] > 0):
        raise InvariantError(f"'{person.name}' moved while standing")
    _refuse_other_speed(person, way_m)


def _fastest_m_s(trajectory: Trajectory) -> NDArray[np.float64]:
    """Highest speed from each knot to the next, (n - 1,). [m/s]."""
    first_m_s = trajectory.speed_m_s[:-1]
    change_m_s = trajectory.acceleration_m_s2[:-1] * np.diff(trajectory.time_us) * 1e-6
    return np.asarray(first_m_s + np.maximum(change_m_s, 0.0), np.float64)


def _refuse_other_edges(person: PersonLog, graph: AisleGraph) -> None:
    """Raise if offsets leave their edges, or run along them faster than the person walks."""
    trajectory = person.trajectory
    beyond_m = trajectory.offset_m - graph.length_m[trajectory.edge]
    if trajectory.offset_m.min() < 0.0 or beyond_m.max() > _ROUNDING_M:
        raise InvariantError(f"'{person.name}': an offset lies beyond the end of its edge")
    if np.any(np.abs(trajectory.edge_speed_m_s[:-1]) > _fastest_m_s(trajectory) + 1e-5):
        raise InvariantError(f"'{person.name}' moved along an edge faster than walking")


def _refuse_other_length(person: PersonLog, walked_m: float, knots: int) -> None:
    if abs(walked_m - person.planned_m) > knots * 2e-6:
        raise InvariantError(
            f"'{person.name}' walked {walked_m:.6f} m of a route of {person.planned_m:.6f} m"
        )


def _refuse_other_speed(person: PersonLog, way_m: NDArray[np.float64]) -> None:
    """Raise if speeds and accelerations at the knots do not lead from knot to knot."""
    trajectory = person.trajectory
    span_s = np.diff(trajectory.time_us) * 1e-6
    speed, change = trajectory.speed_m_s[:-1], trajectory.acceleration_m_s2[:-1]
    told_m = (speed + 0.5 * change * span_s) * span_s
    # Speeds are recorded to a millionth, times to a microsecond.
    if np.any(np.abs(told_m - way_m) > 2e-5 + 2e-6 * span_s + 1e-6 * span_s**2):
        raise InvariantError(f"'{person.name}': speeds do not lead from knot to knot")
