import numpy as np
import pytest
import shapely
from numpy.typing import NDArray
from shapely import Polygon, affinity, box

from blesim.venue.floor_plan import Obstacle
from blesim.venue.line_of_sight import LineOfSight
from blesim.venue.materials import MATERIALS

Points = NDArray[np.float64]

UNIT = box(0, 0, 1, 1)
L_SHAPE = Polygon([(0, 0), (6, 0), (6, 2), (2, 2), (2, 5), (0, 5)])
_SPIKE_RAD = np.arange(14) * np.pi / 7
_SPIKE_M = np.tile([4.0, 1.5], 7)
STAR = Polygon(np.column_stack([_SPIKE_M * np.cos(_SPIKE_RAD), _SPIKE_M * np.sin(_SPIKE_RAD)]))
FRAME = Polygon(
    box(0, 0, 8, 6).exterior, [box(1, 1, 4, 5).exterior, Polygon([(5, 1), (7, 3), (5, 5)]).exterior]
)
OUTLINES = (
    box(2, 2, 12, 3.6),
    affinity.rotate(box(15, 5, 25, 6.6), 31.0),
    affinity.translate(L_SHAPE, 4, 10),
    affinity.rotate(affinity.translate(L_SHAPE, 25, 20), 200.0),
    affinity.translate(STAR, 18, 18),
    affinity.translate(FRAME, 28, 4),
    affinity.rotate(affinity.translate(FRAME, 5, 25), -17.0),
    # Touching along a face, and in a corner.
    box(30, 14, 34, 16),
    box(34, 14, 38, 16),
    box(38, 16, 39, 20),
    shapely.Point(14, 30).buffer(2.5),
)
BOUNDS = (0.0, 0.0, 40.0, 36.0)


def obstacle(number: int, outline: Polygon, height_m: float = float("inf")) -> Obstacle:
    return Obstacle(id=f"s{number}", outline=outline, material="gondola-dry", height_m=height_m)


def sight(*outlines: Polygon, height_m: float = float("inf")) -> LineOfSight:
    return LineOfSight.through([obstacle(i, o, height_m) for i, o in enumerate(outlines)])


def random_ends(count: int, seed: int) -> tuple[Points, Points]:
    rng = np.random.default_rng(seed)
    west, south, east, north = BOUNDS
    ends = rng.uniform((west, south, 0.0), (east, north, 3.0), (2, count, 3))
    return ends[0], ends[1]


def link(*ends: float) -> tuple[Points, Points]:
    """Ends of one link, given as x, y, z, x, y, z."""
    return np.array([ends[:3]]), np.array([ends[3:]])


def by_shapely(outlines: tuple[Polygon, ...], start: Points, end: Points) -> Points:
    lines = shapely.linestrings(np.stack([start[:, :2], end[:, :2]], axis=1))
    flat = shapely.length(lines)
    inside = np.zeros((len(start), len(outlines)))
    for column, outline in enumerate(outlines):
        shapely.prepare(outline)
        hit = np.flatnonzero(shapely.intersects(outline, lines))
        inside[hit, column] = shapely.length(shapely.intersection(lines[hit], outline))
    return inside * (np.linalg.norm(end - start, axis=1) / flat)[:, None]


def test_100_000_random_links_agree_with_shapely() -> None:
    start, end = random_ends(100_000, seed=1)
    expected = by_shapely(OUTLINES, start, end)
    # Stretches shorter than a touch count for nothing.
    expected[expected <= 1e-6] = 0.0
    lengths = sight(*OUTLINES).lengths_m(start, end)
    np.testing.assert_allclose(lengths, expected, rtol=0, atol=1e-9)
    assert np.all((lengths > 0).any(axis=0)), "every obstacle is hit by some link"


def test_crossings_agree_with_shapely_on_concave_and_holed_outlines() -> None:
    start, end = random_ends(2_000, seed=2)
    lines = shapely.linestrings(np.stack([start[:, :2], end[:, :2]], axis=1))
    crossing_db = MATERIALS["gondola-dry"].crossing_db
    for outline in OUTLINES:
        pieces = shapely.get_num_geometries(shapely.intersection(lines, outline))
        pieces[~shapely.intersects(lines, outline)] = 0
        np.testing.assert_allclose(sight(outline).loss_db(start, end), pieces * crossing_db)


