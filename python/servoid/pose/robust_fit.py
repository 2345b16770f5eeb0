"""Fits a few numbers to many residuals by Gauss-Newton steps, in which outliers count little."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from servoid.pose import exact
from servoid.pose.exact import Floats

_STEP = 1e-6  # for slopes
_STEPS = 15
_MOST_STEP = 0.3
_CONVERGED = 1e-6


@dataclass(frozen=True, eq=False)
class RobustFit:
    """The best numbers, (K,), and the inverse of the curvature of the cost there, (K, K).

    Times the variance of a residual, that is the covariance of the numbers.
    """

    numbers: Floats
    inverse: Floats


def robust_fit(off: Callable[[Floats], Floats], count: int, error: float) -> RobustFit | None:
    """Return the `count` numbers near 0 for which `off` is least; None if it leaves some open.

    `off` maps numbers, (K,), to a residual vector of each observation, (N, D). One of the length r
    has the Cauchy weight 1 / (1 + (r / error)^2). Numbers are of the order of 1, such as radians or
    metres: a step changes none by more than 0.3.
    """
    numbers, matrix = np.zeros(count), np.eye(count)
    try:
        for _ in range(_STEPS):
            rest = off(numbers)
            weights = 1.0 / (1.0 + np.square(rest / error).sum(axis=1))
            slopes = np.stack(
                [
                    ((off(numbers + one) - off(numbers - one)) / (2.0 * _STEP)).ravel()
                    for one in _STEP * np.eye(count)
                ]
            )
            weighted = slopes * np.repeat(weights, rest.shape[1])
            matrix = exact.product(weighted, slopes.T.copy())
            step = exact.solve(matrix, -exact.product(weighted, rest.ravel()))
            size = float(np.abs(step).max())
            if not np.isfinite(size):
                return None
            numbers = numbers + step * min(1.0, _MOST_STEP / max(size, _CONVERGED))
            if size < _CONVERGED:
                break
        return RobustFit(numbers, exact.solve(matrix, np.eye(count)))
    except ValueError:  # the matrix has no inverse
        return None
