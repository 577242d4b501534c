import numpy as np
import pytest
import shapely

from blesim.errors import VenueError
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.section_places import SectionPlaces
from blesim.venue.sections import Section


def nodes(**places):
    return tuple(
        Node(id=name, x_m=x_m, y_m=y_m, level=level) for name, (x_m, y_m, level) in places.items()
    )


def section(name, start_m, end_m, *, branch="A", level=0):
    return Section(
        id=name, category="tea", branch=branch, start_m=start_m, end_m=end_m, level=level
    )


@pytest.fixture(scope="module")
def two_levels():
    """An L-shaped aisle A of three edges, the second drawn backwards; A again one level up."""
    return AisleGraph(
        nodes=nodes(
            a=(0, 0, 0), b=(10, 0, 0), c=(20, 0, 0), d=(20, 5, 0), up=(0, 0, 1), end=(10, 0, 1)
        ),
        edges=(
            Edge(first="a", second="b", branch="A", one_way=True),
            Edge(first="c", second="b", branch="A"),
            Edge(first="c", second="d", branch="A"),
            Edge(first="b", second="d", branch="short cut"),
            Edge(first="up", second="end", branch="A"),
        ),
    )


def test_a_section_may_bend_over_several_edges_against_the_one_way_sign(two_levels):
    places = SectionPlaces.of(two_levels, [section("s", (20, 3), (6, 0))])
    found = sorted(zip(places.edge, places.start_m, places.end_m, strict=True))
    assert found == [(0, 6.0, 10.0), (1, 0.0, 10.0), (2, 0.0, 3.0)]
    assert places.length_m.tolist() == [17.0]
    assert places.at([0, 0, 1, 2, 2, 3], [5.9, 6.1, 5, 2.9, 3.1, 1]).tolist() == [
        -1,
        0,
        0,
        0,
        -1,
        -1,
    ]


def test_levels_are_kept_apart(two_levels):
    sections = [section("low", (2, 0), (8, 0)), section("high", (2, 0), (4, 0), level=1)]
    places = SectionPlaces.of(two_levels, sections)
    assert places.at([0, 4, 4], [3.0, 3.0, 5.0]).tolist() == [0, 1, -1]


def test_the_first_of_two_sides_of_an_aisle_is_told_and_both_are_members(two_levels):
    sections = [section("left", (2, 0), (6, 0)), section("right", (4, 0), (8, 0))]
    places = SectionPlaces.of(two_levels, sections)
    assert places.at([0, 0, 0], [3.0, 5.0, 7.0]).tolist() == [0, 0, 1]
    piece, member = places.memberships
    shared = places.piece_at(0, 5.0)
    assert sorted(member[piece == shared]) == [0, 1]


def test_where_one_ends_and_the_next_begins_the_one_ahead_has_the_place(two_levels):
    sections = [section("s", (0, 0), (4, 0)), section("t", (4, 0), (10, 0))]
    places = SectionPlaces.of(two_levels, sections)
    assert places.at([0, 0, 0], [0.0, 4.0, 10.0]).tolist() == [0, 1, 1]


def test_off_the_graph_there_is_no_section(two_levels):
    places = SectionPlaces.of(two_levels, [section("s", (0, 0), (10, 0))])
    assert places.at([-1, 0], [np.nan, 1.0]).tolist() == [-1, 0]


def test_without_sections_and_without_length_nothing_is_anywhere(two_levels):
    assert SectionPlaces.of(two_levels, []).at([0, 1], [1.0, 2.0]).tolist() == [-1, -1]
    point = SectionPlaces.of(two_levels, [section("s", (3, 0), (3, 0))])
    assert point.length_m.tolist() == [0.0]
    assert point.at(0, 3.0).tolist() == -1


def test_a_section_from_one_piece_of_an_aisle_to_another_is_refused():
    graph = AisleGraph(
        nodes=nodes(a=(0, 0, 0), b=(4, 0, 0), c=(8, 0, 0), d=(12, 0, 0)),
        edges=(
            Edge(first="a", second="b", branch="A"),
            Edge(first="b", second="c", branch="B"),
            Edge(first="c", second="d", branch="A"),
        ),
    )
    with pytest.raises(VenueError, match=r"section 's' reaches from one piece of aisle 'A'"):
        SectionPlaces.of(graph, [section("s", (2, 0), (10, 0))])


def test_every_place_of_the_store_is_where_geometry_says(store):
    places = SectionPlaces.of(store.graph, store.sections)
    ends = np.array([(s.start_m, s.end_m) for s in store.sections])
    np.testing.assert_allclose(places.length_m, np.hypot(*(ends[:, 1] - ends[:, 0]).T), atol=1e-9)
    rng = np.random.default_rng(5)
    edge = rng.integers(0, len(store.graph.edges), 4000)
    offset_m = rng.uniform(0, store.graph.length_m[edge])
    points = shapely.points(store.graph.xy_m(edge, offset_m))
    found = places.at(edge, offset_m)
    lines = shapely.linestrings(ends)
    near = shapely.STRtree(lines).query(points, "dwithin", 1e-6)
    expected = np.full(len(edge), -1)
    expected[near[0]] = near[1]
    # Crossing aisles meet sections in no place but a node, which a random draw does not hit.
    np.testing.assert_array_equal(found, expected)
    assert np.mean(found >= 0) > 0.5


def test_every_point_in_the_stretch_of_a_section_is_in_it(store):
    places = SectionPlaces.of(store.graph, store.sections)
    rng = np.random.default_rng(6)
    share = rng.uniform(1e-5, 1 - 1e-5, (50, len(places.edge)))
    offset_m = places.start_m + share * (places.end_m - places.start_m)
    found = places.at(np.broadcast_to(places.edge, share.shape), offset_m)
    np.testing.assert_array_equal(found, np.broadcast_to(places.section, share.shape))
