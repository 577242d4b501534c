"""Each law of a finished day, shown to be broken by a log that breaks it and no other."""

from dataclasses import replace

import numpy as np
import pytest

from blesim.errors import InvariantError
from blesim.walkers.day import OpenStore
from blesim.walkers.invariants import check_people, check_visits
from blesim.walkers.person import PersonLog
from blesim.walkers.trading_day import Basket, Staff, Tills, TradingDay

DAY = TradingDay(
    opens="10:00",
    closes="11:00",
    shoppers=8.0,
    entrance="F/west",
    tills=Tills(nodes=("D/west", "E/west")),
    basket=Basket(mean=4, spread=2),
    staff=Staff(number=1, shift_h=0.5),
)


@pytest.fixture
def floor(section):
    """A finished day, to be spoilt."""
    opened = OpenStore.of(section, DAY, (), 3)
    opened.run()
    return opened.floor


@pytest.fixture(scope="module")
def people(section) -> tuple[PersonLog, ...]:
    opened = OpenStore.of(section, DAY, (), 3)
    opened.run()
    return opened.logs().people


def test_a_day_as_it_was_breaks_no_law(floor, people, section):
    check_visits(floor)
    check_people(people, section)


def test_who_came_and_never_left_is_told(floor):
    floor.visits[2].left_us = -1
    with pytest.raises(InvariantError, match="'shopper-0003' and 0 more came but never left"):
        check_visits(floor)


def test_counts_that_do_not_add_up_are_told(floor):
    floor.gone -= 1
    with pytest.raises(InvariantError, match="are gone, but"):
        check_visits(floor)


def test_who_came_before_being_at_the_door_is_told(floor):
    floor.visits[0].came_us = floor.visits[0].visitor.comes_us - 1
    with pytest.raises(InvariantError, match="'shopper-0001' came in before being at the door"):
        check_visits(floor)


def test_who_walks_on_after_having_left_is_told(floor):
    floor.visits[1].left_us -= 1
    with pytest.raises(InvariantError, match="'shopper-0002' walks on after having left"):
        check_visits(floor)


@pytest.mark.parametrize("held", ["door", "till", "bound"])
def test_a_place_that_nobody_gave_back_is_told(floor, held):
    if held == "door":
        floor.door.request()
    elif held == "till":
        floor.tills[0].desk.request()
    else:
        floor.tills[1].bound += 1
    with pytest.raises(InvariantError, match="still holds a place"):
        check_visits(floor)


def test_an_edge_with_somebody_left_on_it_is_told(floor):
    floor.present[4] += 1
    with pytest.raises(InvariantError, match="edge 4 is left with 1 people"):
        check_visits(floor)


def test_legs_that_overlap_in_time_are_told(floor):
    starts_us = floor.visits[3].starts_us
    starts_us[2] = starts_us[1] + 1
    with pytest.raises(InvariantError, match="'shopper-0004' walks before having arrived"):
        check_visits(floor)


def test_a_leg_that_takes_less_than_no_time_is_told(floor):
    floor.visits[3].hindrances.append((1, (-1, 0.0, 0.5, 0.0)))
    with pytest.raises(InvariantError, match="walks before having arrived"):
        check_visits(floor)


def spoilt(people, section, match, **changes):
    """Check that a person with other values of the trajectory is told."""
    person = people[1]
    trajectory = replace(person.trajectory, **changes)
    with pytest.raises(InvariantError, match=match) as caught:
        check_people((people[0], replace(person, trajectory=trajectory)), section)
    assert "\n" not in str(caught.value)


def test_who_walks_through_a_shelf_is_told(people, section):
    trajectory = people[1].trajectory
    # The same walk, 3 m further north: as long and as fast, but not beside the shelves.
    match = "walked through a shelf or a wall of level 0"
    spoilt(people, section, match, y_m=trajectory.y_m + 3.0)


