"""A trading day of 2000 shoppers: its SimPy part against bare timeouts, and all of it."""

from statistics import median
from time import perf_counter, process_time

import simpy
from measure import Row

from blesim.venue.layouts import wholesale_store
from blesim.walkers.day import OpenStore, simulate_day
from blesim.walkers.trading_day import Tills, TradingDay
from blesim.walkers.trip import TURN

_TILLS = Tills(nodes=tuple(f"A{number}" for number in range(1, 9)))
DAY = TradingDay(shoppers=2000.0, entrance="A/west", tills=_TILLS)
_ROUNDS = 5


def open_store() -> OpenStore:
    return OpenStore.of(wholesale_store(), DAY, (), 1)


def events_of(opened: OpenStore) -> int:
    """Least number of events of a day: a leg, a turn, a stay each are one; three a visitor."""
    count = 0
    for visit in opened.floor.visits:
        for plan, walked in visit.parts:
            legs = plan.legs[:walked]
            count += walked + int((legs[:, TURN] > 0).sum())
        count += 3
    return count


def bare_s(count: int) -> float:
    """Processor time of one process that yields so many timeouts. [s]."""

    def process(env: simpy.Environment) -> object:
        for _ in range(count):
            yield env.timeout(5)

    env = simpy.Environment()
    env.process(process(env))
    start = process_time()
    env.run()
    return process_time() - start


def over_bare_timeouts() -> float:
    """Processor time of the day's events over that of as many bare timeouts."""
    ratios = []
    for _ in range(_ROUNDS):
        opened = open_store()
        start = process_time()
        opened.floor.run()
        ours_s = process_time() - start
        # SimPy numbers its events: the next number is how many there were.
        count = next(opened.floor.env._eid)
        least = events_of(opened)
        assert 300_000 < least <= count < 1.3 * least, (least, count)
        ratios.append(ours_s / bare_s(count))
    return median(ratios)


def whole_day() -> float:
    """Planning, events and exact trajectories of everybody. [s]."""
    start = perf_counter()
    day = simulate_day(wholesale_store(), DAY, (), 1)
    assert len(day.people) > 1900
    return perf_counter() - start


ROWS = [
    Row(
        name="day of 2000 shoppers, events / bare timeouts",
        unit="x",
        measure=over_bare_timeouts,
        goal="<= 3",
    ),
    Row(name="day of 2000 shoppers", unit="s", measure=whole_day),
]
