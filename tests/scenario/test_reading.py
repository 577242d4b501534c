import contextlib
import re

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from blesim.errors import ScenarioError
from blesim.radio.propagation import Propagation
from blesim.scenario.build import set_stage
from blesim.scenario.reading import read_scenario
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle
from blesim.venue.geojson import to_geojson
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.venue import Venue
from blesim.walkers.walker import simulate_walkers

GOOD = """\
title: Ten lines
seed: 1
venue: {layout: wholesale-section}
phones:
  phone: {}
walks:
  - name: run
    phone: phone
    speed_m_s: 1.2
    route: [D1, D5, {x_m: 30.0, y_m: 8.2, pause_s: 5}]
"""


@pytest.fixture
def scenario(tmp_path):
    def write(text: str):
        path = tmp_path / "scenario.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def faults(path) -> list[str]:
    """The lines of the error, without the folder."""
    with pytest.raises(ScenarioError) as caught:
        set_stage(read_scenario(path), 1)
    assert caught.value.exit_code == 2
    return [line.replace(f"{path.parent}/", "") for line in str(caught.value).splitlines()]


def test_a_good_scenario_reads_and_keeps_its_text(scenario):
    file = read_scenario(scenario(GOOD))
    assert file.text == GOOD
    assert file.scenario.walks[0].route[0].node == "D1"
    assert file.scenario.walks[0].route[2].pause_s == 5
    stage = set_stage(file, 1)
    assert len(stage.built.beacons) == 25
    assert stage.built == stage.surveyed


def test_changed_parameters_are_checked_and_told_in_the_text(scenario):
    file = read_scenario(scenario(GOOD))
    changed = file.with_parameters(radio=Propagation(path_loss_exponent=3.0))
    assert changed.scenario.radio.path_loss_exponent == 3.0
    assert changed.scenario.walks == file.scenario.walks
    assert changed.text.startswith(GOOD)
    assert "path_loss_exponent" in changed.text.removeprefix(GOOD)
    with pytest.raises(ValueError, match="seed"):
        file.with_parameters(seed=-1)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("seed: 1", "sed: 1", "scenario.yaml:2: sed: unknown key"),
        ("name: run", "name: all", "scenario.yaml:7: walks.0.name: 'all' stands for all walks"),
        ("seed: 1", "seed: -1", "scenario.yaml:2: seed: "),
        ("seed: 1", "seed: '1'", "scenario.yaml:2: seed: "),
        ("speed_m_s: 1.2", "speed_m_s: fast", "scenario.yaml:9: walks.0.speed_m_s: "),
        ("speed_m_s: 1.2", "speed_m_s: .nan", "scenario.yaml:9: walks.0.speed_m_s: "),
        ("speed_m_s: 1.2", "speed_m_s: .inf", "scenario.yaml:9: walks.0.speed_m_s: "),
        ("speed_m_s: 1.2", "speed_m_s: 0", "scenario.yaml:9: walks.0.speed_m_s: "),
        ("speed_m_s: 1.2", "speed_m_s: true", "scenario.yaml:9: walks.0.speed_m_s: "),
        ("    phone: phone\n", "", "scenario.yaml:7: walks.0.phone: missing"),
        ("phone: phone", "phone: tablet", "scenario.yaml:8: walks.0.phone: unknown phone 'tablet'"),
        ("D1, D5", "D1, Z9", "scenario.yaml:10: walks.0.route.1: there is no node 'Z9'"),
        ("x_m: 30.0, ", "", "scenario.yaml:10: walks.0.route.2: give either 'node' or both"),
        ("y_m: 8.2", "y_m: 11.0", "scenario.yaml:10: walks.0.route.2: (30, 11) is 2.50 m off"),
        ("pause_s: 5", "pause_s: -5", "scenario.yaml:10: walks.0.route.2.pause_s: "),
        ("phone: {}", "phone: {height_m: 9}", "scenario.yaml:5: phones.phone.height_m: "),
        ("layout: wholesale-section", "layout: palace", "scenario.yaml:3: venue.layout: "),
        ("{layout: wholesale-section}", "{}", "scenario.yaml:3: venue: give either 'map'"),
        ("layout: wholesale-section", "map: no.geojson", "scenario.yaml:3: venue.map: no.geojson:"),
        ("title: Ten lines\n", "", "scenario.yaml:1: title: missing"),
        ("seed: 1", "seed: 1\nseed: 2", "scenario.yaml:3: not valid YAML: "),
        ("seed: 1", "seed: [1", "scenario.yaml:3: not valid YAML: "),
        ("seed: 1", "seed: " + "9" * 400, "scenario.yaml:2: seed: Input should be less than"),
        ("Ten lines", "2020-01-01", "scenario.yaml:1: title: a date is no value here"),
        ("Ten lines", '"a\\nb"', "scenario.yaml:1: title: holds the control character U+000A"),
        ("Ten lines", "t" * 201, "scenario.yaml:1: title: String should have at most 200"),
        ("x_m: 30.0", "x_m: 1e308", "scenario.yaml:10: walks.0.route.2.x_m: "),
        ("x_m: 30.0", "x_m: " + "9" * 400, "scenario.yaml:10: walks.0.route.2.x_m: "),
        ("y_m: 8.2", "level: 10000, y_m: 8.2", "scenario.yaml:10: walks.0.route.2.level: "),
        ("y_m: 8.2", "level: 3, y_m: 8.2", "scenario.yaml:10: walks.0.route.2: the aisle graph"),
        ("speed_m_s: 1.2", "speed_m_s: 0.049", "scenario.yaml:9: walks.0.speed_m_s: "),
        ("speed_m_s: 1.2", "turn_rate_deg_s: 0.9", "scenario.yaml:9: walks.0.turn_rate_deg_s: "),
        ("speed_m_s: 1.2", "start_s: 604801", "scenario.yaml:9: walks.0.start_s: "),
        ("speed_m_s: 1.2", "speed_m_s: 10", "scenario.yaml:7: walks.0: at 10 m/s this gait makes"),
        (
            "speed_m_s: 1.2",
            "gait: {length_at_rest_m: 0.01, length_per_speed_s: 0}",
            "scenario.yaml:7: walks.0: at 1 m/s this gait makes steps of 0.01 m",
        ),
        (
            "D1, D5",
            "D1" + ", {node: D5, pause_s: 86400}" * 31,
            "scenario.yaml:7: walks.0: may go on until 26784",
        ),
        ("phone: {}", "phone: 3", "scenario.yaml:5: phones.phone: give a mapping, not 3"),
        ("  phone: {}", "  - phone", "scenario.yaml:4: phones: give a mapping"),
        ("layout: wholesale-section", 'map: "a\\0b"', "scenario.yaml:3: venue.map: holds the cont"),
    ],
)
def test_a_fault_is_told_with_its_line(scenario, old, new, expected):
    assert old in GOOD
    (line,) = faults(scenario(GOOD.replace(old, new)))
    assert line.startswith(expected)
    assert len(line) < 260


