"""Days that it would be easy to hang in: each ends, or is refused in one line."""

import signal

import numpy as np
import pytest
from shapely.geometry import box

from blesim.errors import InvariantError, UsageError
from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.sections import Section
from blesim.venue.venue import Venue
from blesim.walkers.day import OpenStore, simulate_day
from blesim.walkers.trading_day import (
    ArrivalRate,
    Basket,
    Pace,
    RecordedRoute,
    RoutePoint,
    ShoppingList,
    Spread,
    Staff,
    Tills,
    TradingDay,
)
from blesim.walkers.trip import EDGE, END, START

LONGEST_S = 120


@pytest.fixture(autouse=True)
def in_time():
    """Break off a day that hangs, where the system can."""

    def give_up(*_):
        raise TimeoutError(f"the day has not ended after {LONGEST_S} s")

    if not hasattr(signal, "SIGALRM"):
        yield
        return
    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(LONGEST_S)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def trading_day(**settings) -> TradingDay:
    usual = {
        "opens": "10:00",
        "closes": "11:00",
        "shoppers": 30.0,
        "entrance": "F/west",
        "tills": Tills(nodes=("D/west", "E/west")),
        "basket": Basket(mean=4, spread=2),
        "staff": Staff(number=1, shift_h=0.5),
    }
    return TradingDay(**(usual | settings))


def test_a_day_that_is_watched_ends_and_tells_its_counts(section):
    told = []
    found = simulate_day(section, trading_day(), (), 3, lambda *counts: told.append(counts))
    gone, expected = np.array(told).T
    assert np.all(np.diff(gone) >= 0)
    assert set(expected.tolist()) == {len(found.people) + len(found.turned_away)}
    assert gone[-1] == expected[-1]
    # Every five minutes while something happens.
    assert 12 <= len(told) <= 30


def test_a_watched_day_skips_the_time_in_which_nothing_happens(section):
    told = []
    slow = Tills(nodes=("D/west",), service=Spread(median_s=4000.0, spread=0.0))
    day = trading_day(tills=slow, shoppers=10.0, staff=Staff(number=0))
    found = simulate_day(section, day, (), 3, lambda *counts: told.append(counts))
    # Ten shoppers at one till take hours of twelve times five minutes.
    assert max(person.left_us for person in found.people) > 8 * 3600e6
    assert len(told) < 50


def test_tills_that_would_serve_for_days_are_refused(section):
    slow = Tills(nodes=("D/west",), service=Spread(median_s=3600.0, spread=0.0))
    day = trading_day(tills=slow, shoppers=40.0, staff=Staff(number=0))
    store = OpenStore.of(section, day, (), 3)
    with pytest.raises(UsageError, match=r"till 'D/west' would serve 'shopper-\d+'") as caught:
        store.run()
    reason = str(caught.value)
    assert "12 h is the most" in reason
    assert "waits for till 'D/west'" in reason
    assert reason.count(" waits for ") == 5
    assert "\n" not in reason
    assert store.floor.env.now < 13 * 3600e6


def test_a_watched_deadlock_is_told(section):
    store = OpenStore.of(section, trading_day(tills=Tills(nodes=("D/west",))), (), 14)
    store.floor.tills[0].desk.request()
    with pytest.raises(InvariantError, match=r"deadlock .* waits for till 'D/west'") as caught:
        store.run(lambda *_: None)
    assert "\n" not in str(caught.value)


CRAWL = Pace(
    mean_m_s=0.2,
    spread_m_s=0.5,
    acceleration_m_s2=0.1,
    trolley_acceleration_m_s2=0.1,
    turn_rate_deg_s=10.0,
)
RUSH = Pace(
    mean_m_s=3.0,
    spread_m_s=0.5,
    acceleration_m_s2=10.0,
    trolley_acceleration_m_s2=10.0,
    turn_rate_deg_s=3600.0,
)
LAST_MINUTE = (ArrivalRate(since="10:00", weight=0.0), ArrivalRate(since="10:59", weight=1.0))


