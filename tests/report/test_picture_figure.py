"""Pictures of the reruns: what tells ours from published numbers, and places without numbers."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from blesim.report.picture_figure import draw
from blesim.reruns.base import Curve, Picture


def picture(kind, **more):
    x = np.array([1.0, 2.0, 4.0])
    curves = tuple(
        Curve(label=label, x=x, y=x + number, published=label.endswith("published"))
        for number, label in enumerate(
            ("far, simulated", "far, published", "near, simulated", "near, published")
        )
    )
    named = {"title": "Errors", "x_label": "method", "y_label": "error [m]", "name": "errors"}
    return Picture(kind=kind, curves=curves, **named, **more)


def test_published_lines_are_dashed_in_the_colour_of_ours():
    lines = draw(picture("line")).axes[0].get_lines()
    assert [line.get_linestyle() for line in lines] == ["-", "--", "-", "--"]
    colours = [line.get_color() for line in lines]
    assert colours[0] == colours[1] != colours[2] == colours[3]


def test_published_bars_are_empty_and_stand_beside_ours():
    axes = draw(picture("bars", x_names=("A", "B", "C"))).axes[0]
    ours, theirs = axes.containers[0][0], axes.containers[1][0]
    assert theirs.get_facecolor()[3] == 0.0
    assert to_rgba(theirs.get_edgecolor()) == to_rgba(ours.get_facecolor())
    assert theirs.get_x() == pytest.approx(ours.get_x() + ours.get_width())
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["A", "B", "C"]
    assert axes.get_xticks().tolist() == [1.0, 2.0, 4.0]


def test_a_map_is_as_wide_and_high_as_what_it_shows():
    x = np.array([0.0, 80.0])
    flat = Picture(
        name="way",
        title="A way",
        x_label="x [m]",
        y_label="y [m]",
        kind="map",
        curves=(Curve(label="walked", x=x, y=x / 10.0),),
    )
    width_in, height_in = draw(flat).get_size_inches()
    assert width_in > 3 * height_in
