import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import jsonschema
import pytest
import xarray

ROOT = Path(__file__).resolve().parents[2]
SECTION = ROOT / "scenarios" / "wholesale-section.yaml"
COMMAND = [sys.executable, "-c", "from blesim.cli import main; main()"]


def blesim(*arguments, expect=0, cwd=None):
    """Run a command, check its exit code, and that a fault is told without a traceback."""
    ended = subprocess.run(
        [*COMMAND, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, check=False
    )
    assert ended.returncode == expect, ended.stderr
    assert "Traceback" not in ended.stderr
    return ended


@pytest.fixture(scope="module")
def section(tmp_path_factory):
    """A recording of the section, and tracks made from it."""
    folder = tmp_path_factory.mktemp("section")
    blesim("simulate", SECTION, "--seed", 1, "-o", folder / "a.h5")
    blesim("estimate", folder / "a.h5", "-e", "nearest-beacon", "-o", folder / "t.h5")
    return folder


def test_the_same_scenario_and_seed_give_the_same_bytes(section):
    for name, options in (("b.h5", ()), ("c.h5", ("--jobs", 2))):
        blesim("simulate", SECTION, "--seed", 1, *options, "-o", section / name)
        assert (section / name).read_bytes() == (section / "a.h5").read_bytes()
    blesim("simulate", SECTION, "--seed", 2, "-o", section / "d.h5")
    assert (section / "d.h5").read_bytes() != (section / "a.h5").read_bytes()


def test_the_recording_validates_and_opens_in_xarray(section):
    assert blesim("validate", section / "a.h5").stdout.strip().endswith("valid")
    with xarray.open_dataset(section / "a.h5", group="rssi", decode_timedelta=False) as rssi:
        assert rssi.rssi.attrs["units"] == "dBm"
        assert rssi.sizes["obs"] > 3000


def test_score_prints_the_table_of_the_contract(section):
    rows = json.loads(blesim("score", section / "a.h5", section / "t.h5", "--json").stdout)
    keys = "estimator walk n mean_m std_m rmse_m median_m p75_m p90_m ce95_m max_m wrong_aisle"
    assert all(set(keys.split()) <= set(row) for row in rows)
    assert [row["walk"] for row in rows] == ["run-1", "run-2", "run-3", "all"]
    assert rows[-1]["n"] == sum(row["n"] for row in rows[:-1])
    assert all(
        row["rmse_m"] ** 2 == pytest.approx(row["mean_m"] ** 2 + row["std_m"] ** 2) for row in rows
    )
    table = blesim("score", section / "a.h5", section / "t.h5").stdout
    assert f"{rows[-1]['mean_m']:.2f}" in table


def test_score_draws(section):
    picture = section / "folder" / "score.png"
    blesim("score", section / "a.h5", section / "t.h5", "--plot", picture, "--plot-walk", "run-3")
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["new/score.docx"], "score.docx"),
        (["new/a.png", "--plot-walk", "x"], "no walk 'x' to draw"),
    ],
)
def test_what_cannot_be_drawn_is_refused_before_anything_is_made(section, options, words):
    plot, *rest = options
    ended = blesim(
        "score", section / "a.h5", section / "t.h5", "--plot", section / plot, *rest, expect=2
    )
    assert words in ended.stderr
    assert ended.stdout == ""
    assert not (section / "new").exists()


def test_inspect_tells_what_is_inside(section):
    found = json.loads(blesim("inspect", section / "a.h5", "--json").stdout)
    assert found["seed"] == 1
    assert found["beacons"] == 25
    assert [walk["walk"] for walk in found["walks"]] == ["run-1", "run-2", "run-3"]
    assert "run-2" in blesim("inspect", section / "a.h5").stdout


def test_estimators_are_listed_with_needs_and_parameters():
    listed = json.loads(blesim("estimators", "--json").stdout)
    (nearest,) = [each for each in listed if each["name"] == "nearest-beacon"]
    assert nearest["name"] == "nearest-beacon"
    assert [p["name"] for p in nearest["parameters"]] == ["signal", "window_s", "rate"]
    assert "nearest-beacon" in blesim("estimators").stdout


