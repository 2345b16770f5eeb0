"""Points that are no surface are not modelled."""

import numpy as np
import pytest
from numpy.typing import NDArray

from servoid.errors import ModelError
from servoid.model import Request, fit_range_samples, range_samples_of_cloud

EYE = [0.0, 0.0, -1.0]
ALONG = np.linspace(0.0, 1.0, 500)[:, None]


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(
    ("points", "what"),
    [
        (np.zeros((500, 3)), "are all at one position"),
        (np.tile([0.1, 0.2, 0.3], (2000, 1)), "are all at one position"),
        (np.array([0.1, 0.2, 0.3]) + ALONG * [0.3, -0.1, 0.2], "lie on a line"),
        (ALONG * [0.0, 0.0, 0.2], "lie on a line"),
    ],
)
def test_points_at_one_position_or_on_a_line_are_refused(
    points: NDArray[np.float64], what: str, unit: float
) -> None:
    samples = range_samples_of_cloud(unit * points, None, EYE)
    with pytest.raises(ModelError, match=f"the {len(points)} measured points {what}"):
        fit_range_samples(samples, Request(max_ellipsoids=1))


def test_points_of_a_flat_side_are_modelled() -> None:
    flat = np.random.default_rng(0).uniform(-0.1, 0.1, (500, 3)) * [1.0, 1.0, 0.0]
    body = fit_range_samples(range_samples_of_cloud(flat, None, EYE), Request(max_ellipsoids=1))
    assert body.body.radii.max() > 0.05
