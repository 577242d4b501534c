import numpy as np
import pytest

from blesim.errors import DataError
from blesim.pdr.steps import checked_block, step_signal_m_s2
from blesim.tables import Imu


def imu_of(acceleration):
    still = np.zeros(len(acceleration))
    x, y, z = np.array(acceleration).T
    return Imu(
        time_us=np.arange(len(acceleration)) * 20_000,
        acceleration_x_m_s2=x,
        acceleration_y_m_s2=y,
        acceleration_z_m_s2=z,
        angular_rate_x_rad_s=still,
        angular_rate_y_rad_s=still,
        angular_rate_z_rad_s=still,
        magnetic_field_x_ut=still,
        magnetic_field_y_ut=still,
        magnetic_field_z_ut=still,
    )


def test_the_signal_is_the_norm_without_gravity_however_the_phone_lies():
    level, tilted, pushed = step_signal_m_s2(
        imu_of([(0, 0, 9.80665), (0, 9.80665 * 0.6, -9.80665 * 0.8), (2, 3, 6)])
    )
    assert (level, tilted) == pytest.approx((0, 0), abs=2e-5)
    assert pushed == pytest.approx(7 - 9.80665, abs=1e-6)


@pytest.mark.parametrize(
    ("times", "signal", "told"),
    [
        ([1, 2, 3], [0, 0], "one for each"),
        ([5, 4], [0, 0], "in order of time"),
        ([-1, 4], [0, 0], "in order of time"),
        ([1, 2], [0, np.nan], "not a number"),
        ([1, 2], [0, np.inf], "not a number"),
    ],
)
def test_a_bad_block_is_one_line(times, signal, told):
    with pytest.raises(DataError, match=told) as fault:
        checked_block(np.array(times), np.array(signal, float), after_us=0)
    assert "\n" not in str(fault.value)