@pytest.mark.parametrize(
    "pace",
    ["speed_m_s: 3.0", "speed_m_s: 0.05", "start_s: 604800", "turn_rate_deg_s: 1"],
)
def test_a_pace_that_is_possible_is_taken(scenario, pace):
    (itinerary,) = set_stage(
        read_scenario(scenario(GOOD.replace("speed_m_s: 1.2", pace))), 1
    ).itineraries
    assert itinerary.walker == "run"


def test_a_byte_order_mark_is_no_part_of_a_scenario_or_a_map(scenario, tmp_path, section):
    (tmp_path / "map.geojson").write_text("\ufeff" + to_geojson(section), encoding="utf-8")
    text = GOOD.replace("layout: wholesale-section", "map: map.geojson")
    file = read_scenario(scenario("\ufeff" + text))
    assert file.text == text
    assert set_stage(file, 1).built == section


def test_all_faults_are_told_at_once(scenario):
    text = GOOD.replace("seed: 1", "colour: red").replace("1.2", "-1").replace("pause_s", "pose_s")
    lines = faults(scenario(text))
    assert [re.match(r"scenario.yaml:(\d+): (\S+):", line).groups() for line in lines] == [
        ("9", "walks.0.speed_m_s"),
        ("10", "walks.0.route.2.pose_s"),
        ("2", "colour"),
    ]


def test_all_faults_of_the_second_look_are_told_at_once(scenario):
    text = GOOD.replace("D1, D5", "Y1, Z9").replace("phone: phone", "phone: tablet")
    assert [line.split(": ")[1] for line in faults(scenario(text))] == [
        "walks.0.phone",
        "walks.0.route.0",
        "walks.0.route.1",
    ]


def test_two_walks_of_one_name_are_refused(scenario):
    second = "  - {name: run, phone: phone, route: [D1, D2]}\n"
    (line,) = faults(scenario(GOOD + second))
    assert line.startswith("scenario.yaml:11: walks.1.name: walk 'run' is there twice")


@pytest.mark.parametrize("text", ["", "just words", "- a\n- b\n", "null"])
def test_what_is_no_mapping_is_refused(scenario, text):
    (line,) = faults(scenario(text))
    assert line.startswith("scenario.yaml:1: a scenario is a mapping")


def test_a_missing_file_and_bad_bytes_are_refused(tmp_path):
    with pytest.raises(ScenarioError, match=r"nowhere\.yaml: No such file"):
        read_scenario(tmp_path / "nowhere.yaml")
    bad = tmp_path / "bad.yaml"
    bad.write_bytes(b"title: \xff\xfe")
    with pytest.raises(ScenarioError, match="not UTF-8 text at byte 7"):
        read_scenario(bad)


