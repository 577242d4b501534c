"""The aisle-graph experiment: every printed number is simulated, by methods worked by hand."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from blesim.report.picture_figure import draw
from blesim.reruns.aisle_graph import EXPERIMENT, AisleGraph, reshelved
from blesim.reruns.aisle_graph_changes import CHANGES
from blesim.reruns.aisle_graph_numbers import (
    FILTER,
    NEAREST,
    OTHER,
    PAIR,
    SAME,
    chosen_key,
    error_key,
    exponent_key,
    parameters_of,
    particles_key,
    welch_key,
)
from blesim.reruns.aisle_graph_search import (
    LABEL,
    beacon_pairs,
    best_of,
    errors_m,
    nearest_averaged,
    nearest_highest,
    particle_filters,
    printed,
)
from blesim.reruns.aisle_graph_signals import AisleSignals, bump, fitted_exponent, mean_curve
from blesim.reruns.aisle_graph_significance import clustered, welch
from blesim.reruns.registry import change_of
from blesim.reruns.sites import scenario_of
from blesim.simulate import Simulation


def small_trial(seed, *, pictures=False):
    """A trial with a small grid: what is tested here does not depend on its size."""
    with pytest.MonkeyPatch.context() as patch:
        search = "blesim.reruns.aisle_graph_search"
        patch.setattr(f"{search}.SPREADS_SAME_DB", (4.0,))
        patch.setattr(f"{search}.SPREADS_OTHER_DB", (6.0,))
        patch.setattr(f"{search}.VELOCITY_LIMITS_M_S", (4.0,))
        return EXPERIMENT.trial(seed, pictures=pictures)


@pytest.fixture(scope="module")
def trial():
    return small_trial(1, pictures=True)


@pytest.fixture(scope="module")
def simulated():
    return Simulation.run(scenario_of("wholesale-section"), 1).recording()


def test_every_published_number_is_simulated(trial):
    for each in EXPERIMENT.published:
        assert np.isfinite(trial.numbers[each.key]), each.key
    assert all(np.isfinite(value) for value in trial.numbers.values())


def test_every_ordering_is_of_published_numbers():
    printed = {each.key: each.value for each in EXPERIMENT.published}
    for each in EXPERIMENT.expected:
        better = printed[each.better]
        worse = printed[each.worse]
        assert better < worse
    strong = {(each.better.row, each.worse.row) for each in EXPERIMENT.expected if each.strong}
    assert strong == {(FILTER, PAIR), (PAIR, NEAREST), (FILTER, NEAREST)}


def test_no_key_is_published_twice():
    keys = [each.key for each in EXPERIMENT.published]
    assert len(keys) == len(set(keys))


def test_the_same_seed_gives_the_same_numbers(trial):
    assert small_trial(1).numbers == trial.numbers
    assert small_trial(2).numbers != trial.numbers


def test_pictures_can_be_drawn(trial):
    names = [picture.name for picture in trial.pictures]
    assert {"figure-5", "figure-6", "figure-7", "errors"} < set(names)
    assert len(names) == len(set(names))
    for picture in (*trial.pictures, *EXPERIMENT.overview(_stacked(trial.numbers))):
        assert draw(picture).axes


def _stacked(numbers):
    return {key: np.array([value]) for key, value in numbers.items()}


def test_totals_count_each_reading_once(trial, simulated):
    counts = [len(walk.observations.readings) for walk in simulated[0].walks]
    means = [trial.numbers[error_key(NEAREST, f"run {run}")] for run in (1, 2, 3)]
    total = trial.numbers[error_key(NEAREST, "total")]
    assert total == pytest.approx(np.average(means, weights=counts), rel=1e-12)


def test_500_particles_are_the_filter_of_table_2(trial):
    for column, figure in itertools.product(("run 1", "run 3", "total"), ("mean", "std")):
        twice = particles_key(500, column, figure), error_key(FILTER, column, figure)
        assert trial.numbers[twice[0]] == trial.numbers[twice[1]]


def test_the_test_of_the_totals_is_about_their_difference(trial):
    difference_m = (
        trial.numbers[error_key(PAIR, "total")] - trial.numbers[error_key(FILTER, "total")]
    )
    assert trial.numbers[welch_key(PAIR, "difference [m]")] == pytest.approx(difference_m)


def test_the_search_finds_the_least_error_of_run_1(trial, simulated):
    errors = [errors_m(each, *simulated, "run-1", 1).mean() for each in nearest_highest()]
    assert trial.numbers[error_key(NEAREST, "run 1")] == min(errors)
    best = best_of(nearest_highest(), *simulated, "run-1", 1)
    assert errors_m(best, *simulated, "run-1", 1).mean() == min(errors)
    assert trial.numbers[chosen_key(NEAREST, "window_s")] == best.window_s


def test_the_published_choices_are_in_the_grids():
    printed = {each.key: each.value for each in EXPERIMENT.published}
    grids = {
        NEAREST: nearest_highest(),
        "nearest beacon, averaged": nearest_averaged(),
        PAIR: beacon_pairs(),
        "250 particles": particle_filters(250),
        "500 particles": particle_filters(500),
        "1000 particles": particle_filters(1000),
    }
    for row, grid in grids.items():
        names = parameters_of(row)
        printed_choice = [printed[chosen_key(row, name)] for name in names]
        assert printed_choice in [[getattr(each, name) for name in names] for each in grid], row


def test_welch_by_hand_and_by_scipy():
    # Means 2 and 4; variances 1 and 4; t = -2 / sqrt(1/3 + 4/3); 2.94 degrees of freedom:
    # (5/3)^2 / ((1/9)/2 + (16/9)/2).
    found = welch(np.array([1.0, 2.0, 3.0]), np.array([2.0, 4.0, 6.0]))
    assert found.t == pytest.approx(-2.0 / np.sqrt(5.0 / 3.0))
    assert found.difference_m == pytest.approx(-2.0)
    freedom = (25.0 / 9.0) / (17.0 / 18.0)
    assert found.half_m == pytest.approx(stats.t.ppf(0.995, freedom) * np.sqrt(5.0 / 3.0))
    rng = np.random.default_rng(3)
    one, two = rng.exponential(1.1, 300), rng.exponential(1.7, 200)
    told = stats.ttest_ind(one, two, equal_var=False)
    ends = told.confidence_interval(0.99)
    assert welch(one, two).t == pytest.approx(told.statistic)
    assert welch(one, two).half_m == pytest.approx((ends.high - ends.low) / 2)


def test_runs_are_the_unit_of_the_clustered_test():
    # Differences of the runs: -1, -2, -3; mean -2, standard deviation 1; t = -2 sqrt(3), and
    # 9.925 is the 99.5 % point of Student's t with 2 degrees of freedom.
    ours = [np.array([1.0, 1.0]), np.array([1.0, 1.0, 1.0]), np.array([2.0])]
    theirs = [np.array([3.0, 1.0]), np.array([3.0, 4.0, 2.0]), np.array([5.0])]
    found = clustered(ours, theirs)
    assert found.t == pytest.approx(-2.0 * np.sqrt(3.0))
    assert found.difference_m == pytest.approx(-2.0)
    assert found.half_m == pytest.approx(9.925 / np.sqrt(3.0), rel=1e-3)
    # More readings of the same runs make it no surer.
    repeated = clustered([np.repeat(e, 9) for e in ours], [np.repeat(e, 9) for e in theirs])
    assert repeated.half_m == pytest.approx(found.half_m)


def test_the_exponent_of_a_noiseless_curve():
    distance_m = np.repeat(np.linspace(2.05, 15.95, 200), 3)
    signals = AisleSignals(distance_m=distance_m, rssi_dbm=-77.0 - 13.0 * np.log10(distance_m))
    # A bin's mean range and mean level do not lie exactly on a bent curve.
    assert fitted_exponent(signals) == pytest.approx(1.3, abs=0.005)
    raised = signals.rssi_dbm + np.where((distance_m >= 8) & (distance_m < 9), 4.0, 0.0)
    range_m, height_db = bump(AisleSignals(distance_m=distance_m, rssi_dbm=raised))
    assert range_m == pytest.approx(8.5, abs=0.1)
    assert height_db == pytest.approx(4.0, abs=0.4)


def test_bins_with_few_readings_are_left_out():
    distance_m = np.array([2.5] * 10 + [3.5] * 9 + [1.5] * 20 + [16.5] * 20)
    signals = AisleSignals(distance_m=distance_m, rssi_dbm=np.full(len(distance_m), -80.0))
    assert mean_curve(signals)[0].tolist() == [2.5]
    assert len(signals.within((3, 4))) == 9


def changed(name):
    """An experiment with one thing otherwise, without its search."""
    return replace(change_of("aisle-graph", name).experiment, grids=printed)


@pytest.fixture(scope="module")
def unsearched():
    return AisleGraph(grids=printed).trial(1).numbers


def test_changes_give_the_numbers_that_they_show(unsearched):
    for change in CHANGES:
        assert set(change.shown) <= set(unsearched)
    assert EXPERIMENT.grids().keys() == printed().keys()
    methods = change_of("aisle-graph", "half-the-spread").experiment.grids()
    assert {"500 particles", NEAREST, PAIR} < set(methods) < set(printed())


def test_without_a_search_the_printed_parameters_are_chosen(unsearched):
    told = {each.key: each.value for each in EXPERIMENT.published}
    for row in printed():
        for name in parameters_of(row):
            assert unsearched[chosen_key(row, name)] == told[chosen_key(row, name)]


def test_a_deaf_phone_flattens_the_curves_that_a_steeper_air_steepens(unsearched):
    deaf, both = (
        changed(name).trial(1).numbers for name in ("deaf-phone-alone", "deaf-phone-steeper-air")
    )
    for where in (SAME, OTHER):
        key = exponent_key(where)
        assert deaf[key] < unsearched[key] - 0.1
        assert both[key] == pytest.approx(unsearched[key], abs=0.1)


def test_shelves_of_another_material_weaken_other_aisles_alone(simulated, unsearched):
    change = changed("shelves-of-liquids-or-metal")
    before = simulated[0].venue
    after = reshelved(before, change.shelves)
    assert {each.loss.crossing_db for each in before.floor_plan.obstacles} == {3.0}
    assert {each.loss.crossing_db for each in after.floor_plan.obstacles} == {9.0}
    assert replace(after, floor_plan=before.floor_plan) == before
    weaker = change.trial(1).numbers
    same, other = exponent_key(SAME), exponent_key(OTHER)
    assert weaker[same] == pytest.approx(unsearched[same], abs=0.02)
    assert weaker[other] > unsearched[other] + 0.15


def test_other_random_numbers_move_the_filter_alone(simulated):
    again = f"{LABEL} again"
    for method, (estimator,) in printed().items():
        twice = [errors_m(estimator, *simulated, "run-2", 1, label) for label in (LABEL, again)]
        drawn = "particles" in method
        assert np.array_equal(*twice) is not drawn
