"""`transforms.json`, written here by the published format."""

import json
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import CENTER_PX, FOCAL_PX, SIZE_PX, Drawing, write_png
from servoid.errors import CameraError, CaptureError, ImageError, PoseError, ServoidError
from servoid.exchange import open_nerfstudio

GL = np.diag([1.0, -1.0, -1.0, 1.0])
LENS = {
    "camera_model": "OPENCV",
    "w": SIZE_PX[0],
    "h": SIZE_PX[1],
    "fl_x": FOCAL_PX,
    "fl_y": FOCAL_PX,
    "cx": CENTER_PX[0] + 0.5,
    "cy": CENTER_PX[1] + 0.5,
    "k1": 0.0,
    "k2": 0.0,
    "p1": 0.0,
    "p2": 0.0,
    "applied_transform": [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0]],
    "ply_file_path": "sparse_pc.ply",
}


def frame(name: str = "images/0.png", **more: Any) -> dict[str, Any]:
    return {"file_path": name, "transform_matrix": np.eye(4).tolist(), "colmap_im_id": 3} | more


def write(folder: Path, frames: list[dict[str, Any]], **keys: Any) -> Path:
    """Write a transforms.json over one image; a key that is None is left out."""
    (folder / "images").mkdir(parents=True, exist_ok=True)
    write_png(folder / "images" / "0.png", np.zeros((SIZE_PX[1], SIZE_PX[0], 3), np.uint8))
    table = {key: value for key, value in (LENS | keys).items() if value is not None}
    (folder / "transforms.json").write_text(json.dumps(table | {"frames": frames}))
    return folder


def write_drawing(folder: Path, drawing: Drawing) -> Path:
    """Write a drawing with masks and depth in millimetres."""
    frames = []
    for index, pose in enumerate(drawing.world_from_cameras()):
        for kind, pixels in (("images", drawing.picture(pose)), ("masks", drawing.mask(pose))):
            (folder / kind).mkdir(parents=True, exist_ok=True)
            write_png(folder / kind / f"{index:04}.png", pixels)
        (folder / "depth").mkdir(exist_ok=True)
        depth = np.full(SIZE_PX[::-1], 100 + index, np.uint16)
        assert cv2.imwrite(str(folder / "depth" / f"{index:04}.png"), depth)
        frames.append(
            frame(
                f"./images/{index:04}.png",
                transform_matrix=(pose @ GL).tolist(),
                mask_path=f"masks/{index:04}.png",
                depth_file_path=f"depth/{index:04}.png",
            )
        )
    return write(folder, frames)


def test_cameras_stand_and_look_as_those_that_drew(tmp_path: Path, drawing: Drawing) -> None:
    views = open_nerfstudio(write_drawing(tmp_path, drawing)).views()
    assert [view.name for view in views] == [f"camera/{index:04}" for index in range(8)]
    for view, pose in zip(views, drawing.world_from_cameras(), strict=True):
        np.testing.assert_allclose(view.world_from_camera.matrix(), pose, atol=1e-12)
        assert view.camera.focal_px == (FOCAL_PX, FOCAL_PX)
        assert view.camera.center_px == CENTER_PX
        np.testing.assert_array_equal(view.image(), drawing.picture(pose))
        np.testing.assert_array_equal(view.mask(), drawing.mask(pose))
        depth = view.depth()
        assert depth is not None
        np.testing.assert_allclose(depth, 0.001 * (100 + view.index), rtol=1e-6)


def test_the_unit_of_depth_is_the_files_own_where_it_says_one(tmp_path: Path) -> None:
    depth = np.full(SIZE_PX[::-1], 3.0, np.float32)
    write(tmp_path, [frame(depth_file_path="0.npy")], depth_unit_scale_factor=0.5)
    np.save(tmp_path / "0.npy", depth)
    [view] = open_nerfstudio(tmp_path).all_views()
    np.testing.assert_array_equal(view.depth(), 0.5 * depth)


def test_an_angle_of_view_is_enough_and_an_image_says_its_size(tmp_path: Path) -> None:
    none = dict.fromkeys(LENS)
    write(tmp_path, [frame("./images/0")], **none | {"camera_angle_x": math.pi / 2})
    [view] = open_nerfstudio(tmp_path / "transforms.json").all_views()
    assert view.camera.size_px == SIZE_PX
    # A quarter of a circle sees as wide as it is far; the middle is between pixels 79 and 80.
    np.testing.assert_allclose(view.camera.focal_px, [80, 80])
    np.testing.assert_allclose(view.camera.center_px, [79.5, 59.5])
    both = {"camera_angle_x": math.pi / 2, "camera_angle_y": 2 * math.atan(0.5)}
    [view] = open_nerfstudio(write(tmp_path, [frame()], **none | both)).all_views()
    np.testing.assert_allclose(view.camera.focal_px, [80, 120])


def test_an_image_may_have_a_lens_of_its_own(tmp_path: Path) -> None:
    frames = [frame(), frame(fl_x=300.0, cx=10), frame()]
    cameras = open_nerfstudio(write(tmp_path, frames)).cameras
    assert [camera.name for camera in cameras] == ["camera_1", "camera_2"]
    assert [camera.lens.focal_px[0] for camera in cameras] == [FOCAL_PX, 300.0]
    assert cameras[1].lens.center_px == (9.5, CENTER_PX[1])
    delivered = [[picture is not None for picture in camera.pictures] for camera in cameras]
    assert delivered == [[True, True, False], [False, False, True]]


