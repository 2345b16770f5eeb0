"""Places a known body in the masks of one observation: where it must be to look like that."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Camera, Pose
from servoid.errors import TrackError

_SIDE_PX = 160  # images are looked at no larger
_TURNS = 800  # tried at first, evenly spread
_KEPT = 24  # of these, that are made better
_APART = 0.35  # rad between those that are kept
_TRIES = 16  # motions of one reach
_FAR = np.geomspace(0.3, 0.03, 12)  # reaches in rad, and in shares of the body's size
_CLOSE = np.geomspace(0.1, 0.003, 50)
_ALIKE = 0.05  # outlines that differ by less may be told apart by colours
_COLOR_SPREAD = 60.0  # of a colour under other light
_LEAST_IOU = 0.5


@dataclass(frozen=True, eq=False)
class Marked:
    """One image in which the object is marked.

    `mask` is (H, W) uint8, non-zero on the object; `image` (H, W) or (H, W, 3) uint8.
    """

    camera: Camera
    world_from_camera: Pose
    mask: NDArray[np.uint8]
    image: NDArray[np.uint8]


@dataclass(frozen=True)
class Placement:
    """A pose, and how well the outlines there agree with the masks: intersection over union."""

    world_from_object: Pose
    iou: float


def place_body(
    body: Body,
    marked: Sequence[Marked],
    colors: NDArray[np.uint8] | None = None,
    seed: int = 0,
) -> Placement:
    """Find where a body must be for its outlines to agree with masks.

    Turns that outlines alone do not tell apart are told apart by `colors`, (K, 3) uint8 RGB of the
    ellipsoids, if they are known. The same seed gives the same answer.

    Raises:
        TrackError: there is no mask, or the body fits none of its places.

    """
    views = [_small(one) for one in marked if one.mask.any()]
    if not views:
        raise TrackError("a body is placed in masks, and there is none; give a target or a start")
    random = np.random.default_rng(seed)
    main = max(views, key=lambda view: int((view.mask != 0).sum()))
    turns = random.normal(size=(_TURNS, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    tried = [_scored(body, _centred(body, turn, main), views) for turn in turns]
    better = [_climb(body, one, views, (random, _FAR)) for one in _best_apart(tried)]
    best = max(one.iou for one in better)
    if best < _LEAST_IOU:
        raise TrackError(
            f"the body does not fit the mask: their intersection over union is {best:.2f} at best; "
            "check that it is the body of this object, in metres, or give a start"
        )
    alike = [one for one in better if one.iou > best - _ALIKE]
    chosen = max(alike, key=lambda one: one.iou + _agreement(body, one, views, colors))
    return _climb(body, chosen, views, (random, _CLOSE))


def _small(one: Marked) -> Marked:
    """Return an image and its camera, made smaller."""
    import cv2

    width, height = one.camera.size_px
    step = max(1, -(-max(width, height) // _SIDE_PX))
    size = (max(1, width // step), max(1, height // step))
    # Pixel (0, 0) of the small image is the middle of the first step x step pixels.
    moved, center_px = (step - 1) / 2.0, one.camera.center_px
    camera = Camera(
        size_px=size,
        focal_px=(one.camera.focal_px[0] / step, one.camera.focal_px[1] / step),
        center_px=((center_px[0] - moved) / step, (center_px[1] - moved) / step),
    )
    whole = np.s_[: size[1] * step, : size[0] * step]
    share = cv2.resize((one.mask[whole] != 0) * np.float32(1), size, interpolation=cv2.INTER_AREA)
    image = cv2.resize(one.image[whole], size, interpolation=cv2.INTER_AREA)
    return replace(
        one,
        camera=camera,
        mask=np.asarray(share >= 0.5, dtype=np.uint8),
        image=np.asarray(image, dtype=np.uint8),
    )


def _placed(body: Body, pose: Pose) -> Body:
    return Body(
        world_from_object=pose, centers=body.centers, radii=body.radii, rotations=body.rotations
    )


def _centred(body: Body, turn: NDArray[np.float64], view: Marked) -> Pose:
    """Return the pose with this turn at which the outline lies on the mask and is as large."""
    rows, columns = np.nonzero(view.mask)
    wanted, area = np.array([columns.mean(), rows.mean()]), float(len(rows))
    focal, center = np.array(view.camera.focal_px), np.array(view.camera.center_px)
    volume = 4.0 / 3.0 * np.pi * float(body.radii.prod(axis=1).max())
    distance = float(focal.mean()) * volume ** (1.0 / 3.0) / np.sqrt(area)
    at_px = wanted.copy()
    pose = Pose.identity()
    for _ in range(4):
        ray = np.array([*((at_px - center) / focal), 1.0])
        pose = view.world_from_camera @ Pose.from_parts((distance * ray).tolist(), turn.tolist())
        seen = np.nonzero(_placed(body, pose).silhouette(view.camera, view.world_from_camera))
        if not len(seen[0]):
            break
        at_px = at_px + wanted - (seen[1].mean(), seen[0].mean())
        distance *= float(np.clip(np.sqrt(len(seen[0]) / area), 0.5, 2.0))
    return pose


def _scored(body: Body, pose: Pose, views: Sequence[Marked]) -> Placement:
    placed = _placed(body, pose)
    ious = []
    for view in views:
        seen = placed.silhouette(view.camera, view.world_from_camera) != 0
        mask = view.mask != 0
        ious.append(float((seen & mask).sum() / max(1, (seen | mask).sum())))
    return Placement(pose, float(np.mean(ious)))


def _best_apart(tried: Sequence[Placement]) -> list[Placement]:
    """Return the best placements, each turned otherwise than those that are better."""
    kept: list[Placement] = []
    for one in sorted(tried, key=lambda one: -one.iou):
        quaternion = np.array(one.world_from_object.quaternion)
        others = [np.array(other.world_from_object.quaternion) for other in kept]
        if all(2.0 * np.arccos(min(1.0, abs(other @ quaternion))) > _APART for other in others):
            kept.append(one)
        if len(kept) == _KEPT:
            break
    return kept


def _climb(
    body: Body,
    start: Placement,
    views: Sequence[Marked],
    way: tuple[np.random.Generator, NDArray[np.float64]],
) -> Placement:
    """Make a placement better by motions of these reaches, one after the other."""
    random, reaches = way
    size = float((np.linalg.norm(body.centers, axis=1) + body.radii.max(axis=1)).max())
    best = start
    for reach in reaches:
        motions = random.normal(size=(_TRIES, 6)) * reach * np.array([size] * 3 + [1.0] * 3)
        poses = [best.world_from_object @ Pose.exp(motion.tolist()) for motion in motions]
        best = max([best, *(_scored(body, pose, views) for pose in poses)], key=lambda one: one.iou)
    return best


def _agreement(
    body: Body, one: Placement, views: Sequence[Marked], colors: NDArray[np.uint8] | None
) -> float:
    """Return how well the colours of the ellipsoids agree with the images, 0 to 1."""
    if colors is None or len(colors) != len(body):
        return 0.0
    found = []
    for view in views:
        if view.image.ndim == 2:
            continue
        painted, known = _painted(body, one.world_from_object, view, colors)
        away = np.linalg.norm(painted - view.image.astype(np.float64), axis=2)
        found.append(float(np.exp(-0.5 * np.square(away[known] / _COLOR_SPREAD)).mean()))
    return float(np.mean(found)) if found else 0.0


def _painted(
    body: Body, pose: Pose, view: Marked, colors: NDArray[np.uint8]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Paint the ellipsoids in their colours, the one with the nearest centre last."""
    camera_from_object = view.world_from_camera.inverse() @ pose
    depths = camera_from_object.transform(np.ascontiguousarray(body.centers))[:, 2]
    painted = np.zeros((*view.mask.shape, 3))
    known = np.zeros(view.mask.shape, dtype=np.bool_)
    for index in np.argsort(-depths):
        part = Body(
            world_from_object=pose,
            centers=body.centers[index : index + 1],
            radii=body.radii[index : index + 1],
            rotations=body.rotations[index : index + 1],
        )
        seen = part.silhouette(view.camera, view.world_from_camera) != 0
        painted[seen] = colors[index]
        known |= seen
    return painted, known & (view.mask != 0)
