"""Depth images, and what an ideal pinhole makes of a view."""

import resource
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import SIZE_PX, camera_toml, capture_toml
from servoid.camera import read_depth, read_image, read_mask
from servoid.camera.image_size import read_image_size
from servoid.capture import open_capture
from servoid.errors import ImageError, MaskError, ModelError, ServoidError
from servoid.model import fit_capture

SMALL_PX = (4, 3)
COUNTS = np.arange(12, dtype=np.uint16).reshape(3, 4) * 500


@pytest.mark.parametrize("suffix", [".png", ".tif", ".npy"])
@pytest.mark.parametrize("kind", ["uint16", "float32"])
def test_depth_is_metres_whatever_the_file(suffix: str, kind: str, tmp_path: Path) -> None:
    if (suffix, kind) == (".png", "float32"):
        pytest.skip("PNG knows no float")
    path = tmp_path / f"depth{suffix}"
    values = COUNTS.astype(kind)
    np.save(path, values) if suffix == ".npy" else cv2.imwrite(str(path), values)
    depth = read_depth(path, SMALL_PX, 0.001)
    assert depth.dtype == np.float32
    assert np.isnan(depth[0, 0])
    np.testing.assert_allclose(depth.ravel()[1:], COUNTS.ravel()[1:] / 1000, rtol=1e-6)


def test_what_is_no_distance_is_unknown(tmp_path: Path) -> None:
    values = np.array([[0, np.nan, np.inf, -np.inf], [-1, 1, 2, 3e38], [1e-3, 0, 0, 0]], np.float32)
    np.save(tmp_path / "depth.npy", values)
    depth = read_depth(tmp_path / "depth.npy", SMALL_PX, 2.0)
    known = [[False] * 4, [False, True, True, False], [True, False, False, False]]
    np.testing.assert_array_equal(np.isfinite(depth), known)


@pytest.mark.parametrize(("suffix", "kind"), [(".png", "u2"), (".npy", "u2"), (".npy", "i4")])
def test_the_greatest_integer_is_no_distance(suffix: str, kind: str, tmp_path: Path) -> None:
    values = np.full((6, 8), 5340, kind)
    values[2:4, 3:] = np.iinfo(kind).max
    path = tmp_path / f"depth{suffix}"
    if suffix == ".npy":
        np.save(path, values)
    else:
        assert cv2.imwrite(str(path), values)
    depth = read_depth(path, (8, 6), 1e-4)
    assert np.array_equal(np.isnan(depth), values > 5340)
    assert np.nanmax(depth) == np.float32(0.534)


def test_why_depth_is_not_used_is_told_where_a_distance_is_asked_for(drawn_capture: Path) -> None:
    capture = replace(
        open_capture(drawn_capture), notes=("no depth image is within 10 ms", "something else")
    )
    with pytest.raises(
        ModelError,
        match=r"--distance 0\.6 \(distance_m=0\.6 in Python\); no depth image is within 10 ms$",
    ):
        fit_capture(capture, observations=slice(0, 1))


def test_columns_first_is_read_as_it_was_written(tmp_path: Path) -> None:
    np.save(tmp_path / "depth.npy", np.asfortranarray(COUNTS[..., None]))
    depth = read_depth(tmp_path / "depth.npy", SMALL_PX, 1.0)
    np.testing.assert_array_equal(np.nan_to_num(depth), COUNTS)


def test_a_view_knows_the_depth_of_its_own_image(drawn_capture: Path) -> None:
    (drawn_capture / "depth").mkdir()
    for index in (1, 6):
        values = np.full(SIZE_PX[::-1], 1000 + index, np.uint16)
        assert cv2.imwrite(str(drawn_capture / "depth" / f"{index:04}.png"), values)
    extra = 'depths = "depth/*.png"\ndepth_scale_m = 0.001\nsize_px'
    toml = capture_toml(camera_toml().replace("size_px", extra, 1))
    (drawn_capture / "capture.toml").write_text(toml)
    depths = [view.depth() for view in open_capture(drawn_capture).views()]
    assert [index for index, depth in enumerate(depths) if depth is not None] == [1, 6]
    np.testing.assert_allclose(depths[6], 1.006, rtol=1e-6)


def header(shape: str, kind: str = "<f4") -> bytes:
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode()


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.npy", b"", r"a\.npy is no \.npy file"),
        ("a.npy", b"not numbers at all", r"is no \.npy file"),
        ("a.npy", header("(3, 4)") + b"\0" * 40, r"is cut short"),
        ("a.npy", header("(300000, 400000)"), r"400000x300000 pixels, but its camera has size_px"),
        ("a.npy", header("(12,)") + b"\0" * 48, r"shape \(12,\)"),
        ("a.npy", header("(3, 4)", "|O") + b"\0" * 99, r"a depth image is \(height, width\)"),
        ("a.npy", header("(3, 4)", "<c8") + b"\0" * 99, r"a depth image is"),
        ("a.png", b"", r"is empty"),
        ("a.png", b"no image", r"cannot be decoded"),
        ("a.png", cv2.imencode(".png", COUNTS)[1].tobytes()[:60], r"is cut short"),
        ("a.png", cv2.imencode(".png", COUNTS.astype(np.uint8))[1].tobytes(), r"8 bits a pixel"),
        ("a.png", cv2.imencode(".png", np.dstack([COUNTS] * 3))[1].tobytes(), r"3 channels"),
        ("a.png", cv2.imencode(".png", COUNTS.T)[1].tobytes(), r"is 3x4 pixels, but its camera"),
    ],
)
def test_what_is_no_depth_image_is_refused(
    name: str, data: bytes, message: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(ImageError, match=message):
        read_depth(tmp_path / name, SMALL_PX, 1.0)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".bmp", ".webp"])
