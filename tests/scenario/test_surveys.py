"""Surveys that end, and lead around what stands between their spots."""

import numpy as np
import pytest
import shapely

from blesim.scenario.build import Stage, set_stage
from blesim.scenario.reading import read_scenario
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle
from blesim.venue.geojson import to_geojson
from blesim.venue.venue import Venue
from blesim.walkers.survey import survey_walk

# On both sides of the shelf between the aisles F and E, whose middle is at 5.4 m.
ACROSS = "spots: [{x_m: 10, y_m: 2.7}, {x_m: 10, y_m: 8.1}, {x_m: 12, y_m: 8.1}]"


def survey(told: str) -> str:
    return f"surveys:\n  - name: s\n    phone: phone\n    {told}\n"


def walked_line(stage: Stage) -> shapely.LineString:
    trajectory, _ = survey_walk(stage.surveys[0])
    return shapely.LineString(np.stack([trajectory.x_m, trajectory.y_m], axis=1))


def free_of(stage: Stage) -> shapely.Geometry:
    return shapely.buffer(stage.built.floor_plan.walkable[0], 1e-5)


@pytest.mark.parametrize("told", [ACROSS, "grid_m: 1.5"])
def test_nobody_walks_through_a_shelf(written, told):
    stage = set_stage(read_scenario(written(survey(told))), 1)
    assert shapely.covers(free_of(stage), walked_line(stage))
    assert not shapely.covers(free_of(stage), shapely.LineString(stage.surveys[0].spots_m))


def test_the_way_around_a_shelf_is_along_the_aisles(written):
    stage = set_stage(read_scenario(written(survey(ACROSS))), 1)
    (told,) = stage.surveys
    assert list(told.corners_m) == [1]
    edge, offset_m, _ = stage.graph.nearest([10, 10], [2.7, 8.1], [0, 0])
    along_m = stage.graph.distance_m(edge[:1], offset_m[:1], edge[1:], offset_m[1:])[0]
    aside_m = sum(stage.graph.nearest([10, 10], [2.7, 8.1], [0, 0])[2])
    assert walked_line(stage).length == pytest.approx(along_m + aside_m + 2.0, abs=1e-4)
    # The way is longer, the stands are as long as they were.
    trajectory, marks = survey_walk(told)
    assert np.diff(marks.time_us)[::2].tolist() == [10_000_000] * 3
    assert marks.x_m.tolist() == [10, 10, 10, 10, 12, 12]
    assert trajectory.speed_m_s.max() == pytest.approx(1.0, abs=1e-3)


def room(wall: shapely.Polygon) -> Venue:
    """A hall of 10 m by 6 m without aisles, and a wall in it."""
    return Venue(
        name="hall",
        floor_plan=FloorPlan(
            levels=(Level(level=0, bounds=shapely.box(0, 0, 10, 6)),),
            obstacles=(Obstacle(id="wall", outline=wall, material="heavy-wall"),),
        ),
        beacons=(),
    )


def in_room(tmp_path, wall: shapely.Polygon, told: str):
    (tmp_path / "map.geojson").write_text(to_geojson(room(wall)), encoding="utf-8")
    path = tmp_path / "scenario.yaml"
    head = "title: t\nvenue: {map: map.geojson}\nphones: {phone: {}}\n"
    path.write_text(head + survey(told), encoding="utf-8")
    return path


def test_without_aisles_it_is_the_shortest_around_the_corners(tmp_path):
    path = in_room(
        tmp_path, shapely.box(5, 0, 5.4, 4), "spots: [{x_m: 2, y_m: 1}, {x_m: 8.4, y_m: 1}]"
    )
    stage = set_stage(read_scenario(path), 1)
    # Two corners of the wall, passed at 0.2 m.
    assert stage.surveys[0].corners_m[1] == pytest.approx(np.array([[4.8, 4.2], [5.6, 4.2]]))
    assert shapely.covers(free_of(stage), walked_line(stage))


def test_a_gap_too_narrow_to_keep_clear_is_still_a_gap(tmp_path):
    path = in_room(
        tmp_path, shapely.box(5, 0, 5.4, 5.7), "spots: [{x_m: 2, y_m: 1}, {x_m: 8.4, y_m: 1}]"
    )
    stage = set_stage(read_scenario(path), 1)
    assert shapely.covers(free_of(stage), walked_line(stage))


def test_where_no_way_leads_the_spot_is_refused_with_its_line(tmp_path, faults):
    wall = shapely.box(5, 0, 5.4, 6)
    told = "spots:\n      - {x_m: 2, y_m: 1}\n      - {x_m: 8.4, y_m: 1}"
    (line,) = faults(in_room(tmp_path, wall, told))
    assert line.startswith("scenario.yaml:9: surveys.0.spots.1: no way leads from (2, 1) to (8.4,")
    (line,) = faults(in_room(tmp_path, wall, "grid_m: 1"))
    assert line.startswith("scenario.yaml:7: surveys.0.grid_m: no way leads from")


def test_the_same_spot_twice_needs_no_way(tmp_path):
    told = "spots: [{x_m: 2, y_m: 1}, {x_m: 2, y_m: 1}]"
    stage = set_stage(read_scenario(in_room(tmp_path, shapely.box(5, 0, 5.4, 6), told)), 1)
    assert stage.surveys[0].corners_m == {}


@pytest.mark.parametrize(
    ("told", "says"),
    [
        (
            "grid_m: 0.1\n    area: {west_m: -1e5, south_m: 0, east_m: 1e5, north_m: 1e5}",
            "scenario.yaml:5: surveys.0.grid_m: a grid of 0.1 m has 2000000000000 crossings",
        ),
        (
            "grid_m: 0.5\n    directions_deg: [" + "0, " * 59 + "0]",
            "scenario.yaml:3: surveys.0: 2408 spots with 60 directions each are 144480 stands",
        ),
        (
            "spots: [{x_m: 10, y_m: 2.7}]\n    stand_s: 86400\n    directions_deg: ["
            + "0, " * 31
            + "0]",
            "scenario.yaml:3: surveys.0: may go on until 27648",
        ),
        (
            "grid_m: 0.5\n    speed_m_s: 0.05\n    stand_s: 1200",
            "scenario.yaml:3: surveys.0: may go on until",
        ),
    ],
)
def test_a_survey_without_end_is_refused_with_its_line(written, faults, told, says):
    (line,) = faults(written(survey(told)))
    assert line.startswith(says)
