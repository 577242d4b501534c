"""The rerun of the paper on map-compensated headings: its sums by hand, its numbers complete."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import blesim
from blesim.estimators.base import StartInfo, make_track
from blesim.pdr.step_length import Weinberg
from blesim.reruns import map_ekf, map_ekf_numbers
from blesim.reruns.base import Key
from blesim.reruns.map_ekf_changes import CHANGES
from blesim.reruns.map_ekf_gait import (
    THRESHOLDS_S,
    best_range,
    known_by_walkers,
    known_walks,
    off_summary,
)
from blesim.reruns.map_ekf_numbers import EXPECTED, PUBLISHED
from blesim.reruns.map_ekf_walk import (
    KEPT_ROW,
    TRIED,
    Solving,
    errors_m,
    heading_errors_deg,
    heading_numbers,
    misplaced,
    solutions,
    step_headings,
)
from blesim.reruns.sites import scenario_of
from blesim.simulate import Simulation
from blesim.tables import Trajectory

SECOND = 1_000_000


@pytest.fixture(scope="module")
def trials():
    # One walk instead of ten: what is asked here does not hang on their number.
    experiment = map_ekf.MapEkf(walks=1)
    return experiment.trial(1, pictures=True), experiment.trial(1)


def straight_walk():
    """East along the x axis for ten seconds at 1 m/s."""
    return Trajectory(
        time_us=np.array([0, 10 * SECOND]),
        x_m=np.array([0.0, 10.0]),
        y_m=np.zeros(2),
        level=np.zeros(2, int),
        heading_rad=np.zeros(2),
        speed_m_s=np.array([1.0, 0.0]),
        edge=np.zeros(2, int),
        offset_m=np.array([0.0, 10.0]),
        edge_speed_m_s=np.array([1.0, 0.0]),
        state=np.array([0, 0]),
    )


def track(times_s, x_m, y_m):
    return make_track(
        time_us=np.array(times_s) * SECOND,
        x_m=x_m,
        y_m=y_m,
        variance_x_m2=1.0,
        variance_y_m2=1.0,
    )


class TestBestRange:
    def test_exact_run_and_what_is_within_five_percent_around_it(self):
        counts = np.array([0, 37, 38, 40, 40, 40, 42, 43, 40])
        best = best_range(counts, 40)
        assert (best.first, best.last) == (3, 5)
        assert (best.near_first, best.near_last) == (2, 6)

    def test_without_an_exact_count_the_nearest_stands_in(self):
        best = best_range(np.array([0, 90, 99, 99, 90, 99, 0]), 100)
        assert (best.first, best.last) == (2, 3)
        assert (best.near_first, best.near_last) == (2, 3)

    def test_a_best_count_that_is_not_within_five_percent_is_its_own_neighbourhood(self):
        best = best_range(np.array([0, 5, 8, 5]), 10)
        assert (best.first, best.last, best.near_first, best.near_last) == (2, 2, 2, 2)


class TestNumbers:
    def test_differences_of_the_paper_make_its_mean_largest_and_variance(self):
        real_m = np.array(map_ekf_numbers.DISTANCES_M)
        printed = {each.key: each.value for each in PUBLISHED}
        for row in map_ekf_numbers.MODELS:
            columns = map(map_ekf_numbers.length_column, map_ekf_numbers.DISTANCES_M)
            found_m = np.array([printed["table 2", row, column] for column in columns])
            mean_m, most_m, variance_m2 = off_summary(found_m - real_m)
            assert mean_m == pytest.approx(printed["table 2", row, "mean off [m]"], abs=6e-4)
            assert most_m == pytest.approx(printed["table 2", row, "most off [m]"], abs=6e-4)
            assert variance_m2 == pytest.approx(
                printed["table 2", row, "variance of off [m2]"], abs=6e-3
            )

    def test_tables_four_and_five_print_the_same_for_twenty_beacons(self):
        printed = {each.key: each.value for each in PUBLISHED}
        for column in ("least [m]", "mean [m]", "most [m]"):
            assert printed["table 4", "EKFPDR", column] == printed["table 5", "20 beacons", column]

    def test_orderings_have_the_published_sign(self):
        printed = {each.key: each.value for each in PUBLISHED}
        assert all(printed[each.better] < printed[each.worse] for each in EXPECTED)

    def test_strong_orderings_are_those_of_the_issue(self):
        strong = {(each.better[1], each.worse[1]) for each in EXPECTED if each.strong}
        assert strong == {
            ("EKFPDR", "BEPDR"),
            ("BEPDR", "OHPDR"),
            ("EKFPDR", "OHPDR"),
            ("AHPDR", "OHPDR"),
            ("20 beacons", "10 beacons"),
        }


class TestErrors:
    def test_the_estimate_in_force_counts_and_before_it_the_start(self):
        start = StartInfo(x_m=0.0, y_m=2.0, level=0)
        found = errors_m(
            track([2, 4], [2.0, 7.0], [0.0, 4.0]),
            start,
            straight_walk(),
            np.array([0, 1, 2, 3, 4]) * SECOND,
        )
        assert found == pytest.approx([2.0, math.sqrt(5), 0.0, 1.0, 5.0])

    def test_headings_are_those_of_the_moves(self):
        start = StartInfo(x_m=0.0, y_m=0.0, level=0)
        moved = track([1, 2, 3, 4], [1.0, 1.0, 1.0, 0.0], [0.0, 0.0, 1.0, 2.0])
        time_us, heading_rad = step_headings(moved, start)
        assert time_us.tolist() == [1 * SECOND, 3 * SECOND, 4 * SECOND]
        assert heading_rad == pytest.approx([0.0, math.pi / 2, 3 * math.pi / 4])

    def test_the_walk_is_told_to_begin_two_metres_off_and_ends_where_it_did(self):
        file = scenario_of("campus-corridor")
        recording, _ = Simulation.run(file, 1).recording()
        walk = recording.by_name["b-to-c"]
        told, true = misplaced(walk, 1).observations.marks, walk.observations.marks
        off_m = np.hypot(told.x_m - true.x_m, told.y_m - true.y_m)
        assert off_m == pytest.approx([2.0] + [0.0] * (len(true) - 1), abs=1e-5)


class TestTrial:
    def test_gives_a_finite_number_for_every_key(self, trials):
        numbers = trials[0].numbers
        assert {each.key for each in PUBLISHED} <= numbers.keys()
        assert all(math.isfinite(value) for value in numbers.values())

    def test_is_the_same_once_more(self, trials):
        assert trials[0].numbers == trials[1].numbers

    def test_shows_eq_17_to_the_letter_beside_the_filter(self, trials):
        assert Key("table 4", KEPT_ROW, "mean [m]") in trials[0].numbers

    def test_no_valley_is_found_soon_enough_with_the_least_thresholds(self, trials):
        for gait in map_ekf_numbers.GAITS:
            assert trials[0].numbers["table 1", gait, "counted at 0.01 s [-]"] == 0

    def test_twenty_beacons_are_the_same_in_both_tables(self, trials):
        for column in ("least [m]", "mean [m]", "most [m]"):
            assert (
                trials[0].numbers["table 4", "EKFPDR", column]
                == trials[0].numbers["table 5", "20 beacons", column]
            )

    def test_pictures_have_names_of_their_own_and_curves_that_fit(self, trials):
        pictures = [
            *trials[0].pictures,
            *map_ekf.EXPERIMENT.overview(
                {key: np.array([value]) for key, value in trials[0].numbers.items()}
            ),
        ]
        assert len({picture.name for picture in pictures}) == len(pictures)
        curves = [curve for picture in pictures for curve in picture.curves]
        assert all(len(curve.x) == len(curve.y) > 0 for curve in curves)
        assert not trials[1].pictures

    def test_walks_of_two_seeds_have_nothing_in_common(self):
        assert len(set(map_ekf.seeds_of(1)) | set(map_ekf.seeds_of(2))) == 20


class TestChanges:
    def test_show_what_the_experiment_gives(self, trials):
        for change in CHANGES:
            assert trials[0].numbers.keys() >= set(change.shown), change.name

    @pytest.mark.parametrize(
        "name", ["four people", "corridors within 20 degrees", "errors every 15 steps"]
    )
    def test_give_what_they_show(self, name):
        change = next(each for each in CHANGES if each.name == name)
        numbers = replace(change.experiment, walks=1).trial(1).numbers
        assert numbers.keys() >= set(change.shown)

    def test_walks_of_one_strength_and_height_have_one_coefficient(self):
        file = scenario_of("campus-corridor", {"walks.*.gait": {"length_at_rest_m": 0.142}})
        recording, _ = Simulation.run(file, 1).recording()
        own = known_walks(recording)
        same = known_by_walkers(file, 1, same=False)
        assert [walk.distance_m for walk in same] == [walk.distance_m for walk in own]
        assert np.ptp(coefficients(same)) < 0.5 * np.ptp(coefficients(own))

    def test_people_are_told_apart_by_their_gait(self):
        file = scenario_of("campus-corridor")
        by_person, alike = (known_by_walkers(file, 1, same=same) for same in (False, True))
        # Strengths belong to names: the first walk's person is the first of all.
        assert np.array_equal(by_person[0].features.period_s, alike[0].features.period_s)
        assert np.ptp(coefficients(alike)) < np.ptp(coefficients(by_person))

    def test_fewer_looks_are_some_of_all_and_an_exact_start_has_no_error(self):
        file = scenario_of("campus-corridor")
        tried = {20: {"OHPDR": TRIED[20]["OHPDR"]}}
        often, seldom, exact = (
            solutions(file, 1, solving).solved["OHPDR", 20].error_m
            for solving in (
                Solving(tried=tried),
                Solving(tried=tried, every_steps=15),
                Solving(tried=tried, start_off_m=0.0),
            )
        )
        assert np.array_equal(seldom, often[::15])
        assert often[0] == pytest.approx(2.0, abs=1e-5)
        assert exact[0] == 0.0

    def test_steps_of_training_can_be_left_out(self):
        file = scenario_of("campus-corridor")
        tried = {20: {name: TRIED[20][name] for name in ("OHPDR", "AHPDR")}}
        found = solutions(file, 1, Solving(tried=tried))
        _, azimuth_deg, off_deg = heading_errors_deg(found, "AHPDR")
        told = dict(heading_numbers(found, Solving(trained_steps=10)))
        later_deg = np.abs(off_deg[azimuth_deg == 180])[10:]
        assert told["table 3", "180 deg", "compensated, mean [deg]"] == later_deg.mean()

    def test_values_reach_the_scenario(self):
        key = Key("table 3", "270 deg", "raw, mean [deg]")
        tried = {20: {"OHPDR": TRIED[20]["OHPDR"]}}
        no_steel = {"magnetics.anomaly_ut": 0.0, "magnetics.clutter_ut": 0.0}
        usual, clean = (
            map_ekf.MapEkf(values=values, solving=Solving(tried=tried), walks=3)
            .trial(1)
            .numbers[key]
            for values in ({}, no_steel)
        )
        assert clean < 0.7 * usual


def coefficients(walks):
    """K of Eq 8 that each walk alone would give."""
    return [walk.distance_m / Weinberg(k=1.0).terms(walk.features)[0].sum() for walk in walks]


def test_thresholds_are_hundredths():
    assert THRESHOLDS_S[14] == 0.14


def test_the_page_is_there_and_names_its_experiments():
    page = Path(blesim.__file__).parent / "docs" / "reruns" / "map-ekf.md"
    text = page.read_text(encoding="utf-8")
    for table in ("table 1", "table 2", "table 3", "table 4", "table 5"):
        assert table in text.lower()
    for change in CHANGES:
        assert f'"{change.name}"' in text
