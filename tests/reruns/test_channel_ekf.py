"""Rerun of the channel-separate paper: every number, repeatable, and what it computes by hand."""

import re
from dataclasses import replace
from importlib.resources import files
from types import SimpleNamespace

import numpy as np
import pytest

from blesim.estimators.channel_ekf import ChannelEkf, ChannelRanges
from blesim.estimators.fingerprint_maps import Places
from blesim.ranging.polynomial_range import PolynomialRange
from blesim.ranging.radio_map import MapLayout, RadioMap
from blesim.reruns import channel_ekf_numbers as paper
from blesim.reruns.channel_ekf import EXPERIMENT, headline, still_readings
from blesim.reruns.channel_ekf_changes import CHANGES
from blesim.reruns.channel_ekf_otherwise import (
    by_fingerprints_alone,
    by_polynomials_alone,
    to_every_beacon,
)
from blesim.reruns.channel_ekf_ranging import (
    beacon_errors,
    channel_means,
    channels_heard,
    far_error_m,
    left_out_errors_m,
    mean_levels,
)
from blesim.reruns.sites import scenario_of
from blesim.simulate import Simulation
from blesim.tables import Readings

NAN = np.nan


@pytest.fixture(scope="module")
def trial():
    return EXPERIMENT.trial(1, pictures=True)


def test_every_published_number_is_there_and_finite(trial):
    for each in EXPERIMENT.published:
        assert np.isfinite(trial.numbers[each.key]), each.key


def test_a_seed_gives_the_same_numbers_again(trial):
    assert EXPERIMENT.trial(1).numbers == trial.numbers


def test_pictures_have_names_of_their_own_and_curves(trial):
    drawn = [
        *trial.pictures,
        *EXPERIMENT.overview({k: np.array([v]) for k, v in trial.numbers.items()}),
    ]
    names = [picture.name for picture in drawn]
    assert len(set(names)) == len(names) == 16
    for curve in (curve for picture in drawn for curve in picture.curves):
        assert len(curve.x) == len(curve.y) > 0
        assert np.all(np.isfinite(curve.y))


def test_every_ordering_is_of_two_printed_numbers_that_differ_as_told():
    printed = {each.key: each.value for each in EXPERIMENT.published}
    assert len(printed) == len(EXPERIMENT.published)
    for each in EXPERIMENT.expected:
        assert printed[each.better] < printed[each.worse]
    strong = [(each.better.row, each.worse.row) for each in EXPERIMENT.expected if each.strong]
    assert strong == [
        ("sparse, proposed", "sparse, FP + EKF"),
        ("sparse, FP + EKF", "sparse, PM + EKF"),
    ]


def test_the_headline_is_that_of_the_abstract():
    printed = {each.key: each.value for each in EXPERIMENT.published}
    for key, value in headline(printed).items():
        # Metres and per cent as printed, to two places; the abstract rounds from more.
        assert value == pytest.approx(printed[key], abs=0.02), key


def test_the_error_of_nine_in_ten_is_a_mean_over_groups():
    group = np.array([0, 1, 0, 1, 0])
    error_m = np.array([0.0, 4.0, 5.0, 14.0, 10.0])
    # 90 % of 0, 5, 10 is 9; of 4, 14 it is 13.
    assert far_error_m(group, error_m) == pytest.approx(11.0)


def distances():
    """Two beacons; the first is heard on two channels, the second on the last one alone."""
    return SimpleNamespace(
        beacon=np.array([0, 0, 0, 1]),
        channel=np.array([0, 0, 2, 5]),
        by_model={"POLY2": np.array([1.0, 3.0, 5.0, 7.0])},
        aggregate_beacon=np.array([0, 0, 0, 1]),
        aggregate=np.array([2.0, 2.0, 2.0, 8.0]),
    )


def test_channels_that_were_not_heard_have_no_mean():
    assert channel_means(distances(), "POLY2").tolist() == [2.0, 5.0, 7.0]


def test_beacons_are_averaged_channel_by_channel():
    heard = SimpleNamespace(
        beacon=np.array([0, 0, 0, 1, 1, 1]),
        channel=np.array([0, 1, 2, 3, 4, 5]),
        by_model={"POLY2": np.array([1.0, 3.0, 5.0, 7.0, 9.0, 11.0])},
        aggregate_beacon=np.array([0, 1]),
        aggregate=np.array([2.0, 8.0]),
    )
    assert beacon_errors(heard) == {
        "channel 37": 4.0,
        "channel 38": 6.0,
        "channel 39": 8.0,
        "aggregate": 5.0,
    }


def test_a_point_is_located_among_the_others_by_what_it_heard():
    mean_dbm = np.array([[-60.0, NAN], [-62.0, -90.0], [-70.0, -80.0]])
    surveyed = RadioMap(
        layout=MapLayout(),
        x_m=np.array([0.0, 3.0, 3.0]),
        y_m=np.array([0.0, 0.0, 4.0]),
        level=np.zeros(3, np.int64),
        direction=np.full(3, -1),
        mean_dbm=mean_dbm,
        spread_db=np.full((3, 2), NAN),
        count=(~np.isnan(mean_dbm)).astype(np.int64),
    )
    # The second is 2 and 10 dB from the first, whose silence counts -100, but 8 and 10 from the
    # third; the third is 8 and 10 from the second, 10 and 20 from the first.
    assert left_out_errors_m(surveyed).tolist() == [3.0, 3.0, 4.0]


