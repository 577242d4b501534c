import numpy as np
import pytest
from scipy import stats

from blesim.filters.graph_motion import GraphArrays, motion_key
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.venue import Venue

KEY = np.array([3, 4], dtype=np.uint64)


def graph(places: dict[str, tuple[float, float]], *edges: tuple[str, str, bool]) -> AisleGraph:
    return AisleGraph(
        nodes=tuple(Node(id=name, x_m=x, y_m=y) for name, (x, y) in places.items()),
        edges=tuple(Edge(first=a, second=b, branch=a + b, one_way=one) for a, b, one in edges),
    )


def line(one_way: bool = False) -> AisleGraph:
    """Two edges of 3 and 4 m in a row, the second drawn from its far end."""
    places = {"a": (0.0, 0.0), "b": (3.0, 0.0), "c": (7.0, 0.0)}
    return graph(places, ("a", "b", one_way), ("c", "b", False))


def star(arms: int = 4, one_way: tuple[bool, ...] = (False,) * 4) -> AisleGraph:
    """Arms of 10 m that begin at the hub."""
    angle = 2 * np.pi * np.arange(arms) / arms
    places = {str(k): (10 * np.cos(a), 10 * np.sin(a)) for k, a in enumerate(angle)}
    edges = [("hub", str(k), one_way[k]) for k in range(arms)]
    return graph({"hub": (0.0, 0.0), **places}, *edges)


