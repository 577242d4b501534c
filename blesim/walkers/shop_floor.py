"""A store while it is open: everybody in it as SimPy processes, and who waits for what."""

from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import simpy
from simpy.resources.resource import Request

from blesim.errors import InvariantError, UsageError
from blesim.units import MICROSECONDS_PER_SECOND
from blesim.venue.graph import GraphPosition
from blesim.walkers.alarm import Alarm
from blesim.walkers.door import Door
from blesim.walkers.motion import crowd_factors
from blesim.walkers.tills import Party, Till
from blesim.walkers.trip import PLACE, Ground, Places, planned
from blesim.walkers.visit import Course, Visit, crowd_factor_of
from blesim.walkers.visitors import Visitor

Process = Generator[simpy.Event, Any, None]
Progress = Callable[[int, int], None]

_NOWHERE = -1
_NOT_NOW = -1
_TOLD = 5
_PROGRESS_STEP_US = 300 * MICROSECONDS_PER_SECOND
# So long after closing somebody may still be paying; assumed.
_LAST_OUT_H = 12
_HOUR_US = 3600 * MICROSECONDS_PER_SECOND


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
    door : Door
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
        How many on each edge slow nobody down, oneself among them.
    till_ways_m : list of list of float
        Way from the middle of each edge to each till. [m]
    """

    env: simpy.Environment
    ground: Ground
    exit: GraphPosition
    door: Door
    tills: list[Till]
    closed: simpy.Event
    closes_us: int
    present: list[int]
    factors: list[list[float]]
    free_up_to: list[int]
    till_ways_m: list[list[float]]
    visits: list[Visit] = field(default_factory=list)
    parties: dict[str, Party] = field(default_factory=dict)
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
            door=Door(env, capacity),
            tills=[
                Till(node=node, place=place, desk=simpy.Resource(env, servers))
                for node, place in zip(tills, places, strict=True)
            ],
            closed=env.timeout(closes_us),
            closes_us=closes_us,
            present=[0] * (len(graph.edges) + 1),
            factors=factors,
            free_up_to=[sum(factor == 1.0 for factor in slowed) for slowed in factors],
            till_ways_m=np.round(ways_m, 6).tolist(),
        )

    def expect(self, visitors: Iterable[Visitor]) -> None:
        """Await visitors, in any order."""
        self.visits = [Visit(visitor=visitor) for visitor in visitors]
        coming = sorted(self.visits, key=lambda visit: visit.visitor.comes_us)
        self.env.process(self._arrive(coming))

    def _arrive(self, coming: list[Visit]) -> Process:
        """One process brings all to the door: the queue of events holds only who is there."""
        alarm = Alarm(self.env)
        for visit in coming:
            yield alarm.after(visit.visitor.comes_us - int(self.env.now))
            self.env.process(self._stay(visit))

    def run(self, progress: Progress | None = None) -> None:
        """Let time pass until everybody has gone.

        Parameters
        ----------
        progress : callable or None
            Told now and then how many visitors are gone, and of how many.

        Raises
        ------
        UsageError
            If the tills cannot serve everybody within half a day after closing.
        InvariantError
            If some wait for each other, or for what never comes.
        """
        if progress is None:
            self.env.run()
        else:
            while self.env.peek() < float("inf"):
                self.env.run(until=int(self.env.peek()) + _PROGRESS_STEP_US)
                # SimPy leaves the event that stopped it in the queue, for ever another one.
                self.env.step()
                progress(self.gone, len(self.visits))
        self._refuse_deadlock()

    def _stay(self, visit: Visit) -> Process:
        """The process of a visitor: door, list, till, door. One generator, as it is run often."""
        env, present, free_up_to = self.env, self.present, self.free_up_to
        visitor, starts_us, after = visit.visitor, visit.starts_us, Alarm(self.env).after
        place_inside: Request | None = None
        if visitor.role == "shopper":
            place_inside = self.door.request()
            if not place_inside.triggered:
                visit.waits_for = "a place in the store"
                yield place_inside | self.closed
                visit.waits_for = ""
            if env.now >= self.closes_us:
                place_inside.cancel()
                self.door.release(place_inside)
                self._count_out(visit)
                return
        # The process keeps the time itself: asking the clock is a call more a leg.
        visit.came_us = now_us = int(env.now)
        here = _NOWHERE
        now_m_s: float | None = None
        course: Course | None = Course.along(
            visitor.plan, 0, len(visitor.plan.legs), visitor.wait_us, visitor.leave_by_us
        )
        while course is not None:
            if course.turn_us:
                yield after(course.turn_us)
                now_us += course.turn_us
            begun, as_planned_until_us = len(starts_us), course.leave_by_us
            for edge, span_us in zip(course.edges, course.spans_us, strict=True):
                if edge != here:
                    present[here] -= 1
                    present[edge] += 1
                    here = edge
                starts_us.append(now_us)
                then_us = now_us + span_us
                if then_us < as_planned_until_us and present[edge] <= free_up_to[edge]:
                    yield after(span_us)
                    now_us = then_us
                    continue
                row = len(starts_us) - 1
                motion, span_us, now_m_s, breaks = course.hindered(
                    course.first + row - begun,
                    now_us,
                    now_m_s,
                    crowd_factor_of(self.factors[edge], present[edge] - 1),
                    visitor.mover,
                )
                visit.hindrances.append((row, motion))
                # At another speed than planned the next leg is none of those planned either.
                as_planned_until_us = course.leave_by_us if now_m_s is None else _NOT_NOW
                yield after(span_us)
                now_us += span_us
                if breaks:
                    break
            if course.plan is visitor.plan:
                course = self._way_out(visit, len(starts_us))
            elif course.end < len(course.plan.legs):
                yield from self._pay(visit)
                now_us = int(env.now)
                course = Course.along(course.plan, course.end, len(course.plan.legs))
            else:
                course = None
        present[here] -= 1
        visit.left_us = now_us
        self._count_out(visit)
        if place_inside is not None:
            self.door.release(place_inside)

    def _count_out(self, visit: Visit) -> None:
        visit.gone = True
        self.gone += 1

    def _way_out(self, visit: Visit, walked: int) -> Course:
        """Course from the end of the last leg walked to the exit, for shoppers to a till first."""
        visitor = visit.visitor
        here = visitor.plan.place(walked - 1)
        places = [here, self.exit]
        if visitor.role == "shopper":
            party = self.parties.setdefault(visitor.group or visitor.name, Party())
            if party.till is None:
                party.till = self._shortest_queue(here)
                party.till.bound += 1
            places.insert(1, party.till.place)
        plan = planned(
            self.ground,
            Places.at(places, [True] * len(places)),
            visitor.lanes,
            visitor.mover,
            visitor.plan.stance(walked - 1),
        )
        visit.parts = [(visitor.plan, walked), (plan, len(plan.legs))]
        to_next = plan.legs[:, PLACE].tolist().index(1.0) + 1
        return Course.along(plan, 0, to_next)

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
        self._refuse_late(visit, till)
        till.serves.append(visitor.name)
        yield self.env.timeout(visitor.service_us)
        till.serves.remove(visitor.name)
        till.bound -= 1
        till.desk.release(turn)
        party.paid.succeed()

    def _refuse_late(self, visit: Visit, till: Till) -> None:
        """Raise if somebody will pay so late that the day would go on as if for ever."""
        until_us = int(self.env.now) + visit.visitor.service_us - self.closes_us
        if until_us <= _LAST_OUT_H * _HOUR_US:
            return
        waiting = [other for other in self.visits if other.waits_for and other.came_us >= 0]
        told = self._told(waiting) or "nobody else waits"
        raise UsageError(
            f"till '{till.node}' would serve '{visit.visitor.name}' until"
            f" {until_us / _HOUR_US:.1f} h after closing, and {_LAST_OUT_H} h is the most: {told};"
            " shorten tills.service, or give more tills or servers"
        )

    def _refuse_deadlock(self) -> None:
        stuck = [visit for visit in self.visits if not visit.gone]
        if stuck:
            at_s = self.env.now / MICROSECONDS_PER_SECOND
            raise InvariantError(f"deadlock {at_s:.0f} s after opening: {self._told(stuck)}")

    def _told(self, waiting: list[Visit]) -> str:
        """Who waits for what, of the first few."""
        told = "; ".join(self._whom(visit) for visit in waiting[:_TOLD])
        return told + (f"; and {len(waiting) - _TOLD} more" if len(waiting) > _TOLD else "")

    def _whom(self, visit: Visit) -> str:
        """What somebody waits for, and who has it."""
        who, what = visit.visitor.name, visit.waits_for or "nothing that is known"
        for till in self.tills:
            if what == f"till '{till.node}'":
                served = ", ".join(till.serves) or f"{till.desk.count} who are gone"
                return f"'{who}' waits for {what}, which serves {served}"
        return f"'{who}' waits for {what}"
