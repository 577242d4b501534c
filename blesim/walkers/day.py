"""A whole day in a store, simulated: shoppers, staff, and scripted test walks beside them."""

from dataclasses import dataclass
from typing import Self

from blesim.errors import UsageError
from blesim.rng import refuse_bad_seed
from blesim.venue.routes import Routes
from blesim.venue.venue import Venue
from blesim.walkers.clearance import Clearance, graph_of
from blesim.walkers.faults import faults
from blesim.walkers.invariants import check_people, check_visits
from blesim.walkers.itinerary import Itinerary
from blesim.walkers.person import PersonLog
from blesim.walkers.shop_floor import Progress, ShopFloor
from blesim.walkers.trading_day import TradingDay
from blesim.walkers.trip import Ground
from blesim.walkers.visitors import Planner
from blesim.walkers.walker import Tour, WalkLog


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Day:
    """What happened on a day.

    Attributes
    ----------
    people : tuple of PersonLog
        Shoppers in order of arrival, replayed ones, staff; those who came in.
    testers : tuple of WalkLog
        Scripted walks, in the order of their itineraries.
    turned_away : tuple of str
        Shoppers who waited outside until the doors shut.
    """

    people: tuple[PersonLog, ...]
    testers: tuple[WalkLog, ...]
    turned_away: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OpenStore:
    """A store on whose clock everybody waits for the time to come.

    Attributes
    ----------
    venue : Venue
        The store.
    day : TradingDay
        Its day.
    floor : ShopFloor
        Shoppers and staff.
    tour : Tour
        Scripted walks on the same clock.
    """

    venue: Venue
    day: TradingDay
    floor: ShopFloor
    tour: Tour

    @classmethod
    def of(
        cls, venue: Venue, day: TradingDay, itineraries: tuple[Itinerary, ...], seed: int
    ) -> Self:
        """Store with all visitors planned; see `simulate_day`."""
        refuse_bad_seed(seed)
        wrong = faults(day, venue)
        if wrong:
            path, reason = wrong[0]
            where = ".".join(str(key) for key in path) or "day"
            raise UsageError(f"{where}: {reason}")
        graph = graph_of(venue)
        ground = Ground(routes=Routes.of(graph), clearance=Clearance.of(venue))
        floor = ShopFloor.open(
            ground, day.way_out, day.capacity, day.tills.nodes, day.tills.servers, day.open_us
        )
        floor.expect(Planner.of(venue, day, ground, seed).visitors())
        tour = Tour.start(floor.env, graph, itineraries, floor.present)
        return cls(venue=venue, day=day, floor=floor, tour=tour)

    def run(self, progress: Progress | None = None) -> None:
        """Let the day pass; see `ShopFloor.run`."""
        self.floor.run(progress)
        check_visits(self.floor)

    def logs(self) -> Day:
        """What happened, once the day has passed.

        Raises
        ------
        InvariantError
            If somebody broke a law of `invariants`.
        """
        graph = graph_of(self.venue)
        sections = tuple(section.id for section in self.venue.sections)
        people = tuple(
            PersonLog.of(visit, graph, sections, self.day.gait)
            for visit in self.floor.visits
            if visit.came_us >= 0
        )
        check_people(people, self.venue)
        away = (visit.visitor.name for visit in self.floor.visits if visit.came_us < 0)
        return Day(people=people, testers=self.tour.logs(), turned_away=tuple(away))


def simulate_day(
    venue: Venue,
    day: TradingDay,
    itineraries: tuple[Itinerary, ...],
    seed: int,
    progress: Progress | None = None,
) -> Day:
    """Everybody's day in a store, from opening until the last has left.

    Parameters
    ----------
    venue : Venue
        The store; with an aisle graph and product sections.
    day : TradingDay
        What happens there.
    itineraries : tuple of Itinerary
        Scripted walks, which keep their pace but are in the way of others.
    seed : int
        Of all random numbers.
    progress : callable or None
        Told now and then how many visitors are gone, and of how many.

    Returns
    -------
    Day

    Raises
    ------
    UsageError
        If the day does not fit the venue, the first of its `faults`; or if the tills cannot serve
        everybody within half a day after closing.
    VenueError
        If an itinerary does not connect.
    InvariantError
        If the day broke a law, or ended with people who wait for each other.
    """
    store = OpenStore.of(venue, day, itineraries, seed)
    store.run(progress)
    return store.logs()
