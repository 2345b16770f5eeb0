"""sRGB and linear light."""

import numpy as np
import pytest

from servoid.camera.srgb import linear_light


def test_half_of_the_light_is_188_of_255() -> None:
    assert linear_light(188 / 255) == pytest.approx(0.5, abs=0.003)
    assert linear_light([0.0, 1.0]).tolist() == [0.0, 1.0]


def test_the_curve_is_continuous_and_rises() -> None:
    below, above = linear_light([0.04045, np.nextafter(0.04045, 1.0)])
    assert above == pytest.approx(below, rel=1e-4)
    assert (np.diff(linear_light(np.linspace(0.0, 1.0, 1000))) > 0.0).all()


def test_channels_of_any_shape_are_decoded_one_by_one() -> None:
    colors = np.random.default_rng(1).random((3, 4, 3))
    linear = linear_light(colors)
    assert linear.shape == colors.shape
    assert linear[1, 2, 0] == linear_light(colors[1, 2, 0])
