import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon, affinity, box
from shapely.geometry.base import BaseGeometry

from blesim.errors import UsageError
from blesim.filters.plan_motion import PlanMotion
from blesim.venue.venue import Venue

OBSTACLES = (
    box(2, 2, 22, 3.6),
    box(2, 7.4, 22, 7.401),
    affinity.rotate(box(5, 14, 15, 16), 25.0),
    Polygon([(20, 12), (28, 12), (28, 18), (26, 18), (26, 14), (20, 14)]),
    Polygon(box(10, 20, 18, 28).exterior, [box(12, 22, 16, 26).exterior]),
    box(22, 3.6, 24, 5),
)
L_SHAPE = Polygon([(0, 0), (30, 0), (30, 22), (22, 30), (0, 30)])
AREA = shapely.difference(L_SHAPE, shapely.union_all(OBSTACLES))
H_SHAPE = Polygon(
    [(0, 0), (3, 0), (3, 8), (9, 8), (9, 0), (12, 0), (12, 20), (9, 20), (9, 11), (3, 11), (3, 20),
     (0, 20)]
)  # fmt: skip
Points = np.ndarray


def covers(area: BaseGeometry, start: Points, end: Points) -> Points:
    shapely.prepare(area)
    return np.asarray(shapely.covers(area, shapely.linestrings(np.stack([start, end], axis=1))))


def columns(*points: Points) -> list[Points]:
    return [np.ascontiguousarray(column) for point in points for column in point.T]


@pytest.mark.parametrize("area", [AREA, H_SHAPE], ids=["obstacles", "H"])
@pytest.mark.parametrize("longest_m", [0.8, 5.0, 60.0])
def test_random_steps_are_blocked_where_shapely_says_so(
    area: BaseGeometry, longest_m: float
) -> None:
    rng = np.random.default_rng(31)
    west, south, east, north = area.bounds
    start = rng.uniform((west - 1, south - 1), (east + 1, north + 1), (20_000, 2))
    end = start + rng.uniform(-longest_m, longest_m, start.shape)
    ours = PlanMotion.on(area).blocked(*columns(start, end))
    np.testing.assert_array_equal(ours, ~covers(area, start, end))
    assert 20 < ours.sum() < len(ours) - 20


@pytest.mark.parametrize("area", [AREA, H_SHAPE], ids=["obstacles", "H"])
def test_places_are_enterable_where_shapely_says_so(area: BaseGeometry) -> None:
    rng = np.random.default_rng(32)
    places = rng.uniform(-2, 32, (50_000, 2))
    ours = PlanMotion.on(area).enterable(*columns(places))
    np.testing.assert_array_equal(ours, shapely.covers(area, shapely.points(places)))


def test_steps_between_corners_and_along_walls() -> None:
    # Whole numbers: shapely's predicates are exact, and so many steps touch walls and corners.
    obstacles = shapely.union_all([box(2, 2, 4, 5), box(6, 1, 7, 6), box(4, 8, 9, 9)])
    area = shapely.difference(box(0, 0, 10, 10), obstacles)
    grid = np.stack(np.meshgrid(np.arange(11.0), np.arange(11.0)), axis=-1).reshape(-1, 2)
    start, end = np.repeat(grid, len(grid), axis=0), np.tile(grid, (len(grid), 1))
    ours = PlanMotion.on(area).blocked(*columns(start, end))
    np.testing.assert_array_equal(ours, ~covers(area, start, end))


@given(st.integers(0, 10_000))
def test_a_random_star_shaped_obstacle(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 9))
    reach = rng.uniform(0.5, 4, 9)
    star = shapely.make_valid(
        Polygon(np.column_stack([5 + reach * np.cos(angle), 5 + reach * np.sin(angle)]))
    )
    area = shapely.difference(box(0, 0, 10, 10), star)
    start, end = rng.uniform(0, 10, (2, 300, 2))
    ours = PlanMotion.on(area).blocked(*columns(start, end))
    np.testing.assert_array_equal(ours, ~covers(area, start, end))


def test_swapped_ends_give_the_same_answer() -> None:
    rng = np.random.default_rng(33)
    start, end = rng.uniform(0, 30, (2, 5000, 2))
    motion = PlanMotion.on(AREA)
    forth, back = motion.blocked(*columns(start, end)), motion.blocked(*columns(end, start))
    np.testing.assert_array_equal(forth, back)


def test_a_thin_wall_stops_a_fast_particle() -> None:
    motion = PlanMotion.on(AREA)
    (blocked,) = motion.blocked(*(np.array([v]) for v in (10.0, 6.0, 10.0, 9.0)))
    assert blocked


