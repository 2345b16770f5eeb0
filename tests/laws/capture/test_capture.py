import csv
import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import msgspec.toml
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from conftest import BACKGROUND, SIZE_PX, Drawing, camera_toml, capture_toml, write_png
from servoid.camera import read_image, read_mask
from servoid.capture import Capture, open_capture
from servoid.errors import CameraError, CaptureError
from servoid.pose import Pose


def write_stereo(folder: Path, extra: str = "", rig: str = "") -> Capture:
    """Write three stereo pairs; the right camera has no mask of the second pair."""
    for name, dots in (("left", (2, 1, 0)), ("right", (0, 2))):
        for kind in ("", "_masks"):
            (folder / (name + kind)).mkdir(parents=True)
        for index in range(3):
            write_png(folder / name / f"{index}.png", np.zeros((120, 160, 3), np.uint8))
        for index in dots:
            mask = np.zeros((120, 160), np.uint8)
            mask[10 + index, 20] = 1
            write_png(folder / f"{name}_masks" / f"{index}.png", mask)
    left = camera_toml("left", "left/*.png", "left_masks/*.png")
    right = camera_toml("right", "right/*.png", "right_masks/*.png")
    right = right.replace("[[1, 0, 0, 0],", "[[1, 0, 0, 0.25],")
    (folder / "capture.toml").write_text(f"version = 1\n{extra}\n{left}\n{right}\n{rig}")
    return open_capture(folder)


def test_views_come_camera_by_camera_and_only_where_there_is_a_mask(tmp_path: Path) -> None:
    views = write_stereo(tmp_path).views()
    assert [(view.camera_name, view.index) for view in views] == [
        ("left", 0),
        ("left", 1),
        ("left", 2),
        ("right", 0),
        ("right", 2),
    ]
    assert [view.name for view in views][-1] == "right/2"
    for view in views:
        assert view.mask_path is not None
        assert view.mask_path.stem == view.image_path.stem
        assert view.mask()[10 + view.index, 20] == 255


@pytest.mark.parametrize("name", ["temple", "skull", "blowtorch"])
def test_real_photographs_open_in_the_order_and_from_the_places_in_their_files(
    name: str, photos: Callable[[str], Path]
) -> None:
    folder = photos(name)
    settings = msgspec.toml.decode((folder / "capture.toml").read_text())
    with (folder / "poses.csv").open() as lines:
        rows = [[float(value) for value in row] for row in list(csv.reader(lines))[1:]]
    views = open_capture(folder).views()
    images = sorted((folder / "images").iterdir())
    assert [view.image_path for view in views] == images
    assert [view.mask_path and view.mask_path.name for view in views] == [
        f"{path.stem}.png" for path in images
    ]
    for view, (_, x, y, z, qw, qx, qy, qz) in zip(views, rows, strict=True):
        pose = view.world_from_camera.matrix()
        np.testing.assert_allclose(pose[:3, 3], [x, y, z], atol=1e-12)
        turn = Rotation.from_quat([qx, qy, qz, qw]).as_matrix()
        np.testing.assert_allclose(pose[:3, :3], turn, atol=1e-9)
        assert list(view.camera.size_px) == settings["camera"][0]["size_px"]
    assert views[-1].image().shape[:2] == views[-1].mask().shape
    views[-1].view()


def test_a_camera_stands_where_the_rig_and_its_place_on_the_rig_say(tmp_path: Path) -> None:
    poses = "time_s,x,y,z,qw,qx,qy,qz\n"
    poses += "".join(f"{i},0,0,{i},0.7071067811865476,0,0,0.7071067811865476\n" for i in range(3))
    (tmp_path / "poses.csv").write_text(poses)
    capture = write_stereo(tmp_path, rig='[rig]\nposes = "poses.csv"')
    # The rig is turned by 90 degrees about z, so a step along its x is one along the world's y.
    right = capture.views()[-1].world_from_camera
    np.testing.assert_allclose(right.translation, [0.0, 0.25, 2.0], atol=1e-12)
    left = capture.views()[2].world_from_camera
    np.testing.assert_allclose(left.translation, [0.0, 0.0, 2.0], atol=1e-12)


