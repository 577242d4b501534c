"""What `blesim simulate` says about silence, which is legal."""

import subprocess
import sys

import pytest

COMMAND = [sys.executable, "-c", "from blesim.cli import main; main()"]
SCENARIO = """\
title: {title}
venue: {{layout: wholesale-section}}
phones: {{phone: {{receiver: {{random_loss: {loss}}}}}}}
walks:
  - {{name: run, phone: phone, route: [D1, D3]}}
"""


def simulate(folder, loss):
    path = folder / f"loss-{loss}.yaml"
    path.write_text(SCENARIO.format(title="t", loss=loss), encoding="utf-8")
    ended = subprocess.run(
        [*COMMAND, "simulate", str(path), "--seed", "1", "-o", str(folder / "a.h5")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout + ended.stderr


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("silence")


def test_a_deaf_phone_and_beacons_nobody_heard_are_told(folder):
    said = simulate(folder, 1.0)
    assert "walk 'run' heard no beacon at all" in said
    assert "nobody heard 25 of the beacons: D1, D2," in said
    assert "1 walks, 0 readings" in said


def test_beacons_that_were_heard_are_not_named(folder):
    said = simulate(folder, 0.0)
    assert "heard no beacon" not in said
    named = [line for line in said.splitlines() if line.startswith("nobody heard")]
    assert not any("D2" in line for line in named)
