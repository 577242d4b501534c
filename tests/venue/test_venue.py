import pickle
from typing import Any
from uuid import UUID

import pytest
from pydantic import ValidationError
from shapely import box

from blesim.errors import VenueError
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.sections import Section
from blesim.venue.venue import Georeference, Venue

SHELF = Obstacle(id="s1", outline=box(2, 4, 18, 6), material="gondola-dry", height_m=1.8)
PLAN = FloorPlan(
    levels=(Level(level=0, bounds=box(0, 0, 20, 10)), Level(level=1, bounds=box(0, 0, 20, 10))),
    obstacles=(SHELF,),
)
GRAPH = AisleGraph(
    nodes=(
        Node(id="sw", x_m=1, y_m=2),
        Node(id="se", x_m=19, y_m=2),
        Node(id="nw", x_m=1, y_m=8),
        Node(id="ne", x_m=19, y_m=8),
    ),
    edges=(
        Edge(first="sw", second="se", branch="south"),
        Edge(first="nw", second="ne", branch="north"),
        Edge(first="sw", second="nw", branch="west"),
    ),
)


def beacon(x_m: float, y_m: float, **changes: Any) -> Beacon:
    values: dict[str, Any] = {
        "id": "b1",
        "uuid": UUID(int=7),
        "major": 1,
        "minor": 2,
        "z_m": 1.5,
        "tx_power_dbm": -12.0,
        "measured_power_dbm": -77.0,
        "advertising_interval_s": 0.35,
    }
    return Beacon(x_m=x_m, y_m=y_m, **{**values, **changes})


def section(**changes: Any) -> Section:
    values = {"id": "tins", "category": "tins", "branch": "south"}
    return Section(**{**values, "start_m": (3.0, 2.0), "end_m": (5.7, 2.0), **changes})


def venue(**parts: Any) -> Venue:
    return Venue(**{"name": "hall", "floor_plan": PLAN, "beacons": (), "graph": GRAPH, **parts})


@pytest.mark.parametrize(
    "mounted",
    [
        beacon(10, 4),
        beacon(10, 4.02),
        beacon(2, 5),
        beacon(2, 4),
        beacon(10, 5, z_m=1.9),
        beacon(10, 5, level=1),
        beacon(0, 10),
        beacon(20.01, 5),
    ],
    ids=["face", "2 cm deep", "end", "corner", "on top", "upstairs", "wall", "1 cm out"],
)
def test_beacons_in_their_place(mounted: Beacon) -> None:
    assert venue(beacons=(mounted,)).beacon_row == {"b1": 0}


@pytest.mark.parametrize(
    ("mounted", "message"),
    [
        (beacon(10, 5), r"'b1' at \(10, 5\) is inside obstacle 's1'; put it on a face"),
        (beacon(10, 4.03), "inside obstacle 's1'"),
        (beacon(10, 5, z_m=1.8), "inside obstacle 's1'"),
        (beacon(20.03, 5), r"'b1' at \(20\.03, 5\) is out of the bounds of level 0"),
        (beacon(10, 2, level=2), "beacon 'b1' is on level 2, but the floor plan has only 0, 1"),
    ],
)
def test_misplaced_beacons(mounted: Beacon, message: str) -> None:
    with pytest.raises(VenueError, match=message):
        venue(beacons=(mounted,))


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        (((1, 5), (19, 5)), "aisle 'x', edge a - b runs through obstacle 's1'"),
        (((3, 5), (17, 5)), "aisle 'x', edge a - b runs through obstacle 's1'"),
        (((1, 3), (5, 5)), "runs through obstacle 's1'"),
        (((1, 3.9), (19, 4.1)), "runs through obstacle 's1'"),
        (((1, 2), (21, 2)), "aisle 'x', edge a - b leaves the bounds of level 0"),
        (((30, 2), (31, 2)), "leaves the bounds of level 0"),
    ],
)
def test_blocked_aisles(nodes: tuple[tuple[float, float], ...], message: str) -> None:
    (ax, ay), (bx, by) = nodes
    graph = AisleGraph(
        nodes=(Node(id="a", x_m=ax, y_m=ay), Node(id="b", x_m=bx, y_m=by)),
        edges=(Edge(first="a", second="b", branch="x"),),
    )
    with pytest.raises(VenueError, match=message):
        venue(graph=graph)


