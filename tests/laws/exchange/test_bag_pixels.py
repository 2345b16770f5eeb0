"""Pixels of images in bags: each encoding against OpenCV, and depth against what was stored."""

import struct
from types import SimpleNamespace
from typing import Any

import bag_writing
import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from servoid.camera.depth import to_metres
from servoid.errors import ImageError
from servoid.exchange.bags.stored.pixels import ENCODINGS, colors_of, depth_of, is_depth, size_of

SIZES = st.tuples(st.integers(1, 9), st.integers(1, 9)).map(lambda size: (2 * size[0], 2 * size[1]))
SEEDS = st.integers(0, 2**31)


def message(
    pixels: NDArray[Any], encoding: str, *, padding: int = 0, is_big: bool = False
) -> SimpleNamespace:
    stored = bag_writing.image("/a", 0, "a", pixels, encoding, padding=padding, is_big=is_big)
    fields = dict(stored.fields)
    fields["data"] = np.frombuffer(fields["data"], np.uint8)
    return SimpleNamespace(**fields)


def packed(data: bytes, form: str) -> SimpleNamespace:
    return SimpleNamespace(format=form, data=np.frombuffer(data, np.uint8))


def noise(seed: int, size_px: tuple[int, int], channels: int, kind: type) -> NDArray[Any]:
    shape = (size_px[1], size_px[0], channels)[: 3 if channels > 1 else 2]
    top = np.iinfo(kind).max
    return np.random.default_rng(seed).integers(0, top, shape, kind, endpoint=True)


@pytest.mark.parametrize(
    ("encoding", "channels", "way"),
    [
        ("mono8", 1, cv2.COLOR_GRAY2RGB),
        ("8UC1", 1, cv2.COLOR_GRAY2RGB),
        ("rgb8", 3, None),
        ("bgr8", 3, cv2.COLOR_BGR2RGB),
        ("8UC3", 3, cv2.COLOR_BGR2RGB),
        ("rgba8", 4, cv2.COLOR_RGBA2RGB),
        ("bgra8", 4, cv2.COLOR_BGRA2RGB),
        ("8UC4", 4, cv2.COLOR_BGRA2RGB),
        ("yuv422", 2, cv2.COLOR_YUV2RGB_UYVY),
        ("uyvy", 2, cv2.COLOR_YUV2RGB_UYVY),
        ("yuv422_yuy2", 2, cv2.COLOR_YUV2RGB_YUY2),
        ("yuyv", 2, cv2.COLOR_YUV2RGB_YUY2),
    ],
)
@given(seed=SEEDS, size_px=SIZES, padding=st.integers(0, 5))
def test_colors_are_those_that_opencv_makes_of_the_same_pixels(
    encoding: str, channels: int, way: int | None, seed: int, size_px: tuple[int, int], padding: int
) -> None:
    pixels = noise(seed, size_px, channels, np.uint8)
    found = colors_of(message(pixels, encoding, padding=padding), size_px, "a")
    assert found.dtype == np.uint8 and found.shape == (size_px[1], size_px[0], 3)
    assert (found == (pixels if way is None else cv2.cvtColor(pixels, way))).all()


@pytest.mark.parametrize(("encoding", "channels"), [("mono16", 1), ("rgb16", 3), ("bgr16", 3)])
@given(seed=SEEDS, size_px=SIZES, padding=st.integers(0, 5), is_big=st.booleans())
def test_of_sixteen_bits_the_upper_eight_are_seen_in_either_order_of_bytes(
    encoding: str, channels: int, seed: int, size_px: tuple[int, int], padding: int, is_big: bool
) -> None:
    pixels = noise(seed, size_px, channels, np.uint16)
    found = colors_of(message(pixels, encoding, padding=padding, is_big=is_big), size_px, "a")
    expected = (pixels >> 8).reshape(size_px[1], size_px[0], channels)
    expected = np.repeat(expected, 3, axis=2) if channels == 1 else expected
    assert (found == (expected[..., ::-1] if encoding == "bgr16" else expected)).all()


@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
@given(color=st.tuples(*[st.integers(0, 255)] * 3))
def test_a_bayer_pattern_of_one_color_is_that_color(
    pattern: str, color: tuple[int, int, int]
) -> None:
    """The four letters are the first two rows of two pixels, as sensor_msgs names them."""
    seen = dict(zip("rgb", color, strict=True))
    tile = np.array([seen[letter] for letter in pattern], np.uint8).reshape(2, 2)
    found = colors_of(message(np.tile(tile, (4, 5)), f"bayer_{pattern}8"), (10, 8), "a")
    assert (found == np.array(color, np.uint8)).all()


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
@given(seed=SEEDS, size_px=SIZES, padding=st.integers(0, 5), is_big=st.booleans())
def test_depth_is_in_metres_and_unknown_where_it_is_zero_or_no_number(
    encoding: str, seed: int, size_px: tuple[int, int], padding: int, is_big: bool
) -> None:
    rng = np.random.default_rng(seed)
    metres = rng.integers(1, 60000, (size_px[1], size_px[0])) / 1000.0
    gaps = rng.random(metres.shape) < 0.3
    if encoding == "16UC1":
        stored = np.where(gaps, 0, np.rint(1000.0 * metres)).astype(np.uint16)
    else:
        stored = np.where(gaps, rng.choice([0.0, np.nan, np.inf, -1.0]), metres).astype(np.float32)
    seen = message(stored, encoding, padding=padding, is_big=is_big)
    depth = to_metres(*depth_of(seen, "/depth", size_px, "a"))
    assert depth.dtype == np.float32
    assert np.array_equal(depth, np.where(gaps, np.nan, metres).astype(np.float32), equal_nan=True)


