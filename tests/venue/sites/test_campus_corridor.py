from itertools import pairwise

import numpy as np
import pytest

from blesim.errors import UsageError
from blesim.venue.sites.campus_corridor import campus_corridor, campus_corridor_keys

ZONES = ["B", "BZ", "Z", "AZ", "A", "CA", "C"]


def way_m(venue) -> float:
    graph = venue.graph
    legs = graph.route(graph.at_node("B/west"), graph.at_node("C/west"))
    return sum(leg.length_m for leg in legs)


def test_the_way_leads_through_the_seven_zones_in_order():
    venue = campus_corridor()
    assert list(venue.graph.branches) == ZONES
    assert way_m(venue) == pytest.approx(211.68, abs=1e-4)


def test_straight_zones_have_the_published_azimuths():
    graph = campus_corridor().graph
    east, north = graph.direction.T
    azimuth_deg = np.degrees(np.arctan2(east, north)) % 360
    names = np.array(graph.branches)[graph.branch]
    for zone, expected_deg in (("B", 90), ("Z", 180), ("A", 270), ("C", 305)):
        assert azimuth_deg[names == zone] == pytest.approx(expected_deg, abs=1e-3)


def test_entries_of_the_straight_zones_are_2_m_off_the_corners():
    graph = campus_corridor().graph
    xy_m = {node.id: np.array([node.x_m, node.y_m]) for node in graph.nodes}
    for corner, entries in (("BZ", ("B", "Z1")), ("AZ", ("Z2", "A1")), ("CA", ("A2", "C"))):
        for entry in entries:
            assert np.linalg.norm(xy_m[entry] - xy_m[corner]) == pytest.approx(2.0, abs=1e-5)
            assert corner in graph.branches_of_node[entry]


@pytest.mark.parametrize(("count", "spacing_m"), [(20, 10.0), (15, 200 / 15), (10, 20.0)])
def test_beacons_are_evenly_along_the_way(count, spacing_m):
    venue = campus_corridor(count)
    assert len(venue.beacons) == count
    edge, offset_m = venue.beacon_places
    between_m = venue.graph.distance_m(edge[:-1], offset_m[:-1], edge[1:], offset_m[1:])
    # Only a beacon beyond the corner CA, where the wall is not square to the corridor, may be off.
    assert np.median(between_m) == pytest.approx(spacing_m, abs=1e-4)
    assert between_m == pytest.approx(spacing_m, abs=0.7)
    assert {beacon.tx_power_dbm for beacon in venue.beacons} == {4.0}
    x_m, y_m, _ = venue.beacon_xyz_m.T
    _, _, aside_m = venue.graph.nearest(x_m, y_m, np.zeros(count, int))
    assert aside_m == pytest.approx(1.2, abs=0.4)


def test_the_five_key_beacons_are_at_the_ends_and_turns():
    venue = campus_corridor_keys()
    nodes_m = {node.id: (node.x_m, node.y_m) for node in venue.graph.nodes}
    for beacon, node in zip(venue.beacons, ("B/west", "BZ", "AZ", "CA", "C/west"), strict=True):
        aside_m = np.hypot(*np.subtract((beacon.x_m, beacon.y_m), nodes_m[node]))
        assert aside_m == pytest.approx(1.2, abs=1e-5)
    assert way_m(venue) == pytest.approx(211.68, abs=1e-4)


def test_the_corridor_is_one_piece_2_40_m_wide():
    free = campus_corridor().floor_plan.walkable[0]
    assert free.geom_type == "Polygon"
    # Width times length of the centre line; mitred corners add and cut the same.
    assert free.area == pytest.approx(2.4 * 211.68, rel=1e-4)


def test_nodes_ascend_along_the_way():
    graph = campus_corridor().graph
    assert [(edge.first, edge.second) for edge in graph.edges] == [
        (a.id, b.id) for a, b in pairwise(graph.nodes)
    ]


@pytest.mark.parametrize("count", [0, 201])
def test_other_numbers_are_refused(count):
    with pytest.raises(UsageError, match=f"{count} beacons: give 1 to 200"):
        campus_corridor(count)
