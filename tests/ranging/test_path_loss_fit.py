import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import curve_fit

from blesim.errors import DataError, UsageError
from blesim.ranging.curves import Enough
from blesim.ranging.path_loss_fit import (
    AISLE_GRAPH,
    PathLossFit,
    fit_path_loss,
    fit_path_loss_by_branch,
    log_distance_fit,
)

LEVEL_DBM, EXPONENT = -62.0, 1.8


def noisy(count=400, seed=3, spread_db=4.0, level_dbm=LEVEL_DBM, exponent=EXPONENT):
    rng = np.random.default_rng(seed)
    distance_m = rng.uniform(1.0, 20.0, count)
    noise_db = rng.normal(0.0, spread_db, count)
    return distance_m, level_dbm - 10 * exponent * np.log10(distance_m) + noise_db


def test_a_line_through_three_decades_worked_by_hand():
    # -60 at 1 m, -80 at 10 m, -100 at 100 m: A = -60 dBm, n = 2, nothing left over.
    fit = log_distance_fit(np.array([1.0, 10.0, 100.0]), np.array([-60.0, -80.0, -100.0]))
    assert_allclose([fit.level_dbm, fit.exponent], [-60, 2])
    assert fit.spread_db < 1e-12
    assert_allclose(fit.rssi_dbm([1, 10]), [-60, -80])
    assert_allclose(fit.distance_m([-60, -80, -90]), [1, 10, 10**1.5])


def test_agrees_with_scipy():
    distance_m, rssi_dbm = noisy()

    def model(d, level, exponent):
        return level - 10 * exponent * np.log10(d)

    (level_dbm, exponent), _ = curve_fit(model, distance_m, rssi_dbm, p0=(-50, 2))
    fit = log_distance_fit(distance_m, rssi_dbm)
    assert_allclose([fit.level_dbm, fit.exponent], [level_dbm, exponent], rtol=1e-6)
    left_db = rssi_dbm - model(distance_m, level_dbm, exponent)
    assert_allclose(fit.spread_db, np.sqrt(np.sum(left_db**2) / (len(left_db) - 2)), rtol=1e-6)


def test_the_published_example_channel():
    # Digest "channel-ekf": RSS = -79.5891 - 12.954 log10 d.
    fit = PathLossFit(level_dbm=-79.5891, exponent=1.2954, spread_db=4.0)
    assert_allclose(fit.rssi_dbm(10.0), -79.5891 - 12.954)
    assert_allclose(fit.distance_m(-79.5891 - 12.954 * np.log10(7.0)), 7.0)


@given(st.floats(0.2, 50), st.floats(-90, -40), st.floats(0.5, 4))
def test_distance_and_rssi_undo_each_other(distance_m, level_dbm, exponent):
    fit = PathLossFit(level_dbm=level_dbm, exponent=exponent, spread_db=1.0)
    assert_allclose(fit.distance_m(fit.rssi_dbm(distance_m)), distance_m, rtol=1e-9)


def test_the_spread_of_a_range_is_its_slope():
    fit = PathLossFit(level_dbm=-60.0, exponent=2.0, spread_db=1e-4)
    step_m = fit.distance_m(-80.0 - 1e-4) - fit.distance_m(-80.0)
    assert_allclose(fit.distance_spread_m(10.0), step_m, rtol=1e-4)


@pytest.mark.parametrize(
    ("distance_m", "rssi_dbm"),
    [
        ([1.0, 2.0], [-60.0, -66.0]),
        ([3.0, 3.0, 3.0], [-60.0, -61.0, -62.0]),
        ([1.0, 2.0, 4.0], [-70.0, -66.0, -62.0]),
    ],
)
def test_readings_that_make_no_curve(distance_m, rssi_dbm):
    assert log_distance_fit(np.array(distance_m), np.array(rssi_dbm)) is None


def test_each_beacon_has_its_curve_and_one_with_few_readings_that_of_all(readings_at):
    parts = [noisy(spread_db=0.5), noisy(level_dbm=-55.0, seed=4, spread_db=0.5)]
    few_m, few_dbm = parts[0][0][:19], parts[0][1][:19] - 30.0
    distance_m = np.concatenate([parts[0][0], parts[1][0], few_m])
    rssi_dbm = np.concatenate([parts[0][1], parts[1][1], few_dbm])
    survey = readings_at(rssi_dbm, beacons=4, beacon=np.repeat([0, 1, 2], [400, 400, 19]))
    model = fit_path_loss(survey, distance_m)
    curve = model.of(np.arange(4), np.zeros(4, np.int64))
    # Four standard errors of the intercept, about 0.1 dB: false alarms 6e-5.
    assert_allclose(curve.level_dbm[:2], [-62, -55], atol=0.4)
    assert model.rows.fallen_back.tolist() == [False, False, True, True]
    together = log_distance_fit(distance_m, rssi_dbm)
    assert_allclose(curve.level_dbm[2:], together.level_dbm)
    enough = fit_path_loss(survey, distance_m, enough=Enough(readings=19))
    assert enough.rows.fallen_back.tolist() == [False, False, False, True]


