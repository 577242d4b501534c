"""The proximity paper rerun: a number for everything published, and sums worked by hand."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from blesim.columns import NO_EDGE
from blesim.errors import DataError
from blesim.estimators.run import surveys_of
from blesim.ranging.proximity import Proximity
from blesim.recording import Recording, Walk, WalkKind, WalkTruth
from blesim.reruns.base import Key, Trial
from blesim.reruns.proximity_pf import (
    EXPERIMENT,
    PROXIMITY,
    errors_at_m,
    five_trials,
    numbers_of_table,
    read_out_us,
)
from blesim.reruns.proximity_pf_cells import Cells, cells_of, numbers_of_cells, ring_of
from blesim.reruns.proximity_pf_changes import CHANGES
from blesim.reruns.proximity_pf_given import with_near_by_chance, with_true_headings
from blesim.reruns.proximity_pf_numbers import (
    ALGORITHMS,
    CELLS,
    IMMEDIATE,
    INTERCEPT,
    OURS,
    SLOPE,
    A,
    C,
    error_key,
    less_key,
    penalty_key,
    point_key,
    share_key,
    summary_key,
)
from blesim.reruns.sites import scenario_of
from blesim.simulate import Simulation
from blesim.tables import Track


@cache
def trial(seed: int) -> Trial:
    return EXPERIMENT.trial(seed)


def printed() -> dict[Key, float]:
    return {each.key: each.value for each in EXPERIMENT.published}


def test_one_seed_gives_a_number_for_everything_published():
    numbers = trial(1).numbers
    assert set(printed()) <= set(numbers)
    assert all(np.isfinite(value) for value in numbers.values())
    named = {key for each in EXPERIMENT.expected for key in (each.better, each.worse)}
    assert named <= set(numbers)


def test_the_chosen_penalty_is_that_of_the_proposed_algorithm():
    numbers = trial(1).numbers
    assert numbers[penalty_key(-5.0)] == numbers[summary_key(OURS, "mean [m]")]
    assert len({numbers[penalty_key(each)] for each in (-0.5, -5.0, -10.0)}) == 3


def test_keys_are_told_apart():
    keys = [each.key for each in EXPERIMENT.published]
    assert len(set(keys)) == len(keys)
    pairs = [(each.better, each.worse) for each in EXPERIMENT.expected]
    assert len(set(pairs)) == len(pairs)


def test_every_ordering_has_the_printed_sign():
    numbers = printed()
    for each in EXPERIMENT.expected:
        if each.better in numbers:
            assert numbers[each.better] < numbers[each.worse], each


def test_the_printed_table_adds_up():
    published = printed()
    errors_m = {
        name: np.array([[published[error_key(name, t, p)] for p in (1, 2)] for t in range(1, 6)])
        for name in ALGORITHMS
    }
    numbers = numbers_of_table(errors_m)
    for key, value in numbers.items():
        # Means are printed to the millimetre, that of A to the centimetre; percents are cut.
        rounding = 0.9 if key.table == "section IV-C" else 0.002
        assert value == pytest.approx(published[key], abs=rounding), key


def test_table_one_of_errors_worked_by_hand():
    errors_m = {name: np.full((5, 2), 4.0) for name in ALGORITHMS}
    errors_m[OURS] = np.array([[1.0, 2.0], [1.0, 2.0], [1.0, 2.0], [1.0, 2.0], [0.0, 8.0]])
    numbers = numbers_of_table(errors_m)
    assert numbers[summary_key(OURS, "mean [m]")] == pytest.approx(2.0)
    assert numbers[summary_key(OURS, "min [m]")] == 0.0
    assert numbers[summary_key(OURS, "max [m]")] == 8.0
    assert numbers[point_key(OURS, 1)] == pytest.approx(0.8)
    assert numbers[point_key(OURS, 2)] == pytest.approx(3.2)
    assert numbers[error_key(OURS, 5, 2)] == 8.0
    assert numbers[less_key(A)] == numbers[less_key(C)] == pytest.approx(50.0)


def cells_about(near_within_m: float) -> Cells:
    """The 25 x 25 cells, Near up to a distance, with the beacon amid them."""
    x_m, y_m = (axis.ravel() for axis in np.meshgrid(*[0.3 * np.arange(-12, 13)] * 2))
    distance_m = np.hypot(x_m, y_m)
    near = distance_m < near_within_m
    return Cells(
        x_m=x_m,
        y_m=y_m,
        distance_m=distance_m,
        proximity=np.where(near, Proximity.NEAR, Proximity.FAR).astype(np.int64),
    )


def test_rings_hold_the_cells_that_the_paper_counts():
    cells = cells_about(2.0)
    counts = np.bincount(ring_of(cells.distance_m))
    # N(2.4) = 56 as printed. By hand: the beacon's own cell, then its eight neighbours.
    assert counts[[0, 1, 8]].tolist() == [1, 8, 56]


def test_shares_and_their_line_worked_by_hand():
    # Near up to 1.35 m: the ring from 1.2 up to 1.5 m ends with the cells at (4, 2), 1.342 m away.
    numbers = numbers_of_cells(cells_about(1.35))
    shares = [numbers[share_key(each)] for each in (0.0, 0.3, 0.6, 0.9, 1.2, 1.5, 1.8, 2.1, 2.4)]
    assert shares == [1.0] * 5 + [0.0] * 4
    # Line through five ones and four noughts at -4 .. 4: slope -10 / 60 a ring, 5 / 9 amid them.
    assert numbers[SLOPE] == pytest.approx(-10 / 60 / 0.3)
    assert numbers[INTERCEPT] == pytest.approx(5 / 9 + 4 * 10 / 60)
    assert numbers[CELLS] == 56
    assert numbers[IMMEDIATE] == 0.0


@cache
def simulated():
    file = five_trials(scenario_of("h-floor"))
    return file, *Simulation.run(file, 3).recording()


def test_cells_are_told_as_the_phone_told_them_most_often():
    _, recording, truth = simulated()
    cells = cells_of(surveys_of(recording), recording.venue)
    assert len(cells.x_m) == 25 * 25
    # By another way: one cell, its readings from where the tester really was.
    walk = recording.by_name["proximity"]
    readings = walk.observations.readings
    true = truth.walks["proximity"].trajectory.at(readings.time_us)
    row = int(np.argmin(np.abs(cells.distance_m - 1.5)))
    there = np.hypot(true.x_m - cells.x_m[row], true.y_m - cells.y_m[row]) < 1e-6
    told = readings.proximity[there & (readings.beacon == 0) & (true.speed_m_s == 0)]
    assert len(told) >= 4
    assert np.bincount(told).argmax() == cells.proximity[row]


def test_errors_are_read_out_while_the_tester_stands_at_the_points():
    file, recording, truth = simulated()
    for walk in recording.walks[:5]:
        moments_us = read_out_us(file, recording, walk)
        true = truth.walks[walk.name].trajectory.at(moments_us)
        assert true.x_m == pytest.approx([1.5, 12.5], abs=1e-3)
        assert true.y_m == pytest.approx([6.0, 15.5], abs=1e-3)
        assert true.speed_m_s.tolist() == [0.0, 0.0]


def walks_of(recording: Recording) -> list[Walk]:
    return [walk for walk in recording.walks if walk.kind == WalkKind.WALK]


def test_the_five_trials_are_walks_of_their_own_on_one_course():
    _, recording, truth = simulated()
    walks = walks_of(recording)
    assert [walk.name for walk in walks] == [f"trial-{number}" for number in range(1, 6)]
    ways: list[WalkTruth] = [truth.walks[walk.name] for walk in walks]
    ends_us = [int(way.trajectory.time_us[-1]) for way in ways]
    starts_us = [int(way.trajectory.time_us[0]) for way in ways]
    assert all(end < start for end, start in zip(ends_us, starts_us[1:], strict=False))
    assert len({len(walk.observations.readings) for walk in walks}) > 1


def estimates_at(*rows: tuple[int, float, float]) -> Track:
    """Track of times [us] and places [m]."""
    time_us, x_m, y_m = np.array(rows).T
    ones = np.ones(len(rows))
    return Track(
        time_us=time_us.astype(np.int64),
        x_m=x_m,
        y_m=y_m,
        level=np.zeros(len(rows), np.int64),
        variance_x_m2=ones,
        variance_y_m2=ones,
        covariance_xy_m2=0.0 * ones,
        edge=np.full(len(rows), NO_EDGE),
        offset_m=np.nan * ones,
    )


def test_errors_are_those_of_the_estimates_in_force():
    file, recording, truth = simulated()
    walk = recording.by_name["trial-1"]
    first_us, second_us = read_out_us(file, recording, walk)
    # 3 m and 4 m off at the first; the next estimate comes a moment after the second read-out.
    track = estimates_at((first_us, 4.5, 10.0), (second_us, 12.5, 14.5), (second_us + 1, 0.0, 0.0))
    moments_us = np.array([first_us, second_us])
    found_m = errors_at_m(track, truth.walks[walk.name], moments_us)
    assert found_m == pytest.approx([5.0, 1.0], abs=1e-3)
    with pytest.raises(DataError, match="no estimate"):
        errors_at_m(track, truth.walks[walk.name], moments_us - 1)


def test_the_same_seed_gives_the_same_numbers_and_pictures_beside():
    drawn = EXPERIMENT.trial(1, pictures=True)
    assert drawn.numbers == trial(1).numbers
    over = EXPERIMENT.overview({key: np.full(3, value) for key, value in drawn.numbers.items()})
    pictures = (*drawn.pictures, *over)
    assert len({picture.name for picture in pictures}) == len(pictures) == 8
    for picture in pictures:
        assert "[" in picture.x_label
        assert "[" in picture.y_label
        assert all(len(curve.x) == len(curve.y) > 0 for curve in picture.curves)


def test_every_change_changes_something_and_can_be_simulated():
    for change in CHANGES:
        assert change.experiment != EXPERIMENT, change.name
        scenario_of("h-floor", change.experiment.values)


def test_headings_are_told_as_they_were_on_the_steps_that_were_sensed():
    _, recording, truth = simulated()
    given = with_true_headings(recording, truth)
    seen = recording.by_name["trial-2"].observations
    told = given.by_name["trial-2"].observations.steps
    sensed = PROXIMITY.steps(recording.venue, surveys_of(recording)).start().advance(seen)
    assert told.time_us.tolist() == sensed.time_us.tolist()
    true = truth.walks["trial-2"].trajectory.at(told.time_us)
    assert told.heading_rad == pytest.approx(true.heading_rad, abs=1e-5)
    assert given.by_name["trial-2"].observations.imu == seen.imu
    # Nothing is learned that would be taken off them.
    ours = replace(PROXIMITY, source="system").fit(given.venue, surveys_of(given))
    assert ours.learned is not None
    assert ours.learned.steps.offset_rad == 0.0


def test_near_by_chance_is_told_as_often_as_equation_five_says():
    _, recording, truth = simulated()
    given = with_near_by_chance(recording, truth, 3)
    chances, told = [], []
    for walk in walks_of(given):
        readings = walk.observations.readings
        assert readings.rssi_dbm.tolist() == (
            recording.by_name[walk.name].observations.readings.rssi_dbm.tolist()
        )
        true = truth.walks[walk.name].trajectory.at(readings.time_us)
        beacon_m = recording.venue.beacon_xyz_m[readings.beacon]
        distance_m = np.hypot(true.x_m - beacon_m[:, 0], true.y_m - beacon_m[:, 1])
        chance = np.clip(1.1077 - 0.3053 * distance_m, 0.0, 1.0)
        chances.append(chance)
        told.append(readings.proximity == Proximity.NEAR)
    chance, near = np.concatenate(chances), np.concatenate(told)
    assert not near[chance == 0.0].any()
    assert near[chance == 1.0].all()
    spread = np.sqrt(np.sum(chance * (1.0 - chance)))
    assert abs(np.count_nonzero(near) - np.sum(chance)) < 4.0 * spread
    assert given.by_name["proximity"] == recording.by_name["proximity"]


def test_without_body_shadows_and_multipath_near_ends_at_three_metres():
    clean_air = {
        "radio.fading.model": "none",
        "radio.shadowing.standard_deviation_db": 0.0,
        "radio.people.body_loss_db": 0.0,
    }
    file = five_trials(scenario_of("h-floor", clean_air))
    recording, _ = Simulation.run(file, 1).recording()
    cells = cells_of(surveys_of(recording), recording.venue)
    # In space from the tablet, 1.0 m above the floor; whole dB blur the edge.
    range_m = np.hypot(cells.distance_m, 1.0)
    assert (cells.proximity[(range_m > 1.2) & (range_m < 2.7)] == Proximity.NEAR).all()
    assert (cells.proximity[range_m > 3.3] == Proximity.FAR).all()
