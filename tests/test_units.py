import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blesim import units

ANGLES = st.floats(-1e6, 1e6)


def test_microseconds_are_rounded_half_to_even() -> None:
    assert [units.to_us(time_s) for time_s in (0.35, 1e-6, 0.5e-6, 1.5e-6, -2.0)] == [
        350_000,
        1,
        0,
        2,
        -2_000_000,
    ]
    assert isinstance(units.to_us(0.1), int)


@given(st.integers(0, 366 * 24 * 3600 * 10**6))
def test_every_microsecond_of_a_year_survives_seconds(time_us: int) -> None:
    assert units.to_us(float(units.to_s(time_us))) == time_us


def test_levels_and_powers() -> None:
    # 0 dBm is one milliwatt, 3.0103 dB a factor of two, by definition.
    np.testing.assert_allclose(units.dbm_to_mw([0.0, 10.0, -30.0]), [1.0, 10.0, 0.001])
    np.testing.assert_allclose(units.mw_to_dbm([2.0]), [3.010299956639812], rtol=1e-15)


@given(st.floats(-150, 60))
def test_level_and_power_are_inverse(power_dbm: float) -> None:
    assert float(units.mw_to_dbm(units.dbm_to_mw(power_dbm))) == pytest.approx(power_dbm, abs=1e-9)


@given(ANGLES)
def test_a_wrapped_angle_is_the_same_direction(angle_rad: float) -> None:
    wrapped = float(units.wrap_angle(angle_rad))
    assert -np.pi <= wrapped < np.pi
    assert np.cos(wrapped) == pytest.approx(np.cos(angle_rad), abs=1e-9)
    assert np.sin(wrapped) == pytest.approx(np.sin(angle_rad), abs=1e-9)


@pytest.mark.parametrize("turns", [-3, -1, 1, 2])
def test_odd_half_turns_are_minus_pi(turns: int) -> None:
    assert float(units.wrap_angle((2 * turns + 1) * np.pi)) == pytest.approx(-np.pi)


def test_just_below_minus_pi_does_not_round_up_to_pi() -> None:
    assert float(units.wrap_angle(np.nextafter(-np.pi, -4.0))) < np.pi


def test_azimuth_counts_from_north_clockwise() -> None:
    # East, north, west, south.
    headings = np.array([0.0, 0.5, 1.0, -0.5]) * np.pi
    azimuths = np.array([0.5, 0.0, -0.5, -1.0]) * np.pi
    np.testing.assert_allclose(units.heading_to_azimuth(headings), azimuths, atol=1e-15)


@given(ANGLES)
def test_azimuth_and_heading_are_inverse(heading_rad: float) -> None:
    there_and_back = units.azimuth_to_heading(units.heading_to_azimuth(heading_rad))
    assert np.exp(1j * there_and_back) == pytest.approx(np.exp(1j * heading_rad), abs=1e-9)


def test_shapes_are_kept() -> None:
    angles = np.zeros((2, 3))
    for convert in (units.wrap_angle, units.heading_to_azimuth, units.to_s, units.dbm_to_mw):
        assert convert(angles).shape == (2, 3)