def test_times_come_from_the_poses_or_from_the_rate_or_are_unknown(
    tmp_path: Path, drawn_capture: Path
) -> None:
    drawn = [observation.time_s for observation in open_capture(drawn_capture).observations()]
    assert drawn == pytest.approx([0.1 * index for index in range(8)])
    timed = write_stereo(tmp_path / "timed", extra="rate_hz = 25")
    assert [observation.time_s for observation in timed.observations()] == [0.0, 0.04, 0.08]
    photographs = write_stereo(tmp_path / "photographs")
    assert {observation.time_s for observation in photographs.observations()} == {None}


def test_an_observation_has_one_image_of_each_camera(tmp_path: Path) -> None:
    capture = write_stereo(tmp_path)
    assert len(capture) == 3
    names = [
        [
            picture.path.relative_to(tmp_path).as_posix()
            for picture in observation.pictures
            if picture is not None
        ]
        for observation in capture.observations()
    ]
    assert names == [[f"left/{index}.png", f"right/{index}.png"] for index in range(3)]


def test_a_rig_without_poses_rests_at_the_origin_of_the_world(tmp_path: Path) -> None:
    for pose in write_stereo(tmp_path).world_from_rig:
        np.testing.assert_array_equal(pose.matrix(), np.eye(4))


def test_the_toml_itself_opens_like_its_folder(drawn_capture: Path) -> None:
    by_folder = open_capture(drawn_capture).views()
    by_file = open_capture(str(drawn_capture / "capture.toml")).views()
    assert [view.image_path for view in by_file] == [view.image_path for view in by_folder]


def test_hidden_files_are_no_images(drawn_capture: Path) -> None:
    (drawn_capture / "images" / "._0000.png").write_bytes(b"left behind by a file manager")
    assert len(open_capture(drawn_capture)) == 8


def test_images_are_red_green_blue(drawn_capture: Path, drawing: Drawing) -> None:
    view = open_capture(drawn_capture).views()[0]
    colors = {tuple(color) for color in view.image().reshape(-1, 3).tolist()}
    assert colors == {BACKGROUND, *(ellipsoid.color for ellipsoid in drawing.ellipsoids)}


def test_a_turn_in_the_exif_data_is_ignored(tmp_path: Path) -> None:
    image = np.zeros((40, 60, 3), np.uint8)
    image[:, :30] = 255
    jpeg = cv2.imencode(".jpg", image)[1].tobytes()
    tiff = b"II*\x00\x08\x00\x00\x00" + b"\x01\x00" + b"\x12\x01\x03\x00\x01\x00\x00\x00"
    tiff += b"\x06\x00\x00\x00" + b"\x00\x00\x00\x00"  # orientation 6: turn by 90 degrees
    exif = b"Exif\x00\x00" + tiff
    segment = b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif
    path = tmp_path / "turned.jpg"
    path.write_bytes(jpeg[:2] + segment + jpeg[2:])
    assert cv2.imread(str(path)).shape == (60, 40, 3), "the file does ask for a turn"
    read = read_image(path, (60, 40))
    assert read[:, :20].mean() > 250
    assert read[:, 40:].mean() < 5


def test_a_preview_inside_a_jpeg_does_not_hide_that_its_end_is_missing(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (40, 60, 3), np.uint8)
    jpeg = cv2.imencode(".jpg", noise)[1].tobytes()
    segment = b"\xff\xe2" + (len(jpeg) + 2).to_bytes(2, "big") + jpeg
    whole = tmp_path / "whole.jpg"
    whole.write_bytes(jpeg[:2] + segment + jpeg[2:])
    assert read_image(whole, (60, 40)).shape == (40, 60, 3)
    cut = tmp_path / "cut.jpg"
    cut.write_bytes(whole.read_bytes()[:-200])
    with pytest.raises(ValueError, match="cut short"):
        read_image(cut, (60, 40))