@pytest.mark.parametrize(
    "settings",
    [
        {"dwell": Spread(median_s=1e-300, spread=3.0)},
        {"tills": Tills(nodes=("D/west",), service=Spread(median_s=1e-9, spread=0.0))},
        {"staff": Staff(number=2, restock=Spread(median_s=1e-300, spread=3.0))},
        {"staff": Staff(number=3, shift_h=1e-12)},
        {"pace": CRAWL},
        {"pace": RUSH},
        {"pace": RUSH.model_copy(update={"acceleration_m_s2": 0.1})},
        {"capacity": 1, "group_shares": (0.0, 0.0, 0.0, 1.0)},
        {"shoppers": 0.0},
        {"shoppers": 0.0, "staff": Staff(number=0)},
        {"closes": "10:01"},
        {"arrivals": LAST_MINUTE},
        {"tills": Tills(nodes=("F/west",))},
        {"lists": (ShoppingList(shopper="x", sections=("F-01",)),)},
    ],
    ids=lambda settings: "-".join(settings),
)
def test_extreme_days_end_with_everybody_gone(section, settings):
    day = trading_day(**settings)
    planned = len(OpenStore.of(section, day, (), 1).floor.visits)
    found = simulate_day(section, day, (), 1)
    assert len(found.people) + len(found.turned_away) == planned


def test_a_group_that_does_not_fit_comes_in_one_by_one(section):
    day = trading_day(capacity=1, group_shares=(0.0, 0.0, 0.0, 1.0), staff=Staff(number=0))
    found = simulate_day(section, day, (), 1)
    assert len(found.people) > 3
    assert found.turned_away
    for before, after in zip(found.people, found.people[1:], strict=False):
        assert after.came_us >= before.left_us


def test_a_list_longer_than_the_day_is_broken_off(section):
    everything = tuple(each.id for each in section.sections)
    day = trading_day(
        lists=(ShoppingList(shopper="x", sections=everything),),
        order="list",
        dwell=Spread(median_s=3600.0),
        staff=Staff(number=0),
    )
    found = simulate_day(section, day, (), 1)
    assert all(len(person.visits) < len(everything) for person in found.people)
    assert all(3600e6 < person.left_us < 7200e6 for person in found.people)


def test_a_route_that_begins_at_the_last_moment_ends(section):
    points = (RoutePoint(place="F/west", time_s=3599.9), RoutePoint(place="D8", time_s=86400.0))
    route = RecordedRoute(shopper="ann", points=points)
    day = trading_day(shoppers=0.0, staff=Staff(number=0), routes=(route,))
    (person,) = simulate_day(section, day, (), 1).people
    assert 3600e6 < person.left_us < 4000e6


@pytest.mark.parametrize("order", ["nearest-next", "list", "circuit"])
def test_a_store_of_one_way_aisles_is_walked_round_and_round(order):
    corners = {"A": (2, 2), "B": (18, 2), "C": (18, 12), "D": (2, 12)}
    ring = ("AB", "BC", "CD", "DA")
    venue = Venue(
        name="ring",
        floor_plan=FloorPlan(levels=(Level(level=0, bounds=box(0, 0, 20, 14)),)),
        beacons=(),
        graph=AisleGraph(
            nodes=tuple(Node(id=name, x_m=x, y_m=y) for name, (x, y) in corners.items()),
            edges=tuple(Edge(first=a, second=b, branch=a + b, one_way=True) for a, b in ring),
        ),
        sections=tuple(
            Section(id=a + b, category="tins", branch=a + b, start_m=corners[a], end_m=corners[b])
            for a, b in ring
        ),
    )
    # Against the way of the ring.
    backwards = ShoppingList(shopper="x", sections=("DA", "CD", "BC", "AB"))
    day = trading_day(
        entrance="A", tills=Tills(nodes=("A",)), order=order, lists=(backwards,), shoppers=10.0
    )
    store = OpenStore.of(venue, day, (), 2)
    store.run()
    for visit in store.floor.visits:
        legs = visit.legs()
        assert np.all(legs[:, END] >= legs[:, START])
        assert set(np.diff(legs[:, EDGE]) % 4) <= {0, 1}
    store.logs()
