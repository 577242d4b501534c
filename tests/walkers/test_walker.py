import networkx as nx
import numpy as np
import pytest
from shapely import box

from blesim.errors import UsageError, VenueError
from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.graph import AisleGraph, Edge, GraphPosition, Node
from blesim.venue.venue import Venue
from blesim.walkers.itinerary import Itinerary, Stop, WayPoints, way_points
from blesim.walkers.walker import simulate_walkers

# Two aisles of 10 m that meet at a right angle in B; C - D cannot be reached, D - A is one-way.
NODES = {"A": (0, 0), "B": (10, 0), "C": (10, 10), "D": (0, 10), "E": (50, 50), "F": (60, 50)}
GRAPH = AisleGraph(
    nodes=tuple(Node(id=name, x_m=x, y_m=y) for name, (x, y) in NODES.items()),
    edges=(
        Edge(first="A", second="B", branch="south"),
        Edge(first="B", second="C", branch="east"),
        Edge(first="D", second="A", branch="west", one_way=True),
        Edge(first="D", second="C", branch="north"),
        Edge(first="E", second="F", branch="island"),
    ),
)


def stops(*names: str, pause_s: float = 0.0) -> tuple[Stop, ...]:
    return tuple(Stop(place=GRAPH.at_node(name), pause_s=pause_s) for name in names)


def at(*xy_m: list[float], level: int = 0) -> WayPoints:
    return WayPoints(xy_m=np.array(xy_m), level=np.full(len(xy_m), level, np.int16))


def walked(**settings):
    itinerary = Itinerary(**{"walker": "w", "stops": stops("A", "C"), **settings})
    (log,) = simulate_walkers(GRAPH, (itinerary,))
    return log.trajectory(), log.pressed()


def test_story_of_a_walk_round_a_corner():
    trajectory, _ = walked(start_s=5.0, speed_m_s=2.0, turn_rate_rad_s=np.pi / 2)
    # 10 m at 2 m/s, a quarter turn in one second, 10 m at 2 m/s.
    assert trajectory.time_us.tolist() == [5_000_000, 10_000_000, 11_000_000, 16_000_000]
    assert trajectory.state.tolist() == [1, 2, 1, 0]
    assert trajectory.x_m.tolist() == [0, 10, 10, 10]
    assert trajectory.y_m.tolist() == [0, 0, 0, 10]
    assert trajectory.speed_m_s.tolist() == [2, 0, 2, 0]
    assert trajectory.edge.tolist() == [0, 1, 1, 1]
    assert trajectory.offset_m.tolist() == [0, 0, 0, 10]
    assert trajectory.heading_rad == pytest.approx([0, 0, np.pi / 2, np.pi / 2], abs=1e-6)
    middle = trajectory.at(np.array([10_500_000, 12_000_000]))
    assert middle.heading_rad == pytest.approx([np.pi / 4, np.pi / 2], abs=1e-6)
    assert middle.offset_m == pytest.approx([0, 2], abs=1e-6)
    assert middle.y_m == pytest.approx([0, 2], abs=1e-6)


def test_pauses_take_their_time_and_hold_the_place():
    trajectory, _ = walked(stops=stops("A", "B", "C", pause_s=3.0), speed_m_s=1.0)
    moving = 20.0 + 0.5
    assert (trajectory.time_us[-1] - trajectory.time_us[0]) / 1e6 == pytest.approx(moving + 9.0)
    standing = trajectory.at(np.array([1_500_000, 14_000_000, 15_900_000]))
    assert standing.state.tolist() == [0, 0, 0]
    assert standing.x_m.tolist() == [0, 10, 10]


def test_walked_length_is_the_length_of_the_route():
    trajectory, _ = walked(stops=stops("A", "C", "D", "B"), speed_m_s=1.37)
    walked_m = np.hypot(np.diff(trajectory.x_m), np.diff(trajectory.y_m)).sum()
    # A-B-C, C-D, then D-A-B is as long as D-C-B.
    assert walked_m == pytest.approx(20 + 10 + 20)


def test_walking_against_a_one_way_aisle_goes_round():
    trajectory, _ = walked(stops=stops("A", "D"))
    assert trajectory.edge.tolist()[0] == 0
    walked_m = np.hypot(np.diff(trajectory.x_m), np.diff(trajectory.y_m)).sum()
    assert walked_m == pytest.approx(30)


