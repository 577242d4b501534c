from hashlib import sha256

import numpy as np
import pytest
import shapely

from blesim import columns
from blesim.errors import InvariantError, UsageError
from blesim.walkers.clearance import BODY_RADIUS_M
from blesim.walkers.day import OpenStore, simulate_day
from blesim.walkers.itinerary import Itinerary, Stop
from blesim.walkers.motion import SLOWEST
from blesim.walkers.trading_day import (
    Basket,
    CarryingShares,
    Detours,
    Pace,
    RecordedRoute,
    RoutePoint,
    ShoppingList,
    Spread,
    Staff,
    Tills,
    TradingDay,
)

STATE = dict(columns.STATES)


def trading_day(**settings) -> TradingDay:
    """An hour in the measured section, everybody by the tills at the west end of D."""
    usual = {
        "opens": "10:00",
        "closes": "11:00",
        "shoppers": 60.0,
        "entrance": "F/west",
        "tills": Tills(nodes=("D/west", "E/west")),
        "basket": Basket(mean=6, spread=3),
        "staff": Staff(number=2, shift_h=0.5),
    }
    return TradingDay(**(usual | settings))


@pytest.fixture(scope="module")
def hour(section):
    return simulate_day(section, trading_day(), (), 3)


def walked_m(trajectory) -> float:
    return float(np.hypot(np.diff(trajectory.x_m), np.diff(trajectory.y_m)).sum())


def test_the_same_seed_gives_the_same_hour(section, hour):
    again = simulate_day(section, trading_day(), (), 3, progress=lambda *_: None)
    assert [p.trajectory for p in again.people] == [p.trajectory for p in hour.people]
    assert [p.carrying for p in again.people] == [p.carrying for p in hour.people]
    other = simulate_day(section, trading_day(), (), 4)
    assert [p.trajectory for p in other.people] != [p.trajectory for p in hour.people]


def test_the_hour_is_the_one_it_has_always_been(hour):
    digest = sha256()
    for person in hour.people:
        digest.update(person.name.encode())
        for values in person.trajectory.arrays():
            digest.update(values.tobytes())
    assert digest.hexdigest()[:16] == DIGEST


def test_shoppers_are_named_in_order_of_arrival(hour):
    shoppers = [person for person in hour.people if person.role == "shopper"]
    assert [p.name for p in shoppers] == [f"shopper-{k + 1:04d}" for k in range(len(shoppers))]
    alone = [person.came_us for person in shoppers if not person.group]
    assert alone == sorted(alone)
    assert [p.name for p in hour.people if p.role == "staff"] == ["staff-01", "staff-02"]


def test_nobody_touches_a_shelf(section, hour):
    (area,) = section.floor_plan.walkable.values()
    free = shapely.buffer(area, -(BODY_RADIUS_M - 1e-5), join_style="mitre")
    for person in hour.people:
        line = shapely.linestrings(person.trajectory.x_m, person.trajectory.y_m)
        assert shapely.covers(free, line)