def test_a_blocked_particle_stops_just_before_the_wall() -> None:
    motion = PlanMotion.on(box(0, 0, 10, 10) - box(4, 2, 5, 8))
    start_x, start_y = np.array([3.0, 3.0, 3.995, 1.0]), np.array([5.0, 1.0, 5.0, 5.0])
    end_x, end_y = np.array([4.5, 6.0, 6.0, 2.0]), np.array([5.0, 1.0, 5.0, 5.5])
    x_m, y_m, blocked = motion.stopped(start_x, start_y, end_x, end_y, margin_m=0.01)
    assert blocked.tolist() == [True, False, True, False]
    np.testing.assert_allclose(x_m, [3.99, 6.0, 3.995, 2.0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(y_m, [5.0, 1.0, 5.0, 5.5], rtol=0, atol=1e-12)


def test_stopped_particles_are_before_the_first_wall_that_shapely_finds() -> None:
    rng = np.random.default_rng(34)
    motion = PlanMotion.on(AREA)
    start = np.column_stack(motion.uniform_places(3000, rng))
    end = start + rng.uniform(-8, 8, start.shape)
    x_m, y_m, blocked = motion.stopped(*columns(start, end), margin_m=0.02)
    lines = shapely.linestrings(np.stack([start, end], axis=1))
    outside = shapely.difference(lines, shapely.buffer(AREA, 1e-9))
    np.testing.assert_array_equal(blocked, ~shapely.is_empty(outside))
    free_m = shapely.distance(shapely.points(start), outside)[blocked]
    walked_m = np.hypot(x_m - start[:, 0], y_m - start[:, 1])[blocked]
    np.testing.assert_allclose(walked_m, np.maximum(free_m - 0.02, 0), rtol=0, atol=1e-6)
    assert motion.enterable(x_m, y_m).all()
    assert not motion.blocked(*columns(start), x_m, y_m).any()


def test_a_particle_that_is_outside_stays() -> None:
    x_m, y_m, blocked = PlanMotion.on(AREA).stopped(
        *(np.array([v]) for v in (10.0, 3.0, 10.0, 5.0))
    )
    assert (x_m[0], y_m[0], blocked[0]) == (10.0, 3.0, True)


def test_standing_particles() -> None:
    motion = PlanMotion.on(AREA)
    x_m, y_m = np.array([1.0, 10.0, 2.0]), np.array([1.0, 3.0, 3.0])
    # On the floor, in a shelf, at its face.
    assert motion.blocked(x_m, y_m, x_m, y_m).tolist() == [False, True, False]
    assert motion.enterable(x_m, y_m).tolist() == [True, False, True]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300, -1e150])
def test_places_that_are_none(bad: float) -> None:
    motion = PlanMotion.on(AREA)
    x_m, other = np.array([1.0]), np.array([bad])
    assert not motion.enterable(other, x_m)[0]
    assert not motion.enterable(x_m, other)[0]
    assert motion.blocked(x_m, x_m, other, x_m)[0]
    assert motion.blocked(x_m, other, x_m, x_m)[0]


def test_the_whole_store(store: Venue) -> None:
    area = store.floor_plan.walkable[0]
    rng = np.random.default_rng(35)
    motion = PlanMotion.on(area)
    start = np.column_stack(motion.uniform_places(5000, rng))
    end = start + rng.normal(0, 1, start.shape)
    ours = motion.blocked(*columns(start, end))
    np.testing.assert_array_equal(ours, ~covers(area, start, end))


def test_two_rooms_without_a_door() -> None:
    motion = PlanMotion.on(shapely.union_all([box(0, 0, 4, 4), box(5, 0, 9, 4)]))
    steps = np.array([[1.0, 1, 3, 3], [3, 2, 6, 2], [6, 1, 8, 3]])
    assert motion.blocked(*columns(steps)).tolist() == [False, True, False]


def test_uniform_places_are_enterable_and_uniform() -> None:
    """The share of the left half of an L within 5 standard errors (false alarms: 6e-7)."""
    area = box(0, 0, 10, 10) - box(5, 5, 10, 10)
    x_m, y_m = PlanMotion.on(area).uniform_places(9000, np.random.default_rng(36))
    assert shapely.contains_xy(area, x_m, y_m).all()
    assert abs(np.mean(x_m < 5) - 2 / 3) < 5 * np.sqrt(2 / 9 / 9000)


def test_bad_input_is_refused() -> None:
    with pytest.raises(UsageError, match="no valid polygon"):
        PlanMotion.on(Polygon())
    with pytest.raises(UsageError, match="no valid polygon"):
        PlanMotion.on(Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]))
    motion = PlanMotion.on(AREA)
    with pytest.raises(ValueError, match="of one length"):
        motion.enterable(np.ones(2), np.ones(3))
    with pytest.raises(ValueError, match="of one length"):
        motion.blocked(np.ones(2), np.ones(2), np.ones(2), np.ones(3))
