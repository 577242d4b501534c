"""Random numbers addressed by name: who draws, for what, and the how-manieth draw it is.

A draw is addressed by (seed, purpose, walker, beacon, ordinal). Nothing is handed on from one draw
to the next, so adding, removing or moving a walker or a beacon leaves every other draw as it was,
and so does the number of worker processes.

The generator is Philox4x64-10 [1]_: the key holds seed and purpose, the counter holds ordinal,
walker and beacon. `numpy.random.Philox` is the same generator, and the tests hold the two against
each other.

References
----------
.. [1] J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, "Parallel random numbers: as easy as
   1, 2, 3", SC '11, 2011. doi:10.1145/2063384.2063405
"""

from dataclasses import dataclass
from functools import cache
from hashlib import blake2b
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.kernels import kernel

SEED_LIMIT = 2**64

_MULTIPLIER_0 = np.uint64(0xD2E7470EE14C6C93)
_MULTIPLIER_1 = np.uint64(0xCA5A826395121157)
_WEYL_0 = np.uint64(0x9E3779B97F4A7C15)
_WEYL_1 = np.uint64(0xBB67AE8584CAA73B)
_ROUNDS = 10

# The fourth counter word keeps the two kinds of use apart: single draws and sequential streams.
_DRAWS = np.uint64(0)
_SEQUENCE = 1

_HALF_STEP = 0.5
_STEP = 2.0**-52


@cache
def name_key(name: str) -> int:
    """The 64-bit number a name stands for in an address: BLAKE2b of its UTF-8 text, 0 for ''."""
    return int.from_bytes(blake2b(name.encode(), digest_size=8).digest(), "little") if name else 0


def refuse_bad_seed(seed: int) -> None:
    """Raise `UsageError` if a seed is not in [0, 2**64)."""
    if not 0 <= seed < SEED_LIMIT:
        raise UsageError(f"seed {seed}: give a whole number from 0 to 2**64 - 1")


@dataclass(frozen=True, slots=True, kw_only=True)
class Draws:
    """All random numbers of one purpose, walker and beacon.

    Attributes
    ----------
    seed : int
        Seed of the whole simulation, in [0, 2**64).
    purpose : str
        What is drawn, such as ``"advertising delay"``; never empty.
    walker, beacon : str
        Names of those the draw concerns; empty where it concerns none.

    Raises
    ------
    UsageError
        If the seed is out of range.
    """

    seed: int
    purpose: str
    walker: str = ""
    beacon: str = ""

    def __post_init__(self) -> None:
        refuse_bad_seed(self.seed)
        if not self.purpose:
            raise ValueError("a draw needs a purpose")

    def address(self) -> NDArray[np.uint64]:
        """Key and counter words of this address, (4,): seed, purpose, walker, beacon."""
        words = (self.seed, name_key(self.purpose), name_key(self.walker), name_key(self.beacon))
        return np.array(words, dtype=np.uint64)

    def uniforms(self, ordinals: NDArray[np.int64]) -> NDArray[np.float64]:
        """Four independent U(0, 1) numbers for each ordinal, ends excluded.

        Parameters
        ----------
        ordinals : ndarray of int64, (n,)
            Which draws; not negative.

        Returns
        -------
        ndarray of float64, (n, 4)
            [-]
        """
        out = np.empty((len(ordinals), 4))
        _fill_uniforms(self.address(), ordinals.astype(np.uint64), out)
        return out

    def normals(self, ordinals: NDArray[np.int64]) -> NDArray[np.float64]:
        """Four independent N(0, 1) numbers for each ordinal, (n, 4); see `uniforms`. [-]."""
        return normals_of(self.uniforms(ordinals))

    def generator(self) -> np.random.Generator:
        """A NumPy generator for the draws of this address that are taken one after the other."""
        seed, purpose, walker, beacon = self.address()
        return np.random.Generator(
            np.random.Philox(
                key=np.array([seed, purpose]),
                counter=np.array([0, walker, beacon, _SEQUENCE], dtype=np.uint64),
            )
        )


def normals_of(uniforms: NDArray[np.float64]) -> NDArray[np.float64]:
    """N(0, 1) numbers of U(0, 1) numbers, same shape: their standard normal quantiles. [-]."""
    out = np.array(uniforms, dtype=np.float64, order="C")
    _quantiles_in_place(out.reshape(-1))
    return out


