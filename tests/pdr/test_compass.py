import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blesim.errors import DataError
from blesim.pdr.attitude import Leveller, Levelling
from blesim.pdr.compass import (
    CompassCorrection,
    CompassCorrector,
    CompassErrorFilter,
    error_terms,
)
from blesim.pdr.steps import GRAVITY_M_S2
from blesim.tables import Imu
from blesim.units import wrap_angle

DEG = math.radians(1.0)
IRON = np.radians([4.0, -9.0, 6.0, 3.0, -2.0])


def errors(azimuth, coefficients=IRON):
    return error_terms(azimuth) @ coefficients


def trained_on(azimuth, error, **settings):
    filter_ = CompassErrorFilter(CompassCorrection(**settings))
    for xi, delta in zip(azimuth, error, strict=True):
        filter_.update(xi, xi + delta)
    return filter_


def test_terms_of_equation_10():
    expected = [1, 0.5, math.sqrt(3) / 2, math.sqrt(3) / 2, 0.5]
    assert error_terms(math.pi / 6).tolist() == pytest.approx(expected)
    assert error_terms(np.zeros(3)).tolist() == [[1, 0, 1, 0, 1]] * 3


def test_first_update_worked_by_hand():
    # At azimuth 0 the row is [1 0 1 0 1]: gain (1000 + 1e-4) / (3 (1000 + 1e-4) + 25) each.
    filter_ = trained_on([0.0], [6 * DEG])
    gain = 1000.0001 / 3025.0003
    expected = np.array([1, 0, 1, 0, 1]) * gain * 6
    assert (filter_.coefficients_rad / DEG).tolist() == pytest.approx(expected)
    variance = 1000.0001 * (1 - gain)
    assert np.diag(filter_.covariance_rad2)[::2] / DEG**2 == pytest.approx(variance)
    assert filter_.error_rad(0.0) / DEG == pytest.approx(18 * gain)


def test_drift_worked_by_hand():
    # 900 and the drift of 100 make 1000: gain 1000 / 3025 each, before as after.
    filter_ = trained_on([0.0], [6 * DEG], initial_variance_deg2=900.0, drift_variance_deg2=100.0)
    assert filter_.coefficients_rad[0] / DEG == pytest.approx(6 * 1000 / 3025)


@given(st.integers(0, 10_000), st.integers(1, 40))
def test_without_drift_it_is_ridge_regression(seed, count):
    rng = np.random.default_rng(seed)
    azimuth = rng.uniform(-math.pi, math.pi, count)
    error = errors(azimuth) + rng.normal(0, 5 * DEG, count)
    filter_ = trained_on(azimuth, error, drift_variance_deg2=0.0)
    # min |z - H x|^2 / R + |x|^2 / P_0, solved as one system of all rows.
    rows = np.vstack([error_terms(azimuth), math.sqrt(25 / 1000) * np.eye(5)])
    ridge = np.linalg.lstsq(rows, np.append(error, np.zeros(5)), rcond=None)[0]
    np.testing.assert_allclose(filter_.coefficients_rad, ridge, rtol=0, atol=1e-11)
    covariance = 25 * DEG**2 * np.linalg.inv(rows.T @ rows)
    np.testing.assert_allclose(filter_.covariance_rad2, covariance, rtol=0, atol=1e-11)
    # The published drift changes next to nothing in ten steps.
    drifting = trained_on(azimuth[:10], error[:10])
    still = trained_on(azimuth[:10], error[:10], drift_variance_deg2=0.0)
    np.testing.assert_allclose(
        drifting.coefficients_rad, still.coefficients_rad, rtol=0, atol=1e-3 * DEG
    )


def rotated(iron, offset_ut, azimuth):
    """Samples of a phone lying flat, turned through the azimuths, with iron beside it."""
    field = np.stack([-30 * np.sin(azimuth), 30 * np.cos(azimuth)])
    seen = (np.eye(2) + iron) @ field + np.array(offset_ut)[:, None]
    still = np.zeros(len(azimuth))
    columns = [still, still, still + GRAVITY_M_S2, still, still, still, *seen, still - 40]
    names = [column.field for column in Imu.STREAM.columns]
    time_us = np.arange(len(azimuth)) * 20_000
    return Imu(**dict(zip(names, [time_us, *columns], strict=True)))


@pytest.mark.parametrize(
    ("iron", "offset_ut", "expected"),
    [
        ([[0, 0.02], [-0.02, 0]], (0, 0), [0.02, 0, 0, 0, 0]),
        ([[0, 0], [0, 0]], (0, 0.6), [0, 0.02, 0, 0, 0]),
        ([[0, 0], [0, 0]], (0.6, 0), [0, 0, 0.02, 0, 0]),
        ([[-0.02, 0], [0, 0.02]], (0, 0), [0, 0, 0, 0.02, 0]),
        ([[0, 0.02], [0.02, 0]], (0, 0), [0, 0, 0, 0, 0.02]),
    ],
    ids=["turned", "iron ahead", "iron beside", "soft along", "soft across"],
)
def test_each_coefficient_is_a_kind_of_iron(iron, offset_ut, expected):
    # To first order in the iron: hard iron b gives B = b_y / H, C = b_x / H, and so on.
    azimuth = np.linspace(-math.pi, math.pi, 360, endpoint=False)
    measured = (
        Leveller(Levelling()).advance(rotated(np.array(iron), offset_ut, azimuth)).azimuth_rad
    )
    error = wrap_angle(azimuth - measured)
    found = np.linalg.lstsq(error_terms(measured), error, rcond=None)[0]
    np.testing.assert_allclose(found, expected, atol=2 * 0.02**2)