@given(value=st.integers(1, 65535), channels=st.sampled_from([0, 3, 4]), deep=st.booleans())
def test_a_mask_holds_every_pixel_that_is_not_zero(
    value: int, channels: int, deep: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    value = value if deep else 1 + value % 255
    shape = (4, 6, channels) if channels else (4, 6)
    pixels = np.zeros(shape, np.uint16 if deep else np.uint8)
    pixels[1, 2] = [value, *[0] * (channels - 1)] if channels else value
    if channels == 4:
        pixels[..., 3] = 255
    path = tmp_path_factory.mktemp("mask") / "mask.png"
    assert cv2.imwrite(str(path), pixels)
    mask = read_mask(path, (6, 4))
    assert mask.dtype == np.uint8
    assert np.argwhere(mask).tolist() == [[1, 2]]
    assert mask[1, 2] == 255


def test_a_body_is_seen_where_rays_through_the_pixels_meet_it(
    drawn_capture: Path, drawing: Drawing
) -> None:
    body = drawing.body()
    for view in open_capture(drawn_capture).views():
        seen = body.silhouette(view.camera, view.world_from_camera)
        assert seen.shape == (SIZE_PX[1], SIZE_PX[0])
        # Rounding may decide about a pixel whose centre lies on the outline, and no other.
        assert np.count_nonzero((seen != 0) != (view.mask() != 0)) <= 1


def test_capture_files_with_poses_name_their_camera(drawn_capture: Path) -> None:
    (drawn_capture / "capture.toml").write_text(capture_toml(camera_toml(name="hand")))
    assert {view.camera_name for view in open_capture(drawn_capture).views()} == {"hand"}


ALONE = """version = 1
[[camera]]
name = "webcam"
images = "images/*.png"
size_px = [64, 48]
"""


def one_image(folder: Path, more: str) -> Path:
    (folder / "images").mkdir(parents=True)
    cv2.imwrite(str(folder / "images" / "0.png"), np.zeros((48, 64, 3), np.uint8))
    (folder / "capture.toml").write_text(ALONE + more)
    return folder


def test_a_single_camera_needs_an_angle_of_view_only(tmp_path: Path) -> None:
    [camera] = open_capture(one_image(tmp_path, "fov_deg = 90")).cameras
    assert camera.lens.center_px == (31.5, 23.5)
    assert camera.lens.focal_px == pytest.approx((32.0, 32.0))
    assert camera.rig_from_camera == Pose.identity()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("", "give focal_px, .* or fov_deg"),
        ("fov_deg = 60\nfocal_px = [50, 50]", "one of them, not both"),
        ("fov_deg = 180", "less than 180 degrees, but it is 180"),
        ('fov_deg = 170\nmodel = "kannala_brandt"', "does not determine a fisheye"),
        (
            'fov_deg = 60\n[[camera]]\nname = "b"\nimages = "images/*.png"\nsize_px = [64, 48]\n'
            "fov_deg = 60",
            "rig_from_camera is missing",
        ),
    ],
)
def test_a_table_that_says_too_little_is_refused(tmp_path: Path, more: str, words: str) -> None:
    with pytest.raises((CaptureError, CameraError), match=words):
        open_capture(one_image(tmp_path, more))


def test_cameras_may_share_a_folder_of_masks_and_a_mask_of_neither_is_reported_once(
    tmp_path: Path,
) -> None:
    tables = []
    for name in ("left", "right"):
        folder = one_image(tmp_path / name, "") / "images"
        for kind, path in (("images", f"{name}_0.png"), ("masks", f"{name}_0.png")):
            (tmp_path / kind).mkdir(exist_ok=True)
            shutil.copy(folder / "0.png", tmp_path / kind / path)
        x = 0.1 * (name == "right")
        pose = f"rig_from_camera = [[1, 0, 0, {x}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"
        files = f'images = "images/{name}_*.png"\nmasks = "masks/*.png"'
        tables.append(
            f'[[camera]]\nname = "{name}"\n{files}\nsize_px = [64, 48]\nfov_deg = 60\n{pose}'
        )
    (tmp_path / "capture.toml").write_text("version = 1\n" + "\n".join(tables))
    assert open_capture(tmp_path).notes == ()
    shutil.copy(tmp_path / "masks" / "left_0.png", tmp_path / "masks" / "lone.png")
    (note,) = open_capture(tmp_path).notes
    assert "lone.png" in note


@pytest.mark.parametrize(("extra", "more"), [(1, ""), (5, " and 2 more")])
def test_masks_of_no_image_are_reported_with_their_number_and_names(
    extra: int, more: str, drawn_capture: Path, tmp_path: Path
) -> None:
    folder = shutil.copytree(drawn_capture, tmp_path / "capture")
    masks = sorted((folder / "masks").glob("*.png"))
    for number in range(extra):
        shutil.copy(masks[0], masks[0].with_stem(f"lone_{number}"))
    (note,) = open_capture(folder).notes
    names = ", ".join(f"lone_{number}.png" for number in range(min(extra, 3)))
    have = "1 mask of camera 'eye' has" if extra == 1 else f"{extra} masks of camera 'eye' have"
    assert note.startswith(
        f"{have} no image of the same name, of {len(masks) + extra}: {names}{more}; "
    )
    assert open_capture(drawn_capture).notes == ()
