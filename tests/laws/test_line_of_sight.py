"""What lengths inside obstacles keep to, whatever the plan."""

from collections.abc import Callable

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray
from shapely import Polygon, affinity, box

from blesim.venue.floor_plan import Obstacle
from blesim.venue.line_of_sight import LineOfSight

Points = NDArray[np.float64]

OUTLINES = (
    box(2, 2, 22, 3.6),
    box(2, 7.4, 22, 9.0),
    affinity.rotate(box(5, 14, 15, 16), 25.0),
    Polygon([(20, 12), (28, 12), (28, 18), (26, 18), (26, 14), (20, 14)]),
    Polygon(box(10, 20, 18, 28).exterior, [box(12, 22, 16, 26).exterior]),
)
HEIGHT_M = 2.0


def ends() -> tuple[Points, Points]:
    """Random links, a tenth of them with both ends on corners of outlines."""
    rng = np.random.default_rng(11)
    both = rng.uniform((0, 0, 0), (30, 30, 4), (2, 5_000, 3))
    corners = shapely.get_coordinates(OUTLINES)
    both[:, :500, :2] = corners[rng.integers(0, len(corners), (2, 500))]
    return both[0], both[1]


def lengths(outlines: tuple[Polygon, ...], start: Points, end: Points) -> Points:
    shelves = [
        Obstacle(id=str(i), outline=outline, material="gondola-dry", height_m=HEIGHT_M)
        for i, outline in enumerate(outlines)
    ]
    return LineOfSight.through(shelves).lengths_m(start, end)


def shifted(x_m: Points, y_m: Points) -> tuple[Points, Points]:
    return x_m + 1234.5, y_m - 777.25


def mirrored(x_m: Points, y_m: Points) -> tuple[Points, Points]:
    return -x_m, y_m


def turned(x_m: Points, y_m: Points) -> tuple[Points, Points]:
    return -y_m, x_m


def tilted(x_m: Points, y_m: Points) -> tuple[Points, Points]:
    return 0.6 * x_m - 0.8 * y_m, 0.8 * x_m + 0.6 * y_m


@pytest.mark.parametrize("move", [shifted, mirrored, turned, tilted])
def test_a_moved_plan_gives_the_same_lengths(
    move: Callable[[Points, Points], tuple[Points, Points]],
) -> None:
    def moved(points: Points) -> Points:
        return np.column_stack([*move(points[:, 0], points[:, 1]), points[:, 2]])

    outlines = tuple(
        shapely.transform(outline, lambda xy: np.column_stack(move(xy[:, 0], xy[:, 1])))
        for outline in OUTLINES
    )
    start, end = ends()
    there = lengths(outlines, moved(start), moved(end))
    np.testing.assert_allclose(there, lengths(OUTLINES, start, end), rtol=0, atol=1e-8)


def test_the_ends_of_a_link_may_be_swapped() -> None:
    start, end = ends()
    np.testing.assert_allclose(
        lengths(OUTLINES, end, start), lengths(OUTLINES, start, end), rtol=0, atol=1e-9
    )


def test_the_order_of_the_corners_does_not_matter() -> None:
    start, end = ends()
    backwards = tuple(shapely.reverse(outline) for outline in OUTLINES)
    np.testing.assert_allclose(
        lengths(backwards, start, end), lengths(OUTLINES, start, end), rtol=0, atol=1e-9
    )


def test_a_link_cut_in_two_adds_up() -> None:
    start, end = ends()
    middle = start + 0.37 * (end - start)
    halves = lengths(OUTLINES, start, middle) + lengths(OUTLINES, middle, end)
    # A stretch below the touch limit may vanish on either side of the cut.
    np.testing.assert_allclose(halves, lengths(OUTLINES, start, end), rtol=0, atol=2e-6)


def test_no_more_lies_inside_than_the_link_is_long() -> None:
    start, end = ends()
    inside = lengths(OUTLINES, start, end)
    whole = np.linalg.norm(end - start, axis=1)
    assert np.all(inside >= 0.0)
    assert np.all(inside.sum(axis=1) <= whole * (1 + 1e-12))