@given(seed=SEEDS, size_px=SIZES)
def test_a_png_of_colors_and_one_of_depth_come_back_as_they_were(
    seed: int, size_px: tuple[int, int]
) -> None:
    pixels = noise(seed, size_px, 3, np.uint8)
    data = cv2.imencode(".png", pixels[..., ::-1])[1].tobytes()
    assert (colors_of(packed(data, "rgb8; png compressed bgr8"), size_px, "a") == pixels).all()
    # An encoder that was handed red first says so, and then nothing is to be exchanged.
    swapped = packed(data, "rgb8; png compressed rgb8")
    assert (colors_of(swapped, size_px, "a") == pixels[..., ::-1]).all()
    depth = noise(seed, size_px, 1, np.uint16)
    data = cv2.imencode(".png", depth)[1].tobytes()
    for form, topic, skipped in (
        ("16UC1; png compressed", "/depth/compressed", b""),
        ("16UC1; compressedDepth png", "/depth/compressedDepth", bytes(12)),
    ):
        stored = packed(skipped + data, form)
        assert size_of(stored, topic) == size_px
        values, scale_m = depth_of(stored, topic, size_px, "a")
        assert scale_m == 0.001 and (values == depth).all()


@given(seed=SEEDS, size_px=SIZES, near=st.floats(1.0, 200.0), offset=st.floats(-10.0, 10.0))
def test_quantized_depth_is_undone_as_its_publisher_made_it(
    seed: int, size_px: tuple[int, int], near: float, offset: float
) -> None:
    """compressed_depth_image_transport stores near / depth + offset, and 0 where it is unknown."""
    near, offset = (float(np.float32(one)) for one in (near, offset))
    stored = np.random.default_rng(seed).integers(0, 2**16, (size_px[1], size_px[0]), np.uint16)
    stored[(stored > 0) & (stored < 20)] = 20
    parameters = struct.pack("<iff", 0, near, offset)
    data = parameters + cv2.imencode(".png", stored)[1].tobytes()
    image = packed(data, "32FC1; compressedDepth png")
    depth = to_metres(*depth_of(image, "/depth/compressedDepth", size_px, "a"))
    with np.errstate(divide="ignore"):
        expected = np.where(stored == 0, np.nan, near / (stored - offset))
    assert np.allclose(depth, expected, rtol=1e-6, equal_nan=True)


def test_every_encoding_is_tried_here() -> None:
    tried = {"mono8", "8UC1", "rgb8", "bgr8", "8UC3", "rgba8", "bgra8", "8UC4", "yuv422", "uyvy"}
    tried |= {"yuv422_yuy2", "yuyv", "mono16", "rgb16", "bgr16"}
    assert set(ENCODINGS) == tried | {f"bayer_{one}8" for one in ("rggb", "bggr", "gbrg", "grbg")}


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (
            message(np.zeros((4, 4), np.uint8), "nv12"),
            "encoding is 'nv12'; servoid reads mono8",
        ),
        (
            message(np.zeros((4, 4), np.uint8), "rgb8"),
            "16 bytes with 4 a row are not an rgb8 image",
        ),
        (message(np.zeros((4, 6, 3), np.uint8), "rgb8"), "6x4 pixels, but its camera has size_px"),
        (packed(b"", "jpeg"), "is empty"),
        (packed(b"hello", "jpeg"), "cannot be decoded"),
    ],
)
def test_an_image_that_is_none_is_refused_in_words(image: SimpleNamespace, words: str) -> None:
    with pytest.raises(ImageError) as caught:
        colors_of(image, (4, 4), "/left of 3 s")
    assert words in str(caught.value) and str(caught.value).startswith("/left of 3 s")


def test_depth_by_another_codec_is_refused_in_words() -> None:
    image = packed(bytes(40), "16UC1; compressedDepth rvl")
    with pytest.raises(ImageError, match="servoid reads compressed depth as PNG; republish it"):
        depth_of(image, "/depth/compressedDepth", (4, 4), "a")


@pytest.mark.parametrize(
    ("topic", "encoding", "expected"),
    [
        ("/camera/depth/image_raw", "mono16", True),
        ("/camera/infra1/image_rect_raw", "mono16", False),
        ("/camera/depth/image_raw", "mono8", False),
        ("/points", "16UC1", True),
    ],
)
def test_grey_images_of_16_bits_are_depth_if_their_topic_says_so(
    topic: str, encoding: str, expected: bool
) -> None:
    kind = np.uint8 if encoding == "mono8" else np.uint16
    assert is_depth(message(np.ones((4, 4), kind), encoding), topic) == expected
