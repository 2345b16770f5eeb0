"""Models, tracks and servos with arrays alone: no file is written.

Run it after `make samples`: `.venv/bin/python examples/from_arrays.py out/moving`. A
recording stands in for a webcam, and a simulated arm for a real one.
"""

import sys
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from servoid.camera import Camera
from servoid.capture import PosedImage, View, capture_of, open_capture
from servoid.errors import ServoidError
from servoid.model import (
    ModelResult,
    Request,
    fit,
    fit_capture,
    fit_range_samples,
    range_samples_of_cloud,
)
from servoid.pose import Pose
from servoid.servo import Arm, Controller
from servoid.shape import Body
from servoid.sim import SerialArm, read_arm
from servoid.track import Tracker

Image = NDArray[np.uint8]


def model_from_masks(
    camera: Camera, poses: list[Pose], images: list[Image], masks: list[Image]
) -> ModelResult:
    """Model an object from masks in images of one camera at several positions."""
    views = [
        View(camera=camera, world_from_camera=pose, mask=mask)
        for pose, mask in zip(poses, masks, strict=True)
    ]
    return fit(views, images=images, max_ellipsoids=4, delta=0.0)


def model_from_pair(left: PosedImage, right: PosedImage) -> ModelResult:
    """Model an object from the left image's mask and the depth that the pair measures.

    `targets=[parse_target("box:120,80,420,400")]` gives a box in place of the mask.
    """
    return fit_capture(capture_of([[left, right]]), Request(max_ellipsoids=4, delta=0.0))


def model_from_points(points: NDArray[np.float64], eye: tuple[float, float, float]) -> ModelResult:
    """Model a point cloud that was seen from one position."""
    return fit_range_samples(
        range_samples_of_cloud(points, None, eye), Request(max_ellipsoids=4, delta=0.0)
    )


def track(camera: Camera, body: Body, stream: Iterator[tuple[float, Image]]) -> Iterator[Pose]:
    """Track a body before a camera at rest, image by image."""
    world_from_camera, tracker = Pose.identity(), Tracker(camera, body)
    time_s, image = next(stream)
    tracker.start(time_s, world_from_camera, image, body.world_from_object)
    for time_s, image in stream:
        estimate = tracker.step(time_s, world_from_camera, image)
        if estimate.status == "tracking":
            yield estimate.world_from_object


def servo(
    arm: Arm,
    tracker: Tracker,
    rig_from_cameras: list[Pose],
    rig_from_object: Pose,
    stream: Iterator[tuple[float, list[Image]]],
) -> None:
    """Keep the object where it is at first in the hand's frame, by images of a pair at rest.

    The pair stands where the hand is at first, so that the object is before the hand. A single
    camera tells its rotation less certainly, and the hand follows no doubtful one.
    """
    controller = Controller(arm)
    world_from_rig = arm.world_from_hand(arm.state().positions)
    poses = [world_from_rig @ pose for pose in rig_from_cameras]
    time_s, images = next(stream)
    tracker.start(time_s, poses, images, world_from_rig @ rig_from_object)
    for time_s, images in stream:
        controller.see(None, tracker.step(time_s, poses, images))
        while arm.state().time_s < time_s:
            arm.command(controller.command(arm.state(), rig_from_object).velocities)


def main(folder: str) -> None:
    """Run each of these functions with the arrays of a recording."""
    views = open_capture(folder).all_views()
    left = [view for view in views if view.camera_name == views[0].camera_name]
    right = [view for view in views if view.camera_name != views[0].camera_name]
    camera = Camera.from_matrix(left[0].camera.matrix(), left[0].camera.size_px)
    images = [view.image() for view in left[:40]]
    start = left[0].world_from_camera
    pair = [
        PosedImage(
            camera=view.camera,
            world_from_camera=start.inverse() @ view.world_from_camera,
            image=view.image(),
            mask=view.mask() if view.has_mask else None,
        )
        for view in (left[0], right[0])
    ]
    result = model_from_pair(*pair)
    print(f"stereo pair: {len(result.body)} ellipsoids, IoU {result.iou_used.mean():.3f}")
    points = result.range_samples.points
    cloud = model_from_points(points, (0.0, 0.0, 0.0))
    print(f"{len(points)} points: {len(cloud.body)} ellipsoids")
    masks = [one.mask() for one in result.used_views]
    camera_poses = [one.world_from_camera for one in result.used_views]
    used_images = [one.image() for one in result.used_views]
    modelled = model_from_masks(camera, camera_poses, used_images, masks)
    print(f"masks: {len(modelled.body)} ellipsoids, IoU {modelled.iou_used.mean():.3f}")
    times_s = 0.04 * np.arange(len(images))
    poses = list(track(camera, result.body, zip(times_s, images, strict=True)))
    print(f"tracked in {len(poses)} of {len(images) - 1} images")
    arm, tracker = SerialArm(read_arm()), Tracker([camera, camera], result.body)
    before = arm.world_from_hand(arm.state().positions)
    pairs = [[view.image(), other.image()] for view, other in zip(left[:40], right, strict=False)]
    stream = zip(arm.state().time_s + times_s, pairs, strict=True)
    cameras = [one.world_from_camera for one in pair]
    servo(arm, tracker, cameras, result.body.world_from_object, stream)
    after = arm.world_from_hand(arm.state().positions)
    moved_mm = 1e3 * np.linalg.norm(np.subtract(after.translation, before.translation))
    print(f"the hand moved {moved_mm:.0f} mm with the object")


if __name__ == "__main__":
    try:
        main(sys.argv[1] if len(sys.argv) > 1 else "out/moving")
    except ServoidError as error:  # says what to do
        sys.exit(f"error: {error}")
