"""The radio: packets a second with every effect on, against the plain engine, and how it grows."""

import resource
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np
import oracle
from measure import Row, median_seconds, seconds, speed_ratio

from blesim.radio.air import Air, Heard
from blesim.radio.people import People
from blesim.radio.phone import Phone, Receiver, Scanner
from blesim.radio.propagation import Propagation
from blesim.radio.stock import Stock
from blesim.rng import Draws
from blesim.tables import Trajectory
from blesim.venue.layouts import wholesale_section, wholesale_store
from blesim.venue.venue import Venue
from blesim.walkers.itinerary import Itinerary, Stop
from blesim.walkers.walker import simulate_walkers

# Multipath, shadowing, uneven shelves, bodies, sway, a crowd of walkers, collisions, traffic.
EVERYTHING = Propagation(path_loss_exponent=1.0, stock=Stock(spread=0.3), traffic_loss=0.05)
SNIFFER = Phone(scanner=Scanner(all_channels=True), receiver=Receiver())
_WALKERS = 5
_HOUR_S = 3600.0


def walks(venue: Venue, duration_s: float, count: int = _WALKERS) -> Mapping[str, Trajectory]:
    """Walkers who go from beacon to beacon and stand half of the time, until the time is up."""
    graph = venue.graph
    assert graph is not None
    itineraries = []
    for number in range(count):
        nodes = [node.id for node in graph.nodes if "/" not in node.id][number::3]
        # On average 25 m from stop to stop: as long to walk as to stand.
        stops = (nodes * (1 + int(duration_s / 45 / len(nodes)) + 1))[: int(duration_s / 45) + 2]
        route = tuple(Stop(place=graph.at_node(node), pause_s=20.0) for node in stops)
        itineraries.append(Itinerary(walker=f"walker {number}", stops=route))
    logs = simulate_walkers(graph, tuple(itineraries))
    return {plan.walker: log.trajectory() for plan, log in zip(itineraries, logs, strict=True)}


def shoppers(venue: Venue, count: int, day_s: float, stay_s: float) -> Mapping[str, Trajectory]:
    """Shoppers who come at any time of a day and wander at random from node to node.

    A few walks are simulated and begun at many times: for the radio they are as good as others.
    """
    graph = venue.graph
    assert graph is not None
    generator = Draws(seed=1, purpose="shoppers").generator()
    nodes = [node.id for node in graph.nodes if "/" not in node.id]
    itineraries = []
    for number in range(min(count, 32)):
        picked = generator.integers(0, len(nodes), int(stay_s / 65) + 2)
        route = [nodes[row] for row in picked[np.append(True, np.diff(picked) != 0)]]
        stops = tuple(Stop(place=graph.at_node(node), pause_s=10.0) for node in route)
        itineraries.append(Itinerary(walker=str(number), stops=stops))
    logs = simulate_walkers(graph, tuple(itineraries))
    patterns = [log.trajectory() for log in logs]
    comes_us = np.sort(generator.integers(0, int(day_s * 1e6), count))
    return {
        f"shopper {row}": replace(
            patterns[row % len(patterns)], time_us=patterns[row % len(patterns)].time_us + came_us
        )
        for row, came_us in enumerate(comes_us)
    }


class _Case:
    """One phone in a venue for some time."""

    def __init__(
        self, venue: Venue, phone: Phone, duration_s: float, propagation: Propagation = EVERYTHING
    ) -> None:
        self.crowd = walks(venue, duration_s)
        self.walk = self.crowd["walker 0"]
        self.phone = phone
        first_us, last_us = (int(self.walk.time_us[row]) for row in (0, -1))
        self.air = Air.over(venue, propagation, 1, last_us + 1, crowd=self.crowd)
        senders = self.air.medium.senders
        events = sum(len(s.events_between(first_us, last_us)[0]) for s in senders)
        self.candidates = 3 * int(events)

    def hear(self) -> int:
        heard = self.air.heard_by(self.phone, "walker 0", self.walk, keep_packets=False)
        return len(heard.readings)


def _packets_per_second(case: _Case) -> float:
    case.hear()
    return case.candidates / median(seconds(case.hear) for _ in range(7))


@cache
def _case(venue: str, phone: str) -> _Case:
    venues = {"section": wholesale_section, "store": wholesale_store}
    return _Case(venues[venue](), {"phone": Phone(), "sniffer": SNIFFER}[phone], _HOUR_S / 3)


def phone_in_the_section() -> float:
    """Packets sent in the section while a continuously scanning phone is there, a second."""
    return _packets_per_second(_case("section", "phone")) / 1e6


def phone_in_the_store() -> float:
    """The same among 136 beacons and 34 shelves."""
    return _packets_per_second(_case("store", "phone")) / 1e6


def sniffer_in_the_section() -> float:
    """The same with a receiver that listens to all three channels: nothing is skipped."""
    return _packets_per_second(_case("section", "sniffer")) / 1e6


@cache
def _day() -> Mapping[str, Trajectory]:
    """Twelve hours in the store, about 100 shoppers there at any time, each for 25 minutes."""
    return shoppers(wholesale_store(), 2880, 12 * _HOUR_S, 25 * 60.0)