def test_everybody_stands_at_products_facing_the_shelf(section, hour):
    sections = {each.id: each for each in section.sections}
    seen = 0
    for person in hour.people:
        for name, arrived_us, dwell_us in person.visits:
            if dwell_us == 0:
                continue
            pose = person.trajectory.at(np.array([arrived_us + dwell_us // 2]))
            at = sections[name]
            assert min(at.start_m[0], at.end_m[0]) <= pose.x_m[0] <= max(at.start_m[0], at.end_m[0])
            aside_m = pose.y_m[0] - at.start_m[1]
            assert 1.1 < abs(aside_m) < 1.7
            seen += 1
    assert seen > 200


def test_trajectories_pass_through_their_knots(hour):
    for person in hour.people[:10]:
        trajectory = person.trajectory
        moving = trajectory.state[:-1] == STATE["walking"]
        inner = trajectory.time_us[1:][moving] - 1
        before = trajectory.at(np.maximum(inner, trajectory.time_us[:-1][moving]))
        assert before.x_m == pytest.approx(trajectory.x_m[1:][moving], abs=1e-4)
        speed_after = trajectory.speed_m_s[1:][moving]
        continuous = trajectory.state[1:][moving] == STATE["walking"]
        assert before.speed_m_s[continuous] == pytest.approx(speed_after[continuous], abs=1e-3)
        assert np.all(np.diff(trajectory.time_us) > 0)
        assert before.offset_m == pytest.approx(
            trajectory.offset_m[:-1][moving]
            + trajectory.edge_speed_m_s[:-1][moving] * np.diff(trajectory.time_us)[moving] * 1e-6,
            abs=1e-4,
        )


def test_headings_follow_the_way(hour):
    trajectory = hour.people[0].trajectory
    long = np.hypot(np.diff(trajectory.x_m), np.diff(trajectory.y_m)) > 1.0
    heading = np.arctan2(np.diff(trajectory.y_m), np.diff(trajectory.x_m))[long]
    off = np.angle(np.exp(1j * (trajectory.heading_rad[1:][long] - heading)))
    assert np.abs(off).max() < 1e-4


def test_offsets_are_those_of_the_nearest_point_of_the_edge(section, hour):
    graph = section.graph
    for person in hour.people:
        trajectory = person.trajectory
        first, second = graph.node_xy_m[graph.ends[trajectory.edge]].transpose(1, 0, 2)
        lines = shapely.linestrings(np.stack([first, second], axis=1))
        points = shapely.points(trajectory.x_m, trajectory.y_m)
        nearest_m = shapely.line_locate_point(lines, points)
        assert trajectory.offset_m == pytest.approx(nearest_m, abs=2e-6)
        # The way to the next knot is on the edge of this one, whatever the next is on.
        later_m = shapely.line_locate_point(lines[:-1], points[1:])
        moved_m = trajectory.edge_speed_m_s[:-1] * np.diff(trajectory.time_us) * 1e-6
        assert moved_m == pytest.approx(later_m - nearest_m[:-1], abs=1e-5)


def test_nobody_gets_along_an_edge_faster_than_walking(hour):
    for person in hour.people:
        trajectory = person.trajectory
        span_s = np.diff(trajectory.time_us) * 1e-6
        before = trajectory.speed_m_s[:-1]
        after = before + trajectory.acceleration_m_s2[:-1] * span_s
        assert np.all(np.abs(trajectory.edge_speed_m_s[:-1]) <= np.maximum(before, after) + 3e-6)


@pytest.mark.parametrize("turn_rate_deg_s", [20.0, 150.0])
def test_nobody_turns_faster_than_told(section, turn_rate_deg_s):
    day = trading_day(pace=Pace(turn_rate_deg_s=turn_rate_deg_s))
    for person in simulate_day(section, day, (), 3).people:
        turned = np.diff(np.unwrap(person.trajectory.heading_rad))
        span_s = np.diff(person.trajectory.time_us) * 1e-6
        # Headings are rounded to a millionth, times to a microsecond.
        most = np.radians(turn_rate_deg_s) * (span_s + 1e-6) + 2e-6
        assert np.all(np.abs(turned) <= most)


def test_members_of_a_group_share_list_and_pace(section):
    day = trading_day(group_shares=(0.0, 0.0, 1.0), shoppers=45.0)
    found = simulate_day(section, day, (), 5)
    groups = {}
    for person in found.people:
        if person.role == "shopper":
            groups.setdefault(person.group, []).append(person)
    assert len(groups) > 8
    for members in groups.values():
        assert {member.speed_m_s for member in members} == {members[0].speed_m_s}
        if members[0].left_us < 3_600_000_000:
            lists = [[name for name, *_ in member.visits] for member in members]
            assert lists[0] == lists[1] == lists[2]
        gaps = np.diff([member.came_us for member in members])
        assert np.all((gaps >= 500_000) & (gaps <= 1_500_000))


def test_a_full_store_makes_people_wait_outside(section):
    day = trading_day(capacity=3, shoppers=200.0)
    found = simulate_day(section, day, (), 6)
    shoppers = [person for person in found.people if person.role == "shopper"]
    steps = [(p.came_us, 1) for p in shoppers] + [(p.left_us, -1) for p in shoppers]
    inside = np.cumsum([step for _, step in sorted(steps)])
    assert inside.max() == 3
    assert found.turned_away
    assert max(person.came_us for person in shoppers) < 3_600_000_000


def test_at_closing_time_everybody_goes_to_the_tills(section):
    # Lists so long that nobody ever finishes.
    day = trading_day(basket=Basket(mean=50, spread=1), dwell=Spread(median_s=100.0))
    found = simulate_day(section, day, (), 7)
    shoppers = [person for person in found.people if person.role == "shopper"]
    assert all(p.left_us > 3_600_000_000 for p in shoppers)
    for person in shoppers:
        assert all(
            arrived + dwell <= 3_600_000_000 or dwell == 0 for _, arrived, dwell in person.visits
        )
    staying = [person for person in found.people if person.role == "staff"]
    # Shifts of half an hour: the first leaves at half past, the second after closing.
    assert 1_800_000_000 < staying[0].left_us < 2_000_000_000
    assert staying[1].left_us > 3_600_000_000


def test_testers_keep_their_pace_and_slow_others(section):
    graph = section.graph
    route = tuple(Stop(place=graph.at_node(name)) for name in ("D1", "D8"))
    testers = tuple(
        Itinerary(walker=f"tester-{k}", stops=route, start_s=600.0, speed_m_s=0.05)
        for k in range(400)
    )
    day = trading_day(
        lists=(ShoppingList(shopper="x", sections=("D-02", "D-17")),),
        detours=Detours(probability=0, impulse_probability=0),
    )
    alone = simulate_day(section, day, (), 8)
    crowded = simulate_day(section, day, testers, 8)
    (steady,) = {log.trajectory().time_us[-1] for log in crowded.testers}
    assert steady == pytest.approx(600e6 + 48.6 / 0.05 * 1e6, abs=10)
    stay = [
        sum(p.left_us - p.came_us for p in day.people if p.role == "shopper")
        for day in (alone, crowded)
    ]
    assert stay[1] > 1.1 * stay[0]
    slow = min(
        p.trajectory.speed_m_s[
            (p.trajectory.state == 1) & (p.trajectory.acceleration_m_s2 == 0)
        ].min()
        / p.speed_m_s
        for p in crowded.people
    )
    assert slow == pytest.approx(SLOWEST, rel=0.5)


def test_employees_do_not_depend_on_shoppers_draws(section):
    few = OpenStore.of(section, trading_day(shoppers=20.0), (), 9).floor.visits
    many = OpenStore.of(section, trading_day(shoppers=200.0), (), 9).floor.visits
    plans = [
        [v.visitor.plan.legs for v in visits if v.visitor.role == "staff"] for visits in (few, many)
    ]
    for one, other in zip(*plans, strict=True):
        assert np.array_equal(one, other, equal_nan=True)


def test_a_recorded_route_is_replayed(section):
    route = RecordedRoute(
        shopper="ann",
        points=(
            RoutePoint(place="F1", time_s=100.0),
            RoutePoint(place="E-05", time_s=200.0),
            RoutePoint(place="D8", time_s=201.0),
        ),
    )
    day = trading_day(shoppers=0.0, routes=(route,), staff=Staff(number=0))
    (person,) = simulate_day(section, day, (), 10).people
    assert person.name == "replayed-ann"
    assert person.came_us == 100_000_000
    ((name, arrived_us, dwell_us),) = person.visits
    assert (name, arrived_us + dwell_us) == ("E-05", pytest.approx(200e6, abs=2e6))
    # D8 is reached late, and left at once.
    assert np.any(
        np.hypot(
            person.trajectory.x_m - section.graph.node_xy_m[section.graph.node_row["D8"], 0],
            person.trajectory.y_m - section.graph.node_xy_m[section.graph.node_row["D8"], 1],
        )
        < 2.0
    )


@pytest.mark.parametrize("order", ["list", "circuit", "nearest-next"])
def test_orders_of_visits(section, order):
    wanted = ("D-15", "F-02", "E-09")
    day = trading_day(
        shoppers=8.0,
        order=order,
        staff=Staff(number=0),
        group_shares=(1.0,),
        lists=(ShoppingList(shopper="x", sections=wanted),),
        detours=Detours(probability=0, impulse_probability=0),
    )
    person = simulate_day(section, day, (), 11).people[0]
    names = [name for name, *_ in person.visits]
    assert sorted(names) == sorted(wanted)
    if order == "list":
        assert names == list(wanted)
    if order == "circuit":
        # Through all three aisles, whatever is on the list.
        levels = set(
            np.round(
                section.graph.xy_m(person.trajectory.edge, person.trajectory.offset_m)[:, 1], 3
            )
        )
        assert len(levels) >= 3
    if order == "nearest-next":
        # In at F.
        assert names[0] == "F-02"


def test_phones_change_hands_at_stops(section):
    day = trading_day(carrying=CarryingShares(switch_probability=1.0))
    found = simulate_day(section, day, (), 12)
    for person in found.people:
        if person.role == "shopper":
            assert person.carrying.time_us[0] == person.trajectory.time_us[0]
            arrivals = {arrived for _, arrived, _ in person.visits}
            assert set(person.carrying.time_us[1:].tolist()) <= arrivals
    first = np.array([p.carrying.carrying[0] for p in found.people])
    assert len(set(first.tolist())) > 3


def test_who_pushes_a_trolley_is_slower_to_start(section):
    shares = {"hand": 0.0, "flat": 0.0, "swinging": 0.0, "pocket": 0.0, "bag": 0.0}
    day = trading_day(carrying=CarryingShares(**shares, trolley=1.0), staff=Staff(number=0))
    rates = {
        round(float(rate), 6)
        for person in simulate_day(section, day, (), 13).people
        for rate in np.abs(person.trajectory.acceleration_m_s2)
    }
    assert rates == {0.0, Pace().trolley_acceleration_m_s2}


def test_a_till_that_never_serves_is_told(section):
    store = OpenStore.of(section, trading_day(tills=Tills(nodes=("D/west",))), (), 14)
    store.floor.tills[0].desk.request()
    with pytest.raises(InvariantError, match=r"deadlock .* 'shopper-\d+' waits for till 'D/west'"):
        store.run()


def test_a_day_that_does_not_fit_is_refused(section):
    with pytest.raises(UsageError, match=r"tills\.nodes\.1: there is no node 'Z'"):
        simulate_day(section, trading_day(tills=Tills(nodes=("D/west", "Z"))), (), 1)


DIGEST = "c923367d114088f2"
