"""A small trading day from YAML to recording: whose phones, which streams, the same bytes."""

import numpy as np
import pytest

from blesim.dataset.reader import read_recording, read_truth
from blesim.dataset.validator import validate
from blesim.dataset.writer import write_recording
from blesim.errors import ScenarioError
from blesim.recording import Role, WalkKind
from blesim.scenario.reading import read_scenario
from blesim.simulate import Simulation

DAY = """\
title: Small day
venue: {layout: wholesale-section}
phones: {phone: {step_sensor: {system: android}, imu: {chips: bmi160-ak09911}}}
trading_day:
  opens: "09:00"
  closes: "09:20"
  shoppers: 30
  entrance: D/west
  tills: {nodes: [F/west], service: {median_s: 20}}
  basket: {mean: 3, spread: 1}
  dwell: {median_s: 5}
  staff: {number: 1}
shopper_phones:
  - {phone: phone, count: 4}
  - {phone: phone, count: 1, imu: true, headings: true, pressures: true, split: full}
walks:
  - {name: tester, phone: phone, start_s: 60, route: [D1, D8], carrying: pocket}
"""


_SWITCH = "carrying: [{carrying: hand}, {carrying: bag, after_s: 9}]"


def run(tmp_path, text=DAY, seed=5):
    path = tmp_path / "scenario.yaml"
    path.write_text(text, encoding="utf-8")
    return Simulation.run(read_scenario(path), seed)


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    return run(tmp_path_factory.mktemp("day"))


@pytest.fixture(scope="module")
def recorded(day):
    return day.recording()


def test_the_recording_holds_the_walks_the_shoppers_and_everybody(recorded):
    recording, truth = recorded
    names = [walk.name for walk in recording.walks]
    assert names[0] == "tester"
    assert len(names) == 6
    assert all(name.startswith("shopper-") for name in names[1:])
    people = {person.name: person for person in truth.crowd.people}
    assert set(names) <= set(people)
    assert people["tester"].role == Role.TESTER
    roles = [person.role for person in people.values()]
    assert roles.count(Role.STAFF) == 1
    assert 15 <= roles.count(Role.SHOPPER) <= 45  # Poisson(30), wider than 0.6 % to 99.4 %
    for name in names:
        assert truth.walks[name].trajectory == people[name].trajectory


def test_streams_are_those_asked_for(recorded):
    recording, truth = recorded
    for walk in recording.walks[1:]:
        told = walk.observations
        full = walk.split == "full"
        assert len(told.readings)
        assert len(truth.walks[walk.name].steps)
        assert [len(t) > 0 for t in (told.imu, told.headings, told.pressures)] == [full] * 3
        assert not len(told.marks)


def test_carrying_is_in_the_file_and_in_the_walk(recorded):
    recording, truth = recorded
    assert recording.by_name["tester"].carrying == "pocket"
    assert truth.walks["tester"].carrying.carrying.tolist() == [3]
    for walk in recording.walks:
        carrying = truth.walks[walk.name].carrying
        assert carrying.time_us[0] == truth.walks[walk.name].trajectory.time_us[0]


def test_visits_are_at_sections_where_the_person_stands(recorded):
    _, truth = recorded
    visits, people = truth.crowd.visits, truth.crowd.people
    assert len(visits) > 30
    for row in range(0, len(visits), 7):
        person, section = people[visits.person[row]], truth.venue.sections[visits.section[row]]
        pose = person.trajectory.at(visits.time_us[row : row + 1])
        middle_m = np.mean([section.start_m, section.end_m], axis=0)
        away_m = np.hypot(pose.x_m[0] - middle_m[0], pose.y_m[0] - middle_m[1])
        # Half a shelf unit along the aisle, and no farther aside than its face.
        assert away_m < np.hypot(2.7 / 2, 1.9)


def test_the_file_holds_it_all_and_is_valid(recorded, tmp_path):
    recording, truth = recorded
    path = tmp_path / "day.h5"
    write_recording(path, recording, truth)
    assert validate(path) == []
    assert read_recording(path) == recording
    assert read_truth(path) == truth


