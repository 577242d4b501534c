import dataclasses
from pathlib import Path

import numpy as np
import pytest

from blesim.dataset.validator import validate
from blesim.dataset.writer import write_recording
from blesim.errors import InvariantError, UsageError
from blesim.recording import WalkKind
from blesim.scenario.reading import read_scenario
from blesim.simulate import Simulation
from blesim.tables import Marks

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"

SMALL = """\
title: Two phones in one store
venue: {layout: wholesale-section}
phones:
  quick: {}
  told: {tells_channel: true, receiver: {random_loss: 0.5}}
record: {packets: true}
walks:
  - {name: one, phone: quick, route: [D1, D4]}
  - {name: two, phone: told, start_s: 3, kind: survey, split: radio map, route: [F8, E9, E7]}
"""


def simulate(tmp_path, text=SMALL, seed=4, jobs=1):
    path = tmp_path / "scenario.yaml"
    path.write_text(text, encoding="utf-8")
    return Simulation.run(read_scenario(path), seed).recording(jobs)


@pytest.fixture(scope="module")
def section_run():
    return Simulation.run(read_scenario(SCENARIOS / "wholesale-section.yaml"), 1).recording()


def test_walks_are_what_the_scenario_says(tmp_path):
    recording, truth = simulate(tmp_path)
    one, two = recording.walks
    assert (one.name, one.phone, one.kind, one.split) == ("one", "quick", WalkKind.WALK, "")
    assert (two.name, two.phone, two.kind, two.split) == (
        "two",
        "told",
        WalkKind.SURVEY,
        "radio map",
    )
    assert truth.walks["two"].trajectory.time_us[0] == 3_000_000
    assert set(one.observations.readings.channel.tolist()) == {0}
    assert set(two.observations.readings.channel.tolist()) <= {37, 38, 39}
    assert recording.provenance.seed == 4
    assert recording.provenance.scenario == SMALL


def test_the_recording_is_valid(tmp_path):
    recording, truth = simulate(tmp_path)
    write_recording(tmp_path / "a.h5", recording, truth)
    assert validate(tmp_path / "a.h5") == []


def test_processes_change_nothing(tmp_path):
    alone, shared = simulate(tmp_path), simulate(tmp_path, jobs=2)
    assert alone[0].walks == shared[0].walks
    assert alone[1].walks == shared[1].walks


def test_another_walk_leaves_every_draw_of_the_others(tmp_path):
    more = SMALL + "  - {name: three, phone: quick, route: [E1, E9]}\n"
    fewer = "\n".join(line for line in SMALL.splitlines() if "name: one" not in line)
    base, extended, reduced = (simulate(tmp_path, text)[0].by_name for text in (SMALL, more, fewer))
    for name in ("one", "two"):
        assert base[name].observations == extended[name].observations
    assert base["two"].observations == reduced["two"].observations


def test_moving_a_walk_in_time_leaves_the_others(tmp_path):
    base = simulate(tmp_path)[0].by_name
    moved = simulate(tmp_path, SMALL.replace("start_s: 3", "start_s: 30"))[0].by_name
    assert base["one"].observations == moved["one"].observations
    assert base["two"].observations != moved["two"].observations


def test_turning_steps_off_leaves_the_readings(tmp_path):
    with_steps = simulate(tmp_path)[0].by_name["one"].observations
    without = simulate(tmp_path, SMALL.replace("packets: true", "steps: false"))[0].by_name["one"]
    assert len(with_steps.steps) > 20
    assert len(without.observations.steps) == 0
    assert without.observations.readings == with_steps.readings


def test_a_seed_is_needed_and_the_call_overrides_the_scenario(tmp_path):
    with pytest.raises(UsageError, match="no seed; give --seed N"):
        simulate(tmp_path, seed=None)
    seeded = "seed: 9\n" + SMALL
    assert simulate(tmp_path, seeded, seed=None)[0].provenance.seed == 9
    assert simulate(tmp_path, seeded, seed=4)[0].provenance.seed == 4


def test_jobs_must_be_positive(tmp_path):
    with pytest.raises(UsageError, match="at least one process"):
        simulate(tmp_path, jobs=0)


def test_a_broken_walk_is_a_fault_of_the_program(tmp_path):
    path = tmp_path / "scenario.yaml"
    path.write_text(SMALL, encoding="utf-8")
    simulation = Simulation.run(read_scenario(path), 1)
    first, *others = simulation.carriers
    pressed = {column.field: first.marks[column] for column in first.marks.STREAM.columns}
    shifted = dataclasses.replace(first, marks=Marks(**pressed | {"x_m": first.marks.x_m + 1}))
    broken = dataclasses.replace(simulation, carriers=(shifted, *others))
    with pytest.raises(InvariantError, match="way point was pressed somewhere else"):
        broken.recording()