def test_a_compass_in_iron_is_corrected_in_every_direction():
    azimuth = np.linspace(-math.pi, math.pi, 360, endpoint=False)
    iron = rotated(np.array([[0.08, 0.03], [-0.02, -0.05]]), (3.0, -4.0), azimuth)
    measured = Leveller(Levelling()).advance(iron).azimuth_rad
    error = wrap_angle(azimuth - measured)
    filter_ = trained_on(measured, error, initial_variance_deg2=1e6, drift_variance_deg2=0.0)
    left = [wrap_angle(e - filter_.error_rad(m)) for m, e in zip(measured, error, strict=True)]
    assert np.abs(error).max() > 11 * DEG
    assert np.abs(left).max() < 2 * DEG


def test_straight_turning_straight_worked_by_hand():
    # R is next to nothing: after one step of training the model is right at that azimuth.
    settings = CompassCorrection(training_steps=2, noise_deg=1e-3)
    corrector = CompassCorrector(settings)
    north = np.full(3, 0.1)
    known = np.full(3, 0.4)
    straight = np.zeros(3, bool)
    # Two steps of training keep what was measured, the third is corrected (Eq 11).
    np.testing.assert_allclose(
        corrector.advance(north, known, straight), [0.1, 0.1, 0.4], atol=1e-6
    )
    assert corrector.trained
    # Turning: the mean of the deltas (Eq 12), and the training begins anew.
    turn = corrector.advance(np.array([0.7, 1.2]), np.full(2, np.nan), np.ones(2, bool))
    np.testing.assert_allclose(turn, [1.0, 1.5], atol=1e-6)
    assert not corrector.trained
    east = corrector.advance(np.full(3, 1.5), np.full(3, 1.4), straight)
    np.testing.assert_allclose(east, [1.5, 1.5, 1.4], atol=1e-6)
    assert corrector.mean_error_rad == pytest.approx(-0.1, abs=1e-6)


@pytest.mark.parametrize(
    ("untrained", "expected"), [("measured", 1.5), ("mean", 1.8), ("model", 1.4)]
)
def test_what_an_untrained_step_gets_is_a_setting(untrained, expected):
    settings = CompassCorrection(training_steps=1, noise_deg=1e-3, untrained=untrained)
    corrector = CompassCorrector(settings)
    corrector.advance(np.full(2, 0.1), np.full(2, 0.4), np.zeros(2, bool))
    corrector.advance(np.array([0.8]), np.array([np.nan]), np.ones(1, bool))
    after = corrector.advance(np.array([1.5]), np.array([1.4]), np.zeros(1, bool))
    assert after[0] == pytest.approx(expected, abs=1e-6)


def test_an_unknown_way_or_azimuth_teaches_nothing():
    corrector = CompassCorrector(CompassCorrection(training_steps=1))
    azimuth = np.array([0.1, np.nan])
    corrected = corrector.advance(azimuth, np.array([np.nan, 0.4]), np.zeros(2, bool))
    np.testing.assert_allclose(corrected, azimuth, rtol=1e-12)
    assert not corrector.trained
    with pytest.raises(DataError, match="for each step"):
        corrector.advance(azimuth, azimuth[:1], np.zeros(2, bool))


def test_training_may_go_on_from_the_last():
    again, on = (
        CompassCorrector(CompassCorrection(training_steps=1, afresh=afresh, untrained="model"))
        for afresh in (True, False)
    )
    for corrector in (again, on):
        corrector.advance(np.array([0.1, 0.1]), np.array([0.4, np.nan]), np.array([False, True]))
    unknown = (np.array([0.1]), np.array([np.nan]), np.zeros(1, bool))
    assert again.advance(*unknown)[0] == pytest.approx(0.1)
    assert on.advance(*unknown)[0] == pytest.approx(0.4, abs=0.01)


def test_ten_steps_in_each_corridor_make_the_headings_of_the_corridors_right():
    # The four corridor azimuths of the paper, 30 steps each, 5 deg of noise, iron of up to 20 deg.
    rng = np.random.default_rng(12)
    corrector = CompassCorrector(CompassCorrection())
    raw_deg, corrected_deg = [], []
    for corridor in np.radians([90, 180, 270, 305]):
        measured = corridor - errors(corridor) + rng.normal(0, 5 * DEG, 30)
        way = np.full(30, corridor)
        corrected = corrector.advance(measured, way, np.zeros(30, bool))
        raw_deg.append(wrap_angle(measured - corridor)[10:].mean() / DEG)
        corrected_deg.append(wrap_angle(corrected - corridor)[10:].mean() / DEG)
        corrector.advance(corridor[None] + 0.5, np.array([np.nan]), np.ones(1, bool))
    # The trained mean is known to 5 deg / sqrt(10), the mean shown to 5 deg / sqrt(20).
    assert np.abs(corrected_deg).max() < 4 * 5 * math.sqrt(1 / 10 + 1 / 20)
    assert np.abs(corrected_deg).mean() < 0.5 * np.abs(raw_deg).mean()
