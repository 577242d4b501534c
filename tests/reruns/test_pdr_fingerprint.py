"""The rerun of table 3: its arithmetic by hand, and one seed."""

import re
from dataclasses import replace
from functools import cache
from importlib.resources import files

import numpy as np
import pytest

from blesim.metrics.position_error import PositionErrors
from blesim.reruns import pdr_fingerprint_numbers as paper
from blesim.reruns.base import Key, Trial
from blesim.reruns.pdr_fingerprint import (
    EXPERIMENT,
    POINT_M,
    PdrFingerprintExperiment,
    Room,
    error_numbers,
    errors_at_m,
    point_signals_dbm,
    signal_numbers,
    stand_ends_us,
    statistics_of,
    walked,
)
from blesim.reruns.pdr_fingerprint_changes import CHANGES
from blesim.reruns.pdr_fingerprint_pictures import distribution
from blesim.reruns.registry import change_of
from blesim.tables import Trajectory

SEED = 1


@cache
def room() -> Room:
    return walked(SEED)


@cache
def trial() -> Trial:
    return EXPERIMENT.trial(SEED, pictures=True)


def changed(short_name) -> PdrFingerprintExperiment:
    experiment = change_of("pdr-fingerprint", short_name).experiment
    assert isinstance(experiment, PdrFingerprintExperiment)
    return experiment


def way(*knots):
    """Trajectory of (time in s, x, y)."""
    time_s, x_m, y_m = np.array(knots, float).T
    zeros = np.zeros(len(knots))
    return Trajectory(
        time_us=(time_s * 1e6).astype(int),
        x_m=x_m,
        y_m=y_m,
        level=zeros,
        heading_rad=zeros,
        speed_m_s=zeros,
        edge=zeros - 1,
        offset_m=zeros,
        edge_speed_m_s=zeros,
        state=zeros,
    )


def errors(time_s, error_m):
    nothing = np.zeros(len(error_m))
    return PositionErrors(
        time_us=(np.array(time_s) * 1e6).astype(np.int64),
        error_m=np.array(error_m, float),
        wrong_level=nothing,
        wrong_aisle=nothing,
        graph_m=nothing,
        unmatched=0,
    )


def test_statistics_by_hand():
    found = statistics_of(np.array([1.0, 2.0, 3.0, 6.0]))
    # Mean 3, deviations -2, -1, 0, 3; squares 1, 4, 9, 36.
    assert found == {paper.MAX: 6.0, paper.MEAN: 3.0, paper.VARIANCE: 3.5, paper.MSE: 12.5}


def test_the_published_mean_squares_are_ours_of_the_published_means_and_variances():
    printed = {each.key: each.value for each in EXPERIMENT.published}
    for path in paper.PATHS:
        for mode in paper.MODES:
            mean, variance, square = (
                printed[paper.error_key(path, mode, name)]
                for name in (paper.MEAN, paper.VARIANCE, paper.MSE)
            )
            # Each is rounded to 0.005, the mean being 2.25 at most.
            assert square == pytest.approx(variance + mean**2, abs=0.01 + 2 * 2.25 * 0.005)


def test_the_published_vectors_turn_by_13_db_at_most():
    numbers = signal_numbers(np.array(paper.POINT_DBM))
    for each in EXPERIMENT.published:
        if each.key in numbers:
            assert numbers[each.key] == each.value
    assert numbers[paper.TURNED] == 13.0


def test_stands_that_last_long_enough():
    walk = way((0, 0, 0), (4, 4, 0), (12, 4, 0), (13, 5, 0), (18, 5, 0), (30, 6, 0), (36, 6, 0))
    # 8 s, 5 s, 12 s of creeping along, and exactly 6 s.
    assert stand_ends_us(walk, 6.0).tolist() == [12_000_000, 36_000_000]


def test_errors_in_force_at_a_time():
    walk = errors([1, 2, 2, 3], [0.1, 0.2, 0.3, 0.4])
    moments_us = np.array([1_000_000, 1_999_999, 2_000_000, 9_000_000])
    assert errors_at_m(walk, moments_us).tolist() == [0.1, 0.1, 0.3, 0.4]


def test_a_distribution_rises_from_0_to_1_a_step_at_each_value():
    curve = distribution("", np.array([3.0, 1.0]))
    assert curve.x.tolist() == [1.0, 1.0, 3.0]
    assert curve.y.tolist() == [0.0, 0.5, 1.0]


def test_one_seed_gives_a_finite_number_for_everything_published():
    numbers = trial().numbers
    assert all(np.isfinite(value) for value in numbers.values())
    assert {each.key for each in EXPERIMENT.published} <= set(numbers)
    printed = {each.key for each in EXPERIMENT.published}
    for expected in EXPERIMENT.expected:
        assert {expected.better, expected.worse} <= printed


def test_a_seed_gives_the_same_numbers_every_time():
    assert EXPERIMENT.trial(SEED).numbers == trial().numbers
    other = EXPERIMENT.trial(SEED + 1).numbers
    key = paper.error_key("simple", paper.WITH, paper.MEAN)
    assert other[key] != trial().numbers[key]


def test_table_3_is_of_every_reading_of_the_walk():
    numbers = error_numbers(room())
    for path in paper.PATHS:
        readings = room().recording.by_name[path].observations.readings
        for mode in paper.MODES:
            found = room().errors[path, mode]
            assert len(found) == len(readings)
            mean_m = float(np.mean(found.error_m))
            assert numbers[paper.error_key(path, mode, paper.MEAN)] == mean_m


