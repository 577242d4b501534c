"""A visit as it happens: the legs that a visitor follows at present, and what is written down."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel
from blesim.walkers.motion import SLOWEST, stretch_walked
from blesim.walkers.trip import (
    EDGE,
    FACE,
    FREE,
    LENGTH,
    LIMIT,
    PLACE,
    RESTS,
    TURN,
    Mover,
    Plan,
)
from blesim.walkers.visitors import Visitor

# Duration [us]; speed at the start, speed held, speed at the end [m/s].
Motion = tuple[int, float, float, float]
# Later than anything that happens, and yet the sum of two is a whole number of 64 bits.
NEVER_US = 2**61
_NO_WAIT = np.zeros(3, np.int64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """Legs to be walked one after the other, unless the visitor breaks off.

    Attributes
    ----------
    plan : Plan
        Whose legs they are.
    wait_us : ndarray of int64, (places,)
        How long to wait at each place of the plan; see `visitors.Errand`. [us]
    first, end : int
        Rows of the first leg, and after the last.
    turn_us : int
        Turn on the spot before the first. [us]
    edges : list of int
        Edge of each leg.
    spans_us : list of int
        From the start of each leg to that of the next with nobody in the way: nobody else is
        touched by turns and stays, so they need no event of their own. `NEVER_US` where that
        depends on the time. [us]
    leave_by_us : int
        When the visitor breaks off. [us]
    """

    plan: Plan
    wait_us: NDArray[np.int64]
    first: int
    end: int
    turn_us: int
    edges: list[int]
    spans_us: list[int]
    leave_by_us: int

    @classmethod
    def along(
        cls,
        plan: Plan,
        first: int,
        end: int,
        wait_us: NDArray[np.int64] = _NO_WAIT,
        leave_by_us: int = NEVER_US,
    ) -> Self:
        """Course along some legs of a plan."""
        edges, spans_us = _strides(plan.legs, wait_us, first, end).tolist()
        return cls(
            plan=plan,
            wait_us=wait_us,
            first=first,
            end=end,
            turn_us=int(plan.legs[first, TURN]),
            edges=edges,
            spans_us=spans_us,
            leave_by_us=leave_by_us,
        )

    def hindered(
        self, row: int, now_us: int, now_m_s: float | None, factor: float, mover: Mover
    ) -> tuple[Motion, int, float | None, bool]:
        """How a leg is walked that does not go as planned.

        Parameters
        ----------
        row : int
            Of the leg.
        now_us : int
            When it begins. [us]
        now_m_s : float or None
            Speed; as planned where not given. [m/s]
        factor : float
            Share of the desired speed that others leave. [-]
        mover : Mover
            How the visitor moves.

        Returns
        -------
        motion : Motion
            How it is walked.
        span_us : int
            From its start to that of the next leg, or until the visitor breaks off. [us]
        next_m_s : float or None
            Speed at its end, none where that is as planned. [m/s]
        breaks : bool
            Whether the visitor breaks off.
        """
        leg = self.plan.legs[row].tolist()
        motion: Motion = (int(leg[FREE]), *leg[FREE + 1 :])
        planned_m_s, next_m_s = motion[3], None
        if factor < 1.0 or (now_m_s is not None and now_m_s != motion[1]):
            start_m_s = motion[1] if now_m_s is None else now_m_s
            seconds, held_m_s, end_m_s = stretch_walked(
                start_m_s, mover.speed_m_s * factor, leg[LIMIT], leg[LENGTH], mover.rate_m_s2
            )
            motion = (int(seconds * 1e6 + 0.5), start_m_s, held_m_s, end_m_s)
            next_m_s = None if end_m_s == planned_m_s else end_m_s
        span_us = motion[0]
        if leg[RESTS]:
            next_m_s = None
            span_us += self._rest_us(leg, now_us + span_us)
            if now_us + span_us >= self.leave_by_us:
                return motion, span_us, None, True
        if row + 1 < self.end:
            span_us += int(self.plan.legs[row + 1, TURN])
        return motion, span_us, next_m_s, False

    def _rest_us(self, leg: list[float], now_us: int) -> int:
        """Turning to what one looks at, and waiting there until it is time to go. [us]."""
        place, facing_us = int(leg[PLACE]), int(leg[FACE])
        wait_us = int(self.wait_us[place]) if place >= 0 else 0
        if not (wait_us or facing_us):
            return 0
        stay_us = wait_us if wait_us >= 0 else max(-wait_us - now_us, 0)
        return facing_us + min(stay_us, max(self.leave_by_us - now_us, 0))


@kernel
def _strides(
    legs: NDArray[np.float64], wait_us: NDArray[np.int64], first: int, end: int
) -> NDArray[np.int64]:
    """Edges and spans of a course, (2, legs) (kernel)."""
    strides = np.empty((2, end - first), np.int64)
    for row in range(first, end):
        span_us = int(legs[row, FREE])
        place = int(legs[row, PLACE])
        if legs[row, RESTS] > 0.0:
            span_us += int(legs[row, FACE])
            if place >= 0:
                span_us = span_us + wait_us[place] if wait_us[place] >= 0 else NEVER_US
        if row + 1 < end:
            span_us += int(legs[row + 1, TURN])
        strides[0, row - first] = int(legs[row, EDGE])
        strides[1, row - first] = span_us
    return strides


@dataclass(slots=True, eq=False)
class Visit:
    """What becomes of a visitor, written down as it happens.

    Attributes
    ----------
    visitor : Visitor
        Who.
    came_us, left_us : int
        In through the door and out of it; -1 where that did not happen. [us]
    starts_us : list of int
        When each leg walked began. [us]
    hindrances : list of (int, Motion)
        Legs that were not walked as planned, as numbers of `starts_us`, and how they were.
    parts : list of (Plan, int)
        Plans followed, and how many legs of each.
    waits_for : str
        What for, while the visitor waits for somebody else.
    gone : bool
        Whether the visitor has left, or will not come in any more.
    """

    visitor: Visitor
    came_us: int = -1
    left_us: int = -1
    starts_us: list[int] = field(default_factory=list)
    hindrances: list[tuple[int, Motion]] = field(default_factory=list)
    parts: list[tuple[Plan, int]] = field(default_factory=list)
    waits_for: str = ""
    gone: bool = False

    def legs(self) -> NDArray[np.float64]:
        """Legs that the visitor followed, (n, 17); see `trip.Plan`."""
        return np.concatenate([plan.legs[:count] for plan, count in self.parts])

    def motions(self) -> NDArray[np.float64]:
        """How they were walked, (n, 4), with the columns of `Motion`."""
        motions = self.legs()[:, FREE : FREE + 4]
        for row, motion in self.hindrances:
            motions[row] = motion
        return motions


def crowd_factor_of(slowed: list[float], others: int) -> float:
    """Share of the desired speed on a stretch, from its list of `motion.crowd_factors`. [-]."""
    return slowed[others] if others < len(slowed) else SLOWEST
