"""One capture in every format: whatever the files, the views are the same."""

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conftest import BACKGROUND, CENTER_PX, FOCAL_PX, SIZE_PX, Drawing, camera_toml, write_png
from servoid.capture import open_capture
from servoid.errors import CaptureError
from servoid.exchange import open_any

LENS = f"{FOCAL_PX} {FOCAL_PX} {CENTER_PX[0] + 0.5} {CENTER_PX[1] + 0.5}"


def write_pictures(
    folder: Path, drawing: Drawing, images: str = "images/{:04}.png", masks: str = "masks/{:04}.png"
) -> Path:
    for index, pose in enumerate(drawing.world_from_cameras()):
        for name, pixels in ((images, drawing.picture(pose)), (masks, drawing.mask(pose))):
            path = folder / name.format(index)
            path.parent.mkdir(parents=True, exist_ok=True)
            write_png(path, pixels)
    return folder


def write_ours(folder: Path, drawing: Drawing) -> Path:
    return drawing.write(folder)


def write_colmap(folder: Path, drawing: Drawing) -> Path:
    write_pictures(folder, drawing, masks="masks/{:04}.png.png")
    model = folder / "sparse" / "0"
    model.mkdir(parents=True)
    (model / "cameras.txt").write_text(f"1 PINHOLE {SIZE_PX[0]} {SIZE_PX[1]} {LENS}\n")
    lines = []
    for index, pose in enumerate(drawing.world_from_cameras()):
        camera_from_world = np.linalg.inv(pose)
        x, y, z, w = Rotation.from_matrix(camera_from_world[:3, :3]).as_quat()
        numbers = " ".join(f"{value:.17g}" for value in (w, x, y, z, *camera_from_world[:3, 3]))
        lines.append(f"{index + 1} {numbers} 1 {index:04}.png\n\n")
    (model / "images.txt").write_text("".join(lines))
    return folder


def write_nerfstudio(folder: Path, drawing: Drawing) -> Path:
    write_pictures(folder, drawing)
    fx, fy, cx, cy = map(float, LENS.split())
    keys = {"w": SIZE_PX[0], "h": SIZE_PX[1], "fl_x": fx, "fl_y": fy, "cx": cx, "cy": cy}
    frames = [
        {
            "file_path": f"images/{index:04}.png",
            "mask_path": f"masks/{index:04}.png",
            "transform_matrix": (pose @ np.diag([1.0, -1.0, -1.0, 1.0])).tolist(),
        }
        for index, pose in enumerate(drawing.world_from_cameras())
    ]
    (folder / "transforms.json").write_text(json.dumps(keys | {"frames": frames}))
    return folder


def write_bop(folder: Path, drawing: Drawing) -> Path:
    write_pictures(folder, drawing, "rgb/{:06}.png", "mask_visib/{:06}_000000.png")
    k = [FOCAL_PX, 0, CENTER_PX[0], 0, FOCAL_PX, CENTER_PX[1], 0, 0, 1]
    cameras, truth = {}, {}
    for index, pose in enumerate(drawing.world_from_cameras()):
        inverse = np.linalg.inv(pose)
        turn, place = inverse[:3, :3].ravel().tolist(), (1000 * inverse[:3, 3]).tolist()
        cameras[str(index)] = {"cam_K": k, "cam_R_w2c": turn, "cam_t_w2c": place}
        truth[str(index)] = [{"obj_id": 1, "cam_R_m2c": turn, "cam_t_m2c": place}]
    (folder / "scene_camera.json").write_text(json.dumps(cameras))
    (folder / "scene_gt.json").write_text(json.dumps(truth))
    return folder


