"""The moving scene: a toy snail that moves before a stereo rig, or rests while the rig moves."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Pose
from servoid.sim.samples import motion, room, snail
from servoid.sim.samples.drawing import patterns
from servoid.sim.samples.drawing.convex import Floats, box
from servoid.sim.samples.drawing.layers import Drawable, Layer, Pinhole, see

SIZES_PX = {"small": (320, 240), "full": (640, 480)}
BASELINE = 0.1

_FOCAL_OF_WIDTH = 580.0 / 640.0
_SUBPIXELS = {"small": 3, "full": 2}
_LENS_BLUR_PX = 0.45
_SENSOR_NOISE = 1.4  # standard deviation in grey levels
_EXPOSURE = 1.0
_GRAY_WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """What a moving recording shows; the same scenario gives the same bits.

    `size` is small (320 x 240) or full (640 x 480); `turn`: the toy is turned all around and back,
    in `WHOLE_TURN` images; `occluder`: something passes over a third of the
    toy; `hand`: the rig moves and the toy rests; `grey`: images without colour; `plain`: a toy
    without any pattern; `one_camera`: the left one only.
    """

    count: int = 120
    size: str = "full"
    seed: int = 0
    turn: bool = False
    occluder: bool = False
    hand: bool = False
    grey: bool = False
    plain: bool = False
    one_camera: bool = False

    def __post_init__(self) -> None:
        if self.count < 1:
            raise ValueError(f"a recording needs 1 observation or more, not {self.count}")
        if self.size not in SIZES_PX:
            raise ValueError(f"unknown size '{self.size}'; choose one of {', '.join(SIZES_PX)}")
        if self.seed < 0:
            raise ValueError(f"{self.seed} is no seed; choose 0 or more")
        if self.turn and self.hand:
            raise ValueError("the toy rests where a hand moves the rig; leave turn or hand out")


@dataclass(frozen=True, eq=False)
class Look:
    """One observation: an image (H, W, 3) or (H, W) uint8 of each camera, RGB, and what is true.

    `mask` (H, W) uint8 is 255 where the left camera sees the toy, and `hidden` is the share of the
    toy that the occluder takes from it.
    """

    images: tuple[NDArray[np.uint8], ...]
    mask: NDArray[np.uint8]
    hidden: float


class MovingScene:
    """A scenario that can be looked at, observation by observation, in any order."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        width, height = SIZES_PX[scenario.size]
        center_px = ((width - 1) / 2.0, (height - 1) / 2.0)
        subpixels = _SUBPIXELS[scenario.size]
        self.camera: Pinhole = Pinhole(
            (width, height), _FOCAL_OF_WIDTH * width, center_px, subpixels
        )
        self.offsets: tuple[float, ...] = (0.0,) if scenario.one_camera else (0.0, BASELINE)
        self.toy: Drawable = Drawable(
            snail.PARTS, snail.paint_plain if scenario.plain else snail.paint, 0.12
        )

    def __len__(self) -> int:
        return self.scenario.count

    def time_s(self, index: int) -> float:
        """Return when an observation is, in seconds."""
        return index / motion.RATE_HZ

    def room_from_rig(self, index: int) -> Floats:
        """Return the pose (4, 4) of the rig, which is that of the left camera, in the room."""
        if self.scenario.hand:
            return motion.hand_rig(index, self.scenario.seed)
        return motion.resting_rig()

    def room_from_object(self, index: int) -> Floats:
        """Return the pose (4, 4) of the toy in the room."""
        moved = motion.turning_pose if self.scenario.turn else motion.toy_pose
        return moved(0 if self.scenario.hand else index, self.scenario.seed)

    def left_from_object(self, index: int) -> Floats:
        """Return the true pose (4, 4) of the toy in the left camera."""
        return Pose(self.room_from_rig(index)).inverse().matrix() @ self.room_from_object(index)

    def look(self, index: int) -> Look:
        """Take the images of one observation."""
        images, mask, hidden = [], np.zeros((0, 0), np.uint8), 0.0
        for number, room_from_camera in enumerate(self.room_from_cameras(index)):
            toy = self._see(self.toy, self.room_from_object(index), room_from_camera)
            light = toy.over(self._behind(number, room_from_camera))
            before = np.zeros_like(toy.cover)
            if self.scenario.occluder:
                passing = self._see(_OCCLUDER, self._passing_pose(index), room_from_camera)
                light, before = passing.over(light), passing.cover
            images.append(self._develop(light, [self.scenario.seed, index, number]))
            if number == 0:
                seen = toy.cover * (1.0 - before)
                mask = np.where(seen >= 0.5, np.uint8(255), np.uint8(0))
                hidden = 1.0 - float(seen.sum() / max(toy.cover.sum(), 1.0))
        return Look(tuple(images), mask, hidden)

    def room_from_cameras(self, index: int) -> list[Floats]:
        """Return the poses room_from_camera (4, 4) of all cameras."""
        poses = []
        for offset in self.offsets:
            pose = self.room_from_rig(index).copy()
            pose[:3, 3] += offset * pose[:3, 0]
            poses.append(pose)
        return poses

    def _passing_pose(self, index: int) -> Floats:
        return motion.passing_pose(
            index, len(self), self.room_from_rig(index), self.room_from_object(index)
        )

    def _behind(self, number: int, room_from_camera: Floats) -> Floats:
        """Return the light (H, W, 3) of the room alone."""
        scenario = self.scenario
        if scenario.hand:
            return _see_room(scenario, self.camera, room_from_camera)
        return _resting_room(scenario.seed, scenario.size, self.offsets[number])

    def _see(
        self, drawable: Drawable, room_from_drawable: Floats, room_from_camera: Floats
    ) -> Layer:
        drawable_from_room = Pose(room_from_drawable).inverse().matrix()
        pose = drawable_from_room @ room_from_camera
        return see(drawable, self.camera, pose, room.LAMP.within(drawable_from_room))

    def _develop(self, light: Floats, seed: list[int]) -> NDArray[np.uint8]:
        """Turn linear light (H, W, 3) into 8 bits: lens, tone curve, sensor noise."""
        import cv2  # slow to import, and help texts do not need it

        blurred = cv2.GaussianBlur(light, (0, 0), _LENS_BLUR_PX)
        if self.scenario.grey:
            blurred = blurred @ _GRAY_WEIGHTS
        levels = 255.0 * np.clip(_EXPOSURE * blurred, 0.0, 1.0) ** (1 / 2.2)
        levels += np.random.default_rng(seed).normal(0.0, _SENSOR_NOISE, levels.shape)
        return np.clip(np.rint(levels), 0, 255).astype(np.uint8)


