from dataclasses import replace
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest
import shapely
from matplotlib.colors import to_rgba

from blesim.columns import NO_EDGE
from blesim.metrics.presence import presence_h
from blesim.recording import Crowd, Person, Role
from blesim.report.day_figure import draw_day, draw_walks
from blesim.report.figure_file import save
from blesim.tables import Trajectory

S = 1_000_000
HOUR = 3600 * S


def along(venue, edge, since_us, until_us):
    """A walk along an edge, from its first node to its second."""
    length_m = float(venue.graph.length_m[edge])
    ends = venue.graph.xy_m([edge, edge], [0.0, length_m])
    rate = length_m / ((until_us - since_us) / S)
    return Trajectory(
        time_us=[since_us, until_us],
        x_m=ends[:, 0],
        y_m=ends[:, 1],
        level=[0, 0],
        heading_rad=[0.0, 0.0],
        speed_m_s=[rate, 0.0],
        edge=[edge, edge],
        offset_m=[0.0, length_m],
        edge_speed_m_s=[rate, 0.0],
        state=[1, 0],
    )


@pytest.fixture(scope="module")
def crowd(section):
    stays = [
        (Role.SHOPPER, 1, 0, 2 * HOUR),
        (Role.SHOPPER, 1, HOUR, 4 * HOUR),
        (Role.SHOPPER, 5, 2 * HOUR, 3 * HOUR),
        (Role.STAFF, 9, -HOUR, 5 * HOUR),
    ]
    people = [
        Person(name=str(number), role=role, trajectory=along(section, edge, came, left))
        for number, (role, edge, came, left) in enumerate(stays)
    ]
    return Crowd(people=tuple(people))


def test_the_day_has_titles_units_and_roles(section, crowd):
    figure = draw_day(section, crowd)
    chart, plan, bar = figure.axes
    assert figure.texts[0].get_text() == "wholesale section"
    assert chart.get_xlabel() == "time since opening [h]"
    assert chart.get_ylabel() == "people in the venue"
    assert chart.get_title(loc="left") == "at most 3 people at once"
    labels = {text.get_text() for text in chart.get_legend().get_texts()}
    assert labels == {"shoppers (3)", "staff (1)"}
    assert chart.get_xlim() == pytest.approx((-1.0, 5.0), abs=0.02)
    assert plan.get_xlabel() == "x [m]"
    assert plan.get_ylabel() == "y [m]"
    assert bar.get_ylabel() == "presence [person-hours]"


def test_the_areas_of_the_chart_stand_on_each_other(section, crowd):
    chart = draw_day(section, crowd).axes[0]
    tops = [area.get_paths()[0].vertices[:, 1].max() for area in chart.collections]
    # Staff at the bottom, one all the time; two shoppers on them at the most.
    assert tops == [1, 3]


def test_each_section_is_a_strip_on_the_floor_in_the_colour_of_its_presence(section, crowd):
    figure = draw_day(section, crowd)
    (strips,) = figure.axes[1].collections
    paths = [shapely.Polygon(path.vertices[:4]) for path in strips.get_paths()]
    assert len(paths) == len(section.sections)
    floor = section.floor_plan.walkable[0]
    for path, each in zip(paths, section.sections, strict=True):
        assert shapely.covers(floor, path)
        middle = shapely.Point(np.mean([each.start_m, each.end_m], axis=0))
        assert shapely.distance(path.centroid, middle) < 1e-6
        assert path.area > 2.7
    spent_h = presence_h(crowd, section)
    darkness = 3 - strips.get_facecolor()[:, :3].sum(axis=1)
    levels = np.unique(spent_h.round(6))
    assert len(levels) > 2
    shades = [darkness[spent_h.round(6) == level] for level in levels]
    assert all(lighter.max() < darker.min() for lighter, darker in pairwise(shades))


def test_little_presence_is_told_in_minutes(section):
    one = Person(name="a", role=Role.SHOPPER, trajectory=along(section, 1, 0, 60 * S))
    assert draw_day(section, Crowd(people=(one,))).axes[2].get_ylabel() == (
        "presence [person-minutes]"
    )


def test_a_day_on_which_nobody_came_is_drawn_empty(section):
    chart = draw_day(section, Crowd()).axes[0]
    assert chart.get_title(loc="left") == "at most 0 people at once"
    assert len(chart.collections) == 0


def test_walks_are_lines_over_their_presence_and_who_stays_is_a_dot(section):
    still = along(section, 1, 0, HOUR).rows(slice(0, 1))
    figure = draw_walks(section, {"a": along(section, 1, 0, HOUR), "b": still})
    plan, _ = figure.axes
    assert plan.get_title(loc="left") == "2 recorded walks and presence by section"
    assert [len(line.get_xdata()) for line in plan.lines] == [2, 1, 1]
    assert [line.get_marker() for line in plan.lines] == ["None", "None", "o"]


def test_without_sections_there_is_no_colour_bar(section, crowd):
    bare = replace(section, sections=())
    assert len(draw_day(bare, crowd).axes) == 2
    (plan,) = draw_walks(bare, {"a": crowd.people[0].trajectory}).axes
    assert plan.get_title(loc="left") == "1 recorded walk"


def test_the_colours_of_the_roles_differ(section, crowd):
    chart = draw_day(section, crowd).axes[0]
    colours = {tuple(area.get_facecolor()[0]) for area in chart.collections}
    assert len(colours) == 2
    assert to_rgba("white") not in colours


def test_any_name_can_be_drawn_and_the_bytes_repeat(section, crowd, tmp_path):
    named = replace(section, name="$\\foo{$ <&> 店 " * 20)
    for name in ("a.svg", "b.svg"):
        save(draw_day(named, crowd), tmp_path / name)
    ElementTree.parse(tmp_path / "a.svg")
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def off_the_aisles(way):
    nowhere = np.full(len(way), np.nan)
    edge = np.full(len(way), NO_EDGE)
    return replace(way, edge=edge, offset_m=nowhere, edge_speed_m_s=nowhere)


def test_presence_is_claimed_of_walks_on_aisles_alone(section):
    walk = along(section, 1, 0, HOUR)
    survey = off_the_aisles(walk)
    plan, _ = draw_walks(section, {"a": walk, "s": survey}).axes
    assert plan.get_title(loc="left") == (
        "2 recorded walks and presence by section of the 1 on aisles"
    )
    (plan,) = draw_walks(section, {"s": survey}).axes
    assert plan.get_title(loc="left") == "1 recorded walk"
    assert len(plan.lines) == 1
    lost = Crowd(people=(Person(name="a", role=Role.SHOPPER, trajectory=survey),))
    _, plan = draw_day(section, lost).axes
    assert plan.get_title(loc="left") == "floor plan"
