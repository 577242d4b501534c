"""Logarithms and exponentials of whole arrays, for the weights of particles.

Out of additions, multiplications and divisions alone: every processor rounds them alike, and does
several at once, which takes less than half the time of one library call after the other.
"""

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel

Array = NDArray[np.float64]

_LOG_2 = 0.6931471805599453
# The upper and lower part of log 2: multiples of the upper part are exact.
_LOG_2_UPPER, _LOG_2_LOWER = 0.693147180369123816490, 1.90821492927058770002e-10
_PER_LOG_2 = 1.4426950408889634
# A double is 2^(exponent - 1023) times a mantissa of 52 bits.
_MANTISSA_BITS, _ONE = np.uint64(52), np.uint64(1023 << 52)
_ROOT_OF_HALF = np.uint64(0x3FE6A09E667F3BCD)
# Doubles of this size are whole numbers, which stand in their lowest bits.
_WHOLE_BITS, _WHOLE = np.uint64(0x433 << 52), 2.0**52
_ROUNDING = 1.5 * 2.0**52
_R11 = 1.0 / 39916800.0
# e to the power of anything less counts as that: no weight beside one of 1.
_LEAST = -700.0


@kernel
def fill_logarithms(values: Array, out: Array) -> None:
    """Fill natural logarithms, absolute error under 1e-14 (kernel).

    With a mantissa m within the roots of one half and two, ``log m = 2 artanh s`` with
    ``s = (m - 1) / (m + 1)``, as a series to s^19.

    Parameters
    ----------
    values : ndarray of float64, (n,)
        Finite, not under 1e-300; may be `out` itself.
    out : ndarray of float64, (n,)
        Changed.
    """
    mantissa, exponent = np.empty(len(values)), np.empty(len(values))
    bits, mantissa_bits = values.view(np.uint64), mantissa.view(np.uint64)
    exponent_bits = exponent.view(np.uint64)
    for i in range(len(values)):
        power = (bits[i] - _ROOT_OF_HALF + _ONE) >> _MANTISSA_BITS
        mantissa_bits[i] = bits[i] - (power << _MANTISSA_BITS) + _ONE
        exponent_bits[i] = power | _WHOLE_BITS
    for i in range(len(values)):
        s = (mantissa[i] - 1.0) / (mantissa[i] + 1.0)
        q = s * s
        p = ((((2.0 / 19.0) * q + 2.0 / 17.0) * q + 2.0 / 15.0) * q + 2.0 / 13.0) * q + 2.0 / 11.0
        p = ((((p * q + 2.0 / 9.0) * q + 2.0 / 7.0) * q + 2.0 / 5.0) * q + 2.0 / 3.0) * q + 2.0
        out[i] = s * p + (exponent[i] - _WHOLE - 1023.0) * _LOG_2


@kernel
def fill_exponentials(values: Array, out: Array) -> None:
    """Fill ``exp(v)`` of values that are not positive, relative error under 1e-13 (kernel).

    ``exp(v) = 2^k exp(r)`` with r within half of log 2, as a series to r^11.

    Parameters
    ----------
    values : ndarray of float64, (n,)
        Not positive, not NaN; those under -700, minus infinity among them, count as -700.
    out : ndarray of float64, (n,)
        Another array; changed.
    """
    bits, shifted = out.view(np.int64), np.empty(len(values))
    shifted_bits = shifted.view(np.int64)
    for i in range(len(values)):
        value = max(values[i], _LEAST)
        shifted[i] = value * _PER_LOG_2 + _ROUNDING
        k = shifted[i] - _ROUNDING
        r = (value - k * _LOG_2_UPPER) - k * _LOG_2_LOWER
        p = ((_R11 * r + 1.0 / 3628800.0) * r + 1.0 / 362880.0) * r + 1.0 / 40320.0
        p = ((p * r + 1.0 / 5040.0) * r + 1.0 / 720.0) * r + 1.0 / 120.0
        p = ((p * r + 1.0 / 24.0) * r + 1.0 / 6.0) * r + 0.5
        out[i] = (p * r + 1.0) * r + 1.0
    for i in range(len(values)):
        bits[i] += shifted_bits[i] << 52
