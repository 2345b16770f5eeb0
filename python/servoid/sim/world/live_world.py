"""A simulated world as a live device, whose images are rendered in real time."""

import time

import numpy as np

from servoid.camera import pinhole_lens
from servoid.sim.world.settings import CameraSettings, ObjectSettings, WorldSettings
from servoid.sim.world.world import World
from servoid.source import Delivery, Instant, LiveCamera

_SIZE_PX = (320, 240)
_PATH = "circle:0.06@8s"


def open_world(text: str) -> tuple[LiveCamera, ...]:
    """Return the cameras at rest of a world without errors, whose time starts now.

    `text` is OBJECT or OBJECT:PATH, the names of `servoid servo --object` and `--path`.

    Raises:
        SimError: there is no such object or path.
        MissingExtraError: MuJoCo is not installed.

    """
    name, _, path = text.partition(":")
    world = World(
        WorldSettings(
            object=ObjectSettings(name=name, path=path or _PATH),
            cameras=CameraSettings(size_px=_SIZE_PX, moments=1),
            ideal=True,
            threads=1,
        )
    )
    video = WorldVideo(world)
    return tuple(
        LiveCamera(name, video, pinhole_lens(camera), pose)
        for name, camera, pose in zip(
            world.camera_names, world.cameras, video.first.world_from_camera, strict=True
        )
    )


class WorldVideo:
    """The cameras of a world as one device, with stamps of the world's clock.

    Images arrive at the world's rate, or as fast as they can be rendered; late ones are dropped.
    Arm and cameras are at rest. `first` is the first observation.
    """

    def __init__(self, world: World) -> None:
        """Start to synchronise the world's time with wall-clock time."""
        self._world, self._at_rest = world, np.zeros(len(world.arm.state().positions))
        world.start_path()
        self._began_s = time.monotonic() - world.time_s
        self.first: Instant = self._next()
        self._newest: Instant = self.first
        self._began_s = time.monotonic() - world.time_s  # rendering the first image is slow

    def grab(self) -> bool:
        """Wait until an image is due, and render it."""
        self._newest = self._next()
        return True

    def retrieve(self) -> tuple[bool, Delivery]:
        """Return the last rendered images, in BGR order."""
        images = tuple(None if one is None else one[..., ::-1] for one in self._newest.images)
        return True, Delivery(images, self._newest.time_s)

    def release(self) -> None:
        """Do nothing, as nothing is open."""

    def _next(self) -> Instant:
        while True:
            self._world.arm.command(self._at_rest)
            ahead_s = self._world.time_s - (time.monotonic() - self._began_s)
            if ahead_s < -self._world.arm.period_s:
                continue  # if late, skip the images in between
            time.sleep(max(0.0, ahead_s))
            instant = self._world.source.newest()
            if instant is not None:
                return instant
