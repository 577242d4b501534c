"""The inertial and magnetic sensors of a phone, as data sheets describe them."""

from dataclasses import dataclass

import numpy as np
from pydantic import Field

from blesim.imu.signal import GRAVITY_M_S2
from blesim.settings import Settings

_RAD_S = np.pi / 180.0
_UG = GRAVITY_M_S2 * 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Triad:
    """Errors of three axes in the unit of their column.

    Attributes
    ----------
    white : float
        Spread of the white noise of a sample.
    bias, instability : float
        Spread of the constant offset, and of the one that drifts.
    instability_s : float
        Time after which the drift is forgotten to 1/e. [s]
    scale, misalignment : float
        Spread of the relative error of the scale, and of the axes' directions. [-], [rad]
    resolution, largest : float
        Step of the readings, 0 for none; their magnitude's limit.
    """

    white: float
    bias: float
    instability: float
    instability_s: float
    scale: float
    misalignment: float
    resolution: float
    largest: float


class _Sensor(Settings):
    """What all three sensors have.

    Attributes
    ----------
    instability_s : float
        Time after which the drift of the offset is forgotten to 1/e; assumed. [s]
    scale_percent, misalignment_deg : float
        Spread of the error of the scale, and of the directions of the axes, from phone to phone.
        [%], [degree]
    """

    instability_s: float = Field(default=300.0, ge=10, le=1e5)
    scale_percent: float = Field(default=0.5, ge=0, le=10)
    misalignment_deg: float = Field(default=0.3, ge=0, le=10)


class Accelerometer(_Sensor):
    """An accelerometer.

    White noise of a density n spreads samples taken at a rate f by ``n sqrt(f / 2)``, which makes
    an Allan deviation of ``n / sqrt(2 t)`` over a time t.

    Attributes
    ----------
    noise_ug_per_rthz : float
        Noise density: 70 to 285 in phones (data sheets). [ug/sqrt(Hz)]
    bias_mg : float
        Spread of the zero offset, from phone to phone: 20 to 90 in data sheets, less after the
        system's calibration. [mg]
    instability_ug : float
        Spread of the offset's drift; assumed. [ug]
    resolution_m_s2, range_m_s2 : float
        Step of the readings, and their limit. [m/s2]
    """

    noise_ug_per_rthz: float = Field(default=180.0, ge=0, le=1e5)
    bias_mg: float = Field(default=20.0, ge=0, le=1000)
    instability_ug: float = Field(default=100.0, ge=0, le=1e5)
    resolution_m_s2: float = Field(default=0.0023956, ge=0, le=1)
    range_m_s2: float = Field(default=39.22661, gt=0, le=400)

    def triad(self, rate_hz: float) -> Triad:
        """Errors at a sampling rate. [m/s2]."""
        return Triad(
            white=self.noise_ug_per_rthz * _UG * np.sqrt(rate_hz / 2.0),
            bias=self.bias_mg * 1000.0 * _UG,
            instability=self.instability_ug * _UG,
            instability_s=self.instability_s,
            scale=self.scale_percent / 100.0,
            misalignment=self.misalignment_deg * _RAD_S,
            resolution=self.resolution_m_s2,
            largest=self.range_m_s2,
        )


class Gyroscope(_Sensor):
    """A gyroscope; for noise densities see `Accelerometer`.

    Attributes
    ----------
    noise_mdps_per_rthz : float
        Noise density: 4 to 7 in phones (data sheets). [mdeg/s/sqrt(Hz)]
    bias_dps : float
        Spread of the offset from one start to the next: 0.1 to 1 raw. What an application gets is
        calibrated by the system; assumed to a tenth of a degree. [deg/s]
    instability_dph : float
        Spread of the offset's drift; assumed. [deg/h]
    resolution_rad_s, range_rad_s : float
        Step of the readings, and their limit. [rad/s]
    """

    noise_mdps_per_rthz: float = Field(default=7.0, ge=0, le=1e4)
    bias_dps: float = Field(default=0.1, ge=0, le=100)
    instability_dph: float = Field(default=20.0, ge=0, le=1e5)
    resolution_rad_s: float = Field(default=0.0010681152, ge=0, le=1)
    range_rad_s: float = Field(default=34.906586, gt=0, le=100)

    def triad(self, rate_hz: float) -> Triad:
        """Errors at a sampling rate. [rad/s]."""
        return Triad(
            white=self.noise_mdps_per_rthz * 1e-3 * _RAD_S * np.sqrt(rate_hz / 2.0),
            bias=self.bias_dps * _RAD_S,
            instability=self.instability_dph / 3600.0 * _RAD_S,
            instability_s=self.instability_s,
            scale=self.scale_percent / 100.0,
            misalignment=self.misalignment_deg * _RAD_S,
            resolution=self.resolution_rad_s,
            largest=self.range_rad_s,
        )


class Magnetometer(_Sensor):
    """A magnetometer in a phone full of iron.

    Attributes
    ----------
    noise_ut : float
        Spread of a sample: 0.3 to 0.6 in data sheets; 0.84 measured in the magnitude of an AK09911,
        its resolution included. It does not depend on the rate. [uT]
    hard_iron_ut : float
        Spread, from phone to phone, of the constant field that the system's calibration leaves;
        assumed. [uT]
    soft_iron_percent : float
        Spread of each entry of the matrix by which iron distorts the field; assumed. [%]
    instability_ut : float
        Spread of the offset's drift; assumed. [uT]
    resolution_ut, range_ut : float
        Step of the readings, and their limit. [uT]
    """

    noise_ut: float = Field(default=0.6, ge=0, le=100)
    hard_iron_ut: float = Field(default=1.0, ge=0, le=1000)
    soft_iron_percent: float = Field(default=1.0, ge=0, le=50)
    instability_ut: float = Field(default=0.2, ge=0, le=100)
    resolution_ut: float = Field(default=0.5996704, ge=0, le=10)
    range_ut: float = Field(default=4911.9995, gt=0, le=5000)

    def triad(self, _rate_hz: float) -> Triad:
        """Errors at any sampling rate; soft iron apart. [uT]."""
        return Triad(
            white=self.noise_ut,
            bias=self.hard_iron_ut,
            instability=self.instability_ut,
            instability_s=self.instability_s,
            scale=self.scale_percent / 100.0,
            misalignment=self.misalignment_deg * _RAD_S,
            resolution=self.resolution_ut,
            largest=self.range_ut,
        )


class ImuSettings(Settings):
    """The sensors of a phone, and how they are sampled.

    Attributes
    ----------
    rate_hz : float
        Samples a second: 50 or 100, usually. [Hz]
    jitter_ms : float
        Spread of the sample times about the regular ones: below 0.05 measured at 50 Hz. [ms]
    dropped : float
        Share of the samples that never reach the application; assumed. [-]
    accelerometer, gyroscope, magnetometer : Accelerometer, Gyroscope, Magnetometer
        Their errors.
    """

    rate_hz: float = Field(default=50.0, ge=10, le=500)
    jitter_ms: float = Field(default=0.05, ge=0, le=20)
    dropped: float = Field(default=0.0, ge=0, le=0.9)
    accelerometer: Accelerometer = Accelerometer()
    gyroscope: Gyroscope = Gyroscope()
    magnetometer: Magnetometer = Magnetometer()
