"""Sums of plane waves over many places: the loop behind shadowing and multipath.

The cosine is a polynomial of additions and multiplications alone, which every processor rounds
alike and which compilers turn into vector instructions; it is off by less than 4e-9.
"""

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel

# (2 pi)^(2k) / (2k)! with alternating sign: the Taylor series of cos(2 pi t) in t^2.
_COSINE = (
    1.0,
    -19.739208802178716,
    64.93939402266829,
    -85.45681720669373,
    60.24464137187666,
    -26.4262567833744,
    7.903536371318467,
    -1.714390711088672,
    0.28200596845579096,
    -0.03638284114254566,
)


@kernel
def cosine(turns: float) -> float:
    """Cosine of an angle in turns, ``cos(2 pi t)``, within 4e-9 (kernel). [-]."""
    t = turns - np.floor(turns + 0.5)
    u = t * t
    total = _COSINE[9]
    total = total * u + _COSINE[8]
    total = total * u + _COSINE[7]
    total = total * u + _COSINE[6]
    total = total * u + _COSINE[5]
    total = total * u + _COSINE[4]
    total = total * u + _COSINE[3]
    total = total * u + _COSINE[2]
    total = total * u + _COSINE[1]
    return float(total * u + _COSINE[0])


@kernel
def add_waves(
    x_m: NDArray[np.float64],
    y_m: NDArray[np.float64],
    waves: NDArray[np.float64],
    amplitude: float,
    out: NDArray[np.float64],
) -> None:
    """Add ``amplitude sum cos(2 pi (kx x + ky y + phase))`` at each place (kernel).

    Parameters
    ----------
    x_m, y_m : ndarray of float64, (n,)
        Places. [m]
    waves : ndarray of float64, (m, 3)
        Wave vector and phase of each wave. [turns/m], [turns/m], [turns]
    amplitude : float
        Of each wave.
    out : ndarray of float64, (n,)
        Added to.
    """
    for wave in range(len(waves)):
        kx, ky, phase = waves[wave, 0], waves[wave, 1], waves[wave, 2]
        for place in range(len(out)):
            out[place] += amplitude * cosine(kx * x_m[place] + ky * y_m[place] + phase)