def test_a_route_that_does_not_connect_is_refused_at_its_stop(scenario, tmp_path, section):
    text = to_geojson(section)
    lines = [line for line in text.splitlines(keepends=True) if '"branch": "east"' not in line]
    cut = "".join(line for line in lines if '"branch": "west"' not in line)
    (tmp_path / "cut.geojson").write_text(cut, encoding="utf-8")
    (line,) = faults(scenario(GOOD.replace("layout: wholesale-section", "map: cut.geojson")))
    assert line.startswith("scenario.yaml:10: walks.0.route.2: no way leads from node 'D5' to")


def test_a_map_with_a_beacon_inside_a_shelf_is_refused(scenario, tmp_path, section):
    text = to_geojson(section).replace("[3.8, 15.4, 2.0]", "[3.9, 15.6, 2.0]")
    (tmp_path / "map.geojson").write_text(text, encoding="utf-8")
    lines = faults(scenario(GOOD.replace("layout: wholesale-section", "map: map.geojson")))
    assert len(lines) == 1
    assert lines[0].startswith("scenario.yaml:3: venue.map: map.geojson: ")
    assert "beacon 'D1'" in lines[0]
    assert "inside obstacle 'D/wall-1'" in lines[0]


def test_surveying_errors_move_what_estimators_know_not_what_is_built(scenario):
    text = GOOD.replace(
        "{layout: wholesale-section}", "{layout: wholesale-section, survey_error_m: 1}"
    )
    stages = [set_stage(read_scenario(scenario(text)), seed) for seed in range(40)]
    assert len({stage.built.beacon_xyz_m.tobytes() for stage in stages}) == 1
    errors = [s.surveyed.beacon_xyz_m - s.built.beacon_xyz_m for s in stages]
    # Nobody writes a beacon down inside a shelf, so the spread is somewhat below one metre.
    x_m = [error[:, 0] for error in errors]
    assert 0.8 < float(abs(sum(e.std() for e in x_m) / len(x_m))) < 1.05
    assert all((error[:, 2] == 0).all() for error in errors)


@pytest.mark.parametrize("error_m", [0, 1])
def test_no_survey_tells_what_only_the_hardware_knows(scenario, tmp_path, section, error_m):
    front = {"facing_deg": 90.0, "front_to_back_db": 6.0}
    gains = section.with_beacons(
        tuple(
            beacon.model_copy(update={"channel_gain_db": (2.0, -1.0, 0.5), **front})
            for beacon in section.beacons
        )
    )
    (tmp_path / "map.geojson").write_text(to_geojson(gains), encoding="utf-8")
    source = f"map: map.geojson, survey_error_m: {error_m}"
    stage = set_stage(read_scenario(scenario(GOOD.replace("layout: wholesale-section", source))), 1)
    assert {beacon.channel_gain_db for beacon in stage.built.beacons} == {(2.0, -1.0, 0.5)}
    assert {beacon.channel_gain_db for beacon in stage.surveyed.beacons} == {(0.0, 0.0, 0.0)}
    # Which way a beacon faces can be seen.
    assert {beacon.front_to_back_db for beacon in stage.surveyed.beacons} == {6.0}
    moved_m = abs(stage.surveyed.beacon_xyz_m - stage.built.beacon_xyz_m).max()
    assert (moved_m > 0.1) == (error_m > 0)


def two_levels(section: Venue) -> Venue:
    """One aisle on each of two levels, a third level full of machines, and a beacon on each."""
    nodes = tuple(
        Node(id=f"{name}{level}", x_m=x_m, y_m=5.0, level=level)
        for level in (0, 1)
        for name, x_m in (("a", 1.0), ("b", 9.0))
    )
    edges = tuple(Edge(first=f"a{level}", second=f"b{level}", branch="x") for level in (0, 1))
    ground = shapely.box(0, 0, 10, 10)
    full = Obstacle(id="plant", outline=ground, material="heavy-wall", level=2, height_m=1.0)
    places = [
        {"id": f"B{level}", "x_m": 0.0, "y_m": 5.0, "z_m": 2.0, "level": level}
        for level in range(3)
    ]
    return Venue(
        name="two",
        floor_plan=FloorPlan(
            levels=tuple(Level(level=level, bounds=ground) for level in range(3)),
            obstacles=(full,),
        ),
        beacons=tuple(section.beacons[0].model_copy(update=place) for place in places),
        graph=AisleGraph(nodes=nodes, edges=edges),
    )


ON_LEVELS = """\
title: Levels
venue: {map: map.geojson, survey_error_m: 1}
phones: {phone: {}}
walks:
  - {name: low, phone: phone, route: [a0, b0]}
  - {name: high, phone: phone, route: [{x_m: 1.0, y_m: 5.0, level: 1}, b1]}
"""