def test_offset_falls_when_an_edge_is_walked_backwards():
    trajectory, _ = walked(stops=stops("B", "A"), speed_m_s=1.0)
    assert trajectory.at(np.array([4_000_000])).offset_m == pytest.approx([6.0])


def test_turning_round_takes_half_a_turn():
    trajectory, _ = walked(stops=stops("A", "B", "A"), speed_m_s=1.0, turn_rate_rad_s=np.pi)
    assert trajectory.time_us[-1] == 10_000_000 + 1_000_000 + 10_000_000


def test_marks_are_pressed_where_and_when_a_way_point_is_passed():
    points = at([0.0, 0.0], [2.5, 0.0], [10.0, 0.0], [10.0, 4.0], [5.0, 5.0])
    _, marks = walked(speed_m_s=1.0, turn_rate_rad_s=np.pi / 2, way_points=points)
    assert marks.time_us.tolist() == [0, 2_500_000, 10_000_000, 15_000_000]
    assert marks.x_m.tolist() == [0, 2.5, 10, 10]
    assert marks.y_m.tolist() == [0, 0, 0, 4]


def test_a_way_point_at_a_node_is_pressed_once_each_time_it_is_passed():
    _, marks = walked(stops=stops("A", "B", "A"), speed_m_s=1.0, way_points=at([10.0, 0.0]))
    assert marks.time_us.tolist() == [10_000_000]


@pytest.mark.parametrize("level", [-1, 1])
def test_a_way_point_of_another_level_is_not_pressed(level):
    _, marks = walked(way_points=at([0.0, 0.0], [2.5, 0.0], level=level))
    assert len(marks) == 0


def test_way_points_one_above_the_other_are_two():
    nodes = tuple(
        Node(id=f"{name}{level}", x_m=x_m, y_m=y_m, level=level)
        for level in (0, 1)
        for name, x_m, y_m in (("a", 1, 5), ("b", 5, 5), ("c", 5, 9))
    )
    edges = tuple(
        Edge(first=f"{first}{level}", second=f"{second}{level}", branch=branch)
        for level in (0, 1)
        for first, second, branch in (("a", "b", "x"), ("b", "c", "y"))
    )
    levels = tuple(Level(level=level, bounds=box(0, 0, 10, 10)) for level in (0, 1))
    venue = Venue(
        name="two",
        floor_plan=FloorPlan(levels=levels),
        beacons=(),
        graph=AisleGraph(nodes=nodes, edges=edges),
    )
    points = way_points(venue)
    assert points.xy_m.tolist() == [[5, 5], [5, 5]]
    assert points.level.tolist() == [0, 1]


def test_way_points_without_their_levels_are_refused():
    with pytest.raises(UsageError, match="way points"):
        WayPoints(xy_m=np.zeros((2, 2)), level=np.zeros(1, np.int16))


def test_walkers_share_a_clock_and_do_not_disturb_each_other():
    one = Itinerary(walker="one", stops=stops("A", "B"))
    two = Itinerary(walker="two", stops=stops("C", "A"), start_s=3.0, speed_m_s=0.7)
    alone = [simulate_walkers(GRAPH, (each,))[0].trajectory() for each in (one, two)]
    together = [log.trajectory() for log in simulate_walkers(GRAPH, (one, two))]
    assert alone == together


def test_a_stop_within_an_edge():
    route = (Stop(place=GraphPosition(0, 2.0)), Stop(place=GraphPosition(0, 7.5)))
    trajectory, _ = walked(stops=route, speed_m_s=1.0)
    assert trajectory.x_m.tolist() == [2.0, 7.5]
    assert trajectory.time_us[-1] == 5_500_000


def test_a_route_that_does_not_connect_is_refused():
    with pytest.raises(VenueError, match="no way leads from node 'A' to node 'E'"):
        walked(stops=stops("A", "E"))


@pytest.mark.parametrize(
    "settings",
    [
        {"speed_m_s": 0.0},
        {"speed_m_s": -1.0},
        {"speed_m_s": float("nan")},
        {"speed_m_s": 1e-300},
        {"turn_rate_rad_s": 0.0},
        {"turn_rate_rad_s": 1e-300},
        {"start_s": -1.0},
        {"start_s": float("inf")},
        {"stops": stops("A")},
    ],
)
def test_impossible_itineraries_are_refused(settings):
    with pytest.raises(UsageError, match="walker 'w'"):
        walked(**settings)