def test_channels_have_their_own_curves_and_otherwise_that_of_their_beacon(readings_at):
    distance_m, rssi_dbm = noisy(spread_db=0.1)
    channel = np.repeat([37, 38, 39], [200, 190, 10])
    gain_db = np.repeat([0.0, 6.0, 0.0], [200, 190, 10])
    survey = readings_at(rssi_dbm + gain_db, channel=channel)
    model = fit_path_loss(survey, distance_m, by="beacon and channel")
    curve = model.of(np.zeros(4, np.int64), np.array([37, 38, 39, 0]))
    assert_allclose(curve.level_dbm[:2], [-62, -56], atol=0.2)
    assert curve.level_dbm[2] == curve.level_dbm[3]
    assert -62 < curve.level_dbm[3] < -56


def test_one_curve_for_all(readings_at):
    distance_m, rssi_dbm = noisy()
    survey = readings_at(rssi_dbm, beacons=2, beacon=np.arange(400) % 2)
    model = fit_path_loss(survey, distance_m, by="all")
    assert_allclose(model.curves.exponent, [log_distance_fit(distance_m, rssi_dbm).exponent])
    assert model.rows.fallen_back.all()


def test_a_beacon_heard_from_two_places_only_has_no_curve(readings_at):
    distance_m, rssi_dbm = noisy()
    near_m = np.where(np.arange(200) % 2 == 0, 2.0, 8.0)
    survey = readings_at(
        np.concatenate([rssi_dbm, np.full(200, -70)]),
        beacons=2,
        beacon=np.repeat([0, 1], [400, 200]),
    )
    model = fit_path_loss(survey, np.concatenate([distance_m, near_m]))
    assert model.rows.fallen_back.tolist() == [False, True]


def test_readings_of_unknown_distance_are_left_out(readings_at):
    distance_m, rssi_dbm = noisy()
    survey = readings_at(np.append(rssi_dbm, -20.0))
    with_nan = fit_path_loss(survey, np.append(distance_m, np.nan))
    without = fit_path_loss(readings_at(rssi_dbm), distance_m)
    assert_allclose(with_nan.curves.level_dbm, without.curves.level_dbm)


def test_two_exponents_with_one_level_agree_with_scipy():
    (near_m, near_dbm), (far_m, far_dbm) = noisy(exponent=1.0), noisy(exponent=1.3, seed=8)
    distance_m, rssi_dbm = np.append(near_m, far_m), np.append(near_dbm, far_dbm)
    same = np.repeat([True, False], 400)

    def model(rows, level, n_same, n_other):
        return level - 10 * np.where(rows[1] > 0, n_same, n_other) * np.log10(rows[0])

    expected, _ = curve_fit(model, np.stack([distance_m, same]), rssi_dbm, p0=(-50, 2, 2))
    fit = fit_path_loss_by_branch(distance_m, rssi_dbm, same)
    assert fit.same.level_dbm == fit.other.level_dbm
    found = [fit.same.level_dbm, fit.same.exponent, fit.other.exponent]
    assert_allclose(found, expected, rtol=1e-6)
    left_db = rssi_dbm - fit.of(same).rssi_dbm(distance_m)
    assert_allclose(fit.same.spread_db, left_db[same].std())
    assert_allclose(fit.other.spread_db, left_db[~same].std())


def test_the_published_preset_by_branch():
    # At 10 m: -77 - 10 on the same aisle, -77 - 13 beside it.
    curve = AISLE_GRAPH.of(np.array([True, False]))
    assert curve.rssi_dbm(10.0).tolist() == [-87, -90]
    assert curve.spread_db.tolist() == [4, 6]


def test_too_little_to_learn_from_is_refused(readings_at):
    distance_m, rssi_dbm = noisy()
    with pytest.raises(DataError, match="survey more places"):
        fit_path_loss(readings_at(rssi_dbm), np.full(400, np.nan))
    with pytest.raises(DataError, match="survey more places"):
        fit_path_loss_by_branch(distance_m, rssi_dbm, np.ones(400, bool))
    with pytest.raises(UsageError, match="one each"):
        fit_path_loss(readings_at(rssi_dbm), distance_m[:3])
    with pytest.raises(UsageError, match="beacon and channel"):
        fit_path_loss(readings_at(rssi_dbm), distance_m, by="channel")
    with pytest.raises(UsageError, match="1 or more"):
        Enough(readings=0)


def test_the_real_hall(hall):
    # Measured before: A = -61.4 dBm, n = 1.48, spread 4.5 dB on the means of links; single readings
    # spread more, and set 1 is weaker, by half a decibel.
    model = fit_path_loss(hall.survey, hall.survey.distance_m(hall.venue, 1.85))
    assert model.curves.level_dbm[0] == pytest.approx(-61.6, abs=1.0)
    assert model.curves.exponent[0] == pytest.approx(1.48, abs=0.15)
    assert 4.5 < model.curves.spread_db[0] < 6.5
    own = model.of(np.arange(12), np.zeros(12, np.int64))
    assert own.exponent.min() > 0.8
    assert own.exponent.max() < 2.4