FORMATS: dict[str, Callable[[Path, Drawing], Path]] = {
    "capture.toml": write_ours,
    "sparse/0/cameras.txt": write_colmap,
    "transforms.json": write_nerfstudio,
    "scene_camera.json": write_bop,
}


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_shows_the_same_views(name: str, tmp_path: Path, drawing: Drawing) -> None:
    folder = FORMATS[name](tmp_path / "project", drawing)
    for path in (folder, folder / name, str(folder)):
        if path == folder / "sparse/0/cameras.txt":
            path = folder / "sparse/0/images.txt"
        views = open_any(path).views()
        assert [int(view.picture.stem) for view in views] == list(range(drawing.views))
        for view, pose in zip(views, drawing.world_from_cameras(), strict=True):
            np.testing.assert_allclose(view.world_from_camera.matrix(), pose, atol=1e-9)
            assert view.camera.focal_px == (FOCAL_PX, FOCAL_PX)
            assert view.camera.center_px == CENTER_PX
            np.testing.assert_array_equal(view.image(), drawing.picture(pose))
            np.testing.assert_array_equal(view.mask(), drawing.mask(pose))


def test_what_cannot_be_told_is_refused_with_what_was_looked_for(
    tmp_path: Path, drawn_capture: Path
) -> None:
    (tmp_path / "empty").mkdir()
    looked_for = r"no capture\.toml, no transforms\.json, no cameras\.bin .* no scene_camera\.json"
    with pytest.raises(CaptureError, match=looked_for):
        open_any(tmp_path / "empty")
    with pytest.raises(CaptureError, match=r"there is no .*none; name a folder"):
        open_any(tmp_path / "none")
    with pytest.raises(CaptureError, match=r"there is no .*a{300}"):
        open_any(tmp_path / ("a" * 300))
    (tmp_path / "body.json").write_text('{"version": 1, "units": "m", "ellipsoids": []}')
    with pytest.raises(CaptureError, match=r"body\.json is a body, not a capture; .* --body "):
        open_any(tmp_path / "body.json")
    with pytest.raises(CaptureError, match="is not a COLMAP model"):
        open_any(drawn_capture, images=tmp_path)
    with pytest.raises(CaptureError, match="is not a BOP scene"):
        open_any(drawn_capture, bop_object=0)


LENSES = {
    "brown_conrady": ("[-0.25, 0.1, 0.002, -0.003, 0.01]", (0.03, 0.02, 0.0)),
    "kannala_brandt": ("[-0.05, 0.01, 0.002, -0.001]", (0.09, -0.05, 0.0)),
}


@pytest.mark.parametrize("model", LENSES)
def test_a_point_is_seen_where_the_ideal_pinhole_says(model: str, tmp_path: Path) -> None:
    distortion, point = LENSES[model]
    toml = camera_toml().replace('"pinhole"', f'"{model}"')
    toml = toml.replace("distortion = []", f"distortion = {distortion}")
    toml = toml.replace("[0, 0, 1, 0]", "[0, 0, 1, -0.3]")
    (tmp_path / "capture.toml").write_text(f"version = 1\n{toml}")
    for kind in ("images", "masks"):
        (tmp_path / kind).mkdir()
        write_png(tmp_path / kind / "0.png", np.zeros((SIZE_PX[1], SIZE_PX[0], 3), np.uint8))
    [camera] = open_capture(tmp_path).cameras
    point_in_lens = np.array([point]) + np.array([[0.0, 0.0, 0.3]])
    center = np.rint(16 * camera.lens.project(point_in_lens)[0]).astype(int)
    dot = np.zeros((SIZE_PX[1], SIZE_PX[0], 3), np.uint8)
    cv2.circle(dot, center.tolist(), 16 * 5, (255, 255, 255), -1, cv2.LINE_AA, 4)
    for kind in ("images", "masks"):
        write_png(tmp_path / kind / "0.png", dot)
    [view] = open_capture(tmp_path).views()
    assert view.lens.model == model
    point_in_camera = view.world_from_camera.inverse().transform(np.array([point]))
    expected = view.camera.project(point_in_camera)[0]
    image, mask = view.image()[..., 0].astype(float), view.mask().astype(float)
    width, height = view.camera.size_px
    assert image.shape == mask.shape == (height, width)
    for seen in (image, mask):
        rows, columns = np.indices(seen.shape)
        middle = np.array([(columns * seen).sum(), (rows * seen).sum()]) / seen.sum()
        np.testing.assert_allclose(middle, expected, atol=0.5)
    view.view()


