import pytest
from pydantic import ValidationError
from shapely import box

from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.sections import Section
from blesim.venue.venue import Venue
from blesim.walkers.faults import faults
from blesim.walkers.trading_day import (
    ArrivalRate,
    Basket,
    CarryingShares,
    Popularity,
    RecordedRoute,
    RoutePoint,
    ShoppingList,
    Tills,
    TradingDay,
    clock_s,
)


def trading_day(**settings) -> TradingDay:
    return TradingDay(**({"entrance": "A", "tills": Tills(nodes=("C",))} | settings))


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"opens": "20:00", "closes": "08:00"}, "closes '08:00' is not after opens '20:00'"),
        ({"opens": "8:00"}, "opens"),
        ({"closes": "25:00"}, "closes"),
        ({"shoppers": -1.0}, "shoppers"),
        ({"capacity": 0}, "capacity"),
        ({"group_shares": (0.0, 0.0)}, "every share is 0"),
        ({"arrivals": ()}, "arrivals"),
        ({"arrivals": (ArrivalRate(since="08:00", weight=0.0),)}, "nobody would come"),
        (
            {
                "arrivals": (
                    ArrivalRate(since="09:00", weight=1.0),
                    ArrivalRate(since="08:00", weight=1.0),
                )
            },
            "'since' must grow",
        ),
    ],
)
def test_impossible_days_are_refused(settings, reason):
    with pytest.raises(ValidationError, match=reason):
        trading_day(**settings)


def test_impossible_parts_are_refused():
    with pytest.raises(ValidationError, match="nodes"):
        Tills(nodes=())
    with pytest.raises(ValidationError, match="servers"):
        Tills(nodes=("C",), servers=0)
    with pytest.raises(ValidationError, match="sections"):
        ShoppingList(shopper="x", sections=())
    points = (RoutePoint(place="A", time_s=2.0), RoutePoint(place="B", time_s=1.0))
    with pytest.raises(ValidationError, match="times go backwards"):
        RecordedRoute(shopper="x", points=points)
    zero = dict.fromkeys(("hand", "flat", "swinging", "pocket", "bag", "trolley"), 0.0)
    with pytest.raises(ValidationError, match="every share is 0"):
        CarryingShares(**zero)


def test_clock_times_and_rates_from_opening_on():
    assert clock_s("24:00") == 86400
    assert clock_s("07:35") == 27300
    day = trading_day(
        opens="09:30",
        closes="12:00",
        arrivals=(
            ArrivalRate(since="08:00", weight=1.0),
            ArrivalRate(since="09:00", weight=2.0),
            ArrivalRate(since="10:00", weight=3.0),
            ArrivalRate(since="12:00", weight=4.0),
        ),
    )
    assert day.rates() == [(0, 2.0), (1800, 3.0)]
    assert day.open_us == 9000 * 1_000_000


# A - B - C, one-way from C on to D; E - F apart.
NODES = {"A": (1, 1), "B": (5, 1), "C": (9, 1), "D": (9, 8), "E": (2, 9), "F": (4, 9)}


def venue(*, sections=("A-B",), one_way=True) -> Venue:
    edges = (
        Edge(first="A", second="B", branch="ab"),
        Edge(first="B", second="C", branch="bc"),
        Edge(first="C", second="D", branch="cd", one_way=one_way),
        Edge(first="E", second="F", branch="ef"),
    )
    return Venue(
        name="small",
        floor_plan=FloorPlan(levels=(Level(level=0, bounds=box(0, 0, 10, 10)),)),
        beacons=(),
        graph=AisleGraph(
            nodes=tuple(Node(id=name, x_m=x, y_m=y) for name, (x, y) in NODES.items()), edges=edges
        ),
        sections=tuple(
            Section(
                id=name,
                category="tins",
                branch=(name[0] + name[2]).lower(),
                start_m=NODES[name[0]],
                end_m=NODES[name[2]],
            )
            for name in sections
        ),
    )


def test_a_day_that_fits_has_no_faults():
    assert faults(trading_day(), venue()) == []


@pytest.mark.parametrize(
    ("settings", "sections", "path", "reason"),
    [
        ({"entrance": "Z"}, ("A-B",), ("entrance",), "no node 'Z'"),
        ({"exit": "Z"}, ("A-B",), ("exit",), "no node 'Z'"),
        ({"tills": Tills(nodes=("C", "Z"))}, ("A-B",), ("tills", "nodes", 1), "no node 'Z'"),
        ({"tills": Tills(nodes=("C", "C"))}, ("A-B",), ("tills", "nodes", 1), "there twice"),
        ({}, ("A-B", "E-F"), ("entrance",), "no way leads from 'A' to section 'E-F'"),
        ({"tills": Tills(nodes=("E",))}, ("A-B",), ("tills", "nodes", 0), "no way leads"),
        ({"tills": Tills(nodes=("D",))}, ("A-B",), ("tills", "nodes", 0), "no way leads from till"),
        ({"exit": "E"}, ("A-B",), ("tills", "nodes", 0), "no way leads from till 'C' to 'E'"),
        ({}, ("A-B", "C-D"), ("tills", "nodes", 0), "no way leads from section 'C-D'"),
        (
            {"lists": (ShoppingList(shopper="x", sections=("A-B", "no")),)},
            ("A-B",),
            ("lists", 0, "sections", 1),
            "list of 'x': there is no section 'no'",
        ),
        (
            {"routes": (RecordedRoute(shopper="x", points=(RoutePoint(place="Q", time_s=1.0),)),)},
            ("A-B",),
            ("routes", 0, "points", 0, "place"),
            "route of 'x': there is neither a node nor a section 'Q'",
        ),
        (
            {"routes": (RecordedRoute(shopper="x", points=(RoutePoint(place="E", time_s=1.0),)),)},
            ("A-B",),
            ("routes", 0, "points", 0, "place"),
            "route of 'x': node 'E' cannot be reached",
        ),
        (
            {
                "basket": Basket(
                    popularity=Popularity(kind="categories", weights={"tins": 1.0, "tons": 1.0})
                )
            },
            ("A-B",),
            ("basket", "popularity", "weights", "tons"),
            "no section sells 'tons'",
        ),
        (
            {"basket": Basket(popularity=Popularity(kind="categories", weights={"tins": 0.0}))},
            ("A-B",),
            ("basket", "popularity", "weights"),
            "every weight is 0",
        ),
    ],
)
def test_faults_are_told_where_they_are(settings, sections, path, reason):
    found = faults(trading_day(**settings), venue(sections=sections))
    assert path in [where for where, _ in found]
    assert any(reason in why for where, why in found if where == path)
    assert not any("\n" in why for _, why in found)


def test_a_venue_without_aisles_or_sections_is_told():
    assert "section" in faults(trading_day(), venue(sections=()))[0][1]