def test_an_aisle_on_no_level() -> None:
    graph = AisleGraph(
        nodes=(Node(id="a", x_m=1, y_m=2, level=5), Node(id="b", x_m=9, y_m=2, level=5)),
        edges=(Edge(first="a", second="b", branch="x"),),
    )
    with pytest.raises(VenueError, match="aisle 'x', edge a - b is on level 5"):
        venue(graph=graph)


def test_an_aisle_may_run_along_a_face_and_under_another_level() -> None:
    for y_m, level in ((4.0, 0), (5.0, 1)):
        graph = AisleGraph(
            nodes=(
                Node(id="a", x_m=1, y_m=y_m, level=level),
                Node(id="b", x_m=19, y_m=y_m, level=level),
            ),
            edges=(Edge(first="a", second="b", branch="x"),),
        )
        assert venue(graph=graph).graph is graph


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (section(end_m=(5.7, 3.0)), r"section 'tins': \(5\.7, 3\) is 1\.00 m off the aisles"),
        (section(start_m=(0.5, 2.0)), r"the nearest place on them is \(1, 2\)"),
        (section(branch="north"), r"\(3, 2\) is on aisle 'south', not on 'north'"),
        (section(branch="cellar"), "is on aisle 'south', not on 'cellar'"),
        (section(start_m=(float("nan"), 2.0)), r"section 'tins': \(nan, 2\)"),
        (section(level=1), "no edge on level 1"),
    ],
)
def test_sections_off_their_aisle(wrong: Section, message: str) -> None:
    with pytest.raises(VenueError, match=message):
        venue(sections=(wrong,))


def test_sections_on_their_aisle() -> None:
    to_the_corner = section(id="corner", start_m=(1.0, 2.0))
    around = section(id="west", branch="west", start_m=(1.0, 2.0), end_m=(1.0, 4.0))
    assert len(venue(sections=(section(), to_the_corner, around)).sections) == 3


def test_sections_need_a_graph() -> None:
    with pytest.raises(VenueError, match="section 'tins' needs an aisle graph"):
        venue(graph=None, sections=(section(),))


@pytest.mark.parametrize("kind", ["beacon", "section"])
def test_names_stand_once(kind: str) -> None:
    parts = {"beacon": {"beacons": (beacon(1, 1), beacon(1, 2))}}.get(
        kind, {"sections": (section(), section())}
    )
    with pytest.raises(VenueError, match=f"{kind} '(b1|tins)' is there twice; give each its own"):
        venue(**parts)


def test_beacons_as_arrays() -> None:
    hall = venue(beacons=(beacon(10, 4), beacon(2, 5, id="b2", z_m=3.0, level=1)))
    assert hall.beacon_xyz_m.tolist() == [[10.0, 4.0, 1.5], [2.0, 5.0, 3.0]]
    assert hall.beacon_level.tolist() == [0, 1]
    assert venue().beacon_xyz_m.shape == (0, 3)
    for array in (
        hall.beacon_xyz_m,
        hall.beacon_level,
        *venue(beacons=(beacon(1, 1),)).beacon_places,
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_places_beside_the_beacons() -> None:
    edge, offset_m = venue(beacons=(beacon(10, 4), beacon(3, 6, id="b2"))).beacon_places
    assert edge.tolist() == [0, 1]
    assert offset_m.tolist() == [9.0, 2.0]
    with pytest.raises(VenueError, match="venue 'hall' has no aisle graph"):
        _ = venue(graph=None).beacon_places


def test_the_same_building_with_other_beacons() -> None:
    hall = venue(beacons=(beacon(10, 4),))
    other = hall.with_beacons((beacon(10, 6, id="b9"),))
    assert other.beacon_row == {"b9": 0}
    assert hall.beacon_row == {"b1": 0}
    assert other.graph is hall.graph
    with pytest.raises(VenueError, match="inside obstacle"):
        hall.with_beacons((beacon(10, 5),))


@pytest.mark.parametrize(
    "where",
    [
        {"latitude_deg": 91.0, "longitude_deg": 0.0},
        {"latitude_deg": 0.0, "longitude_deg": 181.0},
        {"latitude_deg": 0.0, "longitude_deg": 0.0, "bearing_deg": 400.0},
    ],
)
def test_places_off_the_earth(where: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        Georeference(**where)


def test_a_venue_travels_to_another_process() -> None:
    hall = venue(beacons=(beacon(10, 4),), sections=(section(),))
    assert hall.beacon_row["b1"] == 0
    assert hall.beacon_places[0].tolist() == [0]
    copy = pickle.loads(pickle.dumps(hall))  # noqa: S301
    assert copy == hall
    assert copy.graph.branches == GRAPH.branches