@pytest.mark.parametrize("model", LENSES)
def test_a_body_seen_through_a_lens_is_where_the_ideal_pinhole_sees_it(
    model: str, tmp_path: Path, drawing: Drawing
) -> None:
    folder = drawing.write(tmp_path / "photos")
    toml = (folder / "capture.toml").read_text().replace('"pinhole"', f'"{model}"')
    toml = toml.replace("distortion = []", f"distortion = {LENSES[model][0]}")
    (folder / "capture.toml").write_text(toml)
    [camera] = open_capture(folder).cameras
    columns, rows = np.meshgrid(*(np.arange(side, dtype=float) for side in SIZE_PX))
    rays = camera.lens.rays(np.stack([columns.ravel(), rows.ravel()], axis=1))
    drawn_px = rays[:, :2] / rays[:, 2:] * FOCAL_PX + np.array(CENTER_PX)
    bend = drawn_px.reshape(*SIZE_PX[::-1], 2).astype(np.float32)
    for index, pose in enumerate(drawing.world_from_cameras()):
        for kind, pixels in (("images", drawing.picture(pose)), ("masks", drawing.mask(pose))):
            bent = cv2.remap(pixels, bend, None, cv2.INTER_NEAREST)
            write_png(folder / kind / f"{index:04}.png", np.asarray(bent, np.uint8))
    body = drawing.body()
    # Rounding to pixels, when the images were bent and when they are straightened, moves the edge
    # by one pixel at most each time.
    reach = np.ones((5, 5), np.uint8)
    for view in open_capture(folder).views():
        seen, mask = body.silhouette(view.camera, view.world_from_camera), view.mask()
        assert np.count_nonzero(seen) > 800
        assert not (cv2.erode(seen, reach) & ~mask).any()
        assert not (mask & ~cv2.dilate(seen, reach)).any()
        np.testing.assert_array_equal((view.image() != BACKGROUND).any(axis=2)[mask != 0], True)


def test_views_of_one_camera_share_the_maps_of_its_lens(drawn_capture: Path) -> None:
    toml = drawn_capture / "capture.toml"
    text = toml.read_text().replace('"pinhole"', '"brown_conrady"')
    toml.write_text(text.replace("distortion = []", "distortion = [0.1, 0, 0, 0]"))
    views = open_capture(drawn_capture).views()
    assert len({id(view.ideal.maps()) for view in views}) == 1
    given = views[0].with_mask(np.ones(views[0].camera.size_px[::-1], np.uint8))
    assert given.ideal is views[0].ideal


@pytest.mark.parametrize("lost", [("left/3",), ("left/3", "right/5")])
def test_an_image_that_one_camera_lacks_is_named_rather_than_shifting_all_later_ones(
    lost: tuple[str, ...], tmp_path: Path
) -> None:
    tables = "".join(camera_toml(name, f"{name}/*.png") for name in ("left", "right"))
    tables = tables.replace('masks = "masks/*.png"\n', "")
    (tmp_path / "capture.toml").write_text(f"version = 1\n{tables}[rig]\n")
    for name in ("left", "right"):
        (tmp_path / name).mkdir()
        for index in range(8):
            (tmp_path / name / f"{index}.png").touch()
    assert len(open_capture(tmp_path)) == 8
    for place in lost:
        (tmp_path / f"{place}.png").unlink()
    with pytest.raises(CaptureError, match="camera 'left' has no '3'; add an empty file"):
        open_capture(tmp_path)
    for image in (tmp_path / "left").iterdir():
        image.rename(image.with_stem(f"at_{image.stem}"))
    if len(lost) == 2:  # names that have nothing in common say nothing
        assert len(open_capture(tmp_path)) == 7