def day_of_air() -> float:
    """Time to set up the air of the store for twelve hours. [s]."""
    venue = wholesale_store()
    until_us = int(12 * _HOUR_S * 1e6)
    works = [lambda: Air.over(venue, EVERYTHING, 1, until_us)]
    return median_seconds(works, rounds=3)[0]


def crowd_cost() -> float:
    """Time to hear a phone among 100 shoppers over that in the empty store. [-]."""
    crowd, venue = _day(), wholesale_store()
    name = f"shopper {len(crowd) // 2}"
    until_us = int(crowd[name].time_us[-1]) + 1
    empty, full = (Air.over(venue, EVERYTHING, 1, until_us, crowd=who) for who in ({}, crowd))

    def among(air: Air) -> Heard:
        return air.heard_by(Phone(), name, crowd[name], keep_packets=False)

    return speed_ratio(lambda: among(empty), lambda: among(full), rounds=5)


def ten_phones() -> tuple[float, float]:
    """Time to hear ten phones on a day of shoppers, and most memory this process took. [s, MiB]."""
    crowd, venue = _day(), wholesale_store()
    start = process_time()
    until_us = max(int(walk.time_us[-1]) for walk in crowd.values()) + 1
    air = Air.over(venue, EVERYTHING, 1, until_us, crowd=crowd)
    for name in list(crowd)[100 :: len(crowd) // 10]:
        air.heard_by(Phone(), name, crowd[name], keep_packets=False)
    return process_time() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _apart(expression: str) -> float:
    """A number worked out by a process of its own, whose memory nothing else has used."""
    code = "import sys; sys.path.insert(0, sys.argv[1]); import radio; print({})"
    here = str(Path(__file__).parent)
    ended = subprocess.run(
        [sys.executable, "-c", code.format(expression), here],
        capture_output=True,
        text=True,
        check=True,
    )
    return float(ended.stdout)


def day_time() -> float:
    """Processor time of ten phones of 25 minutes on that day, air and all. [s]."""
    return _apart("radio.ten_phones()[0]")


def day_memory() -> float:
    """Most memory of their process, with the trajectories of all shoppers. [MiB]."""
    return _apart("radio.ten_phones()[1]")


def over_oracle() -> float:
    """The plain engine on the same scenario; both with all that the plain one knows."""
    venue = wholesale_section()
    people = People(sway_m=0.0, crossing_db=0.0)
    propagation = Propagation(path_loss_exponent=1.0, people=people)
    walk = walks(venue, 60.0, 1)["walker 0"]
    phone = Phone(tells_channel=True)

    def plain() -> object:
        return oracle.listen(venue, propagation, 1, {"walker 0": (phone, walk)})

    def fast() -> object:
        air = Air.over(venue, propagation, 1, int(walk.time_us[-1]) + 1)
        return air.heard_by(phone, "walker 0", walk, keep_packets=False)

    return speed_ratio(fast, plain, rounds=3, our_repeats=5)


def denser(venue: Venue, times: int) -> Venue:
    """The same venue with more beacons, side by side along the same shelves."""
    return venue.with_beacons(
        tuple(
            beacon.model_copy(update={"id": f"{beacon.id}.{copy}", "x_m": beacon.x_m + 0.1 * copy})
            if copy
            else beacon
            for copy in range(times)
            for beacon in venue.beacons
        )
    )


def scaling_exponent() -> float:
    """Slope of log time over log (beacons x phones x duration), all three grown fourfold.

    Time is that of the processor, since others share the machine.
    """
    sizes, times = [], []
    for crowding in (1, 4):
        venue = denser(wholesale_section(), crowding)
        for minutes in (10, 40):
            case = _Case(venue, Phone(), 60.0 * minutes)
            case.hear()
            for phones in (1, 4):
                spent = []
                for _ in range(3):
                    start = process_time()
                    for _ in range(phones):
                        case.hear()
                    spent.append(process_time() - start)
                sizes.append(case.candidates * phones)
                times.append(min(spent))
    return float(np.polyfit(np.log(sizes), np.log(times), 1)[0])


def peak_memory() -> float:
    """Most memory a process takes that hears the store for two hours with one phone. [MiB]."""
    return _apart("radio.memory_of_two_hours()")


def memory_of_two_hours() -> float:
    """Most memory of this process after it has heard two hours of the store. [MiB]."""
    _Case(wholesale_store(), Phone(), 2 * _HOUR_S).hear()
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


ROWS = [
    Row(
        name="radio, phone in the section",
        unit="M packets/s",
        measure=phone_in_the_section,
        goal=">= 5",
    ),
    Row(name="radio, phone in the store", unit="M packets/s", measure=phone_in_the_store),
    Row(name="radio, sniffer in the section", unit="M packets/s", measure=sniffer_in_the_section),
    Row(name="radio / plain engine", unit="x", measure=over_oracle, goal=">= 100"),
    Row(name="radio, scaling exponent", unit="1", measure=scaling_exponent, goal="<= 1.05"),
    Row(name="radio, a day of air", unit="s", measure=day_of_air, goal="<= 1"),
    Row(name="radio, in a crowd / alone", unit="x", measure=crowd_cost, goal="<= 1.5"),
    Row(name="radio, ten phones on a day", unit="s", measure=day_time),
    Row(name="radio, memory of that", unit="MiB", measure=day_memory),
    Row(name="radio, peak memory", unit="MiB", measure=peak_memory),
]
