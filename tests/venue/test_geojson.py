"""Maps as GeoJSON: the same venue comes back, and every fault of a map has its own line."""

import json
from collections.abc import Callable
from itertools import pairwise
from typing import Any
from uuid import UUID

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from blesim.errors import VenueError
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FLOOR_TO_CEILING_M, FloorPlan, Level, Obstacle
from blesim.venue.geojson import from_geojson, to_geojson
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.materials import MATERIALS
from blesim.venue.sections import Section
from blesim.venue.venue import Georeference, Venue

UUID_1 = UUID("f7826da6-4fa2-4e98-8024-bc5b71e0893e")
Document = dict[str, Any]


def beacon(**changes: Any) -> Beacon:
    given_ = {
        "id": "D3",
        "uuid": UUID_1,
        "major": 1,
        "minor": 2,
        "x_m": 4.0,
        "y_m": 2.0,
        "z_m": 1.5,
        "tx_power_dbm": -12.0,
        "measured_power_dbm": -71.0,
        "advertising_interval_s": 0.35,
    }
    return Beacon(**(given_ | changes))


@pytest.fixture
def venue() -> Venue:
    hole = shapely.Polygon(
        [(10, 6), (18, 6), (18, 9), (10, 9)], [[(12, 7), (14, 7), (14, 8), (12, 8)]]
    )
    return Venue(
        name="Markt am Ring",
        floor_plan=FloorPlan(
            levels=(
                Level(level=0, bounds=shapely.box(0, 0, 20, 10)),
                Level(level=1, bounds=shapely.box(0, 0, 20, 10)),
            ),
            obstacles=(
                Obstacle(id="S1", outline=shapely.box(2, 2, 18, 3), material="gondola-dry"),
                Obstacle(id="S2", outline=hole, material="bookcase", height_m=1.8, level=1),
            ),
        ),
        beacons=(beacon(), beacon(id="D4", x_m=0.1, y_m=0.30000000000000004, level=1)),
        graph=AisleGraph(
            nodes=(Node(id="a", x_m=1, y_m=5), Node(id="b", x_m=19, y_m=5)),
            edges=(Edge(first="a", second="b", branch="A1", one_way=True),),
        ),
        sections=(Section(id="tea", category="drinks", branch="A1", start_m=(3, 5), end_m=(5, 5)),),
        georeference=Georeference(latitude_deg=48.0, longitude_deg=11.5, bearing_deg=12.0),
    )


def test_round_trip(venue: Venue) -> None:
    text = to_geojson(venue)
    assert from_geojson(text, "map") == venue
    assert to_geojson(from_geojson(text, "map")) == text


def test_one_feature_a_line(venue: Venue) -> None:
    lines = to_geojson(venue).splitlines()
    features = [line.strip().rstrip(",") for line in lines if '"Feature"' in line]
    assert len(features) == 2 + 2 + 2 + 1 + 1 + 2
    assert json.loads(features[0])["properties"] == {"feature_type": "level", "level": 0}
    assert json.loads(features[-2]) == {
        "type": "Feature",
        "properties": {
            "feature_type": "amenity",
            "category": "beacon",
            "id": "D3",
            "uuid": "f7826da6-4fa2-4e98-8024-bc5b71e0893e",
            "major": 1,
            "minor": 2,
            "level": 0,
            "tx_power_dbm": -12.0,
            "measured_power_dbm": -71.0,
            "advertising_interval_s": 0.35,
            "channel_gain_db": [0.0, 0.0, 0.0],
        },
        "geometry": {"type": "Point", "coordinates": [4.0, 2.0, 1.5]},
    }
    assert '"coordinates": [0.1, 0.30000000000000004, 1.5]' in lines[-3]


def test_floor_to_ceiling_has_no_height(venue: Venue) -> None:
    fixtures = [
        feature["properties"]
        for feature in json.loads(to_geojson(venue))["features"]
        if feature["properties"]["feature_type"] == "fixture"
    ]
    assert "height_m" not in fixtures[0]
    assert fixtures[1]["height_m"] == 1.8


