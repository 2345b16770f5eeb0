from pathlib import Path

import numpy as np
import pytest

from conftest import everything_in
from servoid.camera import Camera
from servoid.capture import open_capture
from servoid.errors import OutputError
from servoid.pose import Pose
from servoid.source import Instant, write_looks

CAMERA = Camera(size_px=(48, 36), focal_px=(51.25, 50.75), center_px=(23.1, 17.9))
CAMERAS = (CAMERA, CAMERA)
NAMES = ("left", "right")


def random_looks(count: int = 3, names: tuple[str, ...] = NAMES) -> list[Instant]:
    random = np.random.default_rng(5)
    looks = []
    for number in range(count):
        poses = tuple(Pose.exp(random.normal(size=6).tolist()) for _ in CAMERAS)
        images = tuple(random.integers(0, 256, (36, 48, 3), np.uint8) for _ in CAMERAS)
        looks.append(Instant(number, 0.1 * number, poses, images, names=names))
    return looks


def random_mask() -> np.ndarray:
    return np.where(np.random.default_rng(8).random((36, 48)) < 0.3, 255, 0).astype(np.uint8)


def test_looks_read_back_with_the_same_images_to_the_bit(tmp_path: Path) -> None:
    looks = random_looks()
    capture = open_capture(write_looks(tmp_path / "look", CAMERAS, looks))
    found = {view.camera_name: view.image() for view in capture.all_views()}
    assert len(found) == 6
    for number, look in enumerate(looks):
        for name, image in zip(NAMES, look.images, strict=True):
            np.testing.assert_array_equal(found[f"{name}-{number:02d}"], image)


def test_looks_read_back_with_their_cameras_and_poses(tmp_path: Path) -> None:
    looks = random_looks()
    write_looks(tmp_path / "look", CAMERAS, looks)
    views = {view.camera_name: view for view in open_capture(tmp_path / "look").all_views()}
    for number, look in enumerate(looks):
        for name, pose in zip(NAMES, look.world_from_camera, strict=True):
            view = views[f"{name}-{number:02d}"]
            assert view.camera.size_px == CAMERA.size_px
            assert view.camera.focal_px == CAMERA.focal_px
            assert view.camera.center_px == CAMERA.center_px
            np.testing.assert_allclose(
                view.world_from_camera.matrix(), pose.matrix(), rtol=0.0, atol=1e-12
            )


def test_masks_belong_to_the_first_look_alone(tmp_path: Path) -> None:
    mask = random_mask()
    write_looks(tmp_path / "look", CAMERAS, random_looks(), (None, mask))
    (view,) = open_capture(tmp_path / "look").views()
    assert view.camera_name == "right-00"
    np.testing.assert_array_equal(view.mask(), mask)


def test_a_look_without_an_image_leaves_out_that_camera(tmp_path: Path) -> None:
    looks = random_looks(2, names=())
    second = looks[1]
    looks[1] = Instant(1, 0.1, second.world_from_camera, (None, second.images[1]))
    write_looks(tmp_path / "look", CAMERAS, looks)
    names = [camera.name for camera in open_capture(tmp_path / "look").cameras]
    assert names == ["0-00", "1-00", "1-01"]


def test_more_looks_take_the_place_of_fewer(tmp_path: Path) -> None:
    looks = random_looks()
    write_looks(tmp_path / "look", CAMERAS, looks[:1], (random_mask(), None))
    write_looks(tmp_path / "look", CAMERAS, looks, (random_mask(), None))
    capture = open_capture(tmp_path / "look")
    assert (len(capture.all_views()), len(capture.views())) == (6, 1)


def test_what_cannot_be_written_is_refused_and_nothing_is_half_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(OutputError, match="file"):
        write_looks(tmp_path / "file", CAMERAS, random_looks())
    with pytest.raises(OutputError, match="none"):
        write_looks(tmp_path / "none" / "look", CAMERAS, random_looks())
    assert everything_in(tmp_path) == {"file": b"mine"}


def test_a_capture_that_cannot_be_replaced_stays_as_it_was(tmp_path: Path) -> None:
    folder = tmp_path / "look"
    write_looks(folder, CAMERAS, random_looks(1))
    (folder / "right-01").mkdir()
    (folder / "right-01" / "image.png").mkdir()  # in the way of the second look
    before = everything_in(folder)
    with pytest.raises(OutputError, match="right-01"):
        write_looks(folder, CAMERAS, random_looks(2)[::-1])
    after = everything_in(folder)
    assert {path: data for path, data in after.items() if data is not None} == {
        path: data for path, data in before.items() if data is not None
    }
    assert len(open_capture(folder).all_views()) == 2
