"""The magnetic field in a venue: the Earth's, and what steel makes of it, fixed in space."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.imu.trigonometry import sine_cosine
from blesim.kernels import kernel
from blesim.rng import Draws
from blesim.settings import Settings

# Plane waves of each of the two parts.
WAVES = 12


class Magnetics(Settings):
    """The magnetic field of a venue.

    With the defaults, compass headings are off by 11 to 12 degrees from one straight stretch to
    another and by about 5 within one (11 to 14 and 5.8 measured), and the magnitude varies by a
    median of 5.0 uT along a walk. On six walks through a mall it varied by 2.7 to 7.3 uT, median
    3.7. Both cannot be met: waves without sources and a bias of b need a horizontal spread of
    ``b F cos I`` for an Earth field F of inclination I, and with it the magnitude spreads by
    ``b F cos I sqrt(1 + sin^2 I)``, here 0.47 uT a degree. Of walks whose offset is taken off,
    3.0 and 1.0 uT of anomalies and clutter give 4.0 uT and 9.1 degrees; waves of 200 m give 3.9 uT
    and 10.2 degrees; in the level field of that mall, 28 uT, it would be more uT a degree still.

    Attributes
    ----------
    field_ut, inclination_deg : float
        Magnitude of the Earth's field and its angle below the horizon: 49 uT and 66 degrees in
        southern England, 50 uT and 48 degrees in Hangzhou (World Magnetic Model 2020, rounded).
        [uT], [degree]
    declination_deg : float
        Direction of magnetic north, clockwise from the map's y axis. [degree]
    anomaly_ut, anomaly_m : float
        Spread of each horizontal component of the wide anomalies, and their middle wavelength,
        assumed so that headings are off as measured. [uT], [m]
    clutter_ut, clutter_m : float
        The same of the narrow anomalies. [uT], [m]
    """

    field_ut: float = Field(default=49.0, ge=0, le=100)
    inclination_deg: float = Field(default=66.0, ge=-90, le=90)
    declination_deg: float = Field(default=0.0, ge=-180, le=180)
    anomaly_ut: float = Field(default=3.8, ge=0, le=50)
    anomaly_m: float = Field(default=60.0, ge=1, le=1000)
    clutter_ut: float = Field(default=1.3, ge=0, le=50)
    clutter_m: float = Field(default=8.0, ge=0.5, le=1000)

    def earth_ut(self) -> NDArray[np.float64]:
        """The Earth's field along the map's x and y and upwards, (3,). [uT]."""
        down, east = np.radians([self.inclination_deg, self.declination_deg])
        level = self.field_ut * np.cos(down)
        return np.array([level * np.sin(east), level * np.cos(east), -self.field_ut * np.sin(down)])


@dataclass(frozen=True, slots=True, kw_only=True)
class MagneticField:
    """The field of one venue over its floor, at the height of a phone.

    Each anomaly wave is a magnetostatic field without sources where people walk [1]_: of the
    potential ``cos(k . x + p) exp(-k z) / k`` the horizontal part points along k and the vertical
    part is a quarter wave behind, equally strong.

    Attributes
    ----------
    earth_ut : ndarray of float64, (3,)
        [uT]
    waves : ndarray of float64, (m, 4)
        Wave vector, phase and amplitude. [rad/m], [rad/m], [rad], [uT]

    References
    ----------
    .. [1] J. D. Jackson, "Classical Electrodynamics", 3rd ed., Wiley 1998, section 5.9.
    """

    earth_ut: NDArray[np.float64]
    waves: NDArray[np.float64]

    @classmethod
    def draw(cls, magnetics: Magnetics, seed: int, level: int = 0) -> Self:
        """The field of one level of a venue; each level has anomalies of its own."""
        wide = _waves(magnetics.anomaly_ut, magnetics.anomaly_m, seed, f"anomaly {level}")
        narrow = _waves(magnetics.clutter_ut, magnetics.clutter_m, seed, f"clutter {level}")
        return cls(earth_ut=magnetics.earth_ut(), waves=np.concatenate([wide, narrow]))

    def at_ut(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """The field at places, (n, 3), along the map's x and y and upwards. [uT]."""
        field = np.tile(self.earth_ut, (len(x_m), 1))
        _add_waves(x_m, y_m, self.waves, field)
        return field


@kernel
def _add_waves(
    x_m: NDArray[np.float64],
    y_m: NDArray[np.float64],
    waves: NDArray[np.float64],
    field_ut: NDArray[np.float64],
) -> None:
    """Add the anomalies at each place (kernel)."""
    for wave in range(len(waves)):
        kx, ky, phase, amplitude = waves[wave]
        strength = amplitude / np.sqrt(kx * kx + ky * ky)
        along_x, along_y = strength * kx, strength * ky
        for place in range(len(x_m)):
            sine, cosine = sine_cosine(kx * x_m[place] + ky * y_m[place] + phase)
            field_ut[place, 0] += along_x * sine
            field_ut[place, 1] += along_y * sine
            field_ut[place, 2] += amplitude * cosine


def _waves(spread_ut: float, wavelength_m: float, seed: int, purpose: str) -> NDArray[np.float64]:
    """Waves from all directions, from two thirds to one and a half of a wavelength long."""
    uniforms = Draws(seed=seed, purpose=f"magnetic {purpose}").uniforms(np.arange(WAVES))
    wave_number = 2.0 * np.pi / (wavelength_m * 1.5 ** (2.0 * uniforms[:, 0] - 1.0))
    direction, phase = 2.0 * np.pi * uniforms[:, 1], 2.0 * np.pi * uniforms[:, 2]
    # Half of a wave's power is along each horizontal axis, half of the time.
    amplitude = np.full(WAVES, 2.0 * spread_ut / np.sqrt(WAVES))
    return np.stack(
        [wave_number * np.cos(direction), wave_number * np.sin(direction), phase, amplitude], axis=1
    )