names = st.text(st.characters(exclude_categories=["Cc", "Cs", "Zl", "Zp"]), min_size=1, max_size=8)
inside = st.floats(0.5, 9.5)


@st.composite
def venues(draw: st.DrawFn) -> Venue:
    """Shelves in columns right of x = 20, beacons and aisles left of it."""
    shelves = draw(st.lists(names, max_size=3, unique=True))
    nodes = draw(st.lists(names, min_size=2, max_size=4, unique=True))
    graph = AisleGraph(
        nodes=tuple(
            Node(id=name, x_m=row + draw(st.floats(0, 0.9)), y_m=draw(inside))
            for row, name in enumerate(nodes)
        ),
        edges=tuple(
            Edge(first=first, second=second, branch=draw(names), one_way=draw(st.booleans()))
            for first, second in pairwise(nodes)
        ),
    )
    return Venue(
        name=draw(names),
        floor_plan=FloorPlan(
            levels=(Level(level=0, bounds=shapely.box(-1, 0, 50, 10)),),
            obstacles=tuple(
                Obstacle(
                    id=name,
                    outline=shapely.box(20 + 5 * row, draw(inside), 24 + 5 * row, 9.75),
                    material=draw(st.sampled_from(sorted(MATERIALS))),
                    height_m=draw(st.just(FLOOR_TO_CEILING_M) | st.floats(0.1, 9)),
                )
                for row, name in enumerate(shelves)
            ),
        ),
        beacons=tuple(
            beacon(
                id=name,
                uuid=draw(st.uuids()),
                x_m=draw(inside),
                y_m=draw(inside),
                z_m=draw(st.floats(0, 5)),
                tx_power_dbm=draw(st.floats(-40, 20)),
                advertising_interval_s=draw(st.integers(32, 16384)) * 0.000_625,
                channel_gain_db=tuple(draw(st.floats(-9, 9)) for _ in range(3)),
                payload=draw(st.sampled_from(["ibeacon", "eddystone-uid"])),
                packet_spacing_us=draw(st.none() | st.integers(400, 5000)),
                **draw(
                    st.just({})
                    | st.fixed_dictionaries(
                        {"facing_deg": st.floats(-360, 360), "front_to_back_db": st.floats(0, 40)}
                    )
                ),
            )
            for name in draw(st.lists(names, max_size=3, unique=True))
        ),
        graph=draw(st.none() | st.just(graph)),
        georeference=draw(
            st.none()
            | st.builds(
                Georeference, latitude_deg=st.floats(-90, 90), longitude_deg=st.floats(-180, 180)
            )
        ),
    )


@given(venue=venues())
@settings(max_examples=60, deadline=None, derandomize=True)
def test_any_venue_comes_back(venue: Venue) -> None:
    assert from_geojson(to_geojson(venue), "map") == venue


def changed(venue: Venue, change: Callable[[Document], object]) -> str:
    document = json.loads(to_geojson(venue))
    change(document)
    return json.dumps(document)


def faults(text: str) -> list[str]:
    with pytest.raises(VenueError) as caught:
        from_geojson(text, "shop.geojson")
    lines = str(caught.value).splitlines()
    assert all(line.startswith("shop.geojson:") for line in lines)
    return [line.removeprefix("shop.geojson:") for line in lines]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('{"type": "FeatureCollection",\n  "features": [}', "2:16: not JSON: Expecting value"),
        ("", "1:1: not JSON"),
        ("[]", " not a GeoJSON FeatureCollection"),
        ('{"type": "Feature"}', " not a GeoJSON FeatureCollection with a list of features"),
        ('{"x": NaN}', " not a map: NaN is not a number that JSON knows"),
        ("[" * 100_000, " not a map: "),
        ('{"type": "FeatureCollection", "features": []}', " no member 'blesim'"),
        (
            '{"type": "FeatureCollection", "features": [], "blesim": {"coordinates": "degrees"}}',
            " member 'blesim': property 'coordinates': input should be 'local metres'",
        ),
        (
            '{"type": "FeatureCollection", "features": [], "blesim":'
            ' {"coordinates": "local metres", "name": "v"}}',
            " a floor plan needs at least one level",
        ),
    ],
)
def test_no_map_at_all(text: str, expected: str) -> None:
    assert faults(text)[0].startswith(expected)


