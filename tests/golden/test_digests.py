"""Tiny scenarios whose every recorded number is pinned.

A digest may change only with a change of the model or of the random numbers that the changelog
tells users about. It covers the numbers, not the file, so that it holds for any version of HDF5.
"""

import hashlib

import pytest

from blesim.scenario.reading import read_scenario
from blesim.simulate import Simulation

SCENARIO = """\
title: Pinned
venue: {layout: wholesale-section, survey_error_m: 0.5}
phones:
  phone: {tells_channel: true}
record: {packets: true}
walks:
  - {name: one, phone: phone, speed_m_s: 1.3, route: [D5, {x_m: 30, y_m: 13.5, pause_s: 2}, D3]}
  - {name: two, phone: phone, start_s: 4.5, route: [F8, E9]}
"""

COUNTS = {
    "one": {"rssi": 93, "imu": 0, "steps": 19, "marks": 6, "heading": 0, "pressure": 0},
    "two": {"rssi": 50, "imu": 0, "steps": 14, "marks": 4, "heading": 0, "pressure": 0},
}
DIGEST = "393a8f30fa6fa1ee00309f9684369b487710eebf6b43c5547bf9c689f8ec7057"


@pytest.fixture(scope="module")
def pinned(tmp_path_factory):
    path = tmp_path_factory.mktemp("golden") / "scenario.yaml"
    path.write_text(SCENARIO, encoding="utf-8")
    return Simulation.run(read_scenario(path), 20261121).recording()


def test_row_counts(pinned):
    recording, _ = pinned
    counts = {
        walk.name: {table.STREAM.name: len(table) for table in walk.observations.tables()}
        for walk in recording.walks
    }
    assert counts == COUNTS


def test_every_number(pinned):
    recording, truth = pinned
    digest = hashlib.sha256(recording.venue.beacon_xyz_m.tobytes())
    for walk in recording.walks:
        for table in (*walk.observations.tables(), *truth.walks[walk.name].tables()):
            for values in table.arrays():
                digest.update(values.tobytes())
    assert digest.hexdigest() == DIGEST
