import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from blesim.errors import DataError, UsageError
from blesim.estimators.practice import practice_recording, practice_venue
from blesim.ranging.proximity import (
    Proximity,
    ProximityRule,
    ProximityWindow,
    announced_power_dbm,
    surveyed_classes,
)
from blesim.ranging.proximity_likelihood import (
    PUBLISHED_NEAR,
    DistanceShares,
    distance_shares,
    fit_proximity_likelihood,
)
from blesim.ranging.survey_readings import survey_readings
from blesim.tables import Readings

UNKNOWN, IMMEDIATE, NEAR, FAR = Proximity
POWER_DBM = np.array([-60.0, -50.0])


def readings_of(rows):
    """Rows of (seconds, beacon, RSSI, class told)."""
    columns = np.array(sorted(rows, key=lambda row: row[0]), np.float64).reshape(-1, 4).T
    return Readings(
        time_us=(columns[0] * 1e6).astype(np.int64),
        beacon=columns[1].astype(np.int64),
        rssi_dbm=columns[2].astype(np.int64),
        channel=np.zeros(len(columns[0]), np.int64),
        proximity=columns[3].astype(np.int64),
    )


def test_thresholds_worked_by_hand():
    # n = 2: -60 is 1 m, -60 - 20 log10(3) = -69.54 is 3 m; the bounds belong to the nearer class.
    signals_dbm = np.array([-59, -60, -60.1, -69.5, -69.6, np.nan])
    classes = ProximityRule().classes(signals_dbm, np.array(-60.0))
    assert classes.tolist() == [IMMEDIATE, IMMEDIATE, NEAR, NEAR, FAR, UNKNOWN]


def test_classes_are_numbered_as_recordings_do():
    assert [int(each) for each in Proximity] == [0, 1, 2, 3]


def test_each_beacon_is_held_against_its_own_power():
    readings = readings_of([(0, 0, -58, 0), (0, 1, -58, 0)])
    classes = ProximityWindow(POWER_DBM, ProximityRule()).classes(readings)
    assert classes.tolist() == [[IMMEDIATE, UNKNOWN], [IMMEDIATE, NEAR]]


def test_what_the_phone_tells_comes_first_unless_it_is_not_believed():
    readings = readings_of([(0, 0, -90, NEAR), (1, 1, -40, FAR), (2, 1, -40, 0)])
    believed = ProximityWindow(POWER_DBM, ProximityRule()).classes(readings)
    assert believed.tolist() == [[NEAR, UNKNOWN], [NEAR, FAR], [NEAR, IMMEDIATE]]
    rule = ProximityRule(believe_phone=False)
    own = ProximityWindow(POWER_DBM, rule).own_classes(readings)
    assert own.tolist() == [FAR, IMMEDIATE, IMMEDIATE]


@pytest.mark.parametrize("told", [0, NEAR])
def test_a_beacon_not_heard_for_the_window_is_unknown(told):
    window = ProximityWindow(POWER_DBM, ProximityRule(window_s=3.0))
    window.classes(readings_of([(1, 0, -65, told)]))
    assert window.at(3_999_999).tolist() == [NEAR, UNKNOWN]
    assert window.at(4_000_000).tolist() == [UNKNOWN, UNKNOWN]


READING = st.tuples(st.integers(0, 20), st.integers(0, 1), st.integers(-90, -40), st.integers(0, 3))


@given(st.lists(READING, min_size=1, max_size=25), st.lists(st.integers(0, 25), max_size=4))
def test_cuts_between_blocks_change_nothing(rows, cuts):
    readings = readings_of([(row[0] / 4, *row[1:]) for row in rows])
    whole = ProximityWindow(POWER_DBM, ProximityRule(window_s=1.0)).classes(readings)
    live = ProximityWindow(POWER_DBM, ProximityRule(window_s=1.0))
    ends = [0, *sorted(min(cut, len(readings)) for cut in cuts), len(readings)]
    parts = [live.classes(readings.rows(slice(*pair))) for pair in itertools.pairwise(ends)]
    assert np.array_equal(np.concatenate(parts), whole)


def test_surveyed_classes_begin_anew_with_each_walk(readings_at):
    survey = readings_at([-50, -80, -80], time_us=[0, 1, 2], walk=[0, 1, 1])
    classes = surveyed_classes(survey, np.array([-60.0]), ProximityRule())
    assert classes.tolist() == [IMMEDIATE, FAR, FAR]


