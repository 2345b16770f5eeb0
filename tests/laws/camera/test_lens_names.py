"""The names that other tools give to lenses, as the page on lenses lists them."""

import re
from pathlib import Path

import numpy as np
import pytest

from servoid.camera import Lens

PAGE = Path(__file__).parents[3] / "docs" / "howto" / "lenses.md"
VALUES = {
    "f": 420.0, "fx": 420.0, "fy": 430.0, "cx": 321.0, "cy": 236.5, "0": 0.0, "none": None,
    "k1": -0.08, "k2": 0.02, "p1": 1.3e-3, "p2": -0.7e-3, "k3": 3e-3, "k4": 0.04, "k5": -0.01,
    "k6": 2e-3,
}  # fmt: skip


def colmap_rows() -> list[list[str]]:
    lines = re.findall(r"^\| COLMAP \| (.*) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    return [[cell.strip(" `") for cell in line.split("|")] for line in lines]


def test_the_page_lists_the_usual_models_of_colmap() -> None:
    names = {row[0] for row in colmap_rows()}
    assert names >= {"PINHOLE", "SIMPLE_RADIAL", "OPENCV", "OPENCV_FISHEYE", "FULL_OPENCV"}


@pytest.mark.parametrize("row", colmap_rows(), ids=lambda row: row[0])
def test_a_lens_written_as_the_page_says_sees_as_in_colmap(row: list[str]) -> None:
    pycolmap = pytest.importorskip("pycolmap")
    name, numbers, model, distortion = row
    if name not in pycolmap.CameraModelId.__members__:
        pytest.skip(f"this pycolmap is older than its model {name}")
    params = [VALUES[key] for key in numbers.split()]
    theirs = pycolmap.Camera(model=name, width=640, height=480, params=params)
    focal = [VALUES[key] for key in numbers.split() if key.startswith("f")]
    lens = Lens(
        model=model,
        size_px=(640, 480),
        focal_px=(focal[0], focal[-1]),
        center_px=(VALUES["cx"] - 0.5, VALUES["cy"] - 0.5),
        distortion=[VALUES[key] for key in distortion.split() if key != "none"],
    )
    points = np.random.default_rng(5).uniform((-0.7, -0.5, 0.9), (0.7, 0.5, 2.0), (200, 3))
    pixels = np.array(theirs.img_from_cam(points))
    np.testing.assert_allclose(lens.project(points), pixels - 0.5, atol=1e-8)