def _see_room(scenario: Scenario, camera: Pinhole, room_from_camera: Floats) -> Floats:
    # What is far off and large needs no more than two by two rays a pixel.
    coarse = replace(camera, subpixels=2)
    return see(room.furnish(scenario.seed), coarse, room_from_camera, room.LAMP).light


@lru_cache(maxsize=4)
def _resting_room(seed: int, size: str, offset: float) -> Floats:
    """Return what a rig at rest sees of the room, which costs more than all else in an image."""
    scenario = Scenario(seed=seed, size=size)
    scene = MovingScene(scenario)
    pose = scene.room_from_cameras(0)[scene.offsets.index(offset)]
    light = _see_room(scenario, scene.camera, pose)
    light.setflags(write=False)
    return light


def _paint_ruler(points: Floats, part: int) -> Floats:
    """Return the linear colours (3, N) of a wooden ruler with ticks and figures."""
    del part
    painted = patterns.mottle(
        patterns.plain(snail.KRAFT, points.shape[1]), points, 0.01, 0.3, seed=41
    )
    edge = patterns.covered(points[0] - 0.008)
    painted = patterns.coat(painted, edge * patterns.stripes(points[2], 0.01, 0.2), snail.DARK)
    ink = patterns.print_lines(points[2], points[0], 0.003, seed=43)
    line = patterns.covered(0.0075 - np.abs(points[0] + 0.003))
    return patterns.coat(painted, line * ink, snail.DARK)


_OCCLUDER = Drawable((box((0.0, 0.0, 0.0), (0.0165, 0.002, 0.5)),), _paint_ruler)
