"""What is refused about the radio, each fault with file and line."""

import pytest

from blesim.errors import ScenarioError
from blesim.radio.beacon_events import Moves, Replaced
from blesim.scenario.build import set_stage
from blesim.scenario.reading import read_scenario
from blesim.venue.geojson import to_geojson


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (
            "radio:\n  shadowing:\n    decorrelation_m: -1.0\n",
            "scenario.yaml:4: radio.shadowing.decorrelation_m: Input should be greater than 0",
        ),
        (
            "phones:\n  phone:\n    scanner: {interval_ms: 100, window_ms: 200}\n",
            "scenario.yaml:4: phones.phone.scanner: window_ms 200 is longer than interval_ms 100",
        ),
        (
            "phones:\n  phone:\n    scanner: {mode: android-2023-balanced, window_ms: 20}\n",
            "scenario.yaml:4: phones.phone.scanner: give either 'mode' or",
        ),
        (
            "phones:\n  phone:\n    scanner: {mode: turbo}\n",
            "scenario.yaml:4: phones.phone.scanner.mode: Input should be 'android-2014-low-power'",
        ),
        (
            "phones:\n  phone:\n    delivery: {immediate_m: 5}\n",
            "scenario.yaml:4: phones.phone.delivery: immediate_m 5 is farther than near_m 3",
        ),
    ],
)
def test_an_impossible_setting(written, faults, more, expected):
    (line,) = faults(written(more))
    assert line.startswith(expected)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('_s": 0.35', '_s": 0.019375', "'advertising_interval_s': input should be greater than"),
        ('_s": 0.35', '_s": 10.240625', "'advertising_interval_s': input should be less than"),
        ('_s": 0.35', '_s": 0.3501', "'advertising_interval_s': not a multiple of 0.625 ms; the"),
        ('power_dbm": -12', 'power_dbm": 21', "'tx_power_dbm': input should be less than"),
        ('power_dbm": -12', 'power_dbm": -41', "'tx_power_dbm': input should be greater than"),
        ("gondola-dry", "unobtainium", "unknown material 'unobtainium'; use one of "),
    ],
)
def test_an_impossible_beacon_or_material_on_the_map(written, faults, section, old, new, expected):
    text = to_geojson(section)
    assert old in text
    path = written("", venue="{map: map.geojson}")
    (path.parent / "map.geojson").write_text(text.replace(old, new, 1), encoding="utf-8")
    (line,) = faults(path)
    assert line.startswith("scenario.yaml:1: venue.map: map.geojson: feature ")
    assert expected in line


def events(*lines: str) -> str:
    return "beacon_events:\n" + "".join(f"  - {{{line}}}\n" for line in lines)


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (
            ["at_s: 1, beacon: D1, event: dies", "at_s: 3, beacon: Z9, event: dies"],
            "scenario.yaml:4: beacon_events.1: there is no beacon 'Z9'",
        ),
        (
            ["at_s: -1, beacon: D1, event: dies"],
            "scenario.yaml:3: beacon_events.0.at_s: Input should be greater than or equal to 0",
        ),
        (
            ["at_s: 9, beacon: D1, event: reboots", "at_s: 5, beacon: D1, event: dies"],
            "scenario.yaml:3: beacon_events.0: beacon 'D1' died at 5 s; from then on",
        ),
        (
            ["at_s: 1, beacon: D1, event: moves, x_m: 3.9, y_m: 15.6"],
            "scenario.yaml:3: beacon_events.0: beacon 'D1' at (3.9, 15.6) is inside obstacle",
        ),
        (
            ["at_s: 1, beacon: D1, event: moves, x_m: -300, y_m: 15.6"],
            "scenario.yaml:3: beacon_events.0: beacon 'D1' at (-300, 15.6) is out of the bounds",
        ),
        (
            ["at_s: 1, beacon: D1, event: moves, x_m: 3.8, y_m: 15.4, level: 4"],
            "scenario.yaml:3: beacon_events.0: beacon 'D1' is on level 4, but",
        ),
        (
            ["at_s: 1, beacon: D1, event: replaced, advertising_interval_s: 0.3501"],
            "scenario.yaml:3: beacon_events.0.advertising_interval_s: not a multiple of 0.625 ms",
        ),
        (
            ["at_s: 1, beacon: D1, event: explodes"],
            "scenario.yaml:3: beacon_events.0: unknown 'explodes'; use one of 'dies', 'reboots'",
        ),
        (["at_s: 1, beacon: D1"], "scenario.yaml:3: beacon_events.0: missing 'event'"),
        (
            ["at_s: 1, beacon: D1, event: sags"],
            "scenario.yaml:3: beacon_events.0.power_db: missing",
        ),
    ],
)
def test_an_impossible_event(written, faults, lines, expected):
    (line,) = faults(written(events(*lines)))
    assert line.startswith(expected)


def test_all_impossible_events_are_told_at_once(written, faults):
    text = events(
        "at_s: 2, beacon: D1, event: moves, x_m: -300, y_m: 0",
        "at_s: 1, beacon: Z9, event: dies",
        "at_s: 3, beacon: D2, event: dies",
    )
    assert [line.split(": ")[1] for line in faults(written(text))] == [
        "beacon_events.0",
        "beacon_events.1",
    ]


def test_possible_events_are_read(written):
    path = written(
        events(
            "at_s: 1, beacon: D1, event: dies",
            "at_s: 9, beacon: D1, event: replaced, measured_power_dbm: -71",
            "at_s: 10, beacon: D1, event: moves, x_m: 5.0, y_m: 15.4",
        )
    )
    file = read_scenario(path)
    set_stage(file, 1)
    _, replaced, moved = file.scenario.beacon_events
    assert replaced == Replaced(at_s=9, beacon="D1", measured_power_dbm=-71.0)
    assert isinstance(moved, Moves)
    assert file.with_parameters(seed=2).scenario.beacon_events == file.scenario.beacon_events


@pytest.mark.parametrize(
    "move", ["z_m: 1.0e+300", "z_m: 1.0e+6", "level: 999", "z_m: -1"], ids=lambda move: move[:9]
)
def test_a_beacon_moved_out_of_this_world_is_refused(move, tmp_path):
    path = tmp_path / "scenario.yaml"
    path.write_text(
        "title: far\n"
        "venue: {layout: wholesale-section}\n"
        "phones: {a: {}}\n"
        "beacon_events:\n"
        f"  - {{at_s: 1, beacon: E1, event: moves, x_m: 5.0, y_m: 15.4, {move}}}\n"
        "walks: [{name: w, phone: a, route: [E1, E2]}]\n",
        encoding="utf-8",
    )
    with pytest.raises(ScenarioError, match=r"scenario\.yaml:5: beacon_events\.0\."):
        set_stage(read_scenario(path), 1)
