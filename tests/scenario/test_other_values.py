"""What-if values: laid into the file's own, checked like them, and told in the text."""

import re

import pytest

from blesim.errors import ScenarioError
from blesim.scenario.other_values import laid_in
from blesim.scenario.reading import read_scenario

TEXT = """\
title: Two walks
venue: {layout: wholesale-section}
radio: {environment: office}
phones:
  phone: {profile: moto-g3}
walks:
  - {name: a, phone: phone, route: [D/east, D/west], speed_m_s: 1.0}
  - {name: b, phone: phone, route: [E/east, E/west], speed_m_s: 1.0}
"""


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "scenario.yaml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def test_values_stand_in_place_of_the_files_own(path):
    values = {"walks.*.speed_m_s": 1.3, "walks.1.name": "c", "radio.fading.model": "none"}
    file = read_scenario(path, values)
    assert [(walk.name, walk.speed_m_s) for walk in file.scenario.walks] == [("a", 1.3), ("c", 1.3)]
    assert file.scenario.radio.fading.model == "none"
    assert file.scenario.radio.path_loss_exponent == 1.96  # still of the preset
    assert file.text.startswith(TEXT)
    assert file.text.count("\n# changed from scenario.yaml: {") == 1


def test_nothing_is_changed_without_values(path):
    assert read_scenario(path, {}) == read_scenario(path)


def test_a_value_that_does_not_hold_is_told_with_its_place(path):
    with pytest.raises(ScenarioError, match=r"scenario.yaml:7: walks.0.speed_m_s: .* not -1"):
        read_scenario(path, {"walks.0.speed_m_s": -1})
    with pytest.raises(ScenarioError, match=r"scenario.yaml:3: radio.fadin: unknown key"):
        read_scenario(path, {"radio.fadin.model": "none"})


@pytest.mark.parametrize(
    "name", ["walks.2.name", "walks.first.name", "walks.²", "title.long", "radio.people.*"]
)
def test_a_path_that_leads_nowhere_is_told(path, name):
    with pytest.raises(ScenarioError, match=re.escape(name) + ": leads to nothing"):
        read_scenario(path, {name: 1})


def test_what_is_given_is_left_as_it_was():
    document, inner = {"a": [{"b": 1}, {"b": 2}]}, {"x": 1}
    changed = laid_in(document, {"a.*.b": inner, "c.d": 3})
    assert changed == {"a": [{"b": {"x": 1}}, {"b": {"x": 1}}], "c": {"d": 3}}
    assert document == {"a": [{"b": 1}, {"b": 2}]}
    changed["a"][0]["b"]["x"] = 5
    assert inner == {"x": 1}
    assert changed["a"][1]["b"] == {"x": 1}
