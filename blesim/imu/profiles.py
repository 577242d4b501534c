"""Inertial and magnetic sensors by name, as in phones.

Where it is said so, numbers are typical, not verified against the data sheet. Offsets in data
sheets are those of a chip as soldered; what an application gets has been calibrated by the system,
to an assumed fifth for accelerometers and to a tenth of a degree per second for gyroscopes. Drift:
assumed.
"""

from collections.abc import Mapping
from types import MappingProxyType

from blesim.imu.sensors import Accelerometer, Gyroscope, ImuSettings, Magnetometer

IMU_PROFILES: Mapping[str, ImuSettings] = MappingProxyType(
    {
        # Bosch BMI160 (180 ug per root hertz and 40 mg: Bosch's list of its features, as resellers
        # repeat it; 7 mdeg/s per root hertz: typical, not verified against the data sheet) with AKM
        # AK09911: the phones of ilc20, whose files tell resolutions and ranges; noise of the
        # magnetometer measured there, 0.84 uT in |B|.
        "bmi160-ak09911": ImuSettings(
            accelerometer=Accelerometer(
                noise_ug_per_rthz=180.0,
                bias_mg=8.0,
                resolution_m_s2=0.0023956299,
                range_m_s2=39.22661,
            ),
            gyroscope=Gyroscope(
                noise_mdps_per_rthz=7.0,
                bias_dps=0.1,
                resolution_rad_s=0.0010681152,
                range_rad_s=34.906586,
            ),
            magnetometer=Magnetometer(noise_ut=0.82, resolution_ut=0.5996704, range_ut=4911.9995),
        ),
        # ST LSM6DSO, set to 8 g and 2000 deg/s (16 bits; 70 mdeg/s a digit: DS12140), with AKM
        # AK09918. 70 ug and 3.8 mdeg/s per root hertz, 20 mg, 0.3 uT, 0.15 uT a digit: typical, not
        # verified against the data sheet.
        "lsm6dso-ak09918": ImuSettings(
            accelerometer=Accelerometer(
                noise_ug_per_rthz=70.0,
                bias_mg=4.0,
                resolution_m_s2=0.00239282,
                range_m_s2=78.4532,
            ),
            gyroscope=Gyroscope(
                noise_mdps_per_rthz=3.8,
                bias_dps=0.1,
                resolution_rad_s=0.00122173,
                range_rad_s=34.906586,
            ),
            magnetometer=Magnetometer(noise_ut=0.3, resolution_ut=0.15, range_ut=4911.9995),
        ),
        # InvenSense MPU-6500, as in phones of 2014, set to 2 g and 500 deg/s (16 bits: 1/16384 g
        # and 1/65.5 deg/s a digit), with AKM AK8963. 300 ug and 10 mdeg/s per root hertz, 60 mg,
        # 0.4 uT, 0.15 uT a digit: typical, not verified against the data sheet.
        "mpu6500-ak8963": ImuSettings(
            accelerometer=Accelerometer(
                noise_ug_per_rthz=300.0,
                bias_mg=12.0,
                resolution_m_s2=0.00059855,
                range_m_s2=19.6133,
            ),
            gyroscope=Gyroscope(
                noise_mdps_per_rthz=10.0,
                bias_dps=0.1,
                resolution_rad_s=0.00026646,
                range_rad_s=8.726646,
            ),
            magnetometer=Magnetometer(noise_ut=0.4, resolution_ut=0.15, range_ut=4911.9995),
        ),
    }
)
