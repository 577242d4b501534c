import math

import numpy as np
import pytest

from blesim.errors import UsageError
from blesim.estimators.aisle_zones import (
    NO_JUNCTION,
    no_zones,
    zones_by_level,
)
from blesim.estimators.map_headings import MapHeadings
from blesim.estimators.practice import practice_venue
from blesim.pdr.compass import CompassCorrection
from blesim.venue.graph import AisleGraph, Edge, Node

WIDE = {"reach_m": math.inf, "agree_rad": math.pi / 2}


class Corner:
    """Venue with an aisle from (0, 0) by a beacon's node at (9, 0) to (10, 0), then to (10, 10)."""

    name = "corner"
    graph = AisleGraph(
        nodes=(
            Node(id="a", x_m=0, y_m=0),
            Node(id="beacon", x_m=9, y_m=0),
            Node(id="b", x_m=10, y_m=0),
            Node(id="c", x_m=10, y_m=10),
        ),
        edges=(
            Edge(first="a", second="beacon", branch="1"),
            Edge(first="b", second="beacon", branch="1"),
            Edge(first="b", second="c", branch="2"),
        ),
    )


ZONES = zones_by_level(Corner, 2.0)[0]


def test_only_where_the_way_bends_is_a_junction():
    assert ZONES.junction_xy_m.tolist() == [[10.0, 0.0]]
    # Both arms are 10 m long: the node in between ends no straight way.
    np.testing.assert_allclose(np.sort(ZONES.arm_m[:, 2]), [10.0, 10.0])


def test_the_practice_venue_has_four():
    zones = zones_by_level(practice_venue(), 2.0)[0]
    assert sorted(zones.junction_xy_m.tolist()) == [[2, 2], [2, 6], [14, 2], [14, 6]]


def test_a_non_linear_zone_is_a_disk():
    assert ZONES.junction_at(8.1, 0.0) == 0
    assert ZONES.junction_at(8.0, 0.0) == NO_JUNCTION
    assert ZONES.junction_at(11.0, -1.0) == 0


def test_of_the_two_directions_the_nearer_counts():
    assert ZONES.way_rad(5.0, 0.3, 0.4, **WIDE) == pytest.approx(0.0)
    assert abs(ZONES.way_rad(5.0, 0.3, 2.0, **WIDE)) == pytest.approx(math.pi)
    assert ZONES.way_rad(10.1, 5.0, -1.0, **WIDE) == pytest.approx(-math.pi / 2)


def test_an_aisle_that_does_not_agree_or_is_too_far_is_passed_over():
    near = {"reach_m": 3.0, "agree_rad": math.radians(45)}
    # At (9, 1) the first aisle is nearer, but only the second leads north.
    assert ZONES.way_rad(9.5, 0.1, 1.5, **near) == pytest.approx(math.pi / 2)
    assert math.isnan(ZONES.way_rad(5.0, 0.1, 1.5, **near))
    assert math.isnan(ZONES.way_rad(5.0, 3.1, 0.0, **near))


def test_beyond_the_end_of_an_aisle_is_no_linear_zone():
    assert ZONES.linear_at(5.0, 1.0, reach_m=5.0)
    assert not ZONES.linear_at(5.0, -5.1, reach_m=5.0)
    assert not ZONES.linear_at(9.0, 0.0, reach_m=5.0)
    # Over the corner by 3 m, and beside the part of the second aisle in the non-linear zone.
    assert not ZONES.linear_at(13.0, -3.0, reach_m=5.0)
    assert not ZONES.linear_at(13.0, 1.9, reach_m=5.0)
    assert ZONES.linear_at(13.0, 3.0, reach_m=5.0)


def test_the_entry_lies_on_the_arm_at_the_border():
    assert ZONES.entry_m(10.3, 2.1, reach_m=5.0) == pytest.approx((10.0, 2.0))
    assert ZONES.entry_m(7.9, -0.3, reach_m=5.0) == pytest.approx((8.0, 0.0))
    assert ZONES.entry_m(2.0, 0.0, reach_m=5.0) is None


def test_a_short_arm_is_entered_at_its_end():
    zones = zones_by_level(practice_venue(), 6.0)[0]
    # The cross aisles are 4 m long.
    assert zones.entry_m(2.0, 3.0, reach_m=1.0) == pytest.approx((2.0, 6.0))


def test_without_aisles_nothing_is_known():
    nothing = no_zones(2.0)
    assert nothing.junction_at(0.0, 0.0) == NO_JUNCTION
    assert not nothing.linear_at(0.0, 0.0, reach_m=5.0)
    assert nothing.entry_m(0.0, 0.0, reach_m=5.0) is None
    venue = type("NoGraph", (), {"name": "hall", "graph": None})
    with pytest.raises(UsageError, match="no aisle graph"):
        zones_by_level(venue, 2.0)


def test_a_straight_step_in_an_aisle_trains_and_others_do_not():
    headings = MapHeadings(
        ZONES, CompassCorrection(training_steps=1), reach_m=5.0, agree_rad=math.radians(45)
    )
    # Turning, in the non-linear zone, across the aisle: still untrained, as measured.
    for turning, x_m, y_m, heading_rad in (
        (True, 5.0, 0.0, 0.2),
        (False, 9.0, 0.0, 0.2),
        (False, 3.0, 0.0, 1.5),
    ):
        told = headings.corrected_rad(heading_rad, turning, x_m, y_m)
        assert told == pytest.approx(heading_rad)
    headings.corrected_rad(0.2, False, 5.0, 0.0)
    # One step: prior variance 1000 (1 + 1 + 1) deg2 with the drift 3e-4, noise 25 deg2.
    left_rad = 0.2 * 25 / (3000 + 3e-4 + 25)
    assert headings.corrected_rad(0.2, False, 5.0, 0.0) == pytest.approx(left_rad, rel=1e-6)
