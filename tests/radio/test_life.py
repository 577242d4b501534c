from itertools import pairwise
from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from blesim import columns
from blesim.errors import UsageError
from blesim.radio.beacon_events import BeaconEvent, Dies, Moves, Reboots, Replaced, Sags
from blesim.radio.life import Spell, simulate_life
from blesim.venue.beacons import Beacon

NAMES = {value: name for name, value in columns.BEACON_EVENTS}
END_US = 100_000_000


def beacon(name: str, x_m: float = 1.0) -> Beacon:
    return Beacon(
        id=name,
        uuid=UUID("f7826da6-4fa2-4e98-8024-bc5b71e0893e"),
        major=1,
        minor=1,
        x_m=x_m,
        y_m=2.0,
        z_m=3.0,
        tx_power_dbm=-12.0,
        measured_power_dbm=-77.0,
        advertising_interval_s=0.35,
    )


BEACONS = (beacon("A"), beacon("B", 5.0))


def lives(*events, until_us=END_US):
    return simulate_life(BEACONS, events, until_us)


def spells_of(result, row: int = 0) -> list[Spell]:
    return [spell for spell in result.spells if spell.beacon == row]


def story(result) -> list[tuple[float, str, str]]:
    log = result.log
    return [
        (time_us / 1e6, BEACONS[row].id, NAMES[event])
        for time_us, row, event in zip(log.time_us, log.beacon, log.event, strict=True)
    ]


def spans(spells: list[Spell]) -> list[tuple[float, float]]:
    return [(spell.start_us / 1e6, spell.end_us / 1e6) for spell in spells]


def test_nothing_happens_to_most_beacons():
    result = lives()
    assert len(result.log) == 0
    assert [(s.beacon, s.start_us, s.end_us, s.boot) for s in result.spells] == [
        (0, 0, END_US, 0),
        (1, 0, END_US, 0),
    ]
    spell = result.spells[1]
    assert (spell.x_m, spell.y_m, spell.z_m, spell.level) == (5.0, 2.0, 3.0, 0)
    assert (spell.power_db, spell.interval_s) == (0.0, 0.35)


def test_the_dead_are_silent_until_somebody_replaces_them():
    result = lives(
        Replaced(at_s=50, beacon="A", measured_power_dbm=-70.0, advertising_interval_s=0.1),
        Dies(at_s=10, beacon="A"),
    )
    old, new = spells_of(result)
    assert spans([old, new]) == [(0, 10), (50, 100)]
    assert (new.power_db, new.interval_s, new.boot) == (7.0, 0.1, 1)
    assert story(result) == [(10, "A", "dies"), (50, "A", "replaced")]
    assert result.log.power_change_db.tolist() == [0, 7]
    assert spans(spells_of(result, 1)) == [(0, 100)]


def test_a_reboot_is_a_silence_and_then_another_clock():
    result = lives(Reboots(at_s=10, beacon="B", off_s=2.5))
    before, after = spells_of(result, 1)
    assert spans([before, after]) == [(0, 10), (12.5, 100)]
    assert (before.boot, after.boot) == (0, 1)
    assert story(result) == [(10, "B", "reboots"), (12.5, "B", "returns")]


def test_a_beacon_that_dies_or_is_replaced_while_it_reboots_does_not_return_twice():
    died = lives(Reboots(at_s=10, beacon="A", off_s=20), Dies(at_s=15, beacon="A"))
    assert spans(spells_of(died)) == [(0, 10)]
    replaced = lives(Reboots(at_s=10, beacon="A", off_s=20), Replaced(at_s=15, beacon="A"))
    assert spans(spells_of(replaced)) == [(0, 10), (15, 100)]
    again = lives(Reboots(at_s=10, beacon="A", off_s=20), Reboots(at_s=15, beacon="A", off_s=1))
    assert spans(spells_of(again)) == [(0, 10), (16, 100)]
    assert spells_of(again)[1].boot == 2


def test_a_move_keeps_the_clock_and_what_is_not_given():
    result = lives(
        Moves(at_s=10, beacon="A", x_m=8.0, y_m=9.0),
        Moves(at_s=20, beacon="A", x_m=7.0, y_m=9.0, z_m=0.5, level=1),
    )
    assert [(s.x_m, s.y_m, s.z_m, s.level, s.boot) for s in spells_of(result)] == [
        (1.0, 2.0, 3.0, 0, 0),
        (8.0, 9.0, 3.0, 0, 0),
        (7.0, 9.0, 0.5, 1, 0),
    ]
    assert result.log.x_m.tolist() == [8.0, 7.0]
    assert result.log.level.tolist() == [0, 1]


def test_a_beacon_moved_during_its_silence_sends_from_its_new_place():
    result = lives(
        Reboots(at_s=10, beacon="A", off_s=20), Moves(at_s=15, beacon="A", x_m=8.0, y_m=9.0)
    )
    assert spans(spells_of(result)) == [(0, 10), (30, 100)]
    assert spells_of(result)[1].x_m == 8.0


