"""Laws of every site: what people walk on connects, beacons hang on walls, maps say the same."""

from pathlib import Path

import networkx as nx
import numpy as np
import pytest
import shapely

from blesim.scenario.venue_built import LAYOUTS
from blesim.venue.geojson import from_geojson, to_geojson
from blesim.venue.venue import Venue

SCENARIOS = Path(__file__).resolve().parents[3] / "scenarios"
SITES = [name for name in LAYOUTS if not name.startswith("wholesale")]
# Maps beside the scenarios; the corridor's other numbers of beacons are layouts only.
MAPS = ["room-two-pairs", "campus-corridor", "office-dense", "office-sparse", "h-floor"]


@pytest.fixture(params=SITES)
def site(request) -> Venue:
    return LAYOUTS[request.param]()


def test_everything_walkable_by_the_graph_connects(site):
    assert nx.is_connected(nx.Graph(site.graph.network))


def test_beacons_hang_on_walls_or_lie_under_the_open(site):
    free = site.floor_plan.walkable[0]
    for beacon in site.beacons:
        point = shapely.Point(beacon.x_m, beacon.y_m)
        aside_m = shapely.distance(free.boundary, point)
        on_wall = aside_m < 1e-5
        on_floor_or_ceiling = beacon.z_m == 0.0 or beacon.z_m >= 2.5
        assert on_wall or (on_floor_or_ceiling and shapely.contains(free, point)), beacon.id


def test_obstacles_do_not_overlap(site):
    outlines = [obstacle.outline for obstacle in site.floor_plan.obstacles]
    overlap_m2 = sum(each.area for each in outlines) - shapely.union_all(outlines).area
    assert abs(overlap_m2) < 0.1


@pytest.mark.parametrize("name", MAPS)
def test_a_map_is_what_its_layout_builds(name):
    path = SCENARIOS / f"{name}.geojson"
    drawn, built = from_geojson(path.read_text(encoding="utf-8"), path.name), LAYOUTS[name]()
    assert drawn.name == built.name
    assert drawn.beacons == built.beacons
    assert drawn.graph == built.graph
    for a, b in zip(drawn.floor_plan.obstacles, built.floor_plan.obstacles, strict=True):
        assert (a.id, a.material, a.height_m) == (b.id, b.material, b.height_m)
        assert shapely.symmetric_difference(a.outline, b.outline).area < 1e-3
    assert to_geojson(drawn) == path.read_text(encoding="utf-8")


def test_no_two_beacons_are_at_the_same_place(site):
    apart_m = np.linalg.norm(site.beacon_xyz_m[:, None] - site.beacon_xyz_m[None], axis=2)
    np.fill_diagonal(apart_m, np.inf)
    assert apart_m.min() > 1.0
