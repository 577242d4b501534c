"""The harness itself, on rows that measure nothing."""

import importlib
import json
from pathlib import Path
from types import ModuleType

import jsonschema
import pytest
from rich.console import Console

HERE = Path(__file__).parent
SCHEMA = {
    "type": "array",
    "items": {
        "type": "object",
        "properties": {
            "name": {"type": "string", "minLength": 1},
            "value": {"type": "number"},
            "unit": {"type": "string"},
            "goal": {"type": ["string", "null"]},
            "met": {"type": ["boolean", "null"]},
        },
        "required": ["name", "value", "unit", "goal", "met"],
        "additionalProperties": False,
    },
}


@pytest.fixture
def harness(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Import run.py as it is when it is called: with its own folder on the path."""
    monkeypatch.syspath_prepend(str(HERE))
    return importlib.import_module("run")


@pytest.fixture
def measure(harness: ModuleType) -> ModuleType:  # noqa: ARG001  # sets the path
    return importlib.import_module("measure")


def test_results_are_written_and_a_missed_goal_is_no_failure(
    harness: ModuleType, measure: ModuleType, tmp_path: Path
) -> None:
    rows = [
        measure.Row(name="good", unit="x", goal=">= 100", measure=lambda: 123),
        measure.Row(name="slow", unit="s", goal="< 0.3", measure=lambda: 0.3),
        measure.Row(name="for comparison", unit="s", measure=lambda: 0.01),
    ]
    console = Console(record=True, width=100)
    output = tmp_path / "new" / "bench.json"
    assert harness.run(rows, output, console) == 0
    entries = json.loads(output.read_text())
    jsonschema.validate(entries, SCHEMA)
    assert [entry["met"] for entry in entries] == [True, False, None]
    assert entries[0] == {
        "name": "good",
        "value": 123.0,
        "unit": "x",
        "goal": ">= 100",
        "met": True,
    }
    table = console.export_text()
    assert all(word in table for word in ("good", "123", ">= 100", "yes", "no"))


def test_a_row_that_crashes_is_a_failure_and_the_others_are_kept(
    harness: ModuleType, measure: ModuleType, tmp_path: Path
) -> None:
    rows = [
        measure.Row(name="broken", unit="s", measure=lambda: 1 / 0),
        measure.Row(name="fine", unit="s", measure=lambda: 1.0),
    ]
    console = Console(record=True, width=100)
    assert harness.run(rows, tmp_path / "bench.json", console) == 1
    assert [entry["name"] for entry in json.loads((tmp_path / "bench.json").read_text())] == [
        "fine"
    ]
    assert "ZeroDivisionError" in console.export_text()


def test_rows_are_chosen_by_name(harness: ModuleType, measure: ModuleType) -> None:
    rows = [measure.Row(name=name, unit="s", measure=lambda: 1.0) for name in ("ab", "bc", "cd")]
    assert [row.name for row in harness.chosen(rows, "b")] == ["ab", "bc"]
    assert harness.chosen(rows, None) == rows
    with pytest.raises(SystemExit, match="no row is called 'x'; there are 'ab', 'bc', 'cd'"):
        harness.chosen(rows, "x")


def test_the_real_rows_have_names_of_their_own_and_goals_that_can_be_read(
    harness: ModuleType, measure: ModuleType
) -> None:
    rows = harness.all_rows()
    names = [row.name for row in rows]
    assert len(set(names)) == len(names)
    for row in rows:
        if row.goal is not None:
            assert measure.meets(1.0, row.goal) in (True, False)


def test_a_ratio_says_how_many_times_faster_we_are(measure: ModuleType) -> None:
    # Counted work: theirs takes a thousand times the turns of ours.
    ratio = measure.speed_ratio(lambda: sum(range(100)), lambda: sum(range(100_000)), rounds=5)
    assert ratio > 20


def test_the_two_sides_take_turns(measure: ModuleType) -> None:
    turns: list[str] = []
    measure.speed_ratio(
        lambda: turns.append("a"), lambda: turns.append("b"), rounds=2, our_repeats=2
    )
    assert "".join(turns) == "ab" + "aab" * 2
