"""YAML as plain values with their lines, and whatever else YAML can say refused in one line."""

import contextlib
import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blesim.errors import ScenarioError
from blesim.scenario.document import read_document

FILE = Path("s.yaml")


def read(text: str):
    return read_document(FILE, text)


def refusal(text: str) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        read(text)
    return str(caught.value).split("\n")


def test_values_and_their_lines():
    document = read("a: 1\nb:\n  - x\n  - {c: 0x1f, d: ~}\n'2': [true, 1.5, '7', .inf]\n")
    assert document.value == {
        "a": 1,
        "b": ["x", {"c": 31, "d": None}],
        "2": [True, 1.5, "7", float("inf")],
    }
    assert document.lines[("a",)] == 1
    assert document.lines[("b", 1, "d")] == 4
    assert document.lines[("2", 3)] == 5
    assert read("").value is None


def test_a_fault_stands_at_the_innermost_part_there_is():
    document = read("a:\n  b:\n    - {}\n    - event: e\n      c: 1\n")
    assert document.fault(["a", "b", 1, "c"], "no") == "s.yaml:5: a.b.1.c: no"
    assert document.fault(["a", "b", 0, "c", "d"], "no") == "s.yaml:3: a.b.0.c: no"
    assert document.fault(["a", "b", 1, "e", "c"], "no") == "s.yaml:5: a.b.1.c: no"
    assert document.fault(["a", "b", 1, "f", "c"], "no") == "s.yaml:4: a.b.1.f: no"
    assert document.fault([], "no") == "s.yaml:1: no"


def test_aliases_and_merge_keys_are_resolved():
    document = read("a: &a {x: 1, y: 2}\nb: *a\nc: {y: 3, <<: *a}\nd: {<<: [{x: 5}, *a]}\n")
    assert document.value["b"] == {"x": 1, "y": 2}
    assert document.value["c"] == {"x": 1, "y": 3}
    assert document.value["d"] == {"x": 5, "y": 2}
    assert document.lines[("c", "x")] == 1


def test_an_anchor_may_get_a_new_meaning():
    assert read("a: &x 1\nb: *x\nc: &x 2\nd: *x\n").value == {"a": 1, "b": 1, "c": 2, "d": 2}


BOMB = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 20)
)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a: 1\nb: " + "9" * 5000, "s.yaml:2: not valid YAML: '" + "9" * 60 + "...' cannot be"),
        ("a: !!float abc", "s.yaml:1: not valid YAML: 'abc' cannot be read as float"),
        ("a: !!int abc", "s.yaml:1: not valid YAML: 'abc' cannot be read as int"),
        ("a: !!int ''", "s.yaml:1: not valid YAML: '' cannot be read as int"),
        ("a: !!bool abc", "s.yaml:1: not valid YAML: 'abc' cannot be read as bool"),
        ("a:\n- 2020-99-99", "s.yaml:2: a.0: a date is no value here"),
        ("a:\n- 2020-01-01", "s.yaml:2: a.0: a date is no value here"),
        ("a: 1\nb: " + "[" * 2000, "s.yaml:2: not valid YAML: nested deeper than 50 levels"),
        (
            "a0: &a0 []\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 99)),
            "s.yaml:1: not valid YAML: nested deeper than 50 levels",
        ),
        (BOMB, "s.yaml:1: not valid YAML: more than 200000 values"),
        ("a: &a [*a]", "s.yaml:1: not valid YAML: 'a' contains itself"),
        ("b: 1\na: &a {<<: *a}", "s.yaml:2: not valid YAML: 'a' contains itself"),
        ("a: 1\nb: {a: 1, a: 2}", "s.yaml:2: not valid YAML: the key 'a' is there twice"),
        ("a: 1\n? [a, b]\n: 1", "s.yaml:2: a key must be a text"),
        ("a:\n  ? {b: 1}\n  : 1", "s.yaml:2: a: a key must be a text"),
        ("a: {1: 2}", "s.yaml:1: a: a key must be a text, in quotes"),
        ("a: {<<: 2}", "s.yaml:1: a: '<<' takes a mapping"),
        ("a: 1\nb: !foo {}", "s.yaml:2: b: the tag !foo is not known here"),
        ("a: !x%0Ay b", r"s.yaml:1: a: the tag !x\ny is not known here"),
        ("a: !!set {b, c}", "s.yaml:1: a: !!set is no kind of value here"),
        ("a: !!binary aGFs", "s.yaml:1: a: !!binary is no kind of value here"),
        ("a: !!map [1]", "s.yaml:1: a: !!map is no kind of value here"),
        ('a: "b\\0c"', "s.yaml:1: a: holds the control character U+0000"),
        ('a: "\\ud800"', "s.yaml:1: a: holds the control character U+D800"),
        ('"a\\nb": 1', r"s.yaml:1: the key 'a\nb' holds the control character U+000A"),
        ('a: "\\Uffffffff"', "s.yaml:1: not valid YAML: "),
        ("%YAML 1.99\n---\na: 1", "s.yaml:1: not valid YAML: "),
        ("a: 1\n---\nb: 2", "s.yaml:2: not valid YAML: "),
    ],
)
def test_what_is_no_plain_value_is_refused_in_one_line(text, expected):
    (line,) = refusal(text)
    assert line.startswith(expected)
    assert len(line) < 200


def test_everything_that_is_no_plain_value_is_told_at_once():
    lines = refusal("a: 2020-01-01\nb: !foo x\n3: 4\n")
    assert [line.split(" ")[0] for line in lines] == ["s.yaml:1:", "s.yaml:2:", "s.yaml:3:"]


plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False)
    | st.text(st.characters(exclude_categories=["Cc", "Cs", "Zl", "Zp"])),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.text(st.characters(exclude_categories=["Cc", "Cs", "Zl", "Zp"])), inner, max_size=4
        )
    ),
    max_leaves=12,
)


@given(value=st.dictionaries(st.sampled_from("abc"), plain))
def test_what_json_says_is_read_as_json_reads_it(value):
    # YAML 1.2 contains JSON; Python's own spelling of the infinite is not JSON.
    text = json.dumps(value, ensure_ascii=False).replace("Infinity", "1e999")
    if "\ufeff" not in text:
        assert read(text).value == json.loads(text)


pieces = st.sampled_from(
    [
        *("a: ", "b", "1", "1e400", "~", "- ", "? ", ": ", ", ", "\n", "\n  ", "[", "]", "{", "}"),
        *("&a ", "*a ", "<<: ", "!!int ", "!!float ", "!!bool ", "!!null ", "!!set ", "!!omap "),
        *("!!timestamp ", "!!binary ", "!!merge ", "!!str ", "!!map ", "!!seq ", "!foo ", "! "),
        *("2020-99-99", "0x", "0o9", "'", '"', "\\x", "\\ud800", "|\n", ">-\n", "#", "%YAML 1.1\n"),
        *("---\n", "...\n", "\t", "\0", "\x85", "\ufeff", "9" * 5000, "[" * 60, "=", "!<", ">"),
    ]
)


@given(text=st.lists(pieces, max_size=12).map("".join))
def test_nothing_that_looks_like_yaml_makes_anything_but_a_scenario_error(text):
    with contextlib.suppress(ScenarioError):
        json.dumps(read(text).value)
