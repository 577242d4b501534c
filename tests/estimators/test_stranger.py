"""A package of somebody else's is installed, and its estimator found and run by its name."""

import json
import os
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
label, estimator = make_estimator("weighted-place:scale_db=10")
check_estimator(estimator)
track = run(estimator, recording, recording.by_name["there"], seed=1, label=label)
print(json.dumps({
    "names": estimator_names(),
    "rows": len(track),
    "defaults": {p.name: p.default for p in describe("weighted-place").parameters},
    "fault": describe("broken-stranger").fault,
    "ours": describe("nearest-beacon").fault,
}))
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stranger")
    source = shutil.copytree(HERE / "stranger", folder / "source")
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
    assert {"nearest-beacon", "weighted-place"} <= set(said["names"])
    assert said["rows"] > 100
    assert said["defaults"] == {"scale_db": "20.0", "memory": "0.9"}
    assert "NotThere" in said["fault"]
    assert said["ours"] is None