@given(width=st.integers(1, 40), height=st.integers(1, 40))
@settings(max_examples=10, deadline=None)
def test_the_size_in_a_header_is_the_size_of_the_image(
    suffix: str, width: int, height: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / f"size{suffix}"
    assert cv2.imwrite(str(path), np.zeros((height, width, 3), np.uint8))
    assert read_image_size(path) == (width, height)


def test_a_header_that_claims_a_huge_image_is_refused_before_it_is_decoded(tmp_path: Path) -> None:
    data = bytearray(cv2.imencode(".png", COUNTS)[1].tobytes())
    data[16:24] = (30000).to_bytes(4, "big") * 2
    (tmp_path / "a.png").write_bytes(data)
    for read, error in ((read_image, ImageError), (read_mask, MaskError)):
        with pytest.raises(error, match="30000x30000 pixels, but its camera"):
            read(tmp_path / "a.png", SMALL_PX)


def test_a_chunk_that_claims_gigabytes_asks_for_none(tmp_path: Path) -> None:
    data = bytearray(cv2.imencode(".png", COUNTS)[1].tobytes())
    assert data[37:41] == b"IDAT"
    data[33:37] = b"\xff\xff\xff\x00"
    (tmp_path / "a.png").write_bytes(data)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for read, error in ((read_image, ImageError), (read_mask, MaskError)):
        with pytest.raises(error, match="cut short"):
            read(tmp_path / "a.png", SMALL_PX)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1 << 16  # 64 MiB


def test_what_follows_the_end_of_a_png_is_not_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Of a file without pixels OpenCV goes on beyond the end, and makes room for what that claims.
    image = cv2.imencode(".png", np.full((*SMALL_PX[::-1], 3), 7, np.uint8))[1].tobytes()
    (tmp_path / "a.png").write_bytes(image + b"\x4e\x44\x49\x45IEND")
    decode, given_bytes = cv2.imdecode, []

    def watched(data: np.ndarray, flags: int) -> np.ndarray | None:
        given_bytes.append(data.tobytes())
        return decode(data, flags)

    monkeypatch.setattr(cv2, "imdecode", watched)
    assert (read_image(tmp_path / "a.png", SMALL_PX) == 7).all()
    assert given_bytes == [image]


@settings(max_examples=150, deadline=None)
@given(
    suffix=st.sampled_from([".png", ".tif", ".npy"]),
    end=st.integers(1, 400),
    at=st.integers(0, 400),
    bits=st.integers(0, 255),
)
def test_a_damaged_depth_image_is_refused_or_still_of_its_size(
    suffix: str, end: int, at: int, bits: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / f"damaged{suffix}"
    if suffix == ".npy":
        np.save(path, COUNTS)
    else:
        assert cv2.imwrite(str(path), COUNTS)
    data = bytearray(path.read_bytes()[:end])
    data[at % len(data)] ^= bits
    path.write_bytes(data)
    try:
        assert read_depth(path, SMALL_PX, 1.0).shape == (3, 4)
    except ServoidError as error:
        assert isinstance(error, ImageError)


def test_a_mask_that_is_handed_over_comes_before_the_file(drawn_capture: Path) -> None:
    view = open_capture(drawn_capture).views()[2]
    mask = np.zeros(SIZE_PX[::-1], np.uint8)
    mask[30:50, 40:60] = 7
    other = view.with_mask(mask)
    np.testing.assert_array_equal(other.mask(), (mask != 0) * 255)
    assert other.camera is view.camera
    assert other.name == view.name
    other.view()
    with pytest.raises(MaskError, match=r"eye/0002: the mask has shape \(120, 3\)"):
        view.with_mask(mask[:, :3])


def test_a_view_without_a_mask_can_be_given_one(drawn_capture: Path) -> None:
    (drawn_capture / "masks" / "0004.png").unlink()
    capture = open_capture(drawn_capture)
    assert len(capture.views()) == 7
    bare = capture.all_views()[4]
    assert not bare.has_mask
    with pytest.raises(MaskError, match="eye/0004 has no mask"):
        bare.view()
    mask = np.zeros(SIZE_PX[::-1], np.uint8)
    with pytest.raises(MaskError, match="eye/0004: the mask is empty"):
        bare.with_mask(mask).view()
    mask[3:9, 3:9] = 255
    assert bare.with_mask(mask).has_mask