def test_the_schema_accepts_what_the_reader_accepts():
    schema = json.loads(blesim("schema").stdout)
    jsonschema.Draft202012Validator.check_schema(schema)
    good = {
        "title": "t",
        "venue": {"layout": "wholesale-section"},
        "phones": {"p": {}},
        "walks": [{"name": "w", "phone": "p", "route": ["D1", {"node": "D2", "pause_s": 3}]}],
    }
    jsonschema.validate(good, schema)
    for bad in ({"colour": "red"}, {"seed": -1}, {"walks": []}, {"title": ""}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(good | bad, schema)


def test_outputs_go_to_the_output_folder_by_default(tmp_path):
    blesim("simulate", SECTION, "--seed", 1, cwd=tmp_path)
    blesim("estimate", "output/wholesale-section.h5", "-e", "nearest-beacon", cwd=tmp_path)
    names = sorted(path.name for path in (tmp_path / "output").iterdir())
    assert names == ["wholesale-section-tracks.h5", "wholesale-section.h5"]


def test_a_real_recording_goes_through_the_same_door(data_dir, tmp_path):
    hall, tracks = tmp_path / "hall.h5", tmp_path / "tracks.h5"
    blesim("import", "philotuxo", data_dir("philotuxo"), "-o", hall)
    blesim("validate", hall)
    blesim("estimate", hall, "-e", "nearest-beacon", "-o", tracks)
    rows = json.loads(blesim("score", hall, tracks, "--json").stdout)
    # An untuned reference on the same tracks: 3.19 m.
    assert 2.5 <= rows[-1]["median_m"] <= 4.0
    assert rows[-1]["wrong_aisle"] is None


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["simulate", "nowhere.yaml"], 2, "nowhere.yaml: No such file"),
        (["simulate", "bad.yaml"], 2, "bad.yaml:1: titel: unknown key"),
        (["simulate", "seedless.yaml"], 2, "no seed; give --seed N"),
        (["simulate", "seedless.yaml", "--seed", "-1"], 2, "seed -1"),
        (["simulate", "seedless.yaml", "--seed", "x"], 2, "--seed"),
        (["simulate", "seedless.yaml", "--seed", "1", "--jobs", "0"], 2, "--jobs"),
        (["simulate", "seedless.yaml", "--seed", "1", "-o", "plain.txt/a.h5"], 2, "plain.txt"),
        (["simulate", "seedless.yaml", "--seed", "1", "-o", "."], 2, "directory"),
        (["estimate", "nowhere.h5", "-e", "nearest-beacon"], 1, "nowhere.h5"),
        (["estimate", "plain.txt", "-e", "nearest-beacon"], 1, "plain.txt"),
        (["estimate", "short.h5", "-e", "nearest-beacon"], 1, "short.h5"),
        (["estimate", "foreign.h5", "-e", "nearest-beacon"], 1, "foreign.h5"),
        (["estimate", "a.h5", "-e", "nearest-bacon"], 2, "nearest-beacon"),
        (["estimate", "a.h5", "-e", "nearest-beacon:colour=red"], 2, "colour"),
        (["estimate", "a.h5", "-e", "nearest-beacon:rate=2"], 2, "rate"),
        (["estimate", "a.h5", "-e", "nearest-beacon:window_s=-1"], 2, "window_s"),
        (["estimate", "a.h5", "-e", "nearest-beacon", "-e", "nearest-beacon"], 2, "twice"),
        (["score", "other.h5", "t.h5"], 1, "made from another recording"),
        (["score", "a.h5", "a.h5"], 1, "a.h5"),
        (["score", "short.h5", "t.h5"], 1, "short.h5: damaged (truncated file); make it again"),
        (["estimate", "a.h5", "-e", "nearest-beacon:window_s=1e300"], 2, "31622400 seconds"),
        (["validate", "short.h5"], 1, "short.h5"),
        (["inspect", "foreign.h5"], 1, "foreign.h5"),
        (["import", "fax", "."], 2, "unknown format 'fax'; known are philotuxo"),
        (["import", "philotuxo", "nowhere"], 1, "nowhere"),
        (["fly"], 2, "fly"),
    ],
)
def test_a_bad_call_ends_in_a_clear_line(section, tmp_path, arguments, code, words):
    for name in ("a.h5", "t.h5"):
        (tmp_path / name).write_bytes((section / name).read_bytes())
    (tmp_path / "plain.txt").write_text("hello", encoding="utf-8")
    (tmp_path / "short.h5").write_bytes((section / "a.h5").read_bytes()[:5000])
    with h5py.File(tmp_path / "foreign.h5", "w") as foreign:
        foreign["x"] = [1, 2]
    text = SECTION.read_text(encoding="utf-8").replace(
        "map: wholesale-section.geojson", "layout: wholesale-section"
    )
    (tmp_path / "seedless.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "bad.yaml").write_text("titel: x\n" + text, encoding="utf-8")
    if "other.h5" in arguments:
        blesim("simulate", "seedless.yaml", "--seed", 5, "-o", "other.h5", cwd=tmp_path)
    before = sorted(tmp_path.rglob("*"))
    ended = blesim(*arguments, expect=code, cwd=tmp_path)
    assert words in ended.stdout + ended.stderr
    left = [path for path in sorted(tmp_path.rglob("*")) if path not in before]
    assert [path for path in left if path.is_file()] == []


@pytest.mark.parametrize("delay_s", [0.3, 0.7, 0.9, 1.1, 1.3, 1.5])
def test_killed_at_any_moment_the_file_is_whole_or_absent(section, tmp_path, delay_s):
    target = tmp_path / "a.h5"
    process = subprocess.Popen(
        [*COMMAND, "simulate", str(SECTION), "--seed", "1", "-o", str(target)],
        stderr=subprocess.DEVNULL,
    )
    time.sleep(delay_s)
    process.send_signal(signal.SIGKILL)
    process.wait()
    if target.exists():
        assert target.read_bytes() == (section / "a.h5").read_bytes()


def test_a_closed_pipe_ends_quietly():
    command = f"'{sys.executable}' -c 'from blesim.cli import main; main()' schema | head -n 1"
    ended = subprocess.run(command, shell=True, capture_output=True, text=True, check=True)
    assert ended.stdout == "{\n"
    assert ended.stderr == ""


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_an_interrupt_leaves_nothing(tmp_path, jobs):
    walk = "{{name: w{}, phone: p, speed_m_s: 0.05, route: [D1, D8, E9, E1, D1, E9, D1]}}"
    walks = "".join(f"  - {walk.format(number)}\n" for number in range(60))
    slow = f"title: t\nvenue: {{layout: wholesale-section}}\nphones: {{p: {{}}}}\nwalks:\n{walks}"
    (tmp_path / "slow.yaml").write_text(slow, encoding="utf-8")
    process = subprocess.Popen(
        [*COMMAND, "simulate", "slow.yaml", "--seed", "1", "-o", "a.h5", "--jobs", jobs],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
        # A group of its own, so that a signal reaches the workers as Ctrl-C does.
        start_new_session=True,
    )
    process.stderr.readline()
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    last = "blesim: stopped; every output is either whole or as it was before"
    assert errors.strip().splitlines()[-1] == last
    assert "Traceback" not in errors
    assert [path.name for path in tmp_path.iterdir()] == ["slow.yaml"]
