"""How full a venue was, and where in it people spent their time.

Somebody is in the venue from the first knot of the trajectory until just before the last. Nothing
here is sampled but the curve of `occupancy`: knots tell exactly when a person passes a boundary.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blesim.columns import NO_EDGE
from blesim.errors import DataError
from blesim.recording import Crowd, Person, Role
from blesim.tables import Trajectory
from blesim.venue.section_places import SectionPlaces
from blesim.venue.venue import Venue

_US_PER_HOUR = 3.6e9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Occupancy:
    """Number of people in a venue at n evenly spaced times.

    Attributes
    ----------
    time_us : ndarray of int64, (n,)
        Multiples of the step, from not after the first arrival until not before the last departure.
        [us]
    inside : mapping of Role to ndarray of int64, (n,)
        How many of each role are inside; only roles that somebody had. [-]
    """

    time_us: NDArray[np.int64]
    inside: Mapping[Role, NDArray[np.int64]]

    @property
    def total(self) -> NDArray[np.int64]:
        """How many are inside, (n,). [-]."""
        nobody = np.zeros_like(self.time_us)
        total: NDArray[np.int64] = np.sum([nobody, *self.inside.values()], axis=0)
        return total


def occupancy(crowd: Crowd, step_s: float) -> Occupancy:
    """Number of people inside over time, by role.

    Parameters
    ----------
    crowd : Crowd
        Everybody who was there.
    step_s : float
        From one time to the next, at least a microsecond. [s]

    Returns
    -------
    Occupancy
        Without times where nobody ever came.

    Raises
    ------
    DataError
        If the step is not positive.
    """
    step_us = round(step_s * 1e6)
    if step_us <= 0:
        raise DataError(f"a step of {step_s:g} s leads nowhere; give a positive one")
    came_us, left_us = _stays_us(crowd.people)
    if not len(came_us):
        return Occupancy(time_us=np.empty(0, np.int64), inside=MappingProxyType({}))
    first, last = came_us.min() // step_us, -(-left_us.max() // step_us)
    time_us = np.arange(first, last + 1, dtype=np.int64) * step_us
    inside = {
        role: _inside_at([person for person in crowd.people if person.role == role], time_us)
        for role in Role
        if any(person.role == role for person in crowd.people)
    }
    return Occupancy(time_us=time_us, inside=MappingProxyType(inside))


def most_present(crowd: Crowd) -> tuple[int, int | None]:
    """Largest number of people ever inside at once, and when they first were. [-], [us].

    The time is none where nobody came.
    """
    came_us, _ = _stays_us(crowd.people)
    if not len(came_us):
        return 0, None
    time_us = np.sort(came_us)
    inside = _inside_at(crowd.people, time_us)
    fullest = int(np.argmax(inside))
    return int(inside[fullest]), int(time_us[fullest])


def presence_h(crowd: Crowd, venue: Venue) -> NDArray[np.float64]:
    """Person-hours within each product section.

    A section is the stretch of its aisle, from shelf to shelf: where two sections face each other,
    time between them counts for both.

    Parameters
    ----------
    crowd : Crowd
        Whose trajectories name the edges of the venue's graph.
    venue : Venue
        As built.

    Returns
    -------
    ndarray of float64, (sections,)
        Exact, from the knots. [h]
    """
    if venue.graph is None or not venue.sections or not crowd.people:
        return np.zeros(len(venue.sections))
    places = SectionPlaces.of(venue.graph, venue.sections)
    passages = _Passages.of_all([person.trajectory for person in crowd.people])
    pieces_us = _time_in_pieces_us(passages, places)
    piece, section = places.memberships
    summed_us = np.bincount(section, pieces_us[piece], minlength=places.count)
    return np.asarray(summed_us / _US_PER_HOUR, np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SectionVisits:
    """Stops at each product section: how many, and how long in all.

    Attributes
    ----------
    stops : ndarray of int64, (sections,)
        Number of stops. [-]
    dwell_h : ndarray of float64, (sections,)
        Time that all of them took. [h]
    """

    stops: NDArray[np.int64]
    dwell_h: NDArray[np.float64]


def section_visits(crowd: Crowd, venue: Venue) -> SectionVisits:
    """Stops at each product section of the venue.

    Raises
    ------
    DataError
        If a visit names a section that the venue does not have.
    """
    section, count = crowd.visits.section, len(venue.sections)
    if np.any(section >= count):
        raise DataError(f"a visit names section row {section.max()}, but the venue has {count}")
    dwell_us = np.bincount(section, crowd.visits.dwell_us, minlength=count)
    return SectionVisits(
        stops=np.bincount(section, minlength=count).astype(np.int64),
        dwell_h=np.asarray(dwell_us / _US_PER_HOUR, np.float64),
    )


def _stays_us(people: Sequence[Person]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """When each person with a trajectory came and left, two arrays (n,). [us]."""
    known = [person.trajectory.time_us for person in people if len(person.trajectory)]
    came_us, left_us = ([time_us[row] for time_us in known] for row in (0, -1))
    return np.array(came_us, np.int64), np.array(left_us, np.int64)


def _inside_at(people: Sequence[Person], time_us: NDArray[np.int64]) -> NDArray[np.int64]:
    """How many of some people are inside at each of n times, (n,)."""
    came_us, left_us = map(np.sort, _stays_us(people))
    come = np.searchsorted(came_us, time_us, side="right")
    return (come - np.searchsorted(left_us, time_us, side="right")).astype(np.int64)


class _Passages(NamedTuple):
    """Stretches of a trajectory from knot to knot that lie on edges, all arrays (n,)."""

    edge: NDArray[np.int64]
    start_m: NDArray[np.float64]
    end_m: NDArray[np.float64]
    span_us: NDArray[np.float64]
    speed_m_s: NDArray[np.float64]
    acceleration_m_s2: NDArray[np.float64]

    @classmethod
    def of(cls, trajectory: Trajectory) -> "_Passages":
        """Passages of a walk, edges that it leaves unknown left out."""
        span_us = np.diff(trajectory.time_us)
        known = (trajectory.edge[:-1] != NO_EDGE) & (span_us > 0)
        rate_m_s = np.nan_to_num(trajectory.edge_speed_m_s[:-1][known])
        start_m = trajectory.offset_m[:-1][known]
        return cls(
            edge=trajectory.edge[:-1][known].astype(np.int64),
            start_m=start_m.astype(np.float64),
            end_m=(start_m + rate_m_s * span_us[known] * 1e-6).astype(np.float64),
            span_us=span_us[known].astype(np.float64),
            speed_m_s=trajectory.speed_m_s[:-1][known].astype(np.float64),
            acceleration_m_s2=trajectory.acceleration_m_s2[:-1][known].astype(np.float64),
        )

    @classmethod
    def of_all(cls, trajectories: Sequence[Trajectory]) -> "_Passages":
        """Passages of several walks, one walk after the other."""
        parts = zip(*map(cls.of, trajectories), strict=True)
        return cls._make(map(np.concatenate, parts))

    def rows(self, selected: NDArray[np.int64]) -> "_Passages":
        """Selected passages, in that order."""
        return _Passages._make(values[selected] for values in self)

    def elapsed_us(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Time until a share of each passage's way is done, (n,). [us].

        Solves ``v t + a t^2 / 2 = share (v T + a T^2 / 2)`` for t, in the form that holds for
        a = 0 as well: ``t = 2 c / (v + sqrt(v^2 + 2 a c))`` with c the right-hand side.
        """
        span_s = self.span_us * 1e-6
        way_m = (self.speed_m_s + 0.5 * self.acceleration_m_s2 * span_s) * span_s
        done_m = share * way_m
        root = np.sqrt(np.maximum(self.speed_m_s**2 + 2 * self.acceleration_m_s2 * done_m, 0.0))
        moves = (self.acceleration_m_s2 != 0) & (way_m > 0) & (self.speed_m_s + root > 0)
        elapsed_s = 2 * done_m / np.where(moves, self.speed_m_s + root, 1.0)
        return np.where(moves, elapsed_s * 1e6, share * self.span_us)


