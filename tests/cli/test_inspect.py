"""What `inspect` tells and draws of people, of walks alone, and of nobody."""

import json
import subprocess
import sys
from types import MappingProxyType

import numpy as np
import pytest

from blesim.dataset.writer import write_recording
from blesim.estimators.practice import practice_recording
from blesim.recording import Crowd, Person, Role, Truth, WalkTruth
from blesim.tables import Trajectory, Visits

COMMAND = [sys.executable, "-c", "from blesim.cli import main; main()", "inspect"]
S = 1_000_000


def inspect(*arguments, expect=0):
    ended = subprocess.run(
        [*COMMAND, *map(str, arguments)], capture_output=True, text=True, check=False
    )
    assert ended.returncode == expect, ended.stderr
    assert "Traceback" not in ended.stderr
    return ended


def standing(came_s, left_s):
    return Trajectory(
        time_us=[came_s * S, left_s * S],
        x_m=[4.0, 4.0],
        y_m=[2.0, 2.0],
        level=[0, 0],
        heading_rad=[0.0, 0.0],
        speed_m_s=[0.0, 0.0],
        edge=[0, 0],
        offset_m=[2.0, 2.0],
        edge_speed_m_s=[0.0, 0.0],
        state=[0, 0],
    )


@pytest.fixture(scope="module")
def files(section, tmp_path_factory):
    """Three recordings: of a day with people, of walks alone, and without any truth."""
    folder = tmp_path_factory.mktemp("inspect")
    stays = [(Role.SHOPPER, 0, 7200), (Role.SHOPPER, 3600, 5400), (Role.STAFF, -60, 9000)]
    people = tuple(
        Person(name=f"p{number}", role=role, trajectory=standing(came, left))
        for number, (role, came, left) in enumerate(stays)
    )
    visits = Visits(
        time_us=np.array([60, 90]) * S, person=[0, 0], section=[0, 1], dwell_us=[1800 * S] * 2
    )
    practice = practice_recording()
    known = {walk.name: WalkTruth(trajectory=standing(0, 60)) for walk in practice.walks}
    nothing = {walk.name: WalkTruth() for walk in practice.walks}
    for name, walks, crowd in (
        ("day", known, Crowd(people=people, visits=visits)),
        ("walks", known, Crowd()),
        ("nobody", nothing, Crowd()),
    ):
        truth = Truth(venue=section, walks=MappingProxyType(walks), crowd=crowd)
        write_recording(folder / f"{name}.h5", practice, truth)
    return folder


def test_people_are_told_to_a_program(files):
    found = json.loads(inspect(files / "day.h5", "--json").stdout)
    assert found["crowd"] == {
        "shoppers": 2,
        "staff": 1,
        "testers": 0,
        "most_present": 3,
        "most_present_s": 3600.0,
        "stops": 2,
        "dwell_h": 1.0,
    }
    assert [walk["walk"] for walk in found["walks"]] == ["survey", "there", "back"]


def test_people_are_told_to_a_person(files):
    told = inspect(files / "day.h5").stdout
    assert "2 shoppers, 1 staff, 0 testers; at most 3 at once, 1.00 h after opening" in told
    assert "2 at product sections, 1.0 h in all" in told


@pytest.mark.parametrize("name", ["walks", "nobody"])
def test_where_nobody_but_the_walkers_is_known_no_people_are_told(files, name):
    assert json.loads(inspect(files / f"{name}.h5", "--json").stdout)["crowd"] is None
    told = inspect(files / f"{name}.h5").stdout
    assert "people" not in told
    assert "crowd" not in told


@pytest.mark.parametrize("name", ["day", "walks"])
def test_people_or_walks_are_drawn(files, name):
    picture = files / "new" / f"{name}.svg"
    ended = inspect(files / f"{name}.h5", "--plot", picture)
    assert f"{picture}: drawn" in ended.stderr
    # Words are drawn as outlines, but each text is named in a comment.
    words = picture.read_text(encoding="utf-8")
    assert ("people in the venue" in words) == (name == "day")
    assert ("3 recorded walks" in words) == (name == "walks")


def test_without_any_truth_there_is_nothing_to_draw(files):
    picture = files / "nothing.png"
    ended = inspect(files / "nobody.h5", "--plot", picture, expect=1)
    assert "no truth" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1
    assert ended.stdout == ""
    assert not picture.exists()


def test_an_unknown_picture_is_refused_before_the_file_is_read(tmp_path):
    ended = inspect(tmp_path / "nowhere.h5", "--plot", tmp_path / "new" / "a.docx", expect=2)
    assert "a.docx" in ended.stderr
    assert not (tmp_path / "new").exists()
