"""Resampling: which particles live on, and how often each.

A particle of normalised weight w has ``n w`` copies among n on average, whatever the scheme; they
differ in how much that number varies [1]_:

- multinomial: n independent draws
- stratified: one draw in each n-th of the cumulated weights
- systematic: the same place in each n-th, so that one draw does
- residual: ``floor(n w)`` copies for certain, multinomial draws for the rest

Weights need not add up to one. Where all are zero, nothing is known, and all particles are equally
likely; a particle of weight zero among others never lives on. NaN, infinite and negative weights
are refused.

References
----------
.. [1] R. Douc, O. Cappe, E. Moulines, "Comparison of resampling schemes for particle filtering",
   ISPA 2005. doi:10.1109/ISPA.2005.195385
"""

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError, UsageError
from blesim.kernels import kernel

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

Scheme = Literal["multinomial", "stratified", "systematic", "residual"]


def resample(scheme: Scheme, weights: Array, count: int, rng: np.random.Generator) -> Indices:
    """Particles that live on.

    Parameters
    ----------
    scheme : {"multinomial", "stratified", "systematic", "residual"}
        How they are drawn.
    weights : ndarray of float64, (n,)
        At least one; not negative. [-]
    count : int
        How many shall live on.
    rng : numpy.random.Generator
        Gives `count` numbers, for ``systematic`` one, whatever the weights.

    Returns
    -------
    ndarray of int64, (count,)
        Rows of `weights`; ascending but for ``multinomial``, and for the second part of
        ``residual``.

    Raises
    ------
    DataError
        If a weight is NaN, infinite or negative, or there is none.
    UsageError
        If the scheme is unknown.
    """
    if scheme not in get_args(Scheme):
        raise UsageError(f"resampling '{scheme}': use one of {', '.join(get_args(Scheme))}")
    uniforms = rng.random(1 if scheme == "systematic" else count)
    if scheme == "systematic":
        return systematic(weights, uniforms, count)
    if scheme == "stratified":
        return stratified(weights, uniforms, count)
    if scheme == "residual":
        return residual(weights, uniforms, count)
    return multinomial(weights, uniforms, count)


@kernel
def effective_sample_size(weights: Array) -> float:
    """Number of equally weighted particles worth as much: ``(sum w)^2 / sum w^2`` (kernel). [-].

    Parameters
    ----------
    weights : ndarray of float64, (n,)
        Where all are zero, all count the same: n. [-]

    Raises
    ------
    DataError
        If a weight is NaN, infinite or negative, or there is none.
    """
    largest = _largest(weights)
    if largest == 0.0:
        return float(len(weights))
    total, squares = 0.0, 0.0
    for weight in weights:
        share = weight / largest
        total += share
        squares += share * share
    return total * total / squares


@kernel
def multinomial(weights: Array, uniforms: Array, count: int) -> Indices:
    """Rows of `count` independent draws, (count,), from as many uniforms in [0, 1) (kernel)."""
    _refuse_too_few(uniforms, count)
    cumulated = _cumulated(weights)
    guide, below = _guide(cumulated), _below_whole(cumulated)
    out = np.empty(count, np.int64)
    for i in range(count):
        out[i] = _row_at(cumulated, guide, below, uniforms[i])
    return out


@kernel
def stratified(weights: Array, uniforms: Array, count: int) -> Indices:
    """Rows of one draw in each stratum, (count,), from as many uniforms in [0, 1) (kernel)."""
    _refuse_too_few(uniforms, count)
    cumulated = _cumulated(weights)
    below = _below_whole(cumulated)
    out = np.empty(count, np.int64)
    row = 0
    for i in range(count):
        row = _next_row(cumulated, below, (i + uniforms[i]) / count, row)
        out[i] = row
    return out


@kernel
def systematic(weights: Array, uniforms: Array, count: int) -> Indices:
    """Rows at equal distances, (count,), from the first of the uniforms in [0, 1) (kernel)."""
    _refuse_too_few(uniforms, 1)
    cumulated = _cumulated(weights)
    below = _below_whole(cumulated)
    out = np.empty(count, np.int64)
    row = 0
    for i in range(count):
        row = _next_row(cumulated, below, (i + uniforms[0]) / count, row)
        out[i] = row
    return out


@kernel
def residual(weights: Array, uniforms: Array, count: int) -> Indices:
    """Rows of the certain copies, then of draws for the rest, (count,) (kernel).

    Takes as many of the uniforms in [0, 1) as copies are not certain, at most `count`.
    """
    _refuse_too_few(uniforms, count)
    cumulated = _cumulated(weights)
    rest = np.empty(len(weights))
    out = np.empty(count, np.int64)
    certain, below = 0, 0.0
    for row in range(len(weights)):
        copies = count * ((cumulated[row] - below) / cumulated[-1])
        below = cumulated[row]
        whole = min(int(copies), count - certain)
        out[certain : certain + whole] = row
        certain += whole
        rest[row] = max(copies - whole, 0.0)
    out[certain:] = multinomial(rest, uniforms, count - certain)
    return out


@kernel
def _refuse_too_few(uniforms: Array, count: int) -> None:
    if len(uniforms) < count:
        raise ValueError("give as many uniform numbers as draws")


@kernel
def _largest(weights: Array) -> float:
    """Largest weight; raises `DataError` where weights cannot be used (kernel)."""
    largest = 0.0
    for weight in weights:
        if not 0.0 <= weight < np.inf:
            raise DataError("particle weights: NaN, infinite or negative; check the likelihood")
        largest = max(largest, weight)
    if not len(weights):
        raise DataError("particle weights: there is none; give at least one particle")
    return largest


@kernel
def _cumulated(weights: Array) -> Array:
    """Running total of the weights as shares of the largest; 1, 2, ... where all are zero."""
    largest = _largest(weights)
    out = weights / largest if largest > 0.0 else np.ones(len(weights))
    total = 0.0
    for row in range(len(weights)):
        total += out[row]
        out[row] = total
    return out


@kernel
def _below_whole(cumulated: Array) -> float:
    """Largest number under the whole (kernel).

    Rounded up to the whole, a share would name a row of weight zero at the end, or none.
    """
    return float(np.nextafter(cumulated[-1], 0.0))


@kernel
def _guide(cumulated: Array) -> Indices:
    """First row whose running total exceeds each n-th of the whole, (n,) (kernel)."""
    count = len(cumulated)
    out = np.empty(count, np.int64)
    row = 0
    for i in range(count):
        while row < count - 1 and cumulated[row] <= cumulated[-1] * (i / count):
            row += 1
        out[i] = row
    return out


@kernel
def _row_at(cumulated: Array, guide: Indices, below: float, share: float) -> int:
    """First row whose running total exceeds a share in [0, 1) of the whole (kernel).

    The guide leads near it; a bisection would miss every other branch.
    """
    place = min(share * cumulated[-1], below)
    row = int(guide[int(share * len(guide))])
    while row > 0 and cumulated[row - 1] > place:
        row -= 1
    while cumulated[row] <= place:
        row += 1
    return row


@kernel
def _next_row(cumulated: Array, below: float, share: float, row: int) -> int:
    """The same as `_row_at` for a share whose row is not before `row`: step by step (kernel)."""
    place = min(share * cumulated[-1], below)
    while cumulated[row] <= place:
        row += 1
    return row