def properties(number: int, **values: Any) -> Callable[[Document], object]:
    return lambda document: document["features"][number - 1]["properties"].update(values)


def without(number: int, name: str) -> Callable[[Document], object]:
    return lambda document: document["features"][number - 1]["properties"].pop(name)


def geometry(number: int, **values: Any) -> Callable[[Document], object]:
    return lambda document: document["features"][number - 1]["geometry"].update(values)


FAULTS = {
    "unknown type": (properties(3, feature_type="shelf"), "feature 3 (shelf 'S1'): feature_type"),
    "no type": (without(3, "feature_type"), "feature 3: feature_type null is not known"),
    "no feature": (lambda d: d["features"].append(7), "feature 11: not a GeoJSON Feature"),
    "no geometry": (
        lambda d: d["features"][0].update(geometry=None),
        "feature 1 (level 0): a feature needs both",
    ),
    "missing": (without(9, "uuid"), "feature 9 (beacon 'D3'): property 'uuid' is missing"),
    "missing id": (without(3, "id"), "feature 3: property 'id' is missing"),
    "misspelt": (
        properties(4, heigth_m=2.0),
        "feature 4 (obstacle 'S2'): property 'heigth_m' is not known",
    ),
    "misspelt beacon": (
        properties(9, minro=2),
        "feature 9 (beacon 'D3'): property 'minro' is not known",
    ),
    "position twice": (properties(9, x_m=2), "property 'x_m' belongs into the coordinates"),
    "wrong type": (properties(9, major="1"), "property 'major': input should be a valid integer"),
    "flag": (properties(7, one_way=1), "feature 7 (edge a - b): property 'one_way'"),
    "too much": (properties(9, major=70000), "property 'major': input should be less than"),
    "interval": (
        properties(9, advertising_interval_s=0.3501),
        "property 'advertising_interval_s': not a multiple of 0.625 ms",
    ),
    "material": (
        properties(3, material="cheese"),
        "feature 3 (obstacle 'S1'): unknown material 'cheese'",
    ),
    "height": (properties(4, height_m=-1.0), "feature 4 (obstacle 'S2'): height_m -1.0 must be"),
    "geometry type": (geometry(9, type="Polygon"), 'needs a Point, not "Polygon"'),
    "flat beacon": (geometry(9, coordinates=[1, 2]), "a position needs 3 coordinates, not [1, 2]"),
    "text": (geometry(9, coordinates=[1, "2", 3]), 'coordinate "2" is not a number'),
    "truth value": (geometry(9, coordinates=[1, True, 3]), "coordinate true is not a number"),
    "degrees of a far map": (geometry(9, coordinates=[1e6, 2, 3]), "is not in local metres"),
    "no coordinates": (geometry(9, coordinates=None), "a position needs 3 coordinates, not null"),
    "open ring": (
        geometry(3, coordinates=[[[0, 0], [1, 0], [1, 1], [0, 1]]]),
        "a ring must end where it begins",
    ),
    "short ring": (geometry(3, coordinates=[[[0, 0]]]), "a ring needs at least four positions"),
    "no ring": (geometry(3, coordinates=[]), "a polygon needs at least one ring"),
    "bow tie": (
        geometry(3, coordinates=[[[0, 0], [3, 3], [3, 0], [0, 1], [0, 0]]]),
        "feature 3 (obstacle 'S1'): bad outline",
    ),
    "long line": (geometry(7, coordinates=[[0, 0]] * 3), "a line needs exactly two positions"),
    "detached edge": (
        geometry(7, coordinates=[[1, 5], [19, 6]]),
        "feature 7 (edge a - b): its line misses node 'b'",
    ),
    "inside a shelf": (
        geometry(9, coordinates=[4, 2.5, 1.5]),
        "feature 9 (beacon 'D3'): at (4, 2.5) is inside obstacle 'S1'; put it on a face",
    ),
    "out of bounds": (geometry(9, coordinates=[40, 2, 1]), "feature 9 (beacon 'D3'): at (40, 2)"),
    "no such level": (properties(10, level=3), "feature 10 (beacon 'D4'): is on level 3"),
    "no such node": (properties(7, second="c"), "feature 7 (edge a - c): there is no node 'c'"),
    "twice": (properties(10, id="D3"), "feature 10 (beacon 'D3'): is there twice"),
    "no beacon": (properties(9, category="lift"), "input should be 'beacon'"),
    "level of no building": (properties(1, level=10**300), "feature 1 (level 1000"),
    "long name": (properties(3, id="s" * 201), "property 'id': string should have at most 200"),
    "loud channel": (
        properties(9, channel_gain_db=[0, 31, 0]),
        "feature 9 (beacon 'D3'): property 'channel_gain_db.1': input should be less than",
    ),
    "much else": (geometry(9, coordinates=[7] * 999), "needs 3 coordinates, not [7, 7, "),
    "line break": (properties(3, id="S\n1"), r'"S\n1" holds the control character U+000A'),
    "null": (properties(9, id="D\0"), r'"D\u0000" holds the control character U+0000'),
    "half a character": (
        properties(10, payload="\ud800"),
        r'"\ud800" holds the control character U+D800',
    ),
    "line break in a property": (
        properties(4, **{"a\nb": 1}),
        r'"a\nb" holds the control character U+000A',
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults_of_one_feature(venue: Venue, name: str) -> None:
    change, expected = FAULTS[name]
    (line,) = faults(changed(venue, change))
    assert expected in line
    assert len(line) < 300


def test_a_member_that_is_there_twice(venue: Venue) -> None:
    text = to_geojson(venue)
    (line,) = faults(text.replace('"id": "S2",', '"id": "S2", "id": "S3",'))
    start = '{"feature_type": "fixture", "id": "S2"}'
    assert line == f' not a map: member "id" is there twice after {start}'


def test_infinite_numbers(venue: Venue) -> None:
    text = to_geojson(venue)
    (line,) = faults(text.replace("-12.0", "1e999", 1))
    assert "property 'tx_power_dbm': input should be" in line
    (line,) = faults(text.replace("[4.0, 2.0, 1.5]", "[4.0, 1e999, 1.5]"))
    assert "feature 9 (beacon 'D3'): a coordinate beyond" in line


def test_all_faults_at_once(venue: Venue) -> None:
    def spoil(document: Document) -> None:
        for name in ("material", "wrong type", "no beacon", "long line"):
            FAULTS[name][0](document)
        document["features"][9]["properties"].update(minor=-1, measured_power_dbm=1)

    lines = faults(changed(venue, spoil))
    assert [line.split(":")[0] for line in lines] == [
        " feature 3 (obstacle 'S1')",
        " feature 7 (edge a - b)",
        " feature 9 (beacon 'D3')",
        " feature 10 (beacon 'D4')",
        " feature 10 (beacon 'D4')",
    ]


@given(text=st.text(max_size=60))
@settings(derandomize=True, max_examples=50)
def test_any_other_text_is_refused(text: str) -> None:
    assert faults(text)


@given(number=st.integers(0, 9), member=st.sampled_from(["type", "properties", "geometry"]))
@settings(derandomize=True, max_examples=40)
@pytest.mark.parametrize("value", [None, 1, "x", [], {}, [[]], {"type": []}])
def test_anything_in_place_of_a_member(value: object, number: int, member: str) -> None:
    text = '{"coordinates": "local metres", "name": "v"}'
    point = {
        "type": "Feature",
        "properties": {"feature_type": "node", "id": "a"},
        "geometry": {"type": "Point", "coordinates": [1.0, 2.0]},
    }
    features: list[Any] = [dict(point) for _ in range(10)]
    features[number][member] = value
    document = {"type": "FeatureCollection", "blesim": json.loads(text), "features": features}
    assert f" feature {number + 1}" in faults(json.dumps(document))[0]
