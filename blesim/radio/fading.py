"""Fading: fast variation of the level, over space by multipath or from packet to packet."""

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import exp1

from blesim.kernels import kernel
from blesim.radio.waves import cosine
from blesim.rng import Draws
from blesim.settings import Settings
from blesim.venue.beacons import CHANNELS

FREQUENCY_HZ = {37: 2.402e9, 38: 2.426e9, 39: 2.480e9}
SPEED_OF_LIGHT_M_S = 299_792_458.0
# Of the middle channel, for all three: waves that channels share must not fall out of step because
# their frequencies differ by 3 %.
WAVELENGTH_M = SPEED_OF_LIGHT_M_S / FREQUENCY_HZ[38]
# Scattered waves that all channels of a beacon share; each channel has as many of its own besides.
WAVES = 4
_FAINTEST = 1e-6


class Fading(Settings):
    """Which fading, and how much.

    Attributes
    ----------
    model : str
        ``rician``: a steady and a scattered part that interfere over about half a wavelength, each
        channel in its own way, so that a phone at rest sees three levels; ``gaussian``: a normal
        deviate in dB for every packet alone, as published simulations assume; ``none``.
    rice_factor_db : float
        Power of the steady over that of the scattered part. [dB]
    channel_correlation : float
        Correlation of the scattered power between channels. The 0.30 to 0.43 that was measured
        while walking is that of all that path loss leaves over; shadowing and body, which channels
        share anyway, account for it. [-]
    standard_deviation_db : float
        Spread of the Gaussian. [dB]
    """

    model: Literal["rician", "gaussian", "none"] = "rician"
    rice_factor_db: float = Field(default=3.0, ge=-30, le=60)
    channel_correlation: float = Field(default=0.0, ge=0, le=1)
    standard_deviation_db: float = Field(default=3.0, ge=0, le=20)

    def of_packets_db(self, deviates: NDArray[np.float64]) -> NDArray[np.float64]:
        """Fading that every packet has alone, from a standard normal deviate each, (n,). [dB]."""
        spread_db = self.standard_deviation_db if self.model == "gaussian" else 0.0
        return spread_db * deviates


@dataclass(frozen=True, slots=True, kw_only=True)
class MultipathField:
    """Level of the interference pattern that one beacon makes on one channel.

    ``h = sqrt(K/(K+1)) exp(-j 2 pi d/lambda)
    + sqrt(1/(K+1)) sum a_m exp(j 2 pi (k_m . x + phi_m))``,
    with ``|k_m| = 1/lambda`` from all directions (Clarke's model [1]_); the scattered waves that
    channels share carry the root of their power correlation. The level is ``20 log10 |h|`` less its
    mean ``10 log10(e) (ln(K/(K+1)) + E1(K))``, so that path loss alone sets the mean level in dB.

    References
    ----------
    .. [1] R. H. Clarke, "A statistical theory of mobile-radio reception", Bell System Technical
       Journal 47, 1968. doi:10.1002/j.1538-7305.1968.tb00069.x
    """

    steady: float
    scattered: NDArray[np.float64]
    mean_db: float

    @classmethod
    def draw(cls, fading: Fading, seed: int, beacon: str, channel: int) -> Self:
        """The field of one beacon and channel."""
        rice = 10.0 ** (fading.rice_factor_db / 10.0)
        shared = np.sqrt(fading.channel_correlation)
        draws = Draws(seed=seed, purpose="multipath", beacon=beacon)
        row = (1 + CHANNELS.index(channel)) * WAVES
        parts = [
            _waves(draws, first, np.sqrt(power / (rice + 1.0) / WAVES))
            for power, first in ((shared, 0), (1.0 - shared, row))
        ]
        mean_db = 10.0 * np.log10(np.e) * (np.log(rice / (rice + 1.0)) + exp1(rice))
        return cls(
            steady=float(np.sqrt(rice / (rice + 1.0))),
            scattered=np.concatenate(parts),
            mean_db=float(mean_db),
        )

    def at_db(
        self,
        x_m: NDArray[np.float64],
        y_m: NDArray[np.float64],
        distance_m: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Level of the field at places, + stronger.

        Parameters
        ----------
        x_m, y_m, distance_m : ndarray of float64, (n,)
            Where the phone is, and how far from the beacon. [m]

        Returns
        -------
        ndarray of float64, (n,)
            [dB]
        """
        real, imaginary = np.empty(len(x_m)), np.empty(len(x_m))
        _fill_phasors(x_m, y_m, distance_m, self.steady, self.scattered, real, imaginary)
        power = np.maximum(real**2 + imaginary**2, _FAINTEST)
        return 10.0 * np.log10(power) - self.mean_db


def _waves(draws: Draws, first: int, amplitude: float) -> NDArray[np.float64]:
    """Scattered waves from random directions, (WAVES, 4). [turns/m], [turns], [-]."""
    uniforms = draws.uniforms(np.arange(first, first + WAVES))
    direction = 2.0 * np.pi * uniforms[:, 0]
    columns = (np.cos(direction) / WAVELENGTH_M, np.sin(direction) / WAVELENGTH_M, uniforms[:, 1])
    return np.stack([*columns, np.full(WAVES, amplitude)], axis=1)


@kernel
def _fill_phasors(
    x_m: NDArray[np.float64],
    y_m: NDArray[np.float64],
    distance_m: NDArray[np.float64],
    steady: float,
    scattered: NDArray[np.float64],
    real: NDArray[np.float64],
    imaginary: NDArray[np.float64],
) -> None:
    """Sum of the steady and the scattered waves at each place (kernel)."""
    for place in range(len(real)):
        turns = -distance_m[place] / WAVELENGTH_M
        real[place] = steady * cosine(turns)
        # Sine is a quarter turn behind.
        imaginary[place] = steady * cosine(turns - 0.25)
    for wave in range(len(scattered)):
        kx, ky = scattered[wave, 0], scattered[wave, 1]
        phase, amplitude = scattered[wave, 2], scattered[wave, 3]
        for place in range(len(real)):
            turns = kx * x_m[place] + ky * y_m[place] + phase
            real[place] += amplitude * cosine(turns)
            imaginary[place] += amplitude * cosine(turns - 0.25)