@pytest.mark.parametrize(
    ("ends", "length_m"),
    [
        # Flat, through the box; then between heights that never matter.
        ((-1, 0.5, 1, 2, 0.5, 1), 1.0),
        ((-1, 0.5, 0, 3, 0.5, 3), 1.25),
        ((0.25, 0.5, 1, 0.75, 0.5, 1), 0.5),
        ((0.25, 0.5, 1, 5, 0.5, 1), 0.75),
        ((-1, -1, 1, 2, 2, 1), np.sqrt(2.0)),
        ((-1, 1.5, 1, 2, 1.5, 1), 0.0),
        # From a face outwards, inwards and along.
        ((1, 0.5, 1, 4, 0.5, 1), 0.0),
        ((1, 0.5, 1, -4, 0.5, 1), 1.0),
        ((1, 0.5, 1, 1, 7, 1), 0.0),
        # A touched corner, a zero-length link, a vertical one.
        ((-1, 1, 1, 1, 3, 1), 0.0),
        ((-1, 2, 1, 2, -1, 1), np.sqrt(2.0)),
        ((0, 1, 1, -1, 2, 1), 0.0),
        ((0.5, 0.5, 1, 0.5, 0.5, 1), 0.0),
        ((0.5, 0.5, 0, 0.5, 0.5, 2), 0.0),
    ],
)
def test_hand_worked_lengths(ends: tuple[float, ...], length_m: float) -> None:
    start, end = link(*ends)
    for a, b in ((start, end), (end, start)):
        assert sight(UNIT).lengths_m(a, b)[0, 0] == pytest.approx(length_m, abs=1e-9)


@pytest.mark.parametrize("angle_deg", [0.0, 90.0, 180.0, 270.0, 17.3, 123.4])
@pytest.mark.parametrize("face", [(0, 0, 1, 0), (1, 0, 1, 1), (1, 1, 0, 1), (0, 1, 0, 0)])
def test_a_link_along_a_face_is_outside_from_either_end(
    face: tuple[float, ...], angle_deg: float
) -> None:
    x0, y0, x1, y1 = face
    line = shapely.LineString(
        [(x0 - 2 * (x1 - x0), y0 - 2 * (y1 - y0)), (x1 + 3 * (x1 - x0), y1 + 3 * (y1 - y0))]
    )
    about = (0.3, -7.0)
    turned = affinity.rotate(UNIT, angle_deg, origin=about)
    ends = shapely.get_coordinates(affinity.rotate(line, angle_deg, origin=about))
    start, end = (np.array([[x, y, 1.0]]) for x, y in ends)
    assert sight(turned).lengths_m(start, end)[0, 0] == 0.0
    assert sight(turned).lengths_m(end, start)[0, 0] == 0.0


def test_along_a_face_of_an_l_and_on_through_its_inside() -> None:
    # y = 2 is the upper face of the foot for x in 2..6 and the inside of the leg for x in 0..2.
    start, end = link(-1, 2, 1, 9, 2, 1)
    for a, b in ((start, end), (end, start)):
        assert sight(L_SHAPE).lengths_m(a, b)[0, 0] == pytest.approx(2.0)
        crossing_db = MATERIALS["gondola-dry"].crossing_db
        assert sight(L_SHAPE).loss_db(a, b)[0] == pytest.approx(crossing_db)


def test_between_two_shelves_that_touch() -> None:
    start, end = link(-1, 1, 1, 2, 1, 1)
    both = sight(box(0, 0, 1, 1), box(0, 1, 1, 2))
    np.testing.assert_array_equal(both.lengths_m(start, end), [[0.0, 0.0]])
    start, end = link(0.5, -1, 1, 0.5, 3, 1)
    np.testing.assert_allclose(both.lengths_m(start, end), [[1.0, 1.0]])
    assert both.loss_db(start, end)[0] == 2 * MATERIALS["gondola-dry"].crossing_db


