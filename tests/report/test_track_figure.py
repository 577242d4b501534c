from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from blesim.estimators.base import make_track
from blesim.report.figure_file import save
from blesim.report.track_figure import draw_tracks
from blesim.tables import Trajectory

WEIRD = "$\\foo{$ \x1b[31m\n<&> 店"


def drawn(venue, name):
    walked = Trajectory(
        time_us=[0, 9],
        x_m=[4.0, 10.0],
        y_m=[13.5, 13.5],
        level=[0, 0],
        heading_rad=[0.0, 0.0],
        speed_m_s=[1.0, 0.0],
        edge=[-1, -1],
        offset_m=[np.nan, np.nan],
        edge_speed_m_s=[np.nan, np.nan],
        state=[1, 0],
    )
    track = make_track(time_us=[3], x_m=5.0, y_m=13.0, variance_x_m2=1, variance_y_m2=1)
    beacons = (venue.beacons[0].model_copy(update={"id": f"{name}1"}), *venue.beacons[1:])
    named = replace(venue.with_beacons(beacons), name=name)
    return draw_tracks(named, name, walked, {name: track}, {name: np.array([1.0])})


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_any_name_can_be_drawn(section, tmp_path, ending):
    path = tmp_path / f"a.{ending}"
    save(drawn(section, WEIRD), path)
    if ending == "svg":
        ElementTree.parse(path)