def _emit_high_word(_context: Any, _a: Any, _b: Any) -> Any:
    """Upper 64 bits of a 128-bit product, which Python and NumPy integers cannot give a kernel."""

    def emit(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        wide = ir.IntType(128)
        product = builder.mul(builder.zext(args[0], wide), builder.zext(args[1], wide))
        return builder.trunc(builder.lshr(product, ir.Constant(wide, 64)), ir.IntType(64))

    return types.uint64(types.uint64, types.uint64), emit


_high_word: Any = intrinsic(_emit_high_word)


@kernel
def philox(
    address: NDArray[np.uint64], ordinal: np.uint64
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """The four 64-bit words of one address and ordinal (kernel)."""
    # numpy.random.Philox counts up before it draws; counting from 1 makes the words agree.
    c0, c1, c2, c3 = ordinal + np.uint64(1), address[2], address[3], _DRAWS
    k0, k1 = address[0], address[1]
    for _ in range(_ROUNDS):
        high_0, low_0 = _high_word(_MULTIPLIER_0, c0), _MULTIPLIER_0 * c0
        high_1, low_1 = _high_word(_MULTIPLIER_1, c2), _MULTIPLIER_1 * c2
        c0, c1, c2, c3 = high_1 ^ c1 ^ k0, low_1, high_0 ^ c3 ^ k1, low_0
        k0 += _WEYL_0
        k1 += _WEYL_1
    return c0, c1, c2, c3


@kernel
def uniform(word: np.uint64) -> float:
    """U(0, 1) from the upper 52 bits of a word, both ends excluded (kernel). [-]."""
    # With 53 bits the half step would be rounded away above one half, and 1 would be drawn.
    return (np.float64(word >> np.uint64(12)) + _HALF_STEP) * _STEP


# Coefficients of AS 241, lowest power first: numerator and denominator of each of its three ranges.
_CENTRAL = (
    (
        3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3,
        1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
        3.3430575583588128105e4, 2.5090809287301226727e3,
    ),
    (
        1.0, 4.2313330701600911252e1, 6.8718700749205790830e2, 5.3941960214247511077e3,
        2.1213794301586595867e4, 3.9307895800092710610e4, 2.8729085735721942674e4,
        5.2264952788528545610e3,
    ),
)  # fmt: skip
_MIDDLE = (
    (
        1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0,
        3.64784832476320460504e0, 1.27045825245236838258e0, 2.41780725177450611770e-1,
        2.27238449892691845833e-2, 7.74545014278341407640e-4,
    ),
    (
        1.0, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1,
        1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4,
        1.05075007164441684324e-9,
    ),
)  # fmt: skip
_FAR = (
    (
        6.65790464350110377720e0, 5.46378491116411436990e0, 1.78482653991729133580e0,
        2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3,
        2.71155556874348757815e-5, 2.01033439929228813265e-7,
    ),
    (
        1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2,
        7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7,
        2.04426310338993978564e-15,
    ),
)  # fmt: skip


@kernel
def _ratio(coefficients: tuple[tuple[float, ...], tuple[float, ...]], r: float) -> float:
    numerator, denominator = 0.0, 0.0
    for power in range(7, -1, -1):
        numerator = numerator * r + coefficients[0][power]
        denominator = denominator * r + coefficients[1][power]
    return numerator / denominator


@kernel
def normal_quantile(p: float) -> float:
    """Standard normal quantile of a probability in (0, 1), relative error about 1e-16 (kernel).

    Algorithm AS 241, PPND16: M. J. Wichura, "The percentage points of the normal distribution",
    Applied Statistics 37, 1988. doi:10.2307/2347330
    """
    q = p - 0.5
    if abs(q) <= 0.425:
        return q * _ratio(_CENTRAL, 0.180625 - q * q)
    tail = np.sqrt(-np.log(p if q < 0.0 else 1.0 - p))
    value = _ratio(_MIDDLE, tail - 1.6) if tail <= 5.0 else _ratio(_FAR, tail - 5.0)
    return -value if q < 0.0 else value


@kernel
def _fill_uniforms(
    address: NDArray[np.uint64], ordinals: NDArray[np.uint64], out: NDArray[np.float64]
) -> None:
    for row in range(len(ordinals)):
        words = philox(address, ordinals[row])
        for column in range(4):
            out[row, column] = uniform(words[column])


@kernel
def _quantiles_in_place(values: NDArray[np.float64]) -> None:
    for index in range(len(values)):
        values[index] = normal_quantile(values[index])
