"""The cameras of a world: they expose on their own clock, and images arrive later."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from servoid._native import Camera, Lens
from servoid.observe import Instant, undistortion
from servoid.pose import exact
from servoid.sim.world.course import Course
from servoid.sim.world.drives import Drives
from servoid.sim.world.faults import DropImages, FreezeCamera, concerns, is_on
from servoid.sim.world.kinematics import Kinematics
from servoid.sim.world.layout import Layout
from servoid.sim.world.motions import Floats, row_of
from servoid.sim.world.settings import CameraSettings, WorldSettings
from servoid.sim.world.stages import Drawer, Image, Shot

NAMES = ("left", "right")
_SIGHT_DEG = 50.0  # over the width of an image
_CLOSE_S = 1e-9
_NOISE_STRIDE = 1_000_003  # keeps the noise of worlds with other seeds apart
_SEEDS = 1 << 64  # that the core tells apart


@dataclass(frozen=True, eq=False)
class Exposure:
    """An image that was taken: where the joints were at its moments, (M,) and (M, N)."""

    index: int
    time_s: float
    arrives_s: float
    moments_s: Floats
    positions: Floats
    positions_at_time: Floats


@dataclass(frozen=True)
class Scene:
    """What the shutter looks at."""

    drives: Drives
    kinematics: Kinematics
    layout: Layout
    course: Course
    drawer: Drawer


class Shutter:
    """Implements `servoid.observe.Source`; an image is drawn only when it is handed out."""

    def __init__(self, settings: WorldSettings, scene: Scene) -> None:
        self._settings, self._scene = settings, scene
        self._lens = make_lens(settings.cameras)
        self._ideal = undistortion(self._lens)
        self._next = 0
        self._waiting: deque[Exposure] = deque()
        self._shown: list[Image | None] = [None, None]
        self.handed_out: Exposure | None = None

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the ideal pinhole cameras whose images are delivered."""
        return (self._ideal.camera,) * len(NAMES)

    def expose(self) -> None:
        """Take the images whose exposure is over by now."""
        cameras = self._settings.cameras
        while True:
            start = self._next / cameras.rate_hz
            end = start + cameras.exposure_s
            if end > self._scene.drives.time_s + _CLOSE_S:
                return
            shares = (np.arange(cameras.moments) + 0.5) / cameras.moments
            moments = start + shares * cameras.exposure_s
            middle = start + 0.5 * cameras.exposure_s
            at = self._scene.drives.positions_at
            exposure = Exposure(
                index=self._next,
                time_s=middle,
                arrives_s=max(middle + cameras.latency_s, end) + cameras.compute_s,
                moments_s=moments,
                positions=np.array([at(moment) for moment in moments]),
                positions_at_time=at(middle),
            )
            self._waiting.append(exposure)
            self._next += 1

    def newest(self) -> Instant | None:
        """Return the newest observation that has arrived and was not returned yet, else None."""
        found = None
        while self._waiting and self._waiting[0].arrives_s <= self._scene.drives.time_s + _CLOSE_S:
            exposure = self._waiting.popleft()
            if not all(self._drops(exposure, camera) for camera in range(len(NAMES))):
                found = exposure
        if found is None:
            return None
        self.handed_out = found
        lost = [self._drops(found, camera) for camera in range(len(NAMES))]
        images = [
            None if lost[camera] else self._image(found, camera) for camera in range(len(NAMES))
        ]
        return Instant(
            index=found.index,
            time_s=found.time_s,
            world_from_camera=self._scene.kinematics.world_from_eyes(found.positions_at_time),
            images=tuple(images),
            notices=tuple(
                f"camera {name}: its image was lost"
                for name, gone in zip(NAMES, lost, strict=True)
                if gone
            ),
            names=NAMES,
        )

    def _image(self, exposure: Exposure, camera: int) -> Image:
        """Draw an image, or return the last one where the camera is frozen."""
        kept = self._shown[camera]
        if kept is not None and self._is(FreezeCamera, exposure, camera):
            return kept.copy()
        scene, settings = self._scene, self._settings
        eyes = [scene.kinematics.world_from_eyes(row)[camera] for row in exposure.positions]
        pairs = list(zip(exposure.positions, exposure.moments_s, strict=True))
        things = [scene.layout.world_from_things(row, moment) for row, moment in pairs]
        shot = Shot(
            lens=self._lens,
            world_from_lens=np.array([row_of(eye) for eye in eyes]),
            world_from_things=np.array(things),
            toward=settings.light.toward,
            level=scene.course.level_at(exposure.time_s),
            samples=settings.cameras.samples,
            noise=settings.cameras.noise,
            seed=(settings.seed * _NOISE_STRIDE + len(NAMES) * exposure.index + camera) % _SEEDS,
            threads=settings.threads,
        )
        image = self._ideal.image(scene.drawer.image(shot))
        self._shown[camera] = image
        return image

    def _drops(self, exposure: Exposure, camera: int) -> bool:
        return self._is(DropImages, exposure, camera)

    def _is(
        self, kind: type[DropImages] | type[FreezeCamera], exposure: Exposure, camera: int
    ) -> bool:
        """Say if a fault of this kind concerns an exposure of a camera."""
        started = self._scene.course.path_starts_s
        return started is not None and any(
            isinstance(fault, kind)
            and concerns(fault, camera)
            and is_on(fault, exposure.time_s - started)
            for fault in self._settings.faults
        )


def make_lens(cameras: CameraSettings) -> Lens:
    """Return the lens of a world's cameras, its axis in the middle of the image.

    Raises:
        CameraError: there is no such lens.

    """
    width, height = cameras.size_px
    focal = cameras.focal_px or 0.5 * width / exact.tan(math.radians(0.5 * _SIGHT_DEG))
    return Lens(
        model="brown_conrady" if cameras.distortion else "pinhole",
        size_px=(width, height),
        focal_px=(focal, focal),
        center_px=(0.5 * (width - 1), 0.5 * (height - 1)),
        distortion=cameras.distortion,
    )