def _time_in_pieces_us(passages: _Passages, places: SectionPlaces) -> NDArray[np.float64]:
    """Time that passages spend in each piece of the graph, (pieces,). [us]."""
    first = places.piece_at(passages.edge, passages.start_m)
    last = places.piece_at(passages.edge, passages.end_m)
    entered = np.abs(last - first) + 1
    row = np.repeat(np.arange(len(first)), entered)
    number = np.arange(entered.sum()) - np.repeat(np.cumsum(entered) - entered, entered)
    piece = first[row] + np.sign(last - first)[row] * number
    left_us = _left_us(passages.rows(row), piece, number == entered[row] - 1, places)
    since_us = np.where(number == 0, 0.0, np.roll(left_us, 1))
    spent_us = np.bincount(piece, left_us - since_us, minlength=len(places.piece_start_m))
    return np.asarray(spent_us, np.float64)


def _left_us(
    passages: _Passages,
    piece: NDArray[np.int64],
    is_last: NDArray[np.bool_],
    places: SectionPlaces,
) -> NDArray[np.float64]:
    """Time from its start at which each passage leaves a piece it passes through, (n,). [us]."""
    start_m = places.laid_m(passages.edge, passages.start_m)
    way_m = places.laid_m(passages.edge, passages.end_m) - start_m
    # Forwards it leaves where the next piece begins, backwards where its own does.
    leaving = np.minimum(piece + (way_m > 0), len(places.piece_start_m) - 1)
    boundary_m = places.piece_start_m[leaving] - start_m
    share = np.clip(boundary_m / np.where(way_m == 0, 1.0, way_m), 0.0, 1.0)
    return np.where(is_last, passages.span_us, passages.elapsed_us(share))
