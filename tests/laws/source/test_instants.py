import numpy as np
import pytest

from servoid.pose import Pose
from servoid.source import Instant
from servoid.track import tidy_image


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64, np.bool_])
def test_an_image_of_any_depth_becomes_the_same_bytes(dtype: type) -> None:
    levels = np.array([[0, 255], [255, 0]] if dtype is np.bool_ else [[0, 40], [255, 200]])
    scale = {np.uint8: 1, np.uint16: 257, np.bool_: 1}.get(dtype, 1.0 / 255.0)
    image, notice = tidy_image((levels * scale).astype(dtype))
    assert notice is None and image is not None
    assert image.dtype == np.uint8 and np.array_equal(image, levels)
    whole, _ = tidy_image(levels.astype(np.float64))
    assert whole is not None and np.array_equal(whole, levels)


def test_unknown_pixels_are_black_and_too_many_make_no_image() -> None:
    pixels = np.full((10, 10, 3), 0.5)
    pixels[0, 0] = np.nan
    pixels[1, 0] = np.inf
    image, notice = tidy_image(pixels)
    assert image is not None and image[0, 0].tolist() == [0, 0, 0] and image[5, 5, 0] == 128
    assert notice == "2 % of the image's pixels are not finite, so are black"
    assert tidy_image(np.full((4, 4), np.nan)) == (
        None,
        "100 % of the image's pixels are not finite",
    )


@pytest.mark.parametrize(
    "image", [np.zeros((3, 4, 2)), np.zeros((0, 4)), np.zeros(5), np.zeros((2, 2), np.int64)]
)
def test_what_is_no_image_is_told_so(image: np.ndarray) -> None:
    made, notice = tidy_image(image)
    assert made is None and notice


def test_an_image_with_masked_pixels_is_told_so() -> None:
    pixels = np.ma.masked_array(np.full((4, 6), 90, np.uint8), mask=np.eye(4, 6))
    assert tidy_image(pixels) == (
        None,
        "the image has masked pixels; say what these are, such as image.filled(0)",
    )
    whole, notice = tidy_image(np.ma.masked_array(pixels.data, mask=False))
    assert whole is not None and notice is None


def test_notices_name_cameras_and_say_each_fault_once() -> None:
    notices = ("camera left: the file is cut short",)
    instant = Instant(3, 0.1, (Pose.identity(),) * 2, (None, None), notices, ("left", "right"))
    added = ["camera 0 delivered no image", "camera 1: it is black", "camera 1: it is black"]
    assert instant.with_notices(added) == (*notices, "camera right: it is black")
    assert instant.with_notices(["camera 1 delivered no image", "time jumps by 5 s"]) == (
        *notices,
        "camera right delivered no image",
        "time jumps by 5 s",
    )
    assert instant.with_notices(["camera 7 is new"]) == (*notices, "camera 7 is new")