def test_the_modes_differ_from_the_first_correction_on():
    for path in paper.PATHS:
        without, corrected = (room().errors[path, mode] for mode in paper.MODES)
        ends_us = stand_ends_us(room().truth.walks[path].trajectory, 6.0)
        assert len(ends_us) == 3
        # Stands of 8 s, of which the correction leaves the first 6 s alone.
        before = without.time_us < ends_us[0] - 2_100_000
        assert without.error_m[before].tolist() == corrected.error_m[before].tolist()
        assert without.error_m.tolist() != corrected.error_m.tolist()


def test_the_vectors_of_the_point_are_the_means_of_what_was_heard_there():
    seen = room().recording.by_name["fingerprints"].observations
    marks, readings = seen.marks, seen.readings
    assert pytest.approx((5.1, 4.5)) == POINT_M
    here = np.hypot(marks.x_m - POINT_M[0], marks.y_m - POINT_M[1]) < 0.01
    rows = np.flatnonzero(here)
    turns = np.degrees(marks.heading_rad[rows]).round() % 360
    # A mark at the beginning of each stand, and one at its end; while the tester turns to the next
    # direction, the mark before still holds.
    assert turns.tolist() == [0, 0, 90, 90, 180, 180, 270, 270]
    after = np.searchsorted(marks.time_us[rows], readings.time_us) - 1
    at_point = (after >= 0) & (readings.time_us <= marks.time_us[rows[-1]])
    found = point_signals_dbm(room().survey)
    for direction in range(4):
        for beacon in range(4):
            own = at_point & (turns[after] == 90 * direction) & (readings.beacon == beacon)
            expected_dbm = np.mean(readings.rssi_dbm[own].astype(float))
            assert found[direction, beacon] == pytest.approx(expected_dbm, abs=1e-9)


def test_pictures_have_names_of_their_own_and_labels_with_units():
    few = {key: np.array([value, value + 0.1]) for key, value in trial().numbers.items()}
    pictures = [*trial().pictures, *EXPERIMENT.overview(few)]
    assert len({picture.name for picture in pictures}) == len(pictures) == 9
    for picture in pictures:
        assert picture.x_label.endswith("]")
        assert picture.y_label.endswith("]")
        assert all(len(curve.x) == len(curve.y) > 1 for curve in picture.curves)


def test_errors_of_the_stands_alone_are_told_instead_of_those_of_every_reading():
    found = changed("errors-where-the-tester-stood").trial(SEED).numbers
    ends = trial().numbers
    for path in paper.PATHS:
        for mode in paper.MODES:
            for statistic in (paper.MAX, paper.MEAN):
                key = paper.error_key(path, mode, statistic)
                assert found[key] == ends[paper.stand_key(path, mode, statistic)]


def test_a_change_shows_keys_of_its_own_numbers():
    numbers = set(trial().numbers)
    for change in CHANGES:
        assert 2 <= len(change.shown) <= 6
        assert all(isinstance(key, Key) for key in change.shown)
        assert numbers.issuperset(change.shown)


@pytest.mark.parametrize(
    ("name", "stands"),
    [
        ("stands-of-30-s", {"simple": 3, "complex": 3}),
        ("stands-of-30-s-beside-every-beacon", {"simple": 7, "complex": 6}),
    ],
)
def test_the_tester_stands_longer(name, stands):
    other = changed(name)
    there = walked(SEED, other.values, other.estimator)
    for path, count in stands.items():
        trajectory = there.truth.walks[path].trajectory
        assert len(stand_ends_us(trajectory, 29.9)) == count
        # None other than these.
        assert len(stand_ends_us(trajectory, 6.0)) == count


def test_beside_a_beacon_is_as_near_as_it_says():
    other = changed("stands-beside-every-beacon")
    there = walked(SEED, other.values, other.estimator)
    beacons_m = there.recording.venue.beacon_xyz_m[:, :2]
    for path, most_m in {"simple": 0.61, "complex": 1.4}.items():
        trajectory = there.truth.walks[path].trajectory
        place = trajectory.at(stand_ends_us(trajectory, 6.0))
        away_m = np.hypot(
            place.x_m[:, None] - beacons_m[:, 0], place.y_m[:, None] - beacons_m[:, 1]
        )
        assert np.max(np.min(away_m, axis=1)) < most_m
        assert set(np.argmin(away_m, axis=1)) == {0, 1, 2, 3}


def test_without_body_and_multipath_no_direction_differs_from_another():
    values = {"radio.people.body_loss_db": 0.0, "radio.fading.model": "none"}
    turned_db = PdrFingerprintExperiment(values=values).trial(SEED).numbers[paper.TURNED]
    # Sway and rounding remain.
    assert turned_db < 1.0
    assert trial().numbers[paper.TURNED] > 5.0


def test_a_filter_without_noise_walks_the_same_way_whatever_it_hears():
    settings = changed("four-choices-together").estimator
    deaf = replace(settings, start_m=0.0, step_variance_m2=0.0)
    ways_m = []
    for multipath in ("rician", "none"):
        there = walked(SEED, {"radio.fading.model": multipath}, deaf)
        track = there.tracks["simple", paper.WITHOUT]
        way_m = np.stack([track.x_m, track.y_m], axis=1)
        moved = np.any(np.diff(way_m, axis=0) != 0.0, axis=1)
        ways_m.append(way_m[1:][moved])
    assert len(ways_m[0]) > 40
    assert ways_m[0] == pytest.approx(ways_m[1], abs=1e-9)


def test_the_page_quotes_changes_by_their_names():
    page = files("blesim") / "docs" / "reruns" / "pdr-fingerprint.md"
    quoted = set(re.findall(r'"([^"]+)"', page.read_text(encoding="utf-8")))
    assert quoted == {change.name for change in CHANGES}