@pytest.mark.parametrize("pause_s", [-1.0, 1e300, float("inf"), float("nan")])
def test_impossible_pauses_are_refused(pause_s):
    with pytest.raises(UsageError, match="pause"):
        Stop(place=GraphPosition(0, 0.0), pause_s=pause_s)


def test_way_points_of_the_section_are_shelf_ends_and_junctions(section):
    points = way_points(section)
    # Nineteen shelf ends in each of three aisles, and two junctions each.
    assert len(points) == 3 * 19 + 3 * 2


def test_story_of_a_walk_with_acceleration():
    trajectory, marks = walked(
        speed_m_s=2.0,
        acceleration_m_s2=1.0,
        turn_rate_rad_s=np.pi / 2,
        way_points=at([2.0, 0.0], [10.0, 5.0]),
    )
    # 2 s for the first 2 m, 3 s for 6 m, 2 s to stop; a quarter turn; the same again.
    assert (trajectory.time_us / 1e6).tolist() == [0, 2, 5, 7, 8, 10, 13, 15]
    assert trajectory.state.tolist() == [1, 1, 1, 2, 1, 1, 1, 0]
    assert trajectory.speed_m_s.tolist() == [0, 2, 2, 0, 0, 2, 2, 0]
    assert trajectory.acceleration_m_s2.tolist() == [1, 0, -1, 0, 1, 0, -1, 0]
    assert trajectory.x_m.tolist() == [0, 2, 8, 10, 10, 10, 10, 10]
    middle = trajectory.at(np.array([1_000_000, 3_500_000, 6_000_000]))
    assert middle.x_m == pytest.approx([0.5, 5.0, 9.5])
    assert middle.offset_m == pytest.approx([0.5, 5.0, 9.5])
    assert middle.speed_m_s == pytest.approx([1.0, 2.0, 1.0])
    assert (marks.time_us / 1e6).tolist() == pytest.approx([2.0, 11.5])


def test_who_accelerates_stops_for_pauses_and_goes_on_through_nodes():
    line = AisleGraph(
        nodes=tuple(Node(id=f"n{k}", x_m=2.0 * k, y_m=0) for k in range(6)),
        edges=tuple(Edge(first=f"n{k}", second=f"n{k + 1}", branch="a") for k in range(5)),
    )
    route = tuple(
        Stop(place=line.at_node(name), pause_s=pause)
        for name, pause in (("n0", 0.0), ("n3", 4.0), ("n5", 0.0))
    )
    itinerary = Itinerary(walker="w", stops=route, speed_m_s=1.5, acceleration_m_s2=0.75)
    trajectory = simulate_walkers(line, (itinerary,))[0].trajectory()
    at_nodes = [trajectory.speed_m_s[trajectory.x_m == x].max() for x in (2.0, 4.0, 6.0, 8.0)]
    assert at_nodes == pytest.approx([1.5, 1.5, 0.0, 1.5], abs=0.25)
    assert at_nodes[2] == 0
    way_m = np.diff(trajectory.x_m).sum()
    assert way_m == pytest.approx(10.0)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), 21.0])
def test_impossible_accelerations_are_refused(rate):
    with pytest.raises(UsageError, match="acceleration_m_s2"):
        walked(acceleration_m_s2=rate)


def test_ways_found_once_are_those_of_networkx_even_where_several_are_as_short(store):
    graph = store.graph
    names = [node.id for node in graph.nodes]
    for start in names[::23]:
        for end in names[::7]:
            way = nx.dijkstra_path(graph.network, start, end, weight="length_m")
            assert graph._nodes_from(start)[end] == way


def test_way_points_are_the_same_whoever_walks_there():
    points = at([2.5, 0.0], [10.0, 0.0])
    others = at([4.0, 0.0])
    walks = tuple(
        Itinerary(walker=name, stops=stops("A", "B"), way_points=each)
        for name, each in (("one", points), ("two", points), ("three", others))
    )
    pressed = [log.pressed().x_m.tolist() for log in simulate_walkers(GRAPH, walks)]
    assert pressed == [[2.5, 10.0], [2.5, 10.0], [4.0]]
