import pickle

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from blesim.errors import VenueError
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle

HALL = Level(level=0, bounds=box(0, 0, 20, 10))
BOW_TIE = Polygon([(0, 0), (2, 2), (2, 0), (0, 2)])


def shelf(**changes: object) -> Obstacle:
    values = {"id": "s1", "outline": box(2, 2, 8, 3), "material": "gondola-dry"}
    return Obstacle(**{**values, **changes})  # type: ignore[arg-type]


def test_walkable_is_the_bounds_without_the_obstacles() -> None:
    upper = Level(level=1, bounds=box(0, 0, 5, 5))
    plan = FloorPlan(
        levels=(HALL, upper), obstacles=(shelf(), shelf(id="s2", outline=box(2, 3, 8, 4)))
    )
    assert plan.walkable[0].area == pytest.approx(200.0 - 12.0)
    assert plan.walkable[1].equals(upper.bounds)
    assert not shapely.contains(plan.walkable[0], shapely.Point(4, 3))


def test_loss_is_that_of_the_material() -> None:
    assert shelf(material="concrete-10cm").loss.crossing_db == 8.1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"material": "jelly"}, "obstacle 's1': unknown material 'jelly'; use one of .*bookcase"),
        ({"outline": Polygon()}, "obstacle 's1': the outline encloses no area"),
        ({"outline": Polygon([(0, 0), (1, 1), (2, 2)])}, "'s1': the outline encloses no area"),
        ({"outline": Polygon([(0, 0), (9, 9), (9, 0), (0, 4)])}, "bad outline: Self-intersection"),
        ({"height_m": 0.0}, "obstacle 's1': height_m 0.0 must be positive"),
        ({"height_m": -1.0}, "must be positive"),
        ({"height_m": float("nan")}, "height_m nan must be positive"),
    ],
)
def test_bad_obstacles(changes: dict[str, object], message: str) -> None:
    with pytest.raises(VenueError, match=message):
        shelf(**changes)


def test_an_outline_that_is_nowhere() -> None:
    with np.errstate(invalid="ignore"):
        nowhere = Polygon([(0, 0), (1, float("nan")), (1, 1)])
    with pytest.raises(VenueError, match="obstacle 's1'"), np.errstate(invalid="ignore"):
        shelf(outline=nowhere)


def test_bad_levels() -> None:
    with pytest.raises(VenueError, match="level 3: the outline encloses no area"):
        Level(level=3, bounds=Polygon())
    with pytest.raises(VenueError, match="level 0: the outline encloses no area"):
        Level(level=0, bounds=BOW_TIE)
    with pytest.raises(VenueError, match="level 40000 is not within -50 to 200"):
        Level(level=40_000, bounds=box(0, 0, 1, 1))


@pytest.mark.parametrize(
    ("levels", "obstacles", "message"),
    [
        ((), (), "at least one level"),
        ((HALL, HALL), (), "level '0' is there twice"),
        ((HALL,), (shelf(), shelf()), "obstacle 's1' is there twice"),
        ((HALL,), (shelf(level=2),), "obstacle 's1' is on level 2, but .* has only 0"),
        ((HALL,), (shelf(outline=box(15, 2, 20.01, 3)),), "'s1' reaches out of the bounds"),
        ((HALL,), (shelf(outline=box(30, 2, 31, 3)),), "'s1' reaches out of the bounds of level 0"),
    ],
)
def test_bad_plans(
    levels: tuple[Level, ...], obstacles: tuple[Obstacle, ...], message: str
) -> None:
    with pytest.raises(VenueError, match=message):
        FloorPlan(levels=levels, obstacles=obstacles)


def test_an_obstacle_may_touch_the_bounds() -> None:
    plan = FloorPlan(levels=(HALL,), obstacles=(shelf(outline=box(0, 0, 20, 1)),))
    assert plan.walkable[0].area == pytest.approx(180.0)


def test_a_plan_travels_to_another_process() -> None:
    plan = FloorPlan(levels=(HALL,), obstacles=(shelf(),))
    assert plan.walkable[0].area == pytest.approx(194.0)
    assert pickle.loads(pickle.dumps(plan)) == plan  # noqa: S301
