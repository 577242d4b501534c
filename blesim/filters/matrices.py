"""Products and factors of matrices of a few rows, as plain loops.

For the two to six states of a tracker a loop is faster than a call of BLAS, and its result does not
depend on the machine's BLAS.
"""

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError
from blesim.kernels import kernel

Array = NDArray[np.float64]

# A pivot below this share of the largest variance is nothing but rounding.
_ROUNDING = 1e-14


@kernel
def refuse_bad_shape(matrix: Array, rows: int, columns: int) -> None:
    """Raise `ValueError` before a loop, which checks no bounds, reads beyond a matrix (kernel)."""
    if matrix.shape[0] != rows or matrix.shape[1] != columns:
        raise ValueError("the shapes of mean, covariance, model and noise do not fit each other")


@kernel
def product(a: Array, b: Array) -> Array:
    """``a b`` of (n, k) and (k, m), as (n, m) (kernel)."""
    out = np.zeros((a.shape[0], b.shape[1]))
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            for j in range(b.shape[1]):
                out[i, j] += a[i, k] * b[k, j]
    return out


@kernel
def product_transposed(a: Array, b: Array) -> Array:
    """``a b'`` of (n, k) and (m, k), as (n, m) (kernel)."""
    out = np.zeros((a.shape[0], b.shape[0]))
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            for k in range(a.shape[1]):
                out[i, j] += a[i, k] * b[j, k]
    return out


@kernel
def applied(a: Array, x: Array) -> Array:
    """``a x`` of (n, k) and (k,), as (n,) (kernel)."""
    out = np.zeros(a.shape[0])
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            out[i] += a[i, k] * x[k]
    return out


@kernel
def sandwich(a: Array, covariance: Array, noise: Array) -> Array:
    """``a P a' + N``, exactly symmetric: P of (k, k), a of (n, k), N of (n, n) (kernel)."""
    out = product_transposed(product(a, covariance), a)
    for i in range(a.shape[0]):
        for j in range(i + 1):
            mean = 0.5 * (out[i, j] + out[j, i]) + 0.5 * (noise[i, j] + noise[j, i])
            out[i, j], out[j, i] = mean, mean
    return out


@kernel
def cholesky(covariance: Array) -> Array:
    """Lower factor L of ``P = L L'``, (n, n), also of a P that is only semidefinite (kernel).

    A direction without variance has a column of zeros.

    Raises
    ------
    DataError
        If the matrix has a negative variance beyond rounding, or is not finite.
    """
    n = covariance.shape[0]
    largest = 0.0
    for i in range(n):
        largest = max(largest, covariance[i, i])
    lower = np.zeros((n, n))
    for j in range(n):
        pivot = covariance[j, j]
        for k in range(j):
            pivot -= lower[j, k] * lower[j, k]
        if not (-n * 1e-9 * largest <= pivot < np.inf):
            raise DataError("covariance: not positive semidefinite and finite; check the noise")
        if pivot <= n * _ROUNDING * largest:
            continue
        lower[j, j] = np.sqrt(pivot)
        for i in range(j + 1, n):
            rest = covariance[i, j]
            for k in range(j):
                rest -= lower[i, k] * lower[j, k]
            lower[i, j] = rest / lower[j, j]
    return lower


@kernel
def inverse_factor(covariance: Array) -> Array:
    """Inverse of the lower factor: W with ``P^-1 = W' W``, (n, n) (kernel).

    Raises
    ------
    DataError
        If the matrix is not positive definite, or not finite.
    """
    n = covariance.shape[0]
    lower = cholesky(covariance)
    out = np.zeros((n, n))
    for j in range(n):
        if not lower[j, j] > 0.0:
            raise DataError("innovation covariance: singular; give every measurement a noise")
        out[j, j] = 1.0 / lower[j, j]
        for i in range(j + 1, n):
            rest = 0.0
            for k in range(j, i):
                rest -= lower[i, k] * out[k, j]
            out[i, j] = rest / lower[i, i]
    return out