def test_measured_section_has_the_published_measures(section_run):
    recording, truth = section_run
    assert [walk.name for walk in recording.walks] == ["run-1", "run-2", "run-3"]
    for walk in recording.walks:
        trajectory = truth.walks[walk.name].trajectory
        walked_m = np.hypot(np.diff(trajectory.x_m), np.diff(trajectory.y_m)).sum()
        # Published: about 85 m; 1000 to 1300 readings; 30 to 50 between way points 2.7 m apart.
        assert walked_m == pytest.approx(85, abs=1)
        assert 950 <= len(walk.observations.readings) <= 1300
        marks = walk.observations.marks
        between = np.histogram(walk.observations.readings.time_us, marks.time_us)[0]
        apart_m = np.hypot(np.diff(marks.x_m), np.diff(marks.y_m))
        assert 30 <= between[np.isclose(apart_m, 2.7)].mean() <= 50
    readings = [len(walk.observations.readings) for walk in recording.walks]
    assert 1000 <= np.mean(readings) <= 1300


@pytest.fixture(scope="module")
def received():
    """Range, loss in shelves and RSSI of the received packets of five seeds, (3, n)."""
    file = read_scenario(SCENARIOS / "wholesale-section.yaml")
    record = file.scenario.record.model_copy(update={"packets": True})
    file = dataclasses.replace(file, scenario=file.scenario.model_copy(update={"record": record}))
    parts = []
    # A shadowing field is a single sample of a store: one seed is not enough.
    for seed in range(8):
        recording, truth = Simulation.run(file, seed).recording()
        for walk in recording.walks:
            packets = truth.walks[walk.name].packets
            packets = packets.rows(packets.fate == 0)
            rssi_dbm = walk.observations.readings.rssi_dbm
            parts.append(np.stack([packets.distance_m, packets.obstacle_loss_db, rssi_dbm]))
    return np.concatenate(parts, axis=1)


def test_signal_curves_of_the_section_follow_the_published_exponents(received):
    # Published (figures 5 and 7): with -77 dBm at 1 m, n = 1.0 fits the mean RSSI in 1 m bins of
    # the same aisle and 1.3 that of the adjacent ones. Only received packets count.
    distance_m, loss_db, rssi_dbm = received
    same, adjacent = (
        _fitted_exponent(distance_m[rows], rssi_dbm[rows]) for rows in (loss_db == 0, loss_db > 0)
    )
    assert same == pytest.approx(1.0, abs=0.1)
    assert adjacent == pytest.approx(1.3, abs=0.1)


def test_the_same_aisle_is_stronger_at_every_range(received):
    # Figure 5: both curves fall with range, the adjacent aisles' below that of the same aisle.
    distance_m, loss_db, rssi_dbm = received
    bins = np.floor(distance_m).astype(int)
    same, adjacent = (
        np.array([rssi_dbm[rows & (bins == metre)].mean() for metre in range(6, 15)])
        for rows in (loss_db == 0, loss_db > 0)
    )
    assert (same > adjacent).all()
    assert np.polyfit(np.arange(6, 15), same, 1)[0] < -0.1
    assert np.polyfit(np.arange(6, 15), adjacent, 1)[0] < -0.1


def test_histograms_of_neighbouring_ranges_overlap_heavily(received):
    # Figure 6: 2-3, 4-5 and 8-9 m in the same aisle; the width of the paper's filter is 4 dB.
    distance_m, loss_db, rssi_dbm = received
    ranges = ((2, 3), (4, 5), (8, 9))
    levels = [
        rssi_dbm[(loss_db == 0) & (distance_m >= low) & (distance_m < high)] for low, high in ranges
    ]
    means = [level.mean() for level in levels]
    assert means[0] > means[1] > means[2]
    assert all(3.0 < level.std() < 5.0 for level in levels)
    edges = np.arange(-105.5, -60)
    shares = [np.histogram(level, edges)[0] / len(level) for level in levels]
    overlaps = [np.minimum(shares[a], shares[b]).sum() for a, b in ((0, 1), (1, 2), (0, 2))]
    assert overlaps[0] > 0.5
    assert overlaps[1] > 0.5
    assert 0.25 < overlaps[2] < min(overlaps[:2])


def _fitted_exponent(distance_m, rssi_dbm):
    """Least squares of the mean RSSI in 1 m bins against -77 dBm - 10 n log10(d)."""
    inside = (distance_m >= 2) & (distance_m < 16)
    bins = np.floor(distance_m[inside]).astype(int)
    count = np.bincount(bins)
    filled = count > 30
    mean_dbm = np.bincount(bins, rssi_dbm[inside])[filled] / count[filled]
    decades = np.log10(np.bincount(bins, distance_m[inside])[filled] / count[filled])
    return -np.sum((mean_dbm + 77) * decades) / np.sum(decades**2) / 10
