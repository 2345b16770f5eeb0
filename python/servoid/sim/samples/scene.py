"""The scene of the moving sample: a toy snail and a stereo rig, one of which moves."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Lens
from servoid.brief import brief
from servoid.pose import Floats, Pose
from servoid.sim.samples import motion, room, snail
from servoid.sim.samples.drawing import patterns
from servoid.sim.samples.drawing.convex import box
from servoid.sim.samples.drawing.painting import painted
from servoid.sim.samples.drawing.stage import Stage
from servoid.sim.world.scene.visuals import BOARD, OBJECT, Visual

SIZES_PX = {"small": (320, 240), "full": (640, 480)}
BASELINE = 0.1

_FOCAL_OF_WIDTH = 580.0 / 640.0
_SAMPLES = {"small": 3, "full": 2}  # rays along a pixel's side
_SENSOR_NOISE = 1.4  # standard deviation in grey levels
_GRAY_WEIGHTS = np.array([0.2126, 0.7152, 0.0722])
_RULER_TEXEL = 4e-4  # metres
_AWAY = np.eye(4) - 100.0 * np.eye(4, k=3)  # metres: out of sight


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """The options of a moving recording; the same scenario gives the same bits.

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
            raise ValueError(f"{self.seed} is not a seed; choose 0 or more")
        if self.turn and self.hand:
            raise ValueError("the toy rests where a hand moves the rig; leave turn or hand out")


@dataclass(frozen=True, eq=False)
class Look:
    """One observation: an image (H, W, 3) or (H, W) uint8 of each camera, RGB, and ground truth.

    `mask` (H, W) uint8 is 255 where the left camera sees the toy; `hidden` is the occluded share
    of the toy.
    """

    images: tuple[NDArray[np.uint8], ...]
    mask: NDArray[np.uint8]
    hidden: float

    __repr__ = brief


class MovingScene:
    """Renders the observations of a scenario, in any order."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        width, height = SIZES_PX[scenario.size]
        center_px = ((width - 1) / 2.0, (height - 1) / 2.0)
        focal_px = (_FOCAL_OF_WIDTH * width, _FOCAL_OF_WIDTH * width)
        self.camera: Camera = Camera(
            size_px=(width, height), focal_px=focal_px, center_px=center_px
        )
        self.offsets: tuple[float, ...] = (0.0,) if scenario.one_camera else (0.0, BASELINE)
        self._lens = Lens(
            model="pinhole", size_px=(width, height), focal_px=focal_px, center_px=center_px
        )

    def __len__(self) -> int:
        return self.scenario.count

    def time_s(self, index: int) -> float:
        """Return the time of an observation, in seconds."""
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
        """Render the images of one observation."""
        poses = {OBJECT: self.room_from_object(index)}
        if self.scenario.occluder:
            poses[BOARD] = self._passing_pose(index)
        cameras = self.room_from_cameras(index)
        images = [
            self._image(pose, poses, seed=(self.scenario.seed, index, number))
            for number, pose in enumerate(cameras)
        ]
        seen = self._stage.shows(OBJECT, self._lens, cameras[0], poses)
        hidden = 0.0
        if self.scenario.occluder:
            free = self._stage.shows(OBJECT, self._lens, cameras[0], {**poses, BOARD: _AWAY})
            hidden = 1.0 - float(np.count_nonzero(seen) / max(np.count_nonzero(free), 1))
        return Look(tuple(images), np.where(seen, np.uint8(255), np.uint8(0)), hidden)

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

    @cached_property
    def _stage(self) -> Stage:
        scenario = self.scenario
        visuals = [*room.furnish(scenario.seed), *snail.visuals(plain=scenario.plain)]
        if scenario.occluder:
            visuals += _ruler()
        return Stage(visuals, room.TOWARD_LAMP, room.LEVEL)

    def _image(
        self, room_from_camera: Floats, poses: dict[str, Floats], *, seed: tuple[int, int, int]
    ) -> NDArray[np.uint8]:
        """Render an image (H, W, 3), or (H, W) in grey, with the sensor's noise."""
        # Grey values are sums of three colours, whose noise is smaller.
        grey = self.scenario.grey
        image = self._stage.image(
            self._lens,
            room_from_camera,
            poses,
            samples=_SAMPLES[self.scenario.size],
            noise=_SENSOR_NOISE / float(np.linalg.norm(_GRAY_WEIGHTS)) if grey else _SENSOR_NOISE,
            seed=int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0]),
        )
        return np.rint(image @ _GRAY_WEIGHTS).astype(np.uint8) if grey else image


def _ruler() -> list[Visual]:
    """Return the wooden ruler that occludes the toy."""
    solid = box((0.0, 0.0, 0.0), (0.0165, 0.002, 0.5))
    return painted(solid, _paint_ruler, texel=_RULER_TEXEL, carrier=BOARD)


def _paint_ruler(points: Floats) -> Floats:
    """Return the linear colours (3, N) of a wooden ruler with ticks and figures."""
    wood = patterns.mottle(patterns.plain(snail.KRAFT, points.shape[1]), points, 0.01, 0.3, seed=41)
    edge = patterns.covered(points[0] - 0.008)
    ticked = patterns.coat(wood, edge * patterns.stripes(points[2], 0.01, 0.2), snail.DARK)
    ink = patterns.print_lines(points[2], points[0], 0.003, seed=43)
    line = patterns.covered(0.0075 - np.abs(points[0] + 0.003))
    return patterns.coat(ticked, line * ink, snail.DARK)
