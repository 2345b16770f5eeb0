"""A drawn stereo recording as the messages of a bag, and as a capture in memory."""

from dataclasses import replace

import cv2
import numpy as np
from bag_writing import START_NS, Entry, compressed, image, info, tf
from numpy.typing import NDArray

from servoid.camera import Camera, Lens
from servoid.capture import Capture, PosedImage, capture_of
from servoid.pose import Pose

SIZE_PX = (40, 30)
K = (50.0, 0, 19.25, 0, 51.0, 14.75, 0, 0, 1)
BASELINE_M = 0.1
STEP_NS = 33_333_333
FRAMES = ("left_optical", "right_optical")
STILL = (0.0, 0.0, 0.0, 1.0)


def pixels(seed: int, shape: tuple[int, ...] = (30, 40, 3)) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, shape, np.uint8)


def stamp(index: int) -> int:
    return START_NS + index * STEP_NS


def world_from_rig(index: int) -> Pose:
    return Pose.exp([0.01 * index, 0.02, -0.005 * index, 0.02 * index, -0.01, 0.03])


def link(parent: str, child: str, pose: Pose) -> tuple:
    return parent, child, pose.translation, pose.xyzw


def stereo_entries(count: int = 6, *, is_jpeg: bool = False) -> list[Entry]:
    """Write a moving rig of two cameras: images, calibrations and transforms."""
    entries = [
        tf(
            stamp(0),
            [
                ("rig", FRAMES[0], (0.0, 0.0, 0.0), STILL),
                ("rig", FRAMES[1], (BASELINE_M, 0.0, 0.0), STILL),
            ],
            "/tf_static",
        )
    ]
    for index in range(count):
        at = stamp(index)
        entries.append(tf(at, [link("world", "rig", world_from_rig(index))]))
        for side, frame in zip(("left", "right"), FRAMES, strict=True):
            seen = pixels(2 * index + (side == "right"))
            if is_jpeg:
                data = cv2.imencode(".jpg", seen[..., ::-1])[1].tobytes()
                topic = f"/stereo/{side}/image_raw/compressed"
                entries.append(compressed(topic, at, frame, data, "rgb8; jpeg compressed bgr8"))
            else:
                entries.append(image(f"/stereo/{side}/image_raw", at, frame, seen))
            entries.append(info(f"/stereo/{side}/camera_info", at, frame, SIZE_PX, K))
    return entries


def only_camera(entries: list[Entry], name: str = "left") -> list[Entry]:
    """Leave out what belongs to the other camera."""
    others = {"left": "right", "right": "left"}[name]
    return [one for one in entries if f"/{others}/" not in one.topic]


LENSES = [
    Lens(model="pinhole", size_px=SIZE_PX, focal_px=(50, 51), center_px=(19.3, 14.7)),
    Lens(
        model="brown_conrady",
        size_px=SIZE_PX,
        focal_px=(50, 51),
        center_px=(19.3, 14.7),
        distortion=(-0.1, 0.02, 0.001, -0.002, 0.003),
    ),
    Lens(
        model="brown_conrady",
        size_px=SIZE_PX,
        focal_px=(50, 51),
        center_px=(19.3, 14.7),
        distortion=(-0.1, 0.02, 0.001, -0.002, 0.003, 0.01, 0.02, 0.003),
    ),
    Lens(
        model="kannala_brandt",
        size_px=SIZE_PX,
        focal_px=(20, 21),
        center_px=(19.3, 14.7),
        distortion=(0.01, -0.002, 0.001, 0.0005),
    ),
]


def drawn_capture(count: int = 5, lens: Lens | Camera = LENSES[0]) -> Capture:
    """Make a rig of two cameras that moves, at times that no nanosecond holds; one has depth."""
    rig_from_right = Pose.exp([0.1, 0.001, -0.002, 0.01, 0.02, -0.03])
    observations = []
    for index in range(count):
        pose = world_from_rig(index)
        depth = np.random.default_rng(index).uniform(0.3, 2.0, (30, 40)).astype(np.float32)
        depth[:3] = np.nan
        left = PosedImage(
            camera=lens, world_from_camera=pose, image=pixels(2 * index), depth_m=depth
        )
        right = PosedImage(
            camera=lens, world_from_camera=pose @ rig_from_right, image=pixels(2 * index + 1)
        )
        observations.append([left, right])
    capture = capture_of(observations, times_s=[index / 30 for index in range(count)], rate_hz=30)
    names = zip(capture.cameras, ("left", "right"), strict=True)
    return replace(capture, cameras=tuple(replace(camera, name=name) for camera, name in names))
