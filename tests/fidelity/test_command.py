import json
import subprocess
import sys

import pytest

from blesim.fidelity.scorecard import inside_count
from blesim.fidelity.uji_library import compare_library

COMMAND = [sys.executable, "-c", "from blesim.cli import main; main()", "fidelity"]
KEYS = ["statistic", "unit", "real", "real_low", "real_high", "simulated", "inside"]


def fidelity(*arguments, expect=0):
    ended = subprocess.run(
        [*COMMAND, *map(str, arguments)], capture_output=True, text=True, check=False
    )
    assert ended.returncode == expect, ended.stderr
    assert "Traceback" not in ended.stderr
    return ended


def test_json_and_picture(data_dir, tmp_path):
    picture = tmp_path / "library.png"
    folder = data_dir("uji_library")
    rows = json.loads(fidelity("uji_library", folder, "--json", "--plot", picture).stdout)
    assert [list(row) for row in rows] == [KEYS] * len(rows)
    assert rows == [score.as_dict() for score in compare_library(folder, None, 1).scores]
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_the_radio_section_of_a_scenario_takes_the_place_of_the_preset(data_dir, tmp_path):
    scenario = tmp_path / "flat.yaml"
    scenario.write_text(
        "title: flat\n"
        "venue: {layout: wholesale-section}\n"
        "radio: {path_loss_exponent: 1.2, fading: {model: gaussian}}\n"
        "phones: {a: {}}\n"
        "walks: [{name: w, phone: a, route: [E1, E2]}]\n"
    )
    folder = data_dir("uji_library")
    table = fidelity("uji_library", folder, "--scenario", scenario).stdout
    inside = int(table.splitlines()[-1].split()[0])
    assert inside < inside_count(compare_library(folder, None, 1).scores) - 3


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (
            ("moon", "."),
            2,
            "unknown data set 'moon'; known are ilc20, mitll_static, oxford_steps, philo",
        ),
        (("philotuxo", "nowhere"), 1, "nowhere/cnf/tetam.dev: cannot be read"),
        (("mitll_static", "nowhere"), 1, "Chamber.csv.gz: not there"),
        (("uji_library", "nowhere"), 1, "lib_ids.csv: cannot be read"),
        (("oxford_steps", "nowhere"), 1, "nowhere/index.csv: not there"),
        (("ilc20", "nowhere"), 1, "nowhere/site1_B1: too few traces there"),
        (("uji_library", ".", "--seed", "-1"), 2, "seed -1"),
    ],
)
def test_a_bad_call_is_one_line(arguments, code, told):
    ended = fidelity(*arguments, expect=code)
    assert told in ended.stderr
    assert ended.stderr.count("\n") == 1


@pytest.mark.parametrize("dataset", ["philotuxo", "mitll_static", "uji_library"])
def test_a_twin_that_hears_nothing_is_told_in_one_line(dataset, data_dir, tmp_path):
    scenario = tmp_path / "deaf.yaml"
    scenario.write_text(
        "title: deaf\n"
        "venue: {layout: wholesale-section}\n"
        "radio: {traffic_loss: 1.0}\n"
        "phones: {a: {}}\n"
        "walks: [{name: w, phone: a, route: [E1, E2]}]\n"
    )
    ended = fidelity(dataset, data_dir(dataset), "--scenario", scenario, expect=2)
    assert "too few to compare" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


def test_sensors_have_no_radio_section(tmp_path):
    scenario = tmp_path / "any.yaml"
    scenario.write_text(
        "title: any\n"
        "venue: {layout: wholesale-section}\n"
        "phones: {a: {}}\n"
        "walks: [{name: w, phone: a, route: [E1, E2]}]\n"
    )
    ended = fidelity("oxford_steps", tmp_path, "--scenario", scenario, expect=2)
    assert ended.stderr == "blesim: oxford_steps compares no radio; leave the scenario out\n"