def test_a_battery_sags_in_equal_steps_and_the_clock_goes_on():
    result = lives(Sags(at_s=10, beacon="A", power_db=-6.0, duration_s=30, steps=3))
    assert spans(spells_of(result)) == [(0, 20), (20, 30), (30, 40), (40, 100)]
    assert [s.power_db for s in spells_of(result)] == [0, -2, -4, -6]
    assert {s.boot for s in spells_of(result)} == {0}
    assert [name for *_, name in story(result)] == ["sags"] * 3


def test_a_sag_at_once_is_one_step():
    result = lives(Sags(at_s=10, beacon="A", power_db=-6.0))
    assert spans(spells_of(result)) == [(0, 10), (10, 100)]


def test_a_new_battery_ends_the_sag_of_the_old():
    result = lives(
        Sags(at_s=10, beacon="A", power_db=-6.0, duration_s=30, steps=3),
        Replaced(at_s=25, beacon="A"),
    )
    assert [s.power_db for s in spells_of(result)] == [0, -2, 0]
    assert spans(spells_of(result))[-1] == (25, 100)


def test_what_comes_at_the_end_or_later_does_not_happen():
    result = lives(Dies(at_s=100, beacon="A"), Reboots(at_s=99, beacon="B", off_s=5))
    assert spans(spells_of(result)) == [(0, 100)]
    assert spans(spells_of(result, 1)) == [(0, 99)]
    assert story(result) == [(99, "B", "reboots")]


def test_events_at_one_time_happen_in_the_order_given():
    replaced = lives(Dies(at_s=5, beacon="A"), Replaced(at_s=5, beacon="A"))
    assert spans(spells_of(replaced)) == [(0, 5), (5, 100)]
    dead = lives(Replaced(at_s=5, beacon="A"), Dies(at_s=5, beacon="A"))
    assert spans(spells_of(dead)) == [(0, 5)]


@pytest.mark.parametrize(
    ("events", "message"),
    [
        ([Dies(at_s=1, beacon="Z")], "there is no beacon 'Z'"),
        (
            [Reboots(at_s=6, beacon="A"), Dies(at_s=5, beacon="A")],
            "beacon 'A' died at 5 s; from then on it can only be replaced",
        ),
        ([Dies(at_s=5, beacon="A"), Dies(at_s=5, beacon="A")], "beacon 'A' died at 5 s"),
    ],
)
def test_what_cannot_happen_is_refused(events, message):
    with pytest.raises(UsageError, match=message):
        lives(*events)


@pytest.mark.parametrize(
    "event",
    [
        {"event": "dies", "at_s": -1.0, "beacon": "A"},
        {"event": "explodes", "at_s": 1.0, "beacon": "A"},
        {"event": "sags", "at_s": 1.0, "beacon": "A", "power_db": 3.0},
        {"event": "replaced", "at_s": 1.0, "beacon": "A", "advertising_interval_s": 0.0201},
        {"event": "moves", "at_s": 1.0, "beacon": "A", "x_m": 1.0},
    ],
)
def test_impossible_values(event):
    with pytest.raises(ValidationError):
        TypeAdapter(BeaconEvent).validate_python(event)


TIMES = st.integers(0, 120).map(float)
HAPPENINGS = st.one_of(
    st.builds(Reboots, at_s=TIMES, beacon=st.sampled_from("AB"), off_s=TIMES),
    st.builds(Moves, at_s=TIMES, beacon=st.sampled_from("AB"), x_m=TIMES, y_m=TIMES),
    st.builds(Replaced, at_s=TIMES, beacon=st.sampled_from("AB")),
    st.builds(
        Sags, at_s=TIMES, beacon=st.sampled_from("AB"), power_db=st.just(-2.0), duration_s=TIMES
    ),
)


@given(events=st.lists(HAPPENINGS, max_size=8))
def test_spells_never_overlap_and_the_log_ascends(events):
    result = lives(*events)
    order = [(spell.beacon, spell.start_us) for spell in result.spells]
    assert order == sorted(order)
    assert all(0 <= spell.start_us < spell.end_us <= END_US for spell in result.spells)
    for row in (0, 1):
        for one, next_one in pairwise(spells_of(result, row)):
            assert one.end_us <= next_one.start_us
            assert one.boot <= next_one.boot
    if not any(isinstance(event, Reboots) for event in events):
        assert sum(s.end_us - s.start_us for s in result.spells) == 2 * END_US


@given(events=st.lists(HAPPENINGS, max_size=8))
def test_what_befalls_one_beacon_leaves_the_other(events):
    alone = [event for event in events if event.beacon == "A"]
    assert spells_of(lives(*events)) == spells_of(lives(*alone))
