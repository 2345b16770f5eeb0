"""The same observations through a folder and through bags lead to the same track."""

import csv
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from bag_writing import Entry, compressed, image, info, tf, write_bag, write_by_ros1
from numpy.typing import NDArray
from scenes_bags import STILL
from tracking_errors import tracking_errors

from conftest import REAL_PHOTOS
from servoid.capture import Capture, open_capture
from servoid.exchange import open_bag
from servoid.model import fit_capture
from servoid.pose import Pose
from servoid.segment import MaskTarget
from servoid.track import Estimate, Request, Subject, track_capture

BOTTLE = REAL_PHOTOS.parent / "stereo" / "mustard"
COUNT = 100
JPEG_QUALITY = 80  # of image_transport, unless it is told another
MOST_ADD_M = 3e-4

pytestmark = [
    pytest.mark.extended,
    pytest.mark.skipif(not BOTTLE.exists(), reason=f"there is no {BOTTLE}"),
]


def cut(capture: Capture) -> Capture:
    """Return the first observations, at times that a stamp can hold."""
    times_s = tuple(round(one * 1e9) / 10**9 for one in (capture.times_s or ())[:COUNT])
    cameras = tuple(
        replace(
            camera,
            pictures=camera.pictures[:COUNT],
            mask_paths=(None,) * COUNT,  # a bag has none
            depth_paths=camera.depth_paths[:COUNT],
        )
        for camera in capture.cameras
    )
    poses = capture.world_from_rig[:COUNT]
    return replace(capture, cameras=cameras, world_from_rig=poses, times_s=times_s)


Store = Callable[[str, int, str, NDArray[np.uint8]], Entry]


def entries_of(capture: Capture, store: Store) -> list[Entry]:
    """Turn a capture into the messages that a driver of its cameras would have published."""
    start_ns = round((capture.times_s or (0.0,))[0] * 1e9)
    frames = [f"{camera.name}_optical" for camera in capture.cameras]
    seats = [
        ("rig", frame, camera.rig_from_camera.translation, camera.rig_from_camera.xyzw)
        for frame, camera in zip(frames, capture.cameras, strict=True)
    ]
    entries = [tf(start_ns, seats, "/tf_static")]
    assert all(pose == Pose.identity() for pose in capture.world_from_rig)
    entries.append(tf(start_ns, [("world", "rig", (0, 0, 0), STILL)], "/tf_static"))
    for one in capture.observations():
        stamp_ns = round((one.time_s or 0.0) * 1e9)
        both = zip(capture.cameras, one.pictures, frames, strict=True)
        for camera, picture, frame in both:
            assert picture is not None
            size, k = camera.lens.size_px, camera.lens.matrix().ravel()
            entries.append(info(f"/{camera.name}/camera_info", stamp_ns, frame, size, k))
            entries.append(store(f"/{camera.name}/image_raw", stamp_ns, frame, picture.read(size)))
    return entries


def raw(topic: str, stamp_ns: int, frame: str, pixels: NDArray[np.uint8]) -> Entry:
    return image(topic, stamp_ns, frame, pixels[..., ::-1], "bgr8")


def jpeg(topic: str, stamp_ns: int, frame: str, pixels: NDArray[np.uint8]) -> Entry:
    quality = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
    data = cv2.imencode(".jpg", pixels[..., ::-1], quality)[1].tobytes()
    return compressed(f"{topic}/compressed", stamp_ns, frame, data, "bgr8; jpeg compressed bgr8")


@pytest.fixture(scope="module")
def bottle() -> Capture:
    return cut(open_capture(BOTTLE))


@pytest.fixture(scope="module")
def subject(bottle: Capture) -> Subject:
    mask = next((BOTTLE / "masks").glob("*.png"))
    result = fit_capture(bottle, targets=[MaskTarget(mask)])
    return Subject(name="bottle", body=result.body, start=result.body.world_from_object)


@pytest.fixture(scope="module")
def by_folder(bottle: Capture, subject: Subject) -> list[Estimate]:
    return track(bottle, subject)


def track(capture: Capture, subject: Subject) -> list[Estimate]:
    assert len(capture) == COUNT
    (result,) = track_capture(capture, [subject], Request(seed=3))
    return result.estimates


def mean_add_m(estimates: list[Estimate]) -> float:
    """Return how far points of the true bottle are from where they should be, on average."""
    lines = (BOTTLE / "truth" / "mesh.obj").read_text().splitlines()
    points = [line.split()[1:4] for line in lines if line.startswith("v ")]
    with (BOTTLE / "truth" / "left_from_object.csv").open() as file:
        rows = [tuple(map(float, line)) for line in list(csv.reader(file))[1 : COUNT + 1]]
    truth = [Pose.from_parts(row[1:4], row[4:8]).matrix() for row in rows]
    poses = [one.world_from_object.matrix() for one in estimates]
    return float(tracking_errors(poses, truth, np.array(points, np.float64)).add.mean())


@pytest.mark.parametrize("name", ["run.mcap", "run", "run.bag"])
def test_raw_images_in_a_bag_give_the_bits_that_the_folder_gives(
    name: str, tmp_path: Path, bottle: Capture, subject: Subject, by_folder: list[Estimate]
) -> None:
    path = write_bag(tmp_path / name, entries_of(bottle, raw))
    assert track(open_bag(path), subject) == by_folder
    assert sum(one.status == "tracking" for one in by_folder) > 0.9 * COUNT


def test_a_bag_of_ros_1_itself_gives_the_bits_that_the_folder_gives(
    tmp_path: Path, bottle: Capture, subject: Subject, by_folder: list[Estimate]
) -> None:
    path = write_by_ros1(tmp_path / "real.bag", entries_of(bottle, raw), "lz4")
    assert track(open_bag(path), subject) == by_folder


def test_jpegs_of_the_usual_quality_cost_less_than_a_third_of_a_millimetre(
    tmp_path: Path, bottle: Capture, subject: Subject, by_folder: list[Estimate]
) -> None:
    found = track(open_bag(write_bag(tmp_path / "run.mcap", entries_of(bottle, jpeg))), subject)
    assert abs(mean_add_m(found) - mean_add_m(by_folder)) < MOST_ADD_M
    assert mean_add_m(found) < 2e-3
