"""What is known of somebody who was in the store."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from blesim.tables import Carrying, Trajectory
from blesim.venue.graph import AisleGraph
from blesim.walkers.gait import Gait
from blesim.walkers.knots import Walked, trajectory_of
from blesim.walkers.trip import LENGTH
from blesim.walkers.visit import Visit
from blesim.walkers.visitors import NO_SECTION, NO_SWITCH, Role


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PersonLog:
    """A shopper or an employee, from the door and back.

    Attributes
    ----------
    name, role, group : str
        The group is the name of its first member; empty for somebody alone.
    trajectory : Trajectory
        Exact walk.
    carrying : Carrying
        How the phone was carried.
    gait : Gait
        How the person steps.
    came_us, left_us : int
        In through the door and out of it. [us]
    visits : tuple of (str, int, int)
        Section, time of arrival and how long the person stood there, in order of time. [us]
    planned_m : float
        Length of the way as planned. [m]
    speed_m_s : float
        Desired speed. [m/s]
    turn_rate_rad_s : float
        How fast the person turns. [rad/s]
    """

    name: str
    role: Role
    group: str
    trajectory: Trajectory
    carrying: Carrying
    gait: Gait
    came_us: int
    left_us: int
    visits: tuple[tuple[str, int, int], ...]
    planned_m: float
    speed_m_s: float
    turn_rate_rad_s: float

    @classmethod
    def of(cls, visit: Visit, graph: AisleGraph, sections: tuple[str, ...], gait: Gait) -> Self:
        """Log of a finished visit; `sections` are the ids of the venue's."""
        visitor, walked = visit.visitor, Walked.of(visit)
        at_place = np.flatnonzero(walked.place >= 0)
        section = visitor.section[walked.place[at_place]]
        stopped = (section != NO_SECTION) & (walked.facing_us + walked.dwell_us > 0)[at_place]
        arrived_us, dwell_us = walked.end_us[at_place], walked.dwell_us[at_place]
        return cls(
            name=visitor.name,
            role=visitor.role,
            group=visitor.group,
            trajectory=trajectory_of(walked, graph, visitor.mover),
            carrying=_carrying(visit, walked),
            gait=gait,
            came_us=visit.came_us,
            left_us=visit.left_us,
            visits=tuple(
                (sections[section[row]], int(arrived_us[row]), int(dwell_us[row]))
                for row in np.flatnonzero(stopped)
            ),
            planned_m=float(walked.legs[:, LENGTH].sum()),
            speed_m_s=visitor.mover.speed_m_s,
            turn_rate_rad_s=visitor.mover.turn_rate_rad_s,
        )


def _carrying(visit: Visit, walked: Walked) -> Carrying:
    """How the phone was carried, from the door on."""
    visitor = visit.visitor
    at_place = np.flatnonzero(walked.place >= 0)
    switched = visitor.switched[walked.place[at_place]]
    rows = at_place[switched != NO_SWITCH]
    return Carrying(
        time_us=np.concatenate([[visit.came_us], walked.end_us[rows]]),
        carrying=np.concatenate([[visitor.carrying], switched[switched != NO_SWITCH]]),
    )
