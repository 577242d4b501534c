"""Surveys of a part of the floor, and testers who press at the stops of their route."""

import numpy as np
import pytest

from blesim.scenario.build import set_stage
from blesim.scenario.reading import read_scenario
from blesim.simulate import Simulation

SURVEY = "surveys:\n  - {{name: s, phone: phone, grid_m: 0.5, area: {area}}}\n"
BOX = "{west_m: 10, south_m: 1.5, east_m: 12, north_m: 3}"


def test_a_grid_covers_its_area_alone(written):
    stage = set_stage(read_scenario(written(SURVEY.format(area=BOX))), 1)
    spots_m = stage.surveys[0].spots_m
    assert sorted(set(spots_m[:, 0])) == [10.25, 10.75, 11.25, 11.75]
    assert sorted(set(spots_m[:, 1])) == [1.75, 2.25, 2.75]
    assert len(spots_m) == 12


def test_shelves_in_the_area_are_left_out(written):
    # The shelf between the aisles F and E reaches from 4.6 to 6.2 m.
    area = "{west_m: 10, south_m: 4, east_m: 11, north_m: 7}"
    stage = set_stage(read_scenario(written(SURVEY.format(area=area))), 1)
    assert sorted(set(stage.surveys[0].spots_m[:, 1])) == [4.25, 6.75]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "surveys:\n  - name: s\n    phone: phone\n    grid_m: 1\n"
            "    area: {west_m: 3, south_m: 1, east_m: 3, north_m: 2}\n",
            "surveys.0.area: west_m must be less than east_m, and south_m less than north_m",
        ),
        (
            "surveys:\n  - name: s\n    phone: phone\n    spots: [{x_m: 1, y_m: 1}]\n"
            f"    area: {BOX}\n",
            "surveys.0: 'area' limits a grid; give 'grid_m' too, or leave it out",
        ),
        (
            SURVEY.format(area="{west_m: 900, south_m: 0, east_m: 910, north_m: 9}"),
            "surveys.0: no crossing of a grid of 0.5 m is walkable; make it narrower",
        ),
    ],
)
def test_bad_areas_are_refused_with_their_line(written, faults, text, says):
    (line,) = faults(written(text))
    assert line.endswith(says)
    assert line.startswith("scenario.yaml:")


def marked_m(written, marks: str) -> list[float]:
    path = written("")
    walk = f"{{name: run, phone: phone, marks: {marks}, route: [{{x_m: 10, y_m: 2.7}}, F4]}}"
    text = path.read_text(encoding="utf-8")
    path.write_text(text[: text.index("walks:")] + f"walks: [{walk}]\n", encoding="utf-8")
    recording, _ = Simulation.run(read_scenario(path), 1).recording()
    return recording.walks[0].observations.marks.x_m.tolist()


def test_a_tester_may_press_at_the_stops_of_the_route_too(written):
    ends_m = np.arange(11.9, 28.2, 2.7)
    assert marked_m(written, "way-points") == pytest.approx(ends_m)
    assert marked_m(written, "stops") == pytest.approx([10.0, *ends_m])
    assert marked_m(written, "none") == []
