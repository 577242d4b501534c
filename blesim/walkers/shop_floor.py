"""A store while it is open: everybody in it as SimPy processes, and who waits for what."""

from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import simpy
from simpy.events import Timeout
from simpy.resources.resource import Request

from blesim.errors import InvariantError
from blesim.units import MICROSECONDS_PER_SECOND
from blesim.venue.graph import GraphPosition
from blesim.walkers.motion import SLOWEST, crowd_factors, stretch_walked
from blesim.walkers.tills import Party, Till
from blesim.walkers.trip import (
    EDGE,
    FACE,
    FREE,
    LENGTH,
    LIMIT,
    PLACE,
    RESTS,
    TURN,
    Ground,
    Places,
    Plan,
    planned,
)
from blesim.walkers.visitors import Visitor

Process = Generator[simpy.Event, Any, None]
# Duration [us]; speed at the start, speed held, speed at the end [m/s].
Motion = tuple[int, float, float, float]
# Turning to what one looks at, then waiting, below zero until when. [us]
Rest = tuple[int, int]
# Edge, turn before [us], motion with nobody in the way, rest at the end, length [m], limit [m/s].
LegRow = tuple[int, int, Motion, Rest | None, float, float]

_NOWHERE = -1
_NO_WAIT = [0, 0, 0]
# At rest only to turn.
_BEND: Rest = (0, 0)
_TOLD = 5
Progress = Callable[[int, int], None]
_PROGRESS_STEP_US = 300 * MICROSECONDS_PER_SECOND


@dataclass(slots=True, eq=False)
class Visit:
    """What becomes of a visitor, written down as it happens.

    Attributes
    ----------
    visitor : Visitor
        Who.
    rows : list of LegRow
        Legs of the list, until the visitor sets out.
    came_us, left_us : int
        In through the door and out of it; -1 where that did not happen. [us]
    starts_us : list of int
        When each leg walked began. [us]
    motions : list of Motion
        How it was walked.
    parts : list of (Plan, int)
        Plans followed, and how many legs of each.
    waits_for : str
        What for, while the visitor waits for somebody else.
    """

    visitor: Visitor
    rows: list[LegRow]
    came_us: int = -1
    left_us: int = -1
    starts_us: list[int] = field(default_factory=list)
    motions: list[Motion] = field(default_factory=list)
    parts: list[tuple[Plan, int]] = field(default_factory=list)
    waits_for: str = ""