def test_the_published_line():
    # Digest "proximity-pf": Eq 5, beside the 19 of 56 measured at 2.4 m.
    assert_allclose(PUBLISHED_NEAR.share([1.0, 2.4]), [0.8024, 0.37498])
    assert abs(PUBLISHED_NEAR.share(2.4) - 19 / 56) < 0.04
    assert PUBLISHED_NEAR.share([0.0, 4.0]).tolist() == [1, 0]


def test_shares_in_bins_worked_by_hand():
    distance_m = np.array([0.1, 0.3, 0.6, 0.8, 0.9, 2.1, np.nan])
    near = np.array([1, 1, 1, 0, 0, 1, 1], bool)
    shares = distance_shares(distance_m, near, bin_m=0.5, fewest=2)
    assert_allclose(shares.distance_m, [0.2, (0.6 + 0.8 + 0.9) / 3])
    assert_allclose(shares.share, [1, 1 / 3])
    assert shares.count.tolist() == [2, 3]


def test_the_line_agrees_with_numpy_polyfit():
    shares = DistanceShares(
        distance_m=np.array([0.3, 0.9, 1.5, 2.1, 2.7]),
        share=np.array([1.0, 0.9, 0.6, 0.5, 0.2]),
        count=np.array([5, 20, 30, 44, 60]),
    )
    for by_count in (True, False):
        weight = np.sqrt(shares.count) if by_count else None
        slope, intercept = np.polyfit(shares.distance_m, shares.share, 1, w=weight)
        line = fit_proximity_likelihood(shares, by_count=by_count)
        assert_allclose([line.intercept, line.slope_per_m], [intercept, slope])


def test_bins_beyond_the_last_near_one_do_not_bend_the_line():
    shares = DistanceShares(
        distance_m=np.arange(8.0),
        share=np.array([1.0, 0.75, 0.5, 0.25, 0, 0, 0, 0]),
        count=np.full(8, 10),
    )
    line = fit_proximity_likelihood(shares, clipped=False)
    assert_allclose([line.intercept, line.slope_per_m], [1, -0.25])
    assert_allclose(line.share([2.0, 6.0]), [0.5, -0.5])


def test_a_line_that_was_drawn_from_is_found_again():
    # 20 000 readings: the standard error of the slope is below 0.004; five of them, 6e-7.
    rng = np.random.default_rng(3)
    distance_m = rng.uniform(0.4, 3.4, 20_000)
    near = rng.uniform(size=20_000) < PUBLISHED_NEAR.share(distance_m)
    line = fit_proximity_likelihood(distance_shares(distance_m, near))
    assert line.slope_per_m == pytest.approx(-0.3053, abs=0.02)
    assert line.intercept == pytest.approx(1.1077, abs=0.04)


def test_learned_from_the_practice_survey():
    survey, venue = survey_readings([practice_recording()]), practice_venue()
    classes = surveyed_classes(survey, announced_power_dbm(venue), ProximityRule())
    shares = distance_shares(
        survey.horizontal_distance_m(venue), classes <= NEAR, bin_m=1.0, fewest=4
    )
    line = fit_proximity_likelihood(shares)
    assert line.share(1.5) > line.share(4.0)


def test_bad_settings_and_useless_surveys_are_refused():
    for wrong, says in (
        ({"immediate_m": 4.0}, "in this order"),
        ({"exponent": 0.0}, "exponent 0"),
        ({"window_s": 0.0}, "window_s 0"),
    ):
        with pytest.raises(UsageError, match=says):
            ProximityRule(**wrong)
    with pytest.raises(UsageError, match="bin_m 0"):
        distance_shares(np.ones(3), np.ones(3, bool), bin_m=0.0)
    rising = DistanceShares(
        distance_m=np.arange(3.0), share=np.array([0.1, 0.2, 0.3]), count=np.full(3, 9)
    )
    with pytest.raises(DataError, match="rarer with distance"):
        fit_proximity_likelihood(rising)
    with pytest.raises(DataError, match="fewer than two"):
        fit_proximity_likelihood(distance_shares(np.full(9, np.nan), np.ones(9, bool)))
