"""Normal numbers by the million: two from each random word, by a table of quantiles."""

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel
from blesim.rng import Draws, normal_quantile, normals_of, philox

HALF_WORD = np.uint64(0xFFFFFFFF)
HALF_STEP = 2.0**-32
# Quantiles at multiples of 1/4096. Between them a straight line is off by less than 1e-5, but in
# the tails, which are worked out.
_TABLE = normals_of(np.clip(np.arange(4097) / 4096.0, HALF_STEP, 1.0 - HALF_STEP))
_TAIL = 64.0


@kernel
def quick_normal(half: np.uint64) -> float:
    """N(0, 1) from 32 random bits (kernel). [-]."""
    p = (np.float64(half) + 0.5) * HALF_STEP
    place = p * 4096.0
    if place < _TAIL or place > 4096.0 - _TAIL:
        return normal_quantile(p)
    row = int(place)
    return float(_TABLE[row] + (place - row) * (_TABLE[row + 1] - _TABLE[row]))


@kernel
def nine_normals(address: NDArray[np.uint64], ordinal: np.uint64, out: NDArray[np.float64]) -> None:
    """Nine N(0, 1) numbers of an ordinal, two from each random word (kernel). [-]."""
    a0, a1, a2, a3 = philox(address, np.uint64(2) * ordinal)
    b0, _, _, _ = philox(address, np.uint64(2) * ordinal + np.uint64(1))
    out[0], out[1] = quick_normal(a0 & HALF_WORD), quick_normal(a0 >> np.uint64(32))
    out[2], out[3] = quick_normal(a1 & HALF_WORD), quick_normal(a1 >> np.uint64(32))
    out[4], out[5] = quick_normal(a2 & HALF_WORD), quick_normal(a2 >> np.uint64(32))
    out[6], out[7] = quick_normal(a3 & HALF_WORD), quick_normal(a3 >> np.uint64(32))
    out[8] = quick_normal(b0 & HALF_WORD)


def three_normals(draws: Draws, first: int, count: int) -> NDArray[np.float64]:
    """Three N(0, 1) numbers for each of some ordinals that follow each other, (count, 3). [-]."""
    out = np.empty((count, 3))
    _fill(draws.address(), first, out)
    return out


@kernel
def _fill(address: NDArray[np.uint64], first: int, out: NDArray[np.float64]) -> None:
    for row in range(len(out)):
        a, b, _, _ = philox(address, np.uint64(first + row))
        out[row, 0] = quick_normal(a & HALF_WORD)
        out[row, 1] = quick_normal(a >> np.uint64(32))
        out[row, 2] = quick_normal(b & HALF_WORD)
