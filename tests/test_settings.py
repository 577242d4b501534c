import pickle

import pytest
from pydantic import Field, ValidationError

from blesim import columns
from blesim.settings import LEVEL_RANGE, MAP_LIMIT_M, Name, Settings, Text, shortened, unreadable


class Fan(Settings):
    speed_m_s: float = Field(gt=0)
    blades: int = 3
    name: str = "fan"


def test_the_good_case() -> None:
    assert Fan(speed_m_s=1).speed_m_s == 1.0


@pytest.mark.parametrize(
    ("values", "where", "kind"),
    [
        ({"speed_m_s": float("nan")}, "speed_m_s", "finite_number"),
        ({"speed_m_s": float("inf")}, "speed_m_s", "finite_number"),
        ({"speed_m_s": "2"}, "speed_m_s", "float_type"),
        ({"speed_m_s": True}, "speed_m_s", "float_type"),
        ({"speed_m_s": 0.0}, "speed_m_s", "greater_than"),
        ({}, "speed_m_s", "missing"),
        ({"speed_m_s": 1.0, "blades": 3.0}, "blades", "int_type"),
        ({"speed_m_s": 1.0, "blades": True}, "blades", "int_type"),
        ({"speed_m_s": 1.0, "speed": 1.0}, "speed", "extra_forbidden"),
        ({"speed_m_s": 1.0, "name": 7}, "name", "string_type"),
    ],
)
def test_what_is_refused(values: dict[str, object], where: str, kind: str) -> None:
    with pytest.raises(ValidationError) as refusal:
        Fan(**values)  # type: ignore[arg-type]
    (fault,) = refusal.value.errors()
    assert (fault["loc"], fault["type"]) == ((where,), kind)


def test_all_faults_are_told_at_once() -> None:
    with pytest.raises(ValidationError) as refusal:
        Fan(speed_m_s=-1.0, blades="x", more=1)  # type: ignore[arg-type, call-arg]
    assert {fault["loc"] for fault in refusal.value.errors()} == {
        ("speed_m_s",),
        ("blades",),
        ("more",),
    }


def test_values_are_frozen_comparable_and_travel() -> None:
    fan = Fan(speed_m_s=2.0)
    with pytest.raises(ValidationError, match="frozen"):
        fan.speed_m_s = 3.0  # type: ignore[misc]
    assert pickle.loads(pickle.dumps(fan)) == fan  # noqa: S301
    assert hash(fan) == hash(Fan(speed_m_s=2.0))


class Tagged(Settings):
    name: Name = "n"
    note: Text = ""


@pytest.mark.parametrize("field", ["name", "note"])
@pytest.mark.parametrize("character", ["\0", "\n", "\x1b", "\x7f", "\x85", "\ud800", "\u2028"])
def test_texts_that_fit_into_no_line_are_refused(field: str, character: str) -> None:
    with pytest.raises(ValidationError, match=field):
        Tagged(**{field: f"a{character}b"})
    assert unreadable(f"a{character}b")


def test_texts_of_any_script_are_taken() -> None:
    assert Tagged(name="Gänge 1 bis 22, 通路 🛒", note="").name == "Gänge 1 bis 22, 通路 🛒"
    for name in ("", "a" * 201):
        with pytest.raises(ValidationError, match="name"):
            Tagged(name=name)


def test_bounds_are_those_a_recording_can_hold() -> None:
    ranges = {column.field: column.valid_range for column in columns.MARKS.columns}
    assert ranges["level"] == LEVEL_RANGE
    assert ranges["x_m"] == (-MAP_LIMIT_M, MAP_LIMIT_M)


def test_a_long_text_is_told_by_its_beginning() -> None:
    assert shortened("short") == "short"
    assert shortened("x" * 1000) == "x" * 60 + "..."
    assert shortened("a\nb\ud800ä") == r"a\nb\ud800ä"
