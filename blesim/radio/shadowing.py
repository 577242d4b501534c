"""Shadowing: slow variation of the level over space, one correlated Gaussian field a beacon."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.radio.waves import add_waves
from blesim.rng import Draws
from blesim.settings import Settings

WAVES = 64


class Shadowing(Settings):
    """Strength and scale of the shadowing.

    Attributes
    ----------
    standard_deviation_db : float
        Spread of the field; 4.5 measured about the path loss of a hall. [dB]
    decorrelation_m : float
        Distance at which the correlation has fallen to 1/e; 1 to 1.5 measured in a hall. [m]
    beacon_correlation : float
        Correlation between the fields of any two beacons at the same place. [-]
    """

    standard_deviation_db: float = Field(default=4.5, ge=0, le=20)
    decorrelation_m: float = Field(default=1.25, gt=0, le=100)
    beacon_correlation: float = Field(default=0.0, ge=0, le=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class ShadowField:
    """One sample of the field: a sum of plane waves.

    ``S(x) = sigma sqrt(2/M) sum cos(2 pi (k_m . x + phi_m))``, with wave vectors drawn from the
    spectrum of the exponential correlation ``exp(-d / D)``, so that the field has that correlation
    [1]_ over samples and is Gaussian to order 1/M [2]_. Correlated beacons share a second such sum.

    Attributes
    ----------
    parts : tuple of (float, ndarray of float64 (m, 3))
        Amplitude [dB] and waves of each sum; see `waves.add_waves`.

    References
    ----------
    .. [1] M. Gudmundson, "Correlation model for shadow fading in mobile radio systems",
       Electronics Letters 27, 1991. doi:10.1049/el:19911328
    .. [2] M. Shinozuka, C.-M. Jan, "Digital simulation of random processes and its applications",
       J. Sound Vib. 25, 1972. doi:10.1016/0022-460X(72)90600-1
    """

    parts: tuple[tuple[float, NDArray[np.float64]], ...]

    @classmethod
    def draw(cls, shadowing: Shadowing, seed: int, beacon: str) -> Self:
        """The field of one beacon."""
        share = shadowing.beacon_correlation
        sums = ((1.0 - share, beacon), (share, ""))
        unit_db = shadowing.standard_deviation_db * np.sqrt(2.0 / WAVES)
        return cls(
            parts=tuple(
                (float(unit_db * np.sqrt(power)), _waves(shadowing.decorrelation_m, seed, name))
                for power, name in sums
                if power > 0 and unit_db > 0
            )
        )

    def add_to(
        self, x_m: NDArray[np.float64], y_m: NDArray[np.float64], out: NDArray[np.float64]
    ) -> None:
        """Add the level of the field at places, + stronger; all (n,). [m], [m], [dB]."""
        for amplitude_db, waves in self.parts:
            add_waves(x_m, y_m, waves, amplitude_db, out)


def _waves(decorrelation_m: float, seed: int, beacon: str) -> NDArray[np.float64]:
    """Wave vectors and phases of a field with exponential correlation, (WAVES, 3). [turns]."""
    draws = Draws(seed=seed, purpose="shadowing", beacon=beacon).uniforms(np.arange(WAVES))
    # Radial spectrum in two dimensions: P(k < K) = 1 - 1 / sqrt(1 + (K D)^2).
    wave_number = np.sqrt(draws[:, 0] ** -2 - 1.0) / decorrelation_m / (2.0 * np.pi)
    direction = 2.0 * np.pi * draws[:, 1]
    return np.stack(
        [wave_number * np.cos(direction), wave_number * np.sin(direction), draws[:, 2]], axis=1
    )