@dataclass(slots=True, eq=False)
class ShopFloor:
    """The store and its clock.

    Attributes
    ----------
    env : simpy.Environment
        Clock of whole microseconds.
    ground : Ground
        Where people walk.
    exit : GraphPosition
        Where they leave.
    door : simpy.Resource
        As many places as the store holds shoppers.
    tills : list of Till
        Where they pay.
    closed : simpy.Event
        Happens when the doors shut.
    closes_us : int
        When that is. [us]
    present : list of int
        How many are on each edge, and nowhere as the last.
    factors : list of list of float
        Share of the desired speed on each edge by the number of others there.
    free_up_to : list of int
        How many others on each edge slow nobody down.
    till_ways_m : list of list of float
        Way from the middle of each edge to each till. [m]
    """

    env: simpy.Environment
    ground: Ground
    exit: GraphPosition
    door: simpy.Resource
    tills: list[Till]
    closed: simpy.Event
    closes_us: int
    present: list[int]
    factors: list[list[float]]
    free_up_to: list[int]
    till_ways_m: list[list[float]]
    visits: list[Visit] = field(default_factory=list)
    parties: dict[str, Party] = field(default_factory=dict)
    processes: list[tuple[simpy.Process, Visit]] = field(default_factory=list)
    gone: int = 0

    @classmethod
    def open(
        cls,
        ground: Ground,
        exit_node: str,
        capacity: int,
        tills: tuple[str, ...],
        servers: int,
        closes_us: int,
    ) -> "ShopFloor":
        """A store in which nobody is yet."""
        env = simpy.Environment()
        graph = ground.graph
        factors = crowd_factors(graph.length_m * ground.clearance.width_m)
        places = [graph.at_node(node) for node in tills]
        ways_m = ground.routes.length_m(
            np.arange(len(graph.edges))[:, None],
            graph.length_m[:, None] / 2,
            np.array([place.edge for place in places]),
            np.array([place.offset_m for place in places]),
        )
        return cls(
            env=env,
            ground=ground,
            exit=graph.at_node(exit_node),
            door=simpy.Resource(env, capacity),
            tills=[
                Till(node=node, place=place, desk=simpy.Resource(env, servers))
                for node, place in zip(tills, places, strict=True)
            ],
            closed=env.timeout(closes_us),
            closes_us=closes_us,
            present=[0] * (len(graph.edges) + 1),
            factors=factors,
            free_up_to=[sum(factor == 1.0 for factor in slowed) - 1 for slowed in factors],
            till_ways_m=np.round(ways_m, 6).tolist(),
        )

    def expect(self, visitors: Iterable[Visitor]) -> None:
        """Await visitors, in any order."""
        self.visits = [
            Visit(visitor=visitor, rows=_rows(visitor.plan, visitor.wait_us.tolist()))
            for visitor in visitors
        ]
        coming = sorted(self.visits, key=lambda visit: visit.visitor.comes_us)
        self.env.process(self._arrive(coming))

    def _arrive(self, coming: list[Visit]) -> Process:
        """One process brings all to the door: the queue of events holds only who is there."""
        for visit in coming:
            yield Timeout(self.env, visit.visitor.comes_us - int(self.env.now))
            self.processes.append((self.env.process(self._stay(visit)), visit))

    def run(self, progress: Progress | None = None) -> None:
        """Let time pass until everybody has gone.

        Parameters
        ----------
        progress : callable or None
            Told now and then how many visitors are gone, and of how many.

        Raises
        ------
        InvariantError
            If some wait for each other, or for what never comes.
        """
        if progress is None:
            self.env.run()
        else:
            while self.env.peek() < float("inf"):
                self.env.run(until=int(self.env.now) + _PROGRESS_STEP_US)
                # SimPy leaves the event that stopped it in the queue, for ever another one.
                self.env.step()
                progress(self.gone, len(self.visits))
        self._refuse_deadlock()

    def _stay(self, visit: Visit) -> Process:
        """The process of a visitor: door, list, till, door. One generator, as it is run often."""
        env, present, visitor = self.env, self.present, visit.visitor
        factors, free_up_to = self.factors, self.free_up_to
        speed_m_s, rate_m_s2 = visitor.mover.speed_m_s, visitor.mover.rate_m_s2
        shops = visitor.role == "shopper"
        leave_by_us, starts_us, motions = visitor.leave_by_us, visit.starts_us, visit.motions
        place_inside: Request | None = None
        if shops:
            place_inside = self.door.request()
            if not place_inside.triggered:
                visit.waits_for = "a place in the store"
                yield place_inside | self.closed
                visit.waits_for = ""
            if env.now >= self.closes_us:
                place_inside.cancel()
                self.door.release(place_inside)
                self.gone += 1
                return
        # The process keeps the time itself: asking the clock is a call more a leg.
        visit.came_us = now_us = int(env.now)
        plan = visitor.plan
        rows, visit.rows = visit.rows, []
        here, now_m_s = _NOWHERE, 0.0
        shopping, paying = True, False
        while True:
            before = len(motions)
            for edge, turn_us, motion, rest, length_m, limit_m_s in rows:
                if turn_us:
                    yield Timeout(env, turn_us)
                    now_us += turn_us
                if edge != here:
                    present[here] -= 1
                    present[edge] += 1
                    here = edge
                others = present[edge] - 1
                if others > free_up_to[edge] or now_m_s != motion[1]:
                    slowed = factors[edge]
                    factor = slowed[others] if others < len(slowed) else SLOWEST
                    seconds, held_m_s, end_m_s = stretch_walked(
                        now_m_s, speed_m_s * factor, limit_m_s, length_m, rate_m_s2
                    )
                    motion = (int(seconds * 1e6 + 0.5), now_m_s, held_m_s, end_m_s)
                starts_us.append(now_us)
                motions.append(motion)
                yield Timeout(env, motion[0])
                now_us += motion[0]
                if rest is None:
                    now_m_s = motion[3]
                    continue
                now_m_s = 0.0
                if rest is not _BEND:
                    stay_us = rest[1] if rest[1] >= 0 else max(-rest[1] - now_us, 0)
                    if shopping and now_us + stay_us > leave_by_us:
                        stay_us = max(leave_by_us - now_us, 0)
                    yield Timeout(env, rest[0] + stay_us)
                    now_us += rest[0] + stay_us
                if shopping and now_us >= leave_by_us:
                    break
            walked = len(motions) - before
            if shopping:
                shopping, paying = False, shops
                visit.parts.append((plan, walked))
                plan = self._way_out(visit, plan, walked)
                rows = _rows(plan, _NO_WAIT)
                if paying:
                    visit.parts.append((plan, len(plan.legs)))
                    at_till = int(np.flatnonzero(plan.legs[:, PLACE] == 1)[0]) + 1
                    rows, later = rows[:at_till], rows[at_till:]
                else:
                    visit.parts.append((plan, len(plan.legs)))
            elif paying:
                yield from self._pay(visit)
                now_us = int(env.now)
                paying, rows = False, later
            else:
                break
        present[here] -= 1
        visit.left_us = now_us
        self.gone += 1
        if place_inside is not None:
            self.door.release(place_inside)

    def _way_out(self, visit: Visit, plan: Plan, walked: int) -> Plan:
        """Plan from where a visitor is to the exit, by a till for shoppers."""
        visitor = visit.visitor
        here = plan.place(walked - 1)
        places = [here, self.exit]
        if visitor.role == "shopper":
            party = self.parties.setdefault(visitor.group or visitor.name, Party())
            if party.till is None:
                party.till = self._shortest_queue(here)
                party.till.bound += 1
            places.insert(1, party.till.place)
        return planned(
            self.ground,
            Places.at(places, [True] * len(places)),
            visitor.lanes,
            visitor.mover,
            plan.stance(walked - 1),
        )

    def _shortest_queue(self, here: GraphPosition) -> Till:
        """Till to which the fewest are bound; of several the nearest from the edge's middle."""
        away_m = self.till_ways_m[here.edge]
        row = min(range(len(self.tills)), key=lambda k: (self.tills[k].bound, away_m[k]))
        return self.tills[row]

    def _pay(self, visit: Visit) -> Process:
        """Stand in line and pay; of a group, who comes first pays for all."""
        visitor = visit.visitor
        party = self.parties[visitor.group or visitor.name]
        till = party.till
        if till is None:
            raise InvariantError(f"'{visitor.name}' wants to pay, but at no till")
        if party.paid is not None:
            visit.waits_for = "the one who pays"
            yield party.paid
            visit.waits_for = ""
            return
        party.paid = self.env.event()
        turn = till.desk.request()
        if not turn.triggered:
            visit.waits_for = f"till '{till.node}'"
            yield turn
            visit.waits_for = ""
        till.serves.append(visitor.name)
        yield Timeout(self.env, visitor.service_us)
        till.serves.remove(visitor.name)
        till.bound -= 1
        till.desk.release(turn)
        party.paid.succeed()

    def _refuse_deadlock(self) -> None:
        stuck = [visit for process, visit in self.processes if process.is_alive]
        if not stuck:
            return
        told = "; ".join(self._whom(visit) for visit in stuck[:_TOLD])
        more = f"; and {len(stuck) - _TOLD} more" if len(stuck) > _TOLD else ""
        at_s = self.env.now / MICROSECONDS_PER_SECOND
        raise InvariantError(f"deadlock {at_s:.0f} s after opening: {told}{more}")

    def _whom(self, visit: Visit) -> str:
        """What somebody waits for, and who has it."""
        who, what = visit.visitor.name, visit.waits_for or "nothing that is known"
        for till in self.tills:
            if what == f"till '{till.node}'":
                served = ", ".join(till.serves) or f"{till.desk.count} who are gone"
                return f"'{who}' waits for {what}, which serves {served}"
        return f"'{who}' waits for {what}"


def _rows(plan: Plan, wait_us: list[int]) -> list[LegRow]:
    """Legs of a plan as the process reads them; waits are those of the plan's places."""
    rows: list[LegRow] = []
    for leg in plan.legs.tolist():
        rest: Rest | None = None
        if leg[RESTS]:
            wait = wait_us[int(leg[PLACE])] if leg[PLACE] >= 0 else 0
            rest = (int(leg[FACE]), wait) if wait or leg[FACE] else _BEND
        free = (int(leg[FREE]), *leg[FREE + 1 :])
        rows.append((int(leg[EDGE]), int(leg[TURN]), free, rest, leg[LENGTH], leg[LIMIT]))
    return rows
