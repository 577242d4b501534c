from itertools import pairwise

import pytest
import shapely

from blesim.venue.sites.h_floor import h_floor


def test_the_floor_is_an_h_with_nine_beacons():
    floor = h_floor()
    free = floor.floor_plan.walkable[0]
    assert len(floor.beacons) == 9
    assert free.geom_type == "Polygon"
    # An H has four corners outside and eight inside.
    assert len(shapely.get_coordinates(shapely.normalize(free).simplify(0.0)).tolist()) - 1 == 12
    assert free.area == pytest.approx(2 * 3 * 21 + 8 * 8)


def test_the_hall_holds_the_square_of_the_experiment_around_its_beacon():
    floor = h_floor()
    hall = floor.beacons[0]
    assert (hall.id, hall.z_m) == ("hall", 0.0)
    square = shapely.box(hall.x_m - 3.75, hall.y_m - 3.75, hall.x_m + 3.75, hall.y_m + 3.75)
    assert shapely.covers(floor.floor_plan.walkable[0], square)


def test_the_course_is_70_m_long():
    graph = h_floor().graph
    stops = ["east/south", "west/north", "west/south", "east/north"]
    places = [graph.at_node(stop) for stop in stops]
    legs = [leg for a, b in pairwise(places) for leg in graph.route(a, b)]
    assert sum(leg.length_m for leg in legs) == pytest.approx(70.0)
