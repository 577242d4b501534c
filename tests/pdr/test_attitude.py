import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from blesim.errors import DataError
from blesim.pdr.attitude import Leveller, Levelling
from blesim.pdr.steps import GRAVITY_M_S2
from blesim.tables import Imu
from blesim.units import wrap_angle

# East, north, up: 32 uT to the north, 36 uT downwards.
FIELD_UT = np.array([0.0, 32.0, -36.0])
ANGLE = st.floats(-math.pi, math.pi)
TILT = st.floats(-1.2, 1.2)


def imu_of(time_us, force, rate, field):
    columns = [np.broadcast_to(part, (len(time_us), 3)) for part in (force, rate, field)]
    names = [column.field for column in Imu.STREAM.columns]
    return Imu(**dict(zip(names, [time_us, *np.hstack(columns).T], strict=True)))


def held(azimuth_rad, pitch_rad, roll_rad):
    """Rotation from the phone to east, north, up: y at the azimuth, lifted by the pitch."""
    return Rotation.from_euler("ZXY", [-azimuth_rad, pitch_rad, roll_rad])


@given(azimuth=ANGLE, pitch=TILT, roll=TILT, turn_rate=st.floats(-3, 3))
def test_a_tilted_phone_tells_its_azimuth_and_its_turn_rate(azimuth, pitch, roll, turn_rate):
    phone = held(azimuth, pitch, roll).inv()
    up = phone.apply([0, 0, 1])
    imu = imu_of(np.arange(3) * 20_000, GRAVITY_M_S2 * up, turn_rate * up, phone.apply(FIELD_UT))
    level = Leveller(Levelling()).advance(imu)
    np.testing.assert_allclose(wrap_angle(level.azimuth_rad - azimuth), 0, atol=1e-5)
    np.testing.assert_allclose(level.turn_rate_rad_s, turn_rate, atol=4e-5)
    np.testing.assert_allclose(level.vertical_m_s2, 0, atol=4e-5)


@pytest.mark.parametrize(
    ("forward", "ahead"), [("y", 0.3), ("x", 0.3 + math.pi / 2), ("-x", -1.27)]
)
def test_the_forward_axis_may_be_another(forward, ahead):
    phone = held(0.3, 0.0, 0.0).inv()
    imu = imu_of([0], [0, 0, GRAVITY_M_S2], [0, 0, 0], phone.apply(FIELD_UT))
    level = Leveller(Levelling(forward=forward)).advance(imu)
    assert level.azimuth_rad[0] == pytest.approx(ahead, abs=1e-3)


def test_gravity_is_a_mean_that_forgets_worked_by_hand():
    # After tau ln 2 the first sample counts half: G = (2/3, 0, 1/3) g, u = (2, 0, 1) / sqrt 5.
    leveller = Leveller(Levelling(time_constant_s=1.0))
    force = np.array([[0, 0, GRAVITY_M_S2], [GRAVITY_M_S2, 0, 0]])
    imu = imu_of([0, round(1e6 * math.log(2))], force, [1, 0, 0], FIELD_UT)
    level = leveller.advance(imu)
    assert level.turn_rate_rad_s.tolist() == pytest.approx([0, 2 / math.sqrt(5)], abs=1e-6)
    expected = [0, GRAVITY_M_S2 * (2 / math.sqrt(5) - 1)]
    assert level.vertical_m_s2.tolist() == pytest.approx(expected, abs=1e-5)


def test_steps_hardly_tilt_the_level_frame():
    # Steps of 3 m/s^2 ahead at 2 Hz tilt the mean by 3 / (9.8 * 4 pi) = 1.4 deg, 1 m/s^2 aside at
    # 1 Hz by 0.93; times tan(dip) = 1.125, across the azimuth of 1 rad: 1.57 sin 1 + 1.04 cos 1.
    time_us = np.arange(500) * 20_000
    phase = 2 * np.pi * 2.0 * time_us * 1e-6
    force = np.stack([np.sin(phase / 2), 3 * np.sin(phase), 4 * np.cos(phase) + GRAVITY_M_S2], 1)
    imu = imu_of(time_us, force, [0, 0, 0], held(1.0, 0, 0).inv().apply(FIELD_UT))
    error_deg = np.degrees(Leveller(Levelling()).advance(imu).azimuth_rad - 1.0)
    assert np.abs(error_deg[50:]).max() < 3
    assert np.abs(error_deg[250:]).max() == pytest.approx(1.88, abs=0.05)


def test_no_direction_keeps_the_last_one():
    leveller = Leveller(Levelling())
    nothing = imu_of([0], [0, 0, 0], [0, 0, 0.5], [0, 0, -40])
    level = leveller.advance(nothing)
    assert math.isnan(level.azimuth_rad[0])
    assert level.turn_rate_rad_s[0] == 0.5
    flat = imu_of([1], [0, 0, 0], [0, 0, 0], held(0.5, 0, 0).inv().apply(FIELD_UT))
    assert leveller.advance(flat).azimuth_rad[0] == pytest.approx(0.5, abs=1e-6)
    gone = imu_of([2], [0, 0, 0], [0, 0, 0], [0, 0, -40])
    assert leveller.advance(gone).azimuth_rad[0] == pytest.approx(0.5, abs=1e-6)


def test_bad_samples_are_refused():
    leveller = Leveller(Levelling())
    leveller.advance(imu_of([10], [0, 0, 9.8], [0, 0, 0], FIELD_UT))
    with pytest.raises(DataError, match="order of time"):
        leveller.advance(imu_of([9], [0, 0, 9.8], [0, 0, 0], FIELD_UT))
    with pytest.raises(DataError, match="not a number"):
        leveller.advance(imu_of([11], [0, np.nan, 9.8], [0, 0, 0], FIELD_UT))
    assert len(leveller.advance(Imu.empty())) == 0
