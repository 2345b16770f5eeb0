"""BOP scenes, written here by the published format: rotations row by row, lengths in mm."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conftest import CENTER_PX, FOCAL_PX, SIZE_PX, Drawing, write_png
from servoid.errors import CameraError, CaptureError, PoseError
from servoid.exchange import open_any, open_bop

K = [FOCAL_PX, 0.0, CENTER_PX[0], 0.0, FOCAL_PX, CENTER_PX[1], 0.0, 0.0, 1.0]
WORLD_FROM_OBJECT = np.eye(4)
WORLD_FROM_OBJECT[:3, :3] = Rotation.from_euler("xyz", [20, 30, 40], degrees=True).as_matrix()
WORLD_FROM_OBJECT[:3, 3] = [0.1, -0.2, 0.3]


def parts(pose: np.ndarray, suffix: str) -> dict[str, Any]:
    turn, place = pose[:3, :3].round(9), 1000 * pose[:3, 3]
    return {f"cam_R_{suffix}": turn.ravel().tolist(), f"cam_t_{suffix}": place.tolist()}


def write_scene(folder: Path, drawing: Drawing, *, world: bool = True, objects: int = 1) -> Path:
    """Write a scene; the drawn object is the last one, number 7 of the dataset."""
    cameras, truth = {}, {}
    for kind in ("rgb", "depth", "mask_visib"):
        (folder / kind).mkdir(parents=True)
    for index, pose in enumerate(drawing.world_from_cameras()):
        camera_from_world = np.linalg.inv(pose)
        cameras[str(index)] = {"cam_K": K, "depth_scale": 0.1, "elev_deg": 45}
        if world:
            cameras[str(index)] |= parts(camera_from_world, "w2c")
        camera_from_object = camera_from_world @ WORLD_FROM_OBJECT
        others = [{"obj_id": 3} | parts(np.eye(4), "m2c")] * (objects - 1)
        truth[str(index)] = [*others, {"obj_id": 7} | parts(camera_from_object, "m2c")]
        write_png(folder / "rgb" / f"{index:06}.png", drawing.picture(pose))
        mask = folder / "mask_visib" / f"{index:06}_{objects - 1:06}.png"
        write_png(mask, drawing.mask(pose))
        depth = np.full(SIZE_PX[::-1], 5000 + index, np.uint16)
        depth[0, 0] = 0
        assert cv2.imwrite(str(folder / "depth" / f"{index:06}.png"), depth)
    (folder / "scene_camera.json").write_text(json.dumps(cameras))
    (folder / "scene_gt.json").write_text(json.dumps(truth))
    return folder


def change(path: Path, image: str, key: str, value: Any) -> None:
    table = json.loads(path.read_text())
    entry = table[image]
    (entry[0] if isinstance(entry, list) else entry)[key] = value
    path.write_text(json.dumps(table))


@pytest.mark.parametrize("world", [True, False])
def test_poses_are_the_worlds_or_else_the_objects(
    world: bool, tmp_path: Path, drawing: Drawing
) -> None:
    views = open_bop(write_scene(tmp_path / "s", drawing, world=world)).views()
    frame_from_world = np.eye(4) if world else np.linalg.inv(WORLD_FROM_OBJECT)
    assert [view.name for view in views] == [f"camera/{index:06}" for index in range(8)]
    for view, pose in zip(views, drawing.world_from_cameras(), strict=True):
        found = view.world_from_camera.matrix()
        np.testing.assert_allclose(found, frame_from_world @ pose, atol=1e-8)
        assert view.camera.center_px == CENTER_PX
        np.testing.assert_array_equal(view.image(), drawing.picture(pose))
        np.testing.assert_array_equal(view.mask(), drawing.mask(pose))


def test_depth_is_in_metres_and_zero_is_unknown(tmp_path: Path, drawing: Drawing) -> None:
    for view in open_bop(write_scene(tmp_path / "s", drawing)).views():
        depth = view.depth()
        assert depth is not None
        assert np.isnan(depth[0, 0])
        np.testing.assert_allclose(depth[1:], (5000 + view.index) * 0.1 * 0.001, rtol=1e-6)


def test_one_of_several_objects_is_chosen_by_its_index(tmp_path: Path, drawing: Drawing) -> None:
    scene = write_scene(tmp_path / "s", drawing, objects=3)
    with pytest.raises(CaptureError, match=r"by its index \(0: object 3, 1: object 3, 2: object 7"):
        open_bop(scene)
    assert len(open_bop(scene, 2).views()) == 8
    assert open_bop(scene, 1).views() == []
    with pytest.raises(CaptureError, match=r"no object with index 3; choose 0 to 2"):
        open_any(scene, bop_object=3)
    with pytest.raises(CaptureError, match=r"no object with index -1"):
        open_bop(scene, -1)
    change(scene / "scene_gt.json", "5", "obj_id", 4)
    with pytest.raises(CaptureError, match="index 0 is object 3 in image 0, but object 4 in im"):
        open_bop(scene, 0)


def test_images_without_the_object_have_no_mask_or_are_left_out(
    tmp_path: Path, drawing: Drawing
) -> None:
    for world in (True, False):
        scene = write_scene(tmp_path / str(world), drawing, world=world)
        path = scene / "scene_gt.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {"2": []}))
        capture = open_bop(scene)
        assert len(capture) == (8 if world else 7)
        assert [view.picture.stem for view in capture.views()].count("000002") == 0


def test_images_with_another_calibration_are_of_another_camera(
    tmp_path: Path, drawing: Drawing
) -> None:
    scene = write_scene(tmp_path / "s", drawing)
    change(scene / "scene_camera.json", "3", "cam_K", [100, 0, 50, 0, 100, 50, 0, 0, 1])
    first, second = open_bop(scene).cameras
    assert [picture is not None for picture in second.pictures].count(True) == 1
    assert (first.lens.focal_px, second.lens.focal_px) == ((FOCAL_PX, FOCAL_PX), (100, 100))


def test_grey_images_and_world_poses_alone_are_a_scene(tmp_path: Path, drawing: Drawing) -> None:
    scene = write_scene(tmp_path / "s", drawing)
    (scene / "rgb").rename(scene / "gray")
    (scene / "scene_gt.json").unlink()
    capture = open_bop(scene)
    assert len(capture.all_views()) == 8
    assert capture.views() == []


BAD = {
    "skew": ("scene_camera", "cam_K", [9, 1, 5, 0, 9, 5, 0, 0, 1], r"image 1: cam_K is .*fx 0 cx"),
    "eight numbers": ("scene_camera", "cam_K", K[:8], r"image 1, cam_K: .*length 9"),
    "no focal length": ("scene_camera", "cam_K", [0.0, *K[1:]], r"cam_K: .*focal"),
    "no calibration": ("scene_camera", "cam_K", None, r"image 1, cam_K: expected.*list"),
    "scale of zero": ("scene_camera", "depth_scale", 0, r"image 1, depth_scale: .* above 0"),
    "no rotation": ("scene_camera", "cam_R_w2c", [1] * 9, r"scene_camera\.json, image 1: "),
    "pose of two numbers": ("scene_gt", "cam_t_m2c", [1, 2], r"image 1\[0\], cam_t_m2c: .*th 3"),
    "object by name": ("scene_gt", "obj_id", "duck", r"image 1\[0\], obj_id: .*whole number"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_scene_that_cannot_be_used_is_refused(
    case: str, tmp_path: Path, drawing: Drawing
) -> None:
    name, key, value, message = BAD[case]
    scene = write_scene(tmp_path / "s", drawing)
    change(scene / f"{name}.json", "1", key, value)
    with pytest.raises((CaptureError, CameraError, PoseError), match=message):
        open_bop(scene)


@pytest.mark.parametrize("key", ["-1", "one", "../1", "1.5", "9" * 30, "٣"])
def test_a_number_of_an_image_that_is_none_is_refused(key: str, tmp_path: Path) -> None:
    (tmp_path / "scene_camera.json").write_text(json.dumps({key: {"cam_K": K}}))
    with pytest.raises(CaptureError, match="is not an image number"):
        open_bop(tmp_path)


def test_what_a_scene_lacks_is_named(tmp_path: Path, drawing: Drawing) -> None:
    scene = write_scene(tmp_path / "s", drawing, world=False)
    (scene / "rgb" / "000004.png").unlink()
    with pytest.raises(CaptureError, match="has no image 000004 in rgb or gray"):
        open_bop(scene)
    (scene / "scene_gt.json").unlink()
    with pytest.raises(CaptureError, match="no image has a pose"):
        open_bop(scene)
    (scene / "scene_gt.json").write_text('{"0": {}}')
    with pytest.raises(CaptureError, match="image 0: expected a list of objects"):
        open_bop(scene)
    (scene / "scene_camera.json").write_text('{"0": []}')
    with pytest.raises(CaptureError, match="image 0: expected a table"):
        open_bop(scene)
