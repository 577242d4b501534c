"""A trading day of 2000 shoppers: its SimPy part against bare timeouts, and all of it."""

from collections.abc import Callable
from gc import collect
from statistics import median
from time import perf_counter, process_time

import simpy
from measure import Row

from blesim.venue.layouts import wholesale_store
from blesim.walkers.day import OpenStore, simulate_day
from blesim.walkers.trading_day import Tills, TradingDay

_TILLS = Tills(nodes=tuple(f"A{number}" for number in range(1, 9)))
DAY = TradingDay(shoppers=2000.0, entrance="A/west", tills=_TILLS)
_ROUNDS = 7
# About as many events as the day has.
_ABOUT = 275_000


def open_store() -> OpenStore:
    return OpenStore.of(wholesale_store(), DAY, (), 1)


def events_of(opened: OpenStore) -> int:
    """Least number of events of a day: one a leg walked, three a visitor."""
    return sum(len(visit.starts_us) + 3 for visit in opened.floor.visits)


def bare_s(count: int) -> float:
    """Processor time of one process that yields so many timeouts. [s]."""

    def process(env: simpy.Environment) -> object:
        for _ in range(count):
            yield env.timeout(5)

    env = simpy.Environment()
    env.process(process(env))
    return run_s(env.run)


def run_s(work: Callable[[], object]) -> float:
    """Processor time of some work that finds no garbage of others to collect. [s]."""
    collect()
    start = process_time()
    work()
    return process_time() - start


def over_bare_timeouts() -> float:
    """Processor time of the day's events over that of as many bare timeouts."""
    ratios = []
    for _ in range(_ROUNDS):
        opened = open_store()
        # Both sides of ours, as the pace of a shared machine changes meanwhile.
        before_s = bare_s(_ABOUT)
        ours_s = run_s(opened.floor.run)
        each_s = (before_s + bare_s(_ABOUT)) / (2 * _ABOUT)
        # SimPy numbers its events: the next number is how many there were.
        count = next(opened.floor.env._eid)
        least = events_of(opened)
        assert 250_000 < least <= count < 1.1 * least, (least, count)
        ratios.append(ours_s / count / each_s)
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