def test_levels_are_averaged_over_spots_that_hear_the_channel():
    spot = np.array([0, 0, 1, 2, 2, 2])
    rssi_dbm = np.array([-80.0, -82.0, -60.0, -90.0, -90.0, -90.0])
    assert mean_levels(spot, rssi_dbm) == pytest.approx((-85.5, np.sqrt(2) / 2))


def test_channels_are_counted_in_whole_seconds_from_the_first_reading():
    readings = Readings(
        time_us=np.array([500_000, 600_000, 700_000, 2_600_000, 3_600_000]),
        beacon=np.array([0, 0, 1, 1, 0]),
        rssi_dbm=np.full(5, -80),
        channel=np.array([37, 37, 37, 39, 38]),
    )
    assert channels_heard(readings).tolist() == [2, 0, 1]


def test_the_still_phone_is_five_metres_from_the_beacon_it_hears():
    file = scenario_of("office-dense")
    office = Simulation.run(file, 1).stage.built
    still = still_readings(file, office, 1)
    assert np.unique(still.spot).tolist() == [0, 1, 2, 3, 4]
    height_m = file.scenario.phones["iphone-4s"].height_m
    places_m = np.stack([still.x_m, still.y_m, np.full(len(still), height_m)], axis=1)
    apart_m = np.linalg.norm(office.beacon_xyz_m[still.beacon] - places_m, axis=1)
    np.testing.assert_allclose(apart_m, 5.0, atol=1e-3)


def test_a_phone_in_a_hand_hears_more_differences_than_one_that_lies():
    file = scenario_of("office-dense")
    office = Simulation.run(file, 1).stage.built
    spreads_db = [
        mean_levels(heard.spot[heard.channel == 37], heard.rssi_dbm[heard.channel == 37])[1]
        for heard in (still_readings(file, office, 1, held=held) for held in (False, True))
    ]
    assert spreads_db[0] < 1.0 < spreads_db[1]


def test_points_near_the_beacon_and_no_filter(trial):
    near = replace(EXPERIMENT, estimators={}, deployments=("dense",), farthest_m=15.0)
    found = near.trial(1).numbers
    for key in (paper.spread_key("POLY2"), paper.example_key("PM")):
        assert found[key] < trial.numbers[key]
    for mode in (*paper.CHANNEL_NAMES, paper.AGGREGATE):
        assert found[paper.place_key(mode)] == trial.numbers[paper.place_key(mode)]
    assert not {key for key in found if key.table in ("table 1", "table 2", "headline")}


def learned():
    """Two beacons 10 m apart, a polynomial that says 3 m, and the height of the phone."""
    curve = PolynomialRange(
        scaled=np.array([[3.0, 0.0], [3.0, 0.0]]),
        lowest_dbm=np.array([-90.0, -90.0]),
        highest_dbm=np.array([-60.0, -60.0]),
        spread_m=np.array([1.0, 1.0]),
    )
    estimator = ChannelEkf(separate=False, outliers_1=False)
    height_m = estimator.phone_height_m
    return ChannelRanges(
        beacons_m=np.array([[0.0, 0.0, height_m], [10.0, 0.0, height_m]]),
        levels=np.zeros(2, np.int64),
        curves=(curve,),
        maps=SimpleNamespace(),
        estimator=estimator,
    )


@pytest.mark.parametrize(
    ("ranged", "told_m"),
    [
        (lambda same: same, [3.5, NAN]),
        (by_fingerprints_alone, [4.0, NAN]),
        (by_polynomials_alone, [3.0, NAN]),
        (to_every_beacon, [3.5, 6.0]),
    ],
)
def test_ranges_are_made_of_what_a_change_says(ranged, told_m):
    # The first beacon is heard, from 4 m by fingerprints.
    places = Places(places_m=np.array([[4.0, 0.0]]), variance_m2=np.array([1.0]), level=0)
    ranges_m, _ = ranged(learned()).ranges(np.array([-70.0, NAN]), places)
    np.testing.assert_allclose(ranges_m, told_m)


def test_the_page_names_what_is_off():
    page = files("blesim") / "docs" / "reruns" / "channel-ekf.md"
    told = page.read_text(encoding="utf-8")
    for name in ("figure 1", "figure 5", "figure 7", "figure 8", "figure 9", "figure 11"):
        assert re.search(rf"(?i)\b{name}\b", told)
    for name in ("table 1", "table 2", "table 3", "headline", "Eq 32", *paper.METHODS):
        assert name in told


def test_the_page_quotes_changes_by_their_names():
    page = files("blesim") / "docs" / "reruns" / "channel-ekf.md"
    quoted = set(re.findall(r'"([^"]+)"', page.read_text(encoding="utf-8")))
    names = {change.name for change in CHANGES}
    assert quoted == names