def moved(
    arrays: GraphArrays,
    edge: list[int] | np.ndarray,
    offset_m: list[float] | np.ndarray,
    velocity_m_s: list[float] | np.ndarray,
    duration_s: float,
    *,
    turn_back: bool = False,
    ordinal: int = 0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    cloud = np.array(edge), np.array(offset_m, float), np.array(velocity_m_s, float)
    arrays.advance(*cloud, duration_s, turn_back=turn_back, key=KEY, ordinal=ordinal)
    return cloud


def test_a_way_worked_by_hand() -> None:
    arrays = GraphArrays.of(line())
    # From 1 m before b, 2.5 m on: 1 to b, then 1.5 into the second edge, which counts from c.
    edge, offset_m, velocity = moved(arrays, [0], [2.0], [0.5], 5.0)
    assert (edge[0], offset_m[0], velocity[0]) == (1, 2.5, -0.5)
    # On to the end c after 2.5 m and back again.
    edge, offset_m, velocity = moved(arrays, edge, offset_m, velocity, 7.0)
    assert (edge[0], offset_m[0], velocity[0]) == (1, 1.0, 0.5)


def test_who_stays_on_an_edge_or_stands_still() -> None:
    arrays = GraphArrays.of(line())
    edge, offset_m, velocity = moved(arrays, [0, 0, 1], [1.0, 1.0, 4.0], [0.25, -0.25, 0.0], 4.0)
    assert edge.tolist() == [0, 0, 1]
    assert offset_m.tolist() == [2.0, 0.0, 4.0]
    assert velocity.tolist() == [0.25, -0.25, 0.0]


@pytest.mark.parametrize("turn_back", [False, True])
def test_edges_at_a_node_are_equally_likely(turn_back: bool) -> None:
    """Chi-squared, false-alarm rate 1e-6."""
    arrays, count = GraphArrays.of(star()), 8000
    edge, offset_m, _ = moved(
        arrays, np.zeros(count, int), np.full(count, 1.0), np.full(count, -1.0), 2.0,
        turn_back=turn_back,
    )  # fmt: skip
    np.testing.assert_array_equal(offset_m, 1.0)
    taken = np.bincount(edge, minlength=4)
    if not turn_back:
        assert taken[0] == 0
        taken = taken[1:]
    assert stats.chisquare(taken).pvalue > 1e-6


@pytest.mark.parametrize("turn_back", [False, True])
def test_a_uniform_cloud_stays_uniform(section: Venue, turn_back: bool) -> None:
    """Chi-squared over edges, and over offsets; false-alarm rate 1e-6 each."""
    assert section.graph is not None
    arrays, rng, count = GraphArrays.of(section.graph), np.random.default_rng(21), 20_000
    edge, offset_m = arrays.uniform_places(rng.random(count))
    velocity = rng.uniform(-4, 4, count)
    for ordinal in range(10):
        arrays.advance(edge, offset_m, velocity, 3.0, turn_back=turn_back, key=KEY, ordinal=ordinal)
    expected = count * arrays.length_m / arrays.length_m.sum()
    on_edge = np.bincount(edge, minlength=len(expected))
    assert stats.chisquare(on_edge, expected).pvalue > 1e-6
    share = np.histogram(offset_m / arrays.length_m[edge], bins=10, range=(0, 1))[0]
    assert stats.chisquare(share).pvalue > 1e-6


def test_the_way_walked_is_the_speed_times_the_time(section: Venue) -> None:
    # Without turning back the way on the graph is straight until a dead end: walked in steps so
    # short that each passes one node at most, its pieces add up.
    assert section.graph is not None
    arrays, rng, count = GraphArrays.of(section.graph), np.random.default_rng(22), 500
    edge, offset_m = arrays.uniform_places(rng.random(count))
    velocity = rng.uniform(-2, 2, count)
    speed = np.abs(velocity)
    for ordinal in range(50):
        old_edge, old_offset_m = edge.copy(), offset_m.copy()
        old_velocity = velocity.copy()
        arrays.advance(edge, offset_m, velocity, 0.1, turn_back=False, key=KEY, ordinal=ordinal)
        same = (old_edge == edge) & (old_velocity == velocity)
        stayed_m = np.abs(offset_m - old_offset_m)
        to_node_m = np.where(
            old_velocity > 0, arrays.length_m[old_edge] - old_offset_m, old_offset_m
        )
        from_node_m = np.where(velocity > 0, offset_m, arrays.length_m[edge] - offset_m)
        way_m = np.where(same, stayed_m, to_node_m + from_node_m)
        np.testing.assert_allclose(way_m, 0.1 * speed, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(np.abs(velocity), speed)


def test_nobody_is_lost(store: Venue) -> None:
    assert store.graph is not None
    arrays, rng = GraphArrays.of(store.graph), np.random.default_rng(23)
    edge, offset_m = arrays.uniform_places(rng.random(2000))
    velocity = rng.normal(0, 30, 2000)
    arrays.advance(edge, offset_m, velocity, 60.0, turn_back=True, key=KEY, ordinal=0)
    assert np.all((edge >= 0) & (edge < len(arrays.length_m)))
    assert np.all((offset_m >= 0) & (offset_m <= arrays.length_m[edge]))


def test_draws_belong_to_the_particle_and_the_update() -> None:
    arrays, count = GraphArrays.of(star()), 200
    start = np.zeros(count, int), np.full(count, 1.0), np.full(count, -1.0)
    edge, _, _ = moved(arrays, *start, 500.0)
    again, _, _ = moved(arrays, *start, 500.0)
    np.testing.assert_array_equal(edge, again)
    # The first half is far from any node: it draws nothing, and the second is as before.
    quiet = start[0], np.where(np.arange(count) < 100, 5.0, 1.0), start[2]
    alone, _, _ = moved(arrays, *quiet, 2.0)
    np.testing.assert_array_equal(alone[100:], moved(arrays, *start, 2.0)[0][100:])
    other, _, _ = moved(arrays, *start, 500.0, ordinal=1)
    assert np.any(other != edge)


def test_one_way_signs_are_kept() -> None:
    arrays = GraphArrays.of(star(one_way=(False, True, True, False)))
    # Arms 1 and 2 lead outwards only: who is sent back along one turns round at once.
    edge, offset_m, velocity = moved(arrays, [1], [4.0], [-1.0], 2.0)
    assert (edge[0], offset_m[0], velocity[0]) == (1, 6.0, 1.0)
    # At its end there is no way on: there one waits.
    edge, offset_m, velocity = moved(arrays, edge, offset_m, velocity, 60.0)
    assert (edge[0], offset_m[0]) == (1, 10.0)


def test_an_edge_against_its_sign_is_not_taken() -> None:
    # From c at the end of the line the first edge leads towards b: only back to c.
    arrays = GraphArrays.of(line(one_way=True))
    edge, offset_m, velocity = moved(arrays, [1], [3.0], [1.0], 2.0)
    assert (edge[0], offset_m[0], velocity[0]) == (1, 3.0, -1.0)
    ignored = GraphArrays.of(line(one_way=True), one_way_signs=False)
    edge, offset_m, velocity = moved(ignored, [1], [3.0], [1.0], 2.0)
    assert (edge[0], offset_m[0], velocity[0]) == (0, 2.0, -1.0)


def test_parallel_edges_are_two_edges() -> None:
    places = {"a": (0.0, 0.0), "b": (3.0, 0.0)}
    arrays = GraphArrays.of(graph(places, ("a", "b", False), ("a", "b", False)))
    edge, offset_m, velocity = moved(arrays, [0], [2.0], [1.0], 2.0)
    assert (edge[0], offset_m[0], velocity[0]) == (1, 2.0, -1.0)


def test_uniform_places_worked_by_hand() -> None:
    edge, offset_m = GraphArrays.of(line()).uniform_places(np.array([0.0, 2 / 7, 3.5 / 7]))
    assert edge.tolist() == [0, 0, 1]
    np.testing.assert_allclose(offset_m, [0.0, 2.0, 0.5], atol=1e-12)


def test_uniform_places_among_some_edges() -> None:
    arrays = GraphArrays.of(line())
    uniforms = np.array([0.0, 0.5, np.nextafter(1.0, 0.0)])
    edge, offset_m = arrays.uniform_places(uniforms, np.array([True, False]))
    assert edge.tolist() == [0, 0, 0]
    np.testing.assert_allclose(offset_m, [0.0, 1.5, 3.0])
    edge, offset_m = arrays.uniform_places(uniforms, np.array([False, True]))
    assert edge.tolist() == [1, 1, 1]
    np.testing.assert_allclose(offset_m, [0.0, 2.0, 4.0])


def test_a_key_is_drawn_from_the_generator() -> None:
    first, second = (motion_key(np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert first.dtype == np.uint64
    assert np.any(first != motion_key(np.random.default_rng(6)))


def test_bad_input_is_refused() -> None:
    arrays = GraphArrays.of(line())
    for velocity in (np.nan, np.inf):
        with pytest.raises(ValueError, match="not finite"):
            moved(arrays, [0], [1.0], [velocity], 1.0)
    with pytest.raises(ValueError, match="on no edge"):
        moved(arrays, [2], [1.0], [1.0], 1.0)
    with pytest.raises(ValueError, match="not finite"):
        moved(arrays, [0], [1.0], [1.0], -1.0)
    with pytest.raises(ValueError, match="one edge, offset and velocity"):
        moved(arrays, [0], [1.0, 2.0], [1.0], 1.0)
