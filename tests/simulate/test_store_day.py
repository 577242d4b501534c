"""The store day of the scenarios: an hour of it in every run, all of it in the long ones."""

from pathlib import Path

import pytest

from blesim.dataset.tracks import sha256_of
from blesim.dataset.validator import validate
from blesim.dataset.writer import write_recording
from blesim.recording import Role
from blesim.scenario.reading import read_scenario
from blesim.simulate import Simulation

SCENARIO = Path(__file__).resolve().parents[2] / "scenarios" / "store-day.yaml"


def simulated(text: str, folder: Path, jobs: int) -> Path:
    scenario = folder / "scenario.yaml"
    scenario.write_text(text, encoding="utf-8")
    recording, truth = Simulation.run(read_scenario(scenario), 1).recording(jobs)
    path = folder / f"day-{jobs}.h5"
    write_recording(path, recording, truth)
    shoppers = sum(person.role == Role.SHOPPER for person in truth.crowd.people)
    assert len(recording.walks) == 101 if "count: 90" in text else len(recording.walks) == 6
    assert shoppers >= 60
    assert sum(len(walk.observations.imu) > 0 for walk in recording.walks) in (2, 10)
    return path


def test_an_hour_of_the_store_day_is_a_valid_recording(tmp_path):
    text = SCENARIO.read_text(encoding="utf-8")
    for old, new in (
        ('closes: "20:00"', 'closes: "09:00"'),
        ("shoppers: 2000", "shoppers: 100"),
        ("count: 90", "count: 3"),
        ("count: 10", "count: 2"),
        ("start_s: 10800", "start_s: 600"),
    ):
        assert old in text
        text = text.replace(old, new)
    assert validate(simulated(text, tmp_path, 1)) == []


@pytest.mark.slow
def test_the_store_day_is_valid_and_the_same_with_two_processes(tmp_path):
    text = SCENARIO.read_text(encoding="utf-8")
    one, two = (simulated(text, tmp_path, jobs) for jobs in (1, 2))
    assert sha256_of(one) == sha256_of(two)
    assert validate(one) == []
