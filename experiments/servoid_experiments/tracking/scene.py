"""Renders a scene: two fixed eyes, an object that moves along a curve, and a room behind it."""

import math
from functools import lru_cache
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from servoid.camera import Lens
from servoid.pose import Pose, looking
from servoid.pose.exact import Floats
from servoid.sim.world.cameras.camera_simulator import make_lens
from servoid.sim.world.cameras.renderer import Image
from servoid.sim.world.events.motions import STILL, compose, pose_of, row_of
from servoid.sim.world.events.paths import Random
from servoid.sim.world.objects import make_object
from servoid.sim.world.scene.room import make_room
from servoid.sim.world.scene.visuals import BOARD, OBJECT, Box, Finish, Visual
from servoid.sim.world.settings import BEFORE_HAND, CameraSettings, LightSettings
from servoid_experiments.design import NotNegative, Positive
from servoid_experiments.stage import EyeMode, Stage, pinhole

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Images = tuple[Image, ...]

RATE_HZ = 30.0
_EYES = (-0.89, 0.0, 0.5)  # the midpoint between them, at the start of the paper's hand
AWAY = BEFORE_HAND[2]  # metres before them, at the middle of the object's path
_BOARD = Box((0.3, 0.3, 0.002))
_CARD = Finish(color=(0.45, 0.36, 0.27))
_CLEAR = 0.01  # metres between the board and what it hides
_BESIDE = 0.05  # metres by which it exceeds an object that it hides completely
_OUT_OF_SIGHT = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -50.0)
_ROOMS = 2  # kept in memory, some 60 MB each
_REACH = 0.05  # of the object's path, metres along each axis
_PERIOD_S = 6.0
_BEGIN_S = 2.0  # after which the path's own start has ended
_STEP_S = 0.02
_SOFT = 6  # images over which the motion is faded in


class Scene(Struct, frozen=True, kw_only=True):
    """A sequence of images of a moving object before two fixed eyes.

    `way_mm` is the distance that the object's middle moves from one image to the next. `light` is
    the factor by which the light changes halfway. `hidden` is the share of the object that a board
    in front of it hides for a while.
    """

    object: str
    way_mm: Positive
    noise: NotNegative
    light: Positive
    hidden: Share
    baseline_mm: Positive
    eyes: EyeMode
    images: Annotated[int, Meta(ge=12)]
    size_px: tuple[int, int]
    seed: Annotated[int, Meta(ge=0)]


@lru_cache(maxsize=2)
def shoot(scene: Scene) -> tuple["SetUp", tuple[Images, ...]]:
    """Render all images of a scene; recent scenes are cached, for trials that share them.

    Raises:
        SimError: there is no such object.

    """
    set_up = SetUp(scene)
    return set_up, tuple(set_up.images(index) for index in range(scene.images))


def eyes_of(scene: Scene) -> tuple[Pose, ...]:
    """Return the poses of both eyes in the world, the left one first."""
    head = _head()
    eyes = []
    for side in (-0.5, 0.5):
        shift = Pose.from_parts((side * 0.001 * scene.baseline_mm, 0.0, 0.0), STILL[:4])
        eye = head @ shift
        if scene.eyes is EyeMode.VERGED:
            eye = looking(eye.translation, _rest().translation)
        eyes.append(eye)
    return tuple(eyes)


def is_hidden(scene: Scene, index: int) -> bool:
    """Return whether the board is before the object, as in the third quarter of a scene."""
    return scene.hidden > 0.0 and scene.images // 2 <= index < last_quarter(scene.images)


def last_quarter(images: int) -> int:
    """Return the index of the first image of a scene's last quarter."""
    return 3 * images // 4


