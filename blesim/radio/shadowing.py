"""Shadowing: slow variation of the level over space, one correlated Gaussian field a beacon."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.kernels import kernel
from blesim.rng import Draws
from blesim.settings import Settings

WAVES = 128


class Shadowing(Settings):
    """Strength and scale of the shadowing.

    Attributes
    ----------
    standard_deviation_db : float
        Spread of the field; 4.5 measured about the path loss of a hall. [dB]
    decorrelation_m : float
        Distance at which the correlation has fallen to 1/e; 1 to 1.5 measured in a hall. [m]
    """

    standard_deviation_db: float = Field(default=4.5, ge=0, le=20)
    decorrelation_m: float = Field(default=1.25, gt=0, le=100)


@dataclass(frozen=True, slots=True, kw_only=True)
class ShadowField:
    """One sample of the field: a sum of plane waves.

    ``S(x) = sigma sqrt(2/M) sum cos(k_m . x + phi_m)``, with wave vectors drawn from the spectrum
    of the exponential correlation ``exp(-d / D)``, so that the field has that correlation [1]_ over
    samples and is Gaussian to order 1/M [2]_.

    References
    ----------
    .. [1] M. Gudmundson, "Correlation model for shadow fading in mobile radio systems",
       Electronics Letters 27, 1991. doi:10.1049/el:19911328
    .. [2] M. Shinozuka, C.-M. Jan, "Digital simulation of random processes and its applications",
       J. Sound Vib. 25, 1972. doi:10.1016/0022-460X(72)90600-1
    """

    amplitude_db: float
    waves: NDArray[np.float64]

    @classmethod
    def draw(cls, shadowing: Shadowing, seed: int, beacon: str) -> Self:
        """The field of one beacon."""
        draws = Draws(seed=seed, purpose="shadowing", beacon=beacon).uniforms(np.arange(WAVES))
        # Radial spectrum in two dimensions: P(k < K) = 1 - 1 / sqrt(1 + K^2 D^2).
        wave_number = np.sqrt(draws[:, 0] ** -2 - 1.0) / shadowing.decorrelation_m
        direction, phase = 2.0 * np.pi * draws[:, 1], 2.0 * np.pi * draws[:, 2]
        waves = np.stack(
            [wave_number * np.cos(direction), wave_number * np.sin(direction), phase], axis=1
        )
        return cls(amplitude_db=shadowing.standard_deviation_db * np.sqrt(2.0 / WAVES), waves=waves)

    def at_db(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Level of the field at places, + stronger.

        Parameters
        ----------
        x_m, y_m : ndarray of float64, (n,)
            Where the phone is. [m]

        Returns
        -------
        ndarray of float64, (n,)
            [dB]
        """
        out = np.zeros(len(x_m))
        if self.amplitude_db > 0:
            _add_waves(x_m, y_m, self.waves, self.amplitude_db, out)
        return out


@kernel
def _add_waves(
    x_m: NDArray[np.float64],
    y_m: NDArray[np.float64],
    waves: NDArray[np.float64],
    amplitude_db: float,
    out: NDArray[np.float64],
) -> None:
    for place in range(len(x_m)):
        total = 0.0
        for wave in range(len(waves)):
            total += np.cos(
                waves[wave, 0] * x_m[place] + waves[wave, 1] * y_m[place] + waves[wave, 2]
            )
        out[place] = amplitude_db * total
