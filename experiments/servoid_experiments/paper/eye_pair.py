"""Images of the hand's eyes of an object in the simulated world, without a moving arm."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Camera, Lens, Pose, View
from servoid.servo.law.gaze import fixation
from servoid.sim.arm_file import read_arm
from servoid.sim.world import CameraSettings, LightSettings
from servoid.sim.world.cameras.camera_simulator import make_lens
from servoid.sim.world.events.motions import pose_of, row_of, unit_row
from servoid.sim.world.objects import make_object
from servoid.sim.world.scene.room import make_room
from servoid.sim.world.scene.visuals import OBJECT, Ellipsoid
from servoid_experiments.design import about
from servoid_experiments.stage import EyeMode, Stage, pinhole

Image = NDArray[np.uint8]
Triple = tuple[float, float, float]

_LIGHT_TURN, _LIGHT_LEVEL = 0.2, 0.15


class PairSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the stereo pairs are taken; the paper states none of it."""

    size_px: Annotated[tuple[int, int], about("width and height of an image; assumed")] = (640, 480)
    sight_deg: Annotated[float, about("over the width of an image; assumed", gt=0.0, lt=150.0)] = (
        50.0
    )
    samples: Annotated[int, about("rays along each side of a pixel; assumed", ge=1, le=8)] = 2
    noise: Annotated[float, about("standard deviation in grey levels; assumed", ge=0.0)] = 1.5
    background: Annotated[
        str, about("what stands behind the object, cluttered or plain; assumed")
    ] = "cluttered"
    clutter: Annotated[int, about("seed of what stands about", ge=0)] = 0


@dataclass(frozen=True)
class Moment:
    """The scene of a pair: an object's pose before the hand, the eyes' directions, and the light.

    `seed` is that of the noise.
    """

    object_name: str
    hand_from_object: Pose
    world_from_hand: Pose
    eyes: EyeMode
    seed: int
    level: float = 1.0
    toward: Triple = LightSettings().toward

    def lit(self, random: np.random.Generator) -> "Moment":
        """Return the same scene in another light."""
        x, y, z = np.array(self.toward) + random.uniform(-_LIGHT_TURN, _LIGHT_TURN, 3)
        level = 1.0 + random.uniform(-_LIGHT_LEVEL, _LIGHT_LEVEL)
        return replace(self, level=float(level), toward=(float(x), float(y), float(z)))


@dataclass(frozen=True, eq=False)
class EyePair:
    """A stereo pair, left and right: images (H, W, 3) uint8 RGB, true masks (H, W) uint8.

    `depths` are the true ones, (H, W) float32 in metres along z.
    """

    cameras: tuple[Camera, Camera]
    world_from_cameras: tuple[Pose, Pose]
    images: tuple[Image, Image]
    masks: tuple[Image, Image]
    depths: tuple[NDArray[np.float32], NDArray[np.float32]]
    world_from_object: Pose

    def views(self, masks: Sequence[Image]) -> list[View]:
        """Return both eyes' views with masks of the object."""
        eyes = zip(self.cameras, self.world_from_cameras, masks, strict=True)
        return [View(camera=one, world_from_camera=pose, mask=mask) for one, pose, mask in eyes]


def paper_hand() -> Pose:
    """Return `world_from_hand` at the paper's start, from the arm's file."""
    return pose_of(unit_row(read_arm().start.world_from_hand))


def see(settings: PairSettings, moment: Moment) -> EyePair:
    """Render the images of both eyes, on one thread.

    Raises:
        SimError: there is no such object or background.

    """
    lens = _lens(settings)
    stage = _stage(moment.object_name, settings.background, settings.clutter)
    world_from_object = moment.world_from_hand @ moment.hand_from_object
    places = stage.places({OBJECT: row_of(world_from_object)})
    middle = np.array(moment.hand_from_object.translation)
    eyes = world_from_eyes(moment.world_from_hand, middle, moment.eyes)
    images = [
        stage.image(
            lens,
            eye,
            places,
            toward=moment.toward,
            level=moment.level,
            samples=settings.samples,
            noise=settings.noise,
            seed=2 * moment.seed + number,
        )
        for number, eye in enumerate(eyes)
    ]
    (left_depth, left_own), (right_depth, right_own) = (
        stage.depth(lens, eye, places) for eye in eyes
    )
    return EyePair(
        cameras=(pinhole(lens), pinhole(lens)),
        world_from_cameras=eyes,
        images=(images[0], images[1]),
        masks=(stage.mask(left_own), stage.mask(right_own)),
        depths=(left_depth, right_depth),
        world_from_object=world_from_object,
    )


def world_from_eyes(
    world_from_hand: Pose, fixed_in_hand: NDArray[np.float64], mode: EyeMode
) -> tuple[Pose, Pose]:
    """Return the poses of the eyes' lenses, looking ahead, or both at a point (3,) in the hand."""
    half_baseline = read_arm().eyes.half_baseline
    tilt, left, right = (
        fixation(half_baseline, fixed_in_hand, np.zeros(3)).angles
        if mode is EyeMode.VERGED
        else np.zeros(3)
    )
    head = world_from_hand @ Pose.exp([0.0, 0.0, 0.0, -float(tilt), 0.0, 0.0])

    def eye(side: float, pan: float) -> Pose:
        place = Pose.from_parts([side * half_baseline, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])
        return head @ place @ Pose.exp([0.0, 0.0, 0.0, 0.0, float(pan), 0.0])

    return eye(-1.0, left), eye(1.0, right)


def true_body(object_name: str, world_from_object: Pose, radii: Triple | None = None) -> Body:
    """Return an object that consists of ellipsoids as a body, in the object's own frame.

    `radii` are those of the world's ellipsoid, if they are not its own.
    """
    parts = [one for one in make_object(object_name, radii) if isinstance(one.shape, Ellipsoid)]
    places = np.array([unit_row(visual.carrier_from_visual) for visual in parts])
    sizes = [visual.shape.radii for visual in parts if isinstance(visual.shape, Ellipsoid)]
    return Body(
        world_from_object=world_from_object,
        centers=np.ascontiguousarray(places[:, 4:]),
        radii=np.array(sizes, float),
        rotations=np.ascontiguousarray(places[:, :4]),
    )


@lru_cache(maxsize=4)
def _stage(name: str, background: str, clutter: int) -> Stage:
    return Stage((*make_object(name), *make_room(background, clutter)))


def _lens(settings: PairSettings) -> Lens:
    width, _ = settings.size_px
    focal = 0.5 * width / np.tan(np.radians(0.5 * settings.sight_deg))
    return make_lens(CameraSettings(size_px=settings.size_px, focal_px=float(focal)))
