import pytest
from pydantic import ValidationError

from blesim.imu.profiles import IMU_PROFILES
from blesim.imu.sensors import ImuSettings


@pytest.mark.parametrize("name", sorted(IMU_PROFILES))
def test_noise_is_within_what_data_sheets_of_phones_say(name):
    phone = IMU_PROFILES[name]
    assert 70 <= phone.accelerometer.noise_ug_per_rthz <= 300
    assert 3.8 <= phone.gyroscope.noise_mdps_per_rthz <= 10
    assert 0.3 <= phone.magnetometer.noise_ut <= 0.84


def test_the_recorded_phones_sensors_have_the_resolutions_of_their_files():
    phone = IMU_PROFILES["bmi160-ak09911"]
    # Heads of the ilc20 files; 4 g in 2^15 steps is half of it, as is 2000 deg/s in 2^15.
    assert phone.accelerometer.resolution_m_s2 == pytest.approx(8 * 9.80665 / 2**15, rel=1e-3)
    assert phone.gyroscope.resolution_rad_s == pytest.approx(0.0010681152)
    assert phone.magnetometer.resolution_ut == pytest.approx(0.5996704)


@pytest.mark.parametrize("rate_hz", [9.9, 500.1, float("nan")])
def test_rates_out_of_range_are_refused(rate_hz):
    with pytest.raises(ValidationError, match="rate_hz"):
        ImuSettings(rate_hz=rate_hz)