def test_everybody_walks_on_their_own_level(scenario, tmp_path, section):
    venue = two_levels(section)
    (tmp_path / "map.geojson").write_text(to_geojson(venue), encoding="utf-8")
    stage = set_stage(read_scenario(scenario(ON_LEVELS)), 1)
    logs = simulate_walkers(stage.graph, stage.itineraries)
    assert [set(log.trajectory().level.tolist()) for log in logs] == [{0}, {1}]


def test_a_route_from_one_level_to_another_is_refused(scenario, tmp_path, section):
    (tmp_path / "map.geojson").write_text(to_geojson(two_levels(section)), encoding="utf-8")
    (line,) = faults(scenario(ON_LEVELS.replace("[a0, b0]", "[a0, b1]")))
    assert line.startswith("scenario.yaml:5: walks.0.route.1: no way leads from node 'a0' to")


def test_where_nobody_can_stand_a_beacon_is_written_down_where_it_is(scenario, tmp_path, section):
    venue = two_levels(section)
    (tmp_path / "map.geojson").write_text(to_geojson(venue), encoding="utf-8")
    stage = set_stage(read_scenario(scenario(ON_LEVELS)), 1)
    off_m = abs(stage.surveyed.beacon_xyz_m - venue.beacon_xyz_m).max(axis=1)
    assert off_m[0] > 0
    assert off_m[2] == 0


@given(text=st.text(max_size=200) | st.binary(max_size=200).map(lambda b: b.decode("latin-1")))
def test_no_text_makes_anything_but_a_scenario_error(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("any") / "scenario.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError):
        read_scenario(path)


@given(
    line=st.integers(0, len(GOOD.splitlines()) - 1),
    value=st.sampled_from(
        [
            *("", "null", "[]", "{}", "-1", "1e400", "~", "'", "&a *a", "!!python/x 1", "&a [*a]"),
            *("!foo {}", "!!set {a, b}", "!!binary aGFs", "2020-01-01", "2020-99-99", "!!int abc"),
            *(
                '"\\0"',
                '"\\ud800"',
                "{<<: 1}",
                "{? [a] : b}",
                "{1: 2}",
                "9" * 400,
                "1e308",
                "t" * 300,
            ),
            *("[" * 300, "&b {<<: *b}", "&c 1\n&c ? x", "\t", "!!float ''"),
        ]
    ),
)
def test_a_spoiled_line_never_escapes_as_anything_else(tmp_path_factory, line, value):
    lines = GOOD.splitlines()
    key = lines[line].partition(":")[0]
    lines[line] = f"{key}: {value}"
    path = tmp_path_factory.mktemp("spoiled") / "scenario.yaml"
    path.write_text("\n".join(lines), encoding="utf-8")
    with contextlib.suppress(ScenarioError):
        set_stage(read_scenario(path), 1)


DAY = """\
title: Day
venue: {layout: wholesale-section}
phones: {phone: {}}
trading_day:
  entrance: D/west
  closes: "20:00"
  group_shares: [1]
  arrivals:
    - {since: "08:00", weight: 1}
  tills: {nodes: [F/west]}
surveys:
  - name: s
    phone: phone
    spots: [{x_m: 10, y_m: 13.5}]
    directions_deg: [0]
"""


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('"20:00"', '"07:00"', "6: trading_day.closes: '07:00' is not after opens '08:00'"),
        ("[1]", "[0]", "7: trading_day.group_shares: every share is 0; give one"),
        ("weight: 1", "weight: 0", "8: trading_day.arrivals: nobody would come while"),
        ("[1]", "[]", "7: trading_day.group_shares: give at least 1, not 0"),
        ("[1]", f"{[1] * 21}", "7: trading_day.group_shares: give at most 20, not 21"),
        ("[1]", "1", "7: trading_day.group_shares: give a list, not 1"),
        ("[0]", "[]", "15: surveys.0.directions_deg: give at least 1, not 0"),
        ("{nodes: [F/west]}", "[F/west]", "10: trading_day.tills: give a mapping"),
        ("trading_day:", "shopper_phones: []\nno_day:", "5: no_day: unknown key"),
    ],
)
def test_a_fault_is_told_at_its_key_in_words_of_the_file(scenario, old, new, expected):
    assert DAY.count(old) == 1
    (line,) = faults(scenario(DAY.replace(old, new)))
    assert line.startswith(f"scenario.yaml:{expected}")
    assert "Tuple" not in line
    assert "object" not in line


def test_phones_of_shoppers_without_a_day_are_told_at_their_key(scenario):
    (line,) = faults(scenario(GOOD + "shopper_phones: [{phone: phone, count: 1}]\n"))
    assert line.startswith("scenario.yaml:11: shopper_phones: there are no shoppers")
