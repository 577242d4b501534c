"""The rerun of the paper on map-compensated headings: its sums by hand, its numbers complete."""

import math
from pathlib import Path

import numpy as np
import pytest

import blesim
from blesim.estimators.base import StartInfo, make_track
from blesim.reruns import map_ekf, map_ekf_numbers
from blesim.reruns.base import Key
from blesim.reruns.map_ekf_gait import THRESHOLDS_S, best_range, off_summary
from blesim.reruns.map_ekf_numbers import EXPECTED, PUBLISHED
from blesim.reruns.map_ekf_walk import KEPT_ROW, errors_m, misplaced, step_headings
from blesim.reruns.registry import experiment_of
from blesim.reruns.sites import scenario_of
from blesim.simulate import Simulation
from blesim.tables import Trajectory

SECOND = 1_000_000


@pytest.fixture(scope="module")
def trials():
    # One walk instead of ten: what is asked here does not hang on their number.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(map_ekf, "_WALKS", 1)
        experiment = experiment_of("map-ekf")
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


def test_thresholds_are_hundredths():
    assert THRESHOLDS_S[14] == 0.14


def test_the_page_is_there_and_names_its_experiments():
    page = Path(blesim.__file__).parent / "docs" / "reruns" / "map-ekf.md"
    text = page.read_text(encoding="utf-8")
    for table in ("Table 1", "Table 2", "Table 3", "Table 4", "Table 5"):
        assert table in text
