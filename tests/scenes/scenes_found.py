"""Objects that are found or placed in drawn images, and how far off that is."""

from functools import cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scene_table import Figures, scene

from conftest import write_png
from servoid._native import Camera, OneStepSettings, OneStepTracker, View
from servoid.pose import Pose
from servoid.segment import BackgroundTarget, BoxTarget, ClickTarget, find_object
from servoid.shape import Body
from servoid.track import pose_from_masks

Mask = NDArray[np.uint8]


def drawn(seed: int = 0) -> tuple[NDArray[np.uint8], Mask, NDArray[np.uint8]]:
    """Draw a two-coloured object with a hole on a cloudy floor; also its mask, and the floor."""
    image, mask, floor = _drawn(seed)
    return image.copy(), mask.copy(), floor.copy()


@cache
def _drawn(seed: int) -> tuple[NDArray[np.uint8], Mask, NDArray[np.uint8]]:
    random = np.random.default_rng(seed)
    floor = cv2.GaussianBlur(random.normal(size=(240, 320, 3)), (0, 0), 12.0) * 300.0
    floor = np.clip(floor + np.array([95, 110, 120]), 0, 255)
    mask = np.zeros((240, 320), np.uint8)
    cv2.ellipse(mask, (170, 115), (70, 45), 25.0, 0.0, 360.0, (255,), -1)
    cv2.rectangle(mask, (100, 100), (150, 190), (255,), -1)
    image = floor.copy()
    image[mask > 0] = (205, 60, 40)
    image[150:190, 100:151][mask[150:190, 100:151] > 0] = (230, 190, 60)
    noise = random.normal(scale=3.0, size=(2, *image.shape))
    pictures = [
        np.clip(np.rint(picture + part), 0, 255).astype(np.uint8)
        for picture, part in zip((image, floor), noise, strict=True)
    ]
    return pictures[0], mask, pictures[1]


def iou(one: Mask, other: Mask) -> float:
    return float(((one > 0) & (other > 0)).sum() / ((one > 0) | (other > 0)).sum())


def box_around(mask: Mask, slack: float = 0.05, view: str | None = None) -> BoxTarget:
    rows, columns = np.nonzero(mask)
    dv, du = slack * np.ptp(rows), slack * np.ptp(columns)
    return BoxTarget(columns.min() - du, rows.min() - dv, columns.max() + du, rows.max() + dv, view)


@scene("target drawn", {"missed by click": "1"})
def target_drawn(seed: int, _folder: Path) -> Figures:
    image, mask, _ = drawn(seed)
    return {"missed by click": 1.0 - iou(find_object(ClickTarget(160, 120), image), mask)}


@scene("target before background", {"missed": "1", "missed in less light": "1"})
def before_background(seed: int, folder: Path) -> Figures:
    image, mask, floor = drawn(seed)
    shadow = np.zeros(mask.shape, np.float32)
    cv2.ellipse(shadow, (200, 185), (90, 30), 0.0, 0.0, 360.0, (0.4,), -1)
    shadow = np.asarray(cv2.GaussianBlur(shadow, (0, 0), 8.0))
    shadow[mask > 0] = 0.0
    write_png(folder / "empty.png", floor)
    found = {}
    for name, light in (("missed", 1.0), ("missed in less light", 0.94)):
        shaded = np.rint(light * image * (1.0 - shadow[..., None])).astype(np.uint8)
        found[name] = 1.0 - iou(find_object(BackgroundTarget(folder / "empty.png"), shaded), mask)
    return found


CAMERA = Camera(size_px=(320, 240), focal_px=(400.0, 400.0), center_px=(159.5, 119.5))
EYES = (Pose.identity(), Pose.from_parts((0.12, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)))
COLORS = np.array([[200, 60, 40], [40, 160, 60], [50, 70, 200]], dtype=np.uint8)
Looks = tuple[list[View], list[NDArray[np.uint8]]]