@pytest.mark.parametrize(
    ("keys", "model", "distortion"),
    [
        ({}, "pinhole", ()),
        ({"camera_model": None}, "pinhole", ()),
        ({"camera_model": "PINHOLE"}, "pinhole", ()),
        ({"k1": 0.1, "p2": 0.2}, "brown_conrady", (0.1, 0.0, 0.0, 0.2)),
        ({"camera_model": None, "k2": 0.1}, "brown_conrady", (0.0, 0.1, 0.0, 0.0)),
        ({"k1": 0.1, "k3": 0.3}, "brown_conrady", (0.1, 0.0, 0.0, 0.0, 0.3)),
        ({"camera_model": "OPENCV_FISHEYE", "k4": 0.1}, "kannala_brandt", (0, 0, 0, 0.1)),
        ({"camera_model": None, "is_fisheye": True, "k1": 0.1}, "kannala_brandt", (0.1, 0, 0, 0)),
    ],
)
def test_the_lens_model_is_what_the_keys_say(
    keys: dict[str, Any], model: str, distortion: tuple[float, ...], tmp_path: Path
) -> None:
    [camera] = open_nerfstudio(write(tmp_path, [frame()], **keys)).cameras
    assert camera.lens.model == model
    found = camera.lens.distortion
    assert found[: len(distortion)] == distortion
    assert not any(found[len(distortion) :])


BAD = {
    "unknown model": ({"camera_model": "EQUIRECTANGULAR"}, {}, r"'EQUIRECTANGULAR' is not supp"),
    "pinhole that distorts": ({"camera_model": "PINHOLE", "k1": 0.1}, {}, r"has no distortion"),
    "doubtful coefficient": ({"k4": 0.1}, {}, r"programs disagree about what k4"),
    "no focal length": ({"fl_x": None, "fl_y": None}, {}, r"focal length is missing; write fl_x"),
    "half a pixel": ({"w": 160.5}, {}, r"write whole numbers"),
    "huge image": ({"w": 1e300}, {}, r"size_px"),
    "no pixels": ({"w": 0}, {}, r"size_px must be two positive numbers"),
    "negative focal length": ({"fl_x": -3.0}, {}, r"focal"),
    "angle that sees backwards": ({"camera_angle_x": 4.0}, {}, r"camera_angle_x"),
    "scale of zero": ({"depth_unit_scale_factor": 0}, {}, r"depth_unit_scale_factor"),
    "text for a number": ({"fl_x": "210"}, {}, r"fl_x: expected.* number"),
    "no frames": ({}, None, r"the key 'frames' is missing"),
    "path that leaves": ({}, {"file_path": "../images/0.png"}, r"file_path: .*leaves the capture"),
    "absolute path": ({}, {"file_path": "/images/0.png"}, r"leaves the capture's folder"),
    "path of another machine": ({}, {"file_path": "C:\\images\\0.png"}, r"leaves the capture's"),
    "path that climbs": ({}, {"file_path": "images\\..\\..\\0.png"}, r"leaves the capture's"),
    "path that no file can have": ({}, {"file_path": "images/\0.png"}, r"is not a file name"),
    "no path": ({}, {"file_path": "."}, r"is not a file name"),
    "missing image": ({}, {"file_path": "images/7.png"}, r"frames\[0\]\.file_path: there is no"),
    "missing mask": ({}, {"mask_path": "masks/0.png"}, r"frames\[0\]\.mask_path: there is no"),
    "mask that leaves": ({}, {"mask_path": "../0.png"}, r"mask_path: .*leaves the capture's"),
    "depth that leaves": ({}, {"depth_file_path": "../0.png"}, r"depth_file_path: .*leaves the"),
    "mirror": ({}, {"transform_matrix": np.diag([1, 1, -1, 1]).tolist()}, r"transform_matrix: "),
    "scale": ({}, {"transform_matrix": np.diag([2, 2, 2, 1]).tolist()}, r"transform_matrix: "),
    "three rows": ({}, {"transform_matrix": np.eye(4)[:3].tolist()}, r"transform_matrix: .*4"),
    "no pose": ({}, {"transform_matrix": None}, r"transform_matrix: expected.* list"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_file_that_cannot_be_used_is_refused(case: str, tmp_path: Path) -> None:
    keys, more, message = BAD[case]
    write(tmp_path, [frame(**more or {})], **keys)
    path = tmp_path / "transforms.json"
    if more is None:
        path.write_text(path.read_text().replace('"frames"', '"others"'))
    with pytest.raises((CaptureError, CameraError, PoseError), match=message) as refused:
        open_nerfstudio(tmp_path)
    assert str(path) in str(refused.value)


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "3", "\xff", '{"frames": NaN}', "[" * 100000, '{"a":' * 100000]
)
def test_what_is_no_table_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "transforms.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(CaptureError, match=r"transforms\.json"):
        open_nerfstudio(tmp_path)


def test_a_file_without_images_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="has no image"):
        open_nerfstudio(write(tmp_path, []))


values = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False), st.text(max_size=5),
    st.lists(st.floats(allow_nan=False), max_size=4), st.just({}), st.just([[1, 2], "a"]),
)  # fmt: skip


@settings(max_examples=100, deadline=None)
@given(
    top=st.dictionaries(st.sampled_from([*LENS, "camera_angle_x", "frames"]), values, max_size=3),
    inner=st.dictionaries(st.sampled_from([*frame(), "mask_path", "w", "k1"]), values, max_size=2),
)
def test_values_of_any_kind_are_refused_or_still_a_capture(
    top: dict[str, Any], inner: dict[str, Any], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.getbasetemp() / "values"
    if not folder.exists():
        write(folder, [frame()])
    table = LENS | {"frames": [frame() | inner]} | top
    (folder / "transforms.json").write_text(json.dumps(table))
    try:
        capture = open_nerfstudio(folder)
    except ServoidError as error:
        assert isinstance(error, (CaptureError, CameraError, ImageError, PoseError))
    else:
        assert len(capture) == 1
