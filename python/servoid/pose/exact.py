"""Elementary functions and small linear algebra with the same bits on every processor.

NumPy selects vector code and linear algebra kernels by the processor, and each rounds differently;
so does the C library behind `math`. Whatever a result of servoid depends on is computed here, by
the core: functions take float64 arrays or numbers, and return the same.
"""

from collections.abc import Callable
from typing import Protocol, overload

import numpy as np
from numpy.typing import NDArray

from servoid import _native

Floats = NDArray[np.float64]


class _Elementary(Protocol):
    """A function of a number, or of each number in an array."""

    @overload
    def __call__(self, x: float, /) -> float: ...
    @overload
    def __call__(self, x: Floats, /) -> Floats: ...


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


class _Product(Protocol):
    """Multiplies matrices (M, K) and (K, N) from the left; the first or last may be a vector."""

    def __call__(self, a: Floats, b: Floats, /, *more: Floats) -> Floats: ...


product: _Product = _native.exact_product


is_finite: Callable[[Floats], bool] = _native.exact_is_finite


def dot(a: Floats, b: Floats) -> float:
    """Return the dot product of two vectors (K,)."""
    return float(_native.exact_product(a, b))


def norm(vector: Floats) -> float:
    """Return the length of a vector (K,); for lengths along an axis see `lengths`."""
    return _native.exact_norm(vector)


def lengths(vectors: Floats) -> Floats:
    """Return the lengths of vectors (..., K)."""
    return np.sqrt((vectors * vectors).sum(axis=-1))


@overload
def hypot(x: float, y: float) -> float: ...
@overload
def hypot(x: Floats, y: Floats) -> Floats: ...
def hypot(x: Floats | float, y: Floats | float) -> Floats | float:
    """Return the square root of x² + y², for numbers or for arrays of one shape."""
    found = np.sqrt(x * x + y * y)
    return found if isinstance(found, np.ndarray) else float(found)


def solve(matrix: Floats, right: Floats) -> Floats:
    """Solve matrix (N, N) times x = right, (N,) or (N, K).

    Raises:
        ValueError: the matrix is singular or empty, or shapes do not fit.

    """
    if matrix.size == 0:
        raise ValueError("an empty matrix solves nothing; give one of (N, N)")
    if right.ndim == 1:
        return _native.exact_solve(matrix, right[:, None])[:, 0]
    return _native.exact_solve(matrix, right)


def eigh(matrix: Floats) -> tuple[Floats, Floats]:
    """Return the eigenvalues (N,) of a symmetric matrix, ascending, and (N, N) eigenvectors.

    The eigenvectors are the columns; their signs are arbitrary.

    Raises:
        ValueError: the matrix is empty or not square, or a number in it is not finite.

    """
    if matrix.size == 0 or not np.isfinite(matrix).all():
        raise ValueError(f"a matrix of finite numbers is needed, but got {matrix.tolist()}")
    return _native.exact_eigh(matrix)