def body_at(pose: Pose) -> Body:
    """Make a hand with a thumb: no turn of it looks like another from all sides."""
    return Body(
        world_from_object=pose,
        centers=np.array([[0.0, 0.0, 0.0], [0.06, 0.03, 0.0], [-0.05, 0.02, 0.03]]),
        radii=np.array([[0.06, 0.03, 0.02], [0.02, 0.045, 0.015], [0.02, 0.02, 0.03]]),
        rotations=np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)),
    )


def marked(body: Body, count: int = 2) -> Looks:
    """Draw masks of a body, and images of its ellipsoids, the nearest centre last."""
    views, images = [], []
    for eye in EYES[:count]:
        mask = body.silhouette(CAMERA, eye)
        image = np.full((*mask.shape, 3), 110, np.uint8)
        camera_from_object = eye.inverse() @ body.world_from_object
        for index in np.argsort(-camera_from_object.transform(body.centers)[:, 2]):
            part = Body(
                world_from_object=body.world_from_object,
                centers=body.centers[index : index + 1],
                radii=body.radii[index : index + 1],
                rotations=body.rotations[index : index + 1],
            )
            image[part.silhouette(CAMERA, eye) != 0] = COLORS[index]
        views.append(View(camera=CAMERA, world_from_camera=eye, mask=mask))
        images.append(image)
    return views, images


@scene("place in masks", {"missed": "1", "off": "mm", "turned": "deg"})
def placed(seed: int, _folder: Path) -> Figures:
    turn = np.random.default_rng(seed).normal(size=4)
    turn /= np.linalg.norm(turn)
    true = body_at(Pose.from_parts((0.05, -0.03, 0.6), turn.tolist()))
    views, images = marked(true)
    found, overlap = pose_from_masks(body_at(Pose.identity()), views, images, COLORS, seed)
    off = true.world_from_object.inverse() @ found
    return {
        "missed": 1.0 - overlap,
        "off": 1e3 * float(np.linalg.norm(off.translation)),
        "turned": float(np.degrees(np.linalg.norm(off.log()[3:]))),
    }


SMALL = Camera(size_px=(160, 120), focal_px=(150, 150), center_px=(80, 60))
TWO_EYES = [Pose.from_parts([x, 0, 0], [1, 0, 0, 0]) for x in (-0.08, 0.08)]
START = Pose.from_parts([0, 0, 0.5], [1, 0, 0, 0])


def egg(pose: Pose = START) -> Body:
    return Body(
        world_from_object=pose,
        centers=np.zeros((1, 3)),
        radii=np.array([[0.06, 0.04, 0.04]]),
        rotations=np.array([[1.0, 0, 0, 0]]),
    )


def pictures(pose: Pose) -> list[NDArray[np.uint8]]:
    """Draw the egg in green before grey, as both eyes see it."""
    masks = [egg(pose).silhouette(SMALL, eye) for eye in TWO_EYES]
    green, grey = np.array([40, 160, 70], np.uint8), np.array([130, 130, 130], np.uint8)
    return [np.where(mask[..., None] > 0, green, grey) for mask in masks]


def started(settings: OneStepSettings | None = None) -> OneStepTracker:
    tracker = OneStepTracker([SMALL, SMALL], egg(), settings)
    tracker.start(0.0, TWO_EYES, pictures(START), START)
    return tracker


@scene("one step", {"off": "mm", "not tracking": "images"})
def one_step(seed: int, _folder: Path) -> Figures:
    tracker, off, lost = started(OneStepSettings(turns=False, seed=seed)), [], 0
    for index in range(1, 40):
        x = 0.001 * index
        images = pictures(Pose.from_parts([x, 0, 0.5], [1, 0, 0, 0]))
        estimate = tracker.step(0.03 * index, TWO_EYES, images)
        lost += estimate.status != "tracking"
        off.append(abs(estimate.world_from_object.translation[0] - x))
        assert estimate.world_from_object.quaternion == (1, 0, 0, 0)
    return {"off": 1e3 * max(off), "not tracking": lost}