def test_who_walks_through_a_wall_between_knots_is_told(people, section):
    # Both ends of the way are free, what lies between is shelf.
    person = people[1]
    nodes = section.graph.node_row
    row = int(np.flatnonzero(person.trajectory.state == 1)[0])
    xy_m = section.graph.node_xy_m[[nodes["D3"], nodes["F3"]]]
    x_m, y_m = person.trajectory.x_m.copy(), person.trajectory.y_m.copy()
    x_m[: row + 1], y_m[: row + 1] = xy_m[0]
    x_m[row + 1 :], y_m[row + 1 :] = xy_m[1]
    way_m = float(np.hypot(*(xy_m[1] - xy_m[0])))
    span_s = np.diff(person.trajectory.time_us)[row] * 1e-6
    still = np.zeros(len(x_m))
    speed_m_s = still.copy()
    speed_m_s[row] = way_m / span_s
    trajectory = replace(
        person.trajectory,
        x_m=x_m,
        y_m=y_m,
        speed_m_s=speed_m_s,
        acceleration_m_s2=still,
        edge_speed_m_s=still,
    )
    with pytest.raises(InvariantError, match="through a shelf or a wall"):
        check_people(
            (replace(person, trajectory=trajectory, planned_m=way_m, speed_m_s=100.0),), section
        )


def test_a_walk_of_another_length_than_its_route_is_told(people, section):
    longer = replace(people[1], planned_m=people[1].planned_m + 0.01)
    with pytest.raises(InvariantError, match="of a route of"):
        check_people((longer,), section)


def test_who_walks_faster_than_desired_is_told(people, section):
    slower = replace(people[1], speed_m_s=people[1].speed_m_s - 0.01)
    with pytest.raises(InvariantError, match="walked faster than desired"):
        check_people((slower,), section)


def test_who_gets_too_fast_between_knots_is_told(people, section):
    # Right at every knot, but sped up beyond the pace just before the next.
    person = people[1]
    trajectory = person.trajectory
    steady = (trajectory.state == 1) & (trajectory.acceleration_m_s2 == 0)
    row = int(np.flatnonzero(steady[:-1] & (np.diff(trajectory.time_us) > 2_000_000))[0])
    span_s = np.diff(trajectory.time_us)[row] * 1e-6
    speed_m_s, change = trajectory.speed_m_s.copy(), trajectory.acceleration_m_s2.copy()
    change[row] = 0.2
    speed_m_s[row] -= 0.1 * span_s
    spoilt(people, section, "faster than desired", speed_m_s=speed_m_s, acceleration_m_s2=change)


def test_a_walk_that_does_not_begin_at_the_door_is_told(people, section):
    late = replace(people[1], came_us=people[1].came_us - 1)
    with pytest.raises(InvariantError, match="does not last from door to door"):
        check_people((late,), section)


def test_who_moves_while_standing_is_told(people, section):
    state = people[1].trajectory.state.copy()
    state[state == 1] = 0
    spoilt(people, section, "moved while standing", state=state)


def test_speeds_that_do_not_fit_the_way_are_told(people, section):
    speed_m_s = people[1].trajectory.speed_m_s * 0.9
    spoilt(people, section, "speeds do not lead from knot to knot", speed_m_s=speed_m_s)


def test_an_offset_beyond_its_edge_is_told(people, section):
    trajectory = people[1].trajectory
    longest_m = section.graph.length_m[trajectory.edge]
    match = "an offset lies beyond the end of its edge"
    spoilt(people, section, match, offset_m=np.maximum(trajectory.offset_m, longest_m + 1e-4))
    spoilt(people, section, match, offset_m=trajectory.offset_m - longest_m - 1e-4)


def test_who_gets_along_an_edge_faster_than_walking_is_told(people, section):
    trajectory = people[1].trajectory
    for sign in (1.0, -1.0):
        spoilt(
            people,
            section,
            "moved along an edge faster than walking",
            edge_speed_m_s=sign * (trajectory.speed_m_s + 1.0),
        )


def test_who_turns_too_fast_is_told(people, section):
    person = people[1]
    slow = replace(person, turn_rate_rad_s=person.turn_rate_rad_s - 0.1)
    with pytest.raises(InvariantError, match="turned faster than"):
        check_people((slow,), section)


def test_times_that_do_not_ascend_are_told(people, section):
    time_us = people[1].trajectory.time_us.copy()
    time_us[4] = time_us[3]
    spoilt(people, section, "times do not ascend", time_us=time_us)
