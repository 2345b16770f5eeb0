"""Elementary functions and small linear algebra with the same bits on every processor.

NumPy picks vector code, and its linear algebra a whole library of kernels, by the processor that it
finds, and each rounds in its own way; so does the C library behind `math`. What feeds a result of
servoid is computed here, by the core: arrays of float64 and numbers go in, the same come out.
"""

from collections.abc import Callable
from typing import Protocol, overload

import numpy as np
from numpy.typing import NDArray

from servoid import _native

Array = NDArray[np.float64]


class _Elementary(Protocol):
    """A function of one number, or of each in an array."""

    @overload
    def __call__(self, x: float, /) -> float: ...
    @overload
    def __call__(self, x: Array, /) -> Array: ...


sin: _Elementary = _native.exact_sin
cos: _Elementary = _native.exact_cos
tan: _Elementary = _native.exact_tan
arcsin: _Elementary = _native.exact_arcsin
arccos: _Elementary = _native.exact_arccos
arctan: _Elementary = _native.exact_arctan
exp: _Elementary = _native.exact_exp
expm1: _Elementary = _native.exact_expm1
log: _Elementary = _native.exact_log
arctan2: Callable[[float, float], float] = _native.exact_arctan2
power: Callable[[float, float], float] = _native.exact_power


@overload
def product(a: Array, b: Array, /) -> Array: ...
@overload
def product(a: Array, b: Array, c: Array, /, *more: Array) -> Array: ...
def product(*factors: Array) -> Array:
    """Multiply matrices (M, K) and (K, N), or with a vector (K,) at either end, from the left."""
    result, *others = factors
    for other in others:
        row, column = result.ndim == 1, other.ndim == 1
        left = result[None, :] if row else result
        right = other[:, None] if column else other
        result = _native.exact_product(left, right)
        result = result[:, 0] if column else result
        result = result[0] if row else result
    return result


def dot(a: Array, b: Array) -> float:
    """Return the scalar product of two vectors (K,)."""
    return float(_native.exact_product(a[None, :], b[:, None])[0, 0])


def norm(vector: Array) -> float:
    """Return the length of a vector (K,); for lengths along an axis see `lengths`."""
    return _native.exact_norm(vector)


def lengths(vectors: Array) -> Array:
    """Return the lengths of vectors (..., K)."""
    return np.sqrt((vectors * vectors).sum(axis=-1))


@overload
def hypot(x: float, y: float) -> float: ...
@overload
def hypot(x: Array, y: Array) -> Array: ...
def hypot(x: Array | float, y: Array | float) -> Array | float:
    """Return the square root of x² + y², of numbers or of arrays of any one shape."""
    found = np.sqrt(x * x + y * y)
    return found if isinstance(found, np.ndarray) else float(found)


def solve(matrix: Array, right: Array) -> Array:
    """Solve matrix (N, N) times x = right, (N,) or (N, K).

    Raises:
        ValueError: the matrix is singular or empty, or shapes do not fit.

    """
    if matrix.size == 0:
        raise ValueError("an empty matrix solves nothing; give one of (N, N)")
    if right.ndim == 1:
        return _native.exact_solve(matrix, right[:, None])[:, 0]
    return _native.exact_solve(matrix, right)


def eigh(matrix: Array) -> tuple[Array, Array]:
    """Return the eigenvalues (N,) of a symmetric matrix, the least first, and (N, N) eigenvectors.

    They are columns, and their signs are free.

    Raises:
        ValueError: the matrix is empty or not square, or a number in it is not finite.

    """
    if matrix.size == 0 or not np.isfinite(matrix).all():
        raise ValueError(f"a matrix of finite numbers is needed, but got {matrix.tolist()}")
    return _native.exact_eigh(matrix)