class SetUp:
    """The objects of a scene, and their poses in each image."""

    def __init__(self, scene: Scene, own: tuple[Visual, ...] | None = None) -> None:
        """Set up a scene; `own` are the parts of its object, if it is not one of the world's.

        Raises:
            SimError: there is no such object.

        """
        self.scene = scene
        self._lens = make_lens(CameraSettings(size_px=scene.size_px))
        self.camera = pinhole(self._lens)
        self.eyes = eyes_of(scene)
        ways = rest_from_objects(scene.seed, 0.001 * scene.way_mm, scene.images)
        self.world_from_objects = tuple(_rest() @ one for one in ways)
        own = make_object(scene.object) if own is None else own
        seen = _seen_room(scene.seed, self._lens, self.eyes)
        self._stage = Stage((*own, Visual(_BOARD, _CARD, BOARD), *seen))
        self._alone = Stage(own)

    def images(self, index: int) -> Images:
        """Render what both eyes see at one instant."""
        scene, halfway = self.scene, index >= self.scene.images // 2
        return tuple(
            self._stage.image(
                self._lens,
                eye,
                self._places(index),
                toward=LightSettings().toward,
                level=scene.light if halfway else 1.0,
                samples=1,
                noise=scene.noise,
                seed=(scene.seed * scene.images + index) * len(self.eyes) + side,
            )
            for side, eye in enumerate(self.eyes)
        )

    def masks(self, index: int) -> tuple[NDArray[np.uint8], ...]:
        """Return the object's masks at one instant, (H, W) uint8, 255 inside."""
        places = self._places(index)
        numbers = [self._stage.depth(self._lens, eye, places)[1] for eye in self.eyes]
        return tuple(map(self._stage.mask, numbers))

    def depths(self, index: int) -> tuple[NDArray[np.float32], ...]:
        """Return the eyes' depth images at one instant, (H, W) float32, metres, without noise."""
        places = self._places(index)
        return tuple(self._stage.depth(self._lens, eye, places)[0] for eye in self.eyes)

    def _places(self, index: int) -> Floats:
        """Return the poses (T, 7) of all objects in the world."""
        board = self._board(index) if is_hidden(self.scene, index) else np.array(_OUT_OF_SIGHT)
        return self._stage.places({OBJECT: row_of(self.world_from_objects[index]), BOARD: board})

    def _board(self, index: int) -> Floats:
        """Place the board's edge so that it hides the given share as seen from between the eyes."""
        places = compose(row_of(self.world_from_objects[index]), self._alone.carried)
        depths, numbers = self._alone.depth(self._lens, _head(), places)
        columns = np.cumsum((numbers >= 0).sum(axis=0))
        edge = int(np.searchsorted(columns, self.scene.hidden * columns[-1]))
        near = float(np.nanmin(depths)) - _CLEAR
        right = near * (edge + 0.5 - self._lens.center_px[0]) / self._lens.focal_px[0]
        if math.isclose(self.scene.hidden, 1.0):
            right += _BESIDE
        place = (right - _BOARD.half_size[0], 0.0, near)
        return row_of(_head() @ Pose.from_parts(place, STILL[:4]))


def _seen_room(seed: int, lens: Lens, eyes: tuple[Pose, ...]) -> tuple[Visual, ...]:
    """Return the visible part of a room: the rest costs time without effect."""
    room = _room(seed)
    seen = {int(one) for eye in eyes for one in np.unique(room.depth(lens, eye, room.carried)[1])}
    return tuple(one for number, one in enumerate(room.visuals) if number in seen)


@lru_cache(maxsize=_ROOMS)
def _room(seed: int) -> Stage:
    return Stage(make_room("cluttered", seed))


def _head() -> Pose:
    return looking(_EYES, (_EYES[0] - AWAY, *_EYES[1:]))


def _rest() -> Pose:
    """Return the frame in the world with the middle of the object's path at its origin."""
    return _head() @ pose_of((*STILL[:4], 0.0, 0.0, AWAY))


def rest_from_objects(seed: int, way: float, count: int) -> list[Pose]:
    """Return the object's pose in each image, in a frame in the middle of its path.

    Its middle moves `way` metres along the curve from one image to the next, less in the first few.
    """
    path = Random(seed, _REACH, _PERIOD_S)
    shares = np.minimum(np.arange(count) / _SOFT, 1.0)
    gone = way * np.cumsum(shares)
    return [path.start_from_object(time_s) for time_s in _times(path, gone)]


def _times(path: Random, gone: Floats) -> list[float]:
    """Return the times at which a path has covered distances (N,) along its curve."""
    times, lengths = [_BEGIN_S], [0.0]
    place = np.array(path.start_from_object(_BEGIN_S).translation)
    while lengths[-1] < gone[-1]:
        times.append(times[-1] + _STEP_S)
        after = np.array(path.start_from_object(times[-1]).translation)
        lengths.append(lengths[-1] + float(np.linalg.norm(after - place)))
        place = after
    return np.interp(gone, lengths, times).tolist()