@pytest.mark.parametrize(
    ("start_z", "end_z", "top_m", "share"),
    [
        (2.5, 2.5, 1.8, 0.0),
        (1.9, 1.9, 1.9, 1.0),
        # From 1 m to 3 m over x = -1..3: below 1.8 m until x = 0.6, that is 60 % of the box.
        (1.0, 3.0, 1.8, 0.6),
        # From 1 m to 4.2 m: at 1.8 m when x = 0. Down the same slope: not before x = 2.
        (1.0, 4.2, 1.8, 0.0),
        (4.2, 1.0, 1.8, 0.0),
        (1.0, 2.6, 1.8, 1.0),
        (1.0, 2.6, float("inf"), 1.0),
    ],
)
def test_links_over_and_under_the_top(
    start_z: float, end_z: float, top_m: float, share: float
) -> None:
    start, end = link(-1, 0.5, start_z, 3, 0.5, end_z)
    slope = np.hypot(4.0, end_z - start_z) / 4.0
    low = sight(UNIT, height_m=top_m)
    assert low.lengths_m(start, end)[0, 0] == pytest.approx(share * slope, abs=1e-9)
    assert low.lengths_m(end, start)[0, 0] == pytest.approx(share * slope, abs=1e-9)


def test_low_shelves_agree_with_shapely_on_the_clipped_link() -> None:
    top_m = 1.8
    start, end = random_ends(5_000, seed=3)
    share = (top_m - start[:, 2]) / (end[:, 2] - start[:, 2])
    level_with_top = start + np.clip(share, 0.0, 1.0)[:, None] * (end - start)
    below_start = np.where((start[:, 2] <= top_m)[:, None], start, level_with_top)
    below_end = np.where((end[:, 2] <= top_m)[:, None], end, level_with_top)
    kept = (start[:, 2] <= top_m) | (end[:, 2] <= top_m)
    expected = by_shapely(OUTLINES, below_start[kept], below_end[kept])
    expected[expected <= 1e-6] = 0.0
    lengths = sight(*OUTLINES, height_m=top_m).lengths_m(start, end)
    np.testing.assert_allclose(lengths[kept], expected, rtol=0, atol=1e-9)
    assert not lengths[~kept].any()


def test_loss_is_the_sum_over_materials() -> None:
    stock = [
        Obstacle(id="wall", outline=box(1, 0, 1.2, 9), material="concrete-10cm"),
        Obstacle(id="low", outline=box(2, 0, 3, 9), material="bookcase", height_m=1.5),
        Obstacle(id="shelf", outline=box(4, 0, 5, 9), material="gondola-liquid"),
        Obstacle(id="aside", outline=box(4, 20, 5, 29), material="heavy-wall"),
    ]
    start, end = link(0, 5, 2, 6, 5, 2)
    assert LineOfSight.through(stock).loss_db(start, end)[0] == pytest.approx(8.1 + 9.0)
    start, end = link(0, 5, 1, 6, 5, 1)
    assert LineOfSight.through(stock).loss_db(start, end)[0] == pytest.approx(8.1 + 1.45 + 9.0)


def test_loss_of_each_metre_is_added(monkeypatch: pytest.MonkeyPatch) -> None:
    thick = MATERIALS["bookcase"].model_copy(update={"metre_db": 2.5})
    monkeypatch.setattr("blesim.venue.floor_plan.MATERIALS", {**MATERIALS, "thick": thick})
    stock = LineOfSight.through([Obstacle(id="s", outline=box(0, 0, 4, 1), material="thick")])
    start, end = link(-1, 0.5, 1, 3, 0.5, 1)
    assert stock.loss_db(start, end)[0] == pytest.approx(1.45 + 3 * 2.5)


def test_without_obstacles_and_without_links() -> None:
    start, end = random_ends(5, seed=4)
    empty = LineOfSight.through([])
    assert empty.lengths_m(start, end).shape == (5, 0)
    np.testing.assert_array_equal(empty.loss_db(start, end), np.zeros(5))
    none = np.empty((0, 3))
    assert sight(UNIT).lengths_m(none, none).shape == (0, 1)
    assert sight(UNIT).loss_db(none, none).shape == (0,)


def test_links_of_a_wrong_shape_are_refused() -> None:
    with pytest.raises(ValueError, match=r"two \(n, 3\) arrays"):
        sight(UNIT).loss_db(np.zeros((4, 2)), np.zeros((4, 2)))
    with pytest.raises(ValueError, match=r"two \(n, 3\) arrays"):
        sight(UNIT).lengths_m(np.zeros((4, 3)), np.zeros((1, 3)))
