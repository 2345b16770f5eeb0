"""Images of the hand's eyes of an object in the simulated world, without a moving arm."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from servoid._native import Body, Camera, Lens, Pose
from servoid.servo.law.gaze import fixation
from servoid.sim.arm_file import read_arm
from servoid.sim.world import CameraSettings, LightSettings
from servoid.sim.world.cameras.camera_simulator import make_lens
from servoid.sim.world.cameras.renderer import Raycaster, Shot
from servoid.sim.world.events.motions import compose, pose_of, row_of, unit_row
from servoid.sim.world.objects import make_object
from servoid.sim.world.scene.room import make_room
from servoid.sim.world.scene.visuals import OBJECT, Ellipsoid, Visual

Image = NDArray[np.uint8]
Triple = tuple[float, float, float]


class EyeMode(Enum):
    """Where the two eyes look."""

    VERGED = "verged"
    PARALLEL = "parallel"


class PairSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the stereo pairs are taken; the paper states none of it."""

    size_px: Annotated[
        tuple[int, int], Meta(description="width and height of an image; assumed")
    ] = (640, 480)
    sight_deg: Annotated[
        float, Meta(gt=0.0, lt=150.0, description="over the width of an image; assumed")
    ] = 50.0
    samples: Annotated[
        int, Meta(ge=1, le=8, description="rays along each side of a pixel; assumed")
    ] = 2
    noise: Annotated[
        float, Meta(ge=0.0, description="standard deviation in grey levels; assumed")
    ] = 1.5
    background: Annotated[
        str, Meta(description="what stands behind the object, cluttered or plain; assumed")
    ] = "cluttered"
    clutter: Annotated[int, Meta(ge=0, description="seed of what stands about")] = 0


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


def paper_hand() -> Pose:
    """Return `world_from_hand` at the paper's start, from the arm's file."""
    return pose_of(unit_row(read_arm().start.world_from_hand))


def see(settings: PairSettings, moment: Moment) -> EyePair:
    """Render the images of both eyes, on one thread.

    Raises:
        SimError: there is no such object or background.

    """
    lens = _lens(settings)
    visuals, renderer = _stage(moment.object_name, settings.background, settings.clutter)
    world_from_object = moment.world_from_hand @ moment.hand_from_object
    rows = _rows(visuals, world_from_object)
    middle = np.array(moment.hand_from_object.translation)
    eyes = world_from_eyes(moment.world_from_hand, middle, moment.eyes)
    own = [index for index, visual in enumerate(visuals) if visual.carrier == OBJECT]
    images, masks, depths = [], [], []
    for number, eye in enumerate(eyes):
        shot = Shot(
            lens=lens,
            world_from_lens=row_of(eye)[None],
            world_from_visuals=rows[None],
            toward=moment.toward,
            level=moment.level,
            samples=settings.samples,
            noise=settings.noise,
            seed=2 * moment.seed + number,
            threads=1,
        )
        images.append(renderer.image(shot))
        depth, numbers = renderer.depth(lens, row_of(eye), rows)
        depths.append(depth)
        masks.append(np.where(np.isin(numbers, own), np.uint8(255), np.uint8(0)))
    camera = Camera(size_px=lens.size_px, focal_px=lens.focal_px, center_px=lens.center_px)
    return EyePair(
        cameras=(camera, camera),
        world_from_cameras=eyes,
        images=(images[0], images[1]),
        masks=(masks[0], masks[1]),
        depths=(depths[0], depths[1]),
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


def true_body(object_name: str, world_from_object: Pose) -> Body:
    """Return an object that consists of ellipsoids as a body, in the object's own frame."""
    parts = [visual for visual in make_object(object_name) if isinstance(visual.shape, Ellipsoid)]
    places = np.array([unit_row(visual.carrier_from_visual) for visual in parts])
    radii = [visual.shape.radii for visual in parts if isinstance(visual.shape, Ellipsoid)]
    return Body(
        world_from_object=world_from_object,
        centers=np.ascontiguousarray(places[:, 4:]),
        radii=np.array(radii),
        rotations=np.ascontiguousarray(places[:, :4]),
    )


@lru_cache(maxsize=4)
def _stage(name: str, background: str, clutter: int) -> tuple[tuple[Visual, ...], Raycaster]:
    visuals = (*make_object(name), *make_room(background, clutter))
    return visuals, Raycaster(visuals)


def _rows(visuals: Sequence[Visual], world_from_object: Pose) -> NDArray[np.float64]:
    carried = np.array([unit_row(visual.carrier_from_visual) for visual in visuals])
    still = row_of(Pose.identity())
    carriers = [row_of(world_from_object) if t.carrier == OBJECT else still for t in visuals]
    return compose(np.array(carriers), carried)


def _lens(settings: PairSettings) -> Lens:
    width, _ = settings.size_px
    focal = 0.5 * width / np.tan(np.radians(0.5 * settings.sight_deg))
    return make_lens(CameraSettings(size_px=settings.size_px, focal_px=float(focal)))
