"""Numbers are fitted to most of what was seen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from servoid.pose import Floats
from servoid.pose.robust_fit import robust_fit

NUMBERS = st.lists(st.floats(-0.9, 0.9), min_size=3, max_size=3)


@given(NUMBERS, st.integers(0, 1000))
def test_a_fifth_of_outliers_does_not_move_what_is_fitted(true: list[float], seed: int) -> None:
    rng = np.random.default_rng(seed)
    slopes, outliers = rng.standard_normal((100, 2, 3)), rng.uniform(-50.0, 50.0, (20, 2))

    def off(numbers: Floats) -> Floats:
        rest = slopes @ (np.sin(numbers) - np.sin(true))
        rest[:20] += outliers
        return rest

    fit = robust_fit(off, 3, 1e-2)
    assert fit is not None
    assert np.abs(fit.numbers - true).max() < 1e-3


def test_the_inverse_curvature_is_that_of_least_squares_without_outliers() -> None:
    slopes = np.random.default_rng(3).standard_normal((40, 3))
    fit = robust_fit(lambda numbers: (slopes @ (numbers - 0.2))[:, None], 3, 1.0)
    assert fit is not None
    assert fit.inverse == pytest.approx(np.linalg.inv(slopes.T @ slopes), rel=1e-5)


def test_numbers_that_nothing_determines_are_not_fitted() -> None:
    assert robust_fit(lambda numbers: numbers[:1, None] - 0.1, 2, 1.0) is None
    assert robust_fit(lambda numbers: numbers[:1, None] * np.nan, 1, 1.0) is None