def test_the_same_with_two_processes(day, recorded):
    assert day.recording(jobs=2) == recorded


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("imu: true", "imu: false"),
        ("imu: {chips: bmi160-ak09911}", "imu: {chips: bmi160-ak09911, rate_hz: 100}"),
        ("headings: true, pressures: true", "headings: false, pressures: false"),
    ],
)
def test_other_sensors_leave_rssi_and_trajectories_as_they_were(recorded, tmp_path, old, new):
    changed, changed_truth = run(tmp_path, DAY.replace(old, new)).recording()
    recording, truth = recorded
    assert changed_truth.crowd == truth.crowd
    for walk, other in zip(recording.walks, changed.walks, strict=True):
        assert walk.observations.readings == other.observations.readings
        assert walk.observations.steps == other.observations.steps
    full = recording.walks[-1].observations.imu
    imu = changed.walks[-1].observations.imu
    if "100" in new:
        assert len(imu) == pytest.approx(2 * len(full), abs=2)
    else:
        assert (len(imu) > 0) == ("imu: true" in DAY.replace(old, new))


def test_more_recorded_phones_leave_the_others_as_they_were(recorded, tmp_path):
    more, _ = run(tmp_path, DAY.replace("count: 1, imu", "count: 3, imu")).recording()
    for walk in recorded[0].walks:
        if walk.split != "full":
            assert more.by_name[walk.name].observations == walk.observations


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('closes: "09:20"', 'closes: "08:20"', ":6: trading_day.closes: '08:20' is not after"),
        ("nodes: [F/west]", "nodes: [F/moon]", ":9: trading_day.tills.nodes.0:"),
        ("nodes: [F/west]", "nodes: []", ":9: trading_day.tills.nodes:"),
        ("nodes: [F/west],", "nodes: [F/west], servers: 0,", ":9: trading_day.tills.servers:"),
        ("entrance: D/west", "entrance: nowhere", ":8: trading_day.entrance:"),
        ("imu: {chips: bmi160-ak09911}", "imu: {rate_hz: 1000}", ":3: phones.phone.imu.rate_hz:"),
        ("imu: {chips: bmi160-ak09911}", "imu: {chips: soup}", ":3: phones.phone.imu.chips:"),
        ("name: tester", "name: shopper-0001", ":17: walks.0.name:"),
        ("carrying: pocket", "carrying: teeth", ":17: walks.0.carrying.0"),
        ("staff: {number: 1}", "lists: []\n  lists_file: none.csv", ":13: trading_day.lists_file:"),
    ],
)
def test_a_wrong_day_is_told_with_its_line(tmp_path, old, new, expected):
    with pytest.raises(ScenarioError) as told:
        run(tmp_path, DAY.replace(old, new))
    assert str(told.value).startswith(f"{tmp_path / 'scenario.yaml'}{expected}")


def test_more_phones_than_shoppers_are_refused(tmp_path):
    says = r"yaml:13: shopper_phones: 2004 phones are to be recorded, but \d+ shoppers came"
    with pytest.raises(ScenarioError, match=says):
        run(tmp_path, DAY.replace("count: 4", "count: 2003"))


def test_a_store_that_is_full_lets_the_others_wait_outside(day, tmp_path):
    small = run(tmp_path, DAY.replace("shoppers: 30", "shoppers: 30\n  capacity: 2"), seed=5)
    inside = [p for p in small.crowd.people if p.role == Role.SHOPPER]
    edges = [(p.trajectory.time_us[0], 1) for p in inside]
    edges += [(p.trajectory.time_us[-1], -1) for p in inside]
    present = np.cumsum([step for _, step in sorted(edges)])
    assert present.max() <= 2
    assert len(inside) <= sum(p.role == Role.SHOPPER for p in day.crowd.people)


def test_lists_and_routes_come_from_files_beside_the_scenario(tmp_path):
    (tmp_path / "lists.csv").write_text("shopper,section\nann,D-03\nann,E-07\n", encoding="utf-8")
    text = DAY.replace(
        "  staff: {number: 1}", "  staff: {number: 0}\n  lists_file: lists.csv\n  order: list"
    )
    text = text.replace(
        "  shoppers: 30", "  shoppers: 30\n  detours: {probability: 0, impulse_probability: 0}"
    )
    truth = run(tmp_path, text).recording()[1]
    visited = {truth.venue.sections[row].id for row in truth.crowd.visits.section}
    assert visited == {"D-03", "E-07"}


