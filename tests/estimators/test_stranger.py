"""The README's estimator is installed as somebody else's package, found by name and run."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent

USE = """
import json
from blesim.estimators.check import check_estimator
from blesim.estimators.practice import practice_recording
from blesim.estimators.registry import describe, estimator_names, make_estimator
from blesim.estimators.run import run

recording = practice_recording()
label, estimator = make_estimator("my-centroid:memory=0.9")
check_estimator(estimator)
track = run(estimator, recording, recording.by_name["there"], seed=1, label=label)
print(json.dumps({
    "names": estimator_names(),
    "rows": len(track),
    "defaults": {p.name: p.default for p in describe("my-centroid").parameters},
    "fault": describe("broken-stranger").fault,
    "ours": describe("nearest-beacon").fault,
}))
"""


def readme_block(words):
    """The fenced block of the README that contains the words."""
    text = (HERE.parents[1] / "README.md").read_text(encoding="utf-8")
    (block,) = [b for b in re.findall(r"^```\w+\n(.*?)^```", text, re.S | re.M) if words in b]
    return block


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stranger")
    source = shutil.copytree(HERE / "stranger", folder / "source")
    (source / "my_estimator.py").write_text(readme_block("class MyCentroid"), encoding="utf-8")
    options = ["--quiet", "--no-index", "--no-build-isolation", "--no-deps"]
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", *options]
    subprocess.run([*pip, "--target", str(folder / "site"), str(source)], check=True)
    return folder / "site"


def test_the_estimator_of_another_package_is_found_checked_and_run(installed):
    answer = subprocess.run(
        [sys.executable, "-c", USE],
        env={**os.environ, "PYTHONPATH": str(installed)},
        check=True,
        capture_output=True,
        text=True,
    )
    said = json.loads(answer.stdout)
    assert {"nearest-beacon", "weighted-centroid", "my-centroid"} <= set(said["names"])
    assert said["rows"] > 100
    assert said["defaults"] == {"memory": "0.98"}
    assert "NotThere" in said["fault"]
    assert said["ours"] is None


def test_the_readme_declares_it_as_the_package_does(installed):
    declared = readme_block("[project.entry-points")
    assert declared in (HERE / "stranger" / "pyproject.toml").read_text(encoding="utf-8")
    assert (installed / "my_estimator.py").is_file()


def test_it_takes_thirty_lines_or_so():
    code = [line for line in readme_block("class MyCentroid").splitlines() if line.strip()]
    assert len(code) <= 32
