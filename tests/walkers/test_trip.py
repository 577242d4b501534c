import numpy as np
import pytest

from blesim.rng import Draws
from blesim.venue.graph import GraphPosition
from blesim.venue.routes import Routes
from blesim.walkers.clearance import BODY_RADIUS_M, EITHER, Clearance, shelf_sides
from blesim.walkers.trip import (
    EDGE,
    END,
    HEADING,
    LENGTH,
    LIMIT,
    RESTS,
    TURN,
    Ground,
    Mover,
    Places,
    X,
    Y,
    planned,
)

MOVER = Mover(speed_m_s=0.9, rate_m_s2=0.8, turn_rate_rad_s=2.0)
LANES = Draws(seed=1, purpose="lane", walker="w").address()


@pytest.fixture(scope="module")
def ground(section) -> Ground:
    return Ground(routes=Routes.of(section.graph), clearance=Clearance.of(section))


def plan(ground, *names, rests=True, start=None):
    places = [ground.graph.at_node(name) for name in names]
    return planned(ground, Places.at(places, [rests] * len(places)), LANES, MOVER, start)


def test_clearance_is_what_the_shelves_leave(section):
    clearance = Clearance.of(section)
    # 1.9 m from the centre to the shelf faces and walls, less half a body.
    assert clearance.edge_m == pytest.approx(np.full(len(clearance.edge_m), 1.65), abs=1e-5)
    assert clearance.width_m == pytest.approx(np.full(len(clearance.edge_m), 3.8), abs=1e-5)
    assert set(shelf_sides(section).tolist()) == {EITHER}


def test_legs_end_within_the_room_beside_the_aisle(ground):
    for seed in range(20):
        address = Draws(seed=seed, purpose="lane", walker="w").address()
        names = [ground.graph.nodes[k].id for k in (0, 20, 7, 25, 13)]
        places = Places.at([ground.graph.at_node(n) for n in names], [True] * 5)
        legs = planned(ground, places, address, MOVER).legs
        centre_m = ground.graph.xy_m(legs[:, EDGE].astype(int), legs[:, END])
        away_m = np.hypot(legs[:, X] - centre_m[:, 0], legs[:, Y] - centre_m[:, 1])
        assert away_m.max() <= 1.9 - BODY_RADIUS_M


def test_who_goes_straight_on_keeps_the_lane(ground):
    legs = plan(ground, "D1", "D8").legs
    inner = legs[:-1]
    assert np.ptp(inner[:, Y]) < 1e-6
    assert np.all(legs[1:-1, TURN] == 0)
    assert np.all(inner[:, RESTS] == 0)
    assert np.all(np.isfinite(inner[:, LIMIT]))
    assert legs[-1, LIMIT] == 0


def test_turning_round_takes_half_a_turn_on_the_spot(ground):
    legs = plan(ground, "D1", "D4", "D1").legs
    turns_us = legs[legs[:, TURN] > 0, TURN]
    assert len(turns_us) == 1
    # Lanes are not quite parallel: half a turn at 2 rad/s takes 1.57 s.
    assert turns_us[0] == pytest.approx(np.pi / 2 * 1e6, rel=0.25)


def test_limits_let_the_walker_stop_in_time(ground):
    legs = plan(ground, "D1", "F8", rests=False).legs
    lengths, limits = legs[:, LENGTH], legs[:, LIMIT]
    assert np.all(limits[:-1] ** 2 <= limits[1:] ** 2 + 2 * 0.8 * lengths[1:] + 1e-9)
    assert np.all(limits[legs[:, RESTS] > 0] == 0)


def test_going_on_from_a_stance_starts_there(ground):
    first = plan(ground, "D1", "E5")
    row = len(first.legs) - 1
    stance = first.stance(row)
    there = first.place(row)
    on = planned(
        ground,
        Places.at([there, ground.graph.at_node("F1")], [True, True]),
        LANES,
        MOVER,
        stance,
    )
    assert (on.start.x_m, on.start.y_m) == (stance.x_m, stance.y_m)
    first_m = np.hypot(on.legs[0, X] - stance.x_m, on.legs[0, Y] - stance.y_m)
    assert first_m == pytest.approx(on.legs[0, LENGTH])
    assert on.end.ordinal > stance.ordinal


def test_crossing_the_aisle_is_a_leg_too(ground):
    here = GraphPosition(3, 1.0)
    places = Places(
        edge=np.array([3, 3, 3]),
        offset_m=np.array([here.offset_m] * 3),
        rests=np.ones(3, np.bool_),
        aside_m=np.array([[np.nan, np.nan], [0.0, 1.5], [0.0, -1.5]]),
        facing_rad=np.full(3, np.nan),
    )
    legs = planned(ground, places, LANES, MOVER).legs
    assert len(legs) == 2
    assert legs[1, LENGTH] == pytest.approx(3.0, abs=1e-5)
    assert abs(legs[1, HEADING]) == pytest.approx(np.pi / 2)