@pytest.mark.parametrize(
    ("key", "rows", "expected"),
    [
        ("lists", "shopper,section\nann,D-03\nann,moon\n", "list of 'ann': there is no section"),
        ("routes", "shopper,time_s,node\nann,1,moon\n", "route of 'ann': there is neither"),
        ("lists", "shopper,section\nann,D\x0703\n", "{path}:2: section: holds the control"),
    ],
)
def test_a_wrong_row_of_a_file_is_told_where_the_file_is_named(tmp_path, key, rows, expected):
    path = tmp_path / "rows.csv"
    path.write_text(rows, encoding="utf-8")
    own = "lists: [{shopper: bob, sections: [D-03]}]\n  "
    text = DAY.replace("  staff: {number: 1}", f"  {own}{key}_file: rows.csv")
    with pytest.raises(ScenarioError) as told:
        run(tmp_path, text)
    where = f"{tmp_path / 'scenario.yaml'}:13: trading_day.{key}_file: "
    assert str(told.value).startswith(where + expected.format(path=path))
    assert "\n" not in str(told.value)


def test_a_file_without_a_name_is_refused(tmp_path):
    text = DAY.replace("  staff: {number: 1}", '  lists_file: ""')
    with pytest.raises(
        ScenarioError, match=r":12: trading_day\.lists_file: .* is not a file; give"
    ):
        run(tmp_path, text)


def test_a_survey_stands_at_its_spots(tmp_path):
    text = """\
title: Survey
venue: {layout: wholesale-section}
phones: {phone: {}}
surveys:
  - name: grid
    phone: phone
    spots: [{x_m: 10, y_m: 13.5}, {x_m: 12, y_m: 13.5}]
    directions_deg: [0, 90]
    stand_s: 4
"""
    recording, truth = run(tmp_path, text).recording()
    (walk,) = recording.walks
    assert walk.kind == WalkKind.SURVEY
    marks = walk.observations.marks
    assert marks.x_m.tolist() == [10.0] * 4 + [12.0] * 4
    assert np.degrees(marks.heading_rad).round().tolist() == [0, 0, 90, 90] * 2
    assert np.diff(marks.time_us)[::2].tolist() == [4_000_000] * 4
    poses = truth.walks["grid"].trajectory.at(marks.time_us)
    np.testing.assert_allclose(poses.x_m, marks.x_m)
    np.testing.assert_allclose(np.degrees(poses.heading_rad), np.degrees(marks.heading_rad))
    path = tmp_path / "survey.h5"
    write_recording(path, recording, truth)
    assert validate(path) == []


def test_a_surveyor_may_carry_the_phone_in_any_way(tmp_path):
    text = """\
title: Survey
venue: {layout: wholesale-section}
phones: {phone: {}}
surveys:
  - {name: hand, phone: phone, spots: [{x_m: 10, y_m: 13.5}]}
  - {name: flat, phone: phone, spots: [{x_m: 10, y_m: 13.5}], start_s: 60, carrying: flat}
  - name: both
    phone: phone
    start_s: 90
    spots: [{x_m: 10, y_m: 13.5}]
    carrying: [{carrying: hand}, {carrying: pocket, after_s: 4}]
"""
    recording, truth = run(tmp_path, text).recording()
    assert [walk.carrying for walk in recording.walks] == ["hand", "flat", "hand, pocket"]
    assert truth.walks["both"].carrying.time_us.tolist() == [90_000_000, 94_000_000]


def test_a_survey_inside_a_shelf_is_refused(tmp_path):
    text = """\
title: Survey
venue: {layout: wholesale-section}
phones: {phone: {}}
surveys: [{name: grid, phone: phone, spots: [{x_m: 10, y_m: 10.8}]}]
"""
    with pytest.raises(ScenarioError, match=r"4: surveys\.0: \(10, 10\.8\) is not walkable"):
        run(tmp_path, text)


def test_a_phone_changes_hands_on_the_way(tmp_path):
    text = DAY.replace(
        "carrying: pocket", "carrying: [{carrying: hand}, {carrying: bag, after_s: 9}]"
    )
    recording, truth = run(tmp_path, text).recording()
    assert recording.by_name["tester"].carrying == "hand, bag"
    assert np.diff(truth.walks["tester"].carrying.time_us).tolist() == [9_000_000]
