"""Simulates the cameras of a world: they expose on their own clock, and images arrive later."""

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from servoid._native import Camera, Lens
from servoid.camera import undistortion
from servoid.pose import Floats, exact
from servoid.sim.world.arms.calibration import Calibration
from servoid.sim.world.arms.encoders import Encoders
from servoid.sim.world.arms.joint_servos import JointServos
from servoid.sim.world.arms.kinematics import Kinematics
from servoid.sim.world.cameras.metering import Metering
from servoid.sim.world.cameras.renderer import Image, Renderer, Shot
from servoid.sim.world.events.faults import DropImages, FreezeCamera, concerns, is_on
from servoid.sim.world.events.motions import row_of
from servoid.sim.world.events.timeline import Timeline
from servoid.sim.world.lab import Lab
from servoid.sim.world.scene.layout import Layout
from servoid.sim.world.settings import CameraSettings, WorldSettings
from servoid.source import Instant

NAMES = ("left", "right")
_SIGHT_DEG = 50.0  # share of the image's width
_CLOSE_S = 1e-9
_NOISE_STRIDE = 1_000_003  # separates the noise of worlds with different seeds
_BAND_STRIDE = 0x9E37_79B9_7F4A_7C15  # and the noise of an image's bands
_LATER_S = 1e-4  # minimum difference of successive time stamps
_SEEDS = 1 << 64  # that the core distinguishes


_BAND_PX = 16  # rows that are rendered with a common exposure


@dataclass(frozen=True, eq=False)
class Exposure:
    """An exposure: its times (B, M), and the true joint positions at these times (B, M, N).

    Its B bands of rows have M moments each. `time_s` is its true middle, `stamp_s` its time stamp,
    `positions_at_time` the true joint positions at that time, and `gains` the exposure gain of each
    camera.
    """

    index: int
    time_s: float
    stamp_s: float
    arrives_s: float
    moments_s: Floats
    positions: Floats
    positions_at_time: Floats
    gains: tuple[float, ...]


@dataclass(frozen=True)
class WorldParts:
    """What the cameras see, and the calibrated poses from which they see it."""

    servos: JointServos
    kinematics: Kinematics
    layout: Layout
    timeline: Timeline
    renderer: Renderer
    lab: Lab
    encoders: Encoders
    calibration: Calibration


class CameraSimulator:
    """Implements `servoid.source.Source`; an image is rendered only when it is delivered.

    The tracker's computing time is simulated: images are delivered later, depending on whether it
    is `tracking` or searching, and images that arrive while it is busy are missed.
    """

    def __init__(self, settings: WorldSettings, parts: WorldParts) -> None:
        self._settings, self._parts, self._lab = (
            settings,
            parts,
            parts.lab.settings,
        )
        self._lens = make_lens(settings.cameras)
        self._ideal = undistortion(self._lens)  # whose distortion coefficients have no error
        self._bands = bands(settings.cameras.size_px[1], self._lab.readout_s)
        self._meters = self._metering()
        self._next = 0
        self._stamped_s = -math.inf
        self._free_s = -math.inf
        self._waiting: deque[Exposure] = deque()
        self._shown: list[Image | None] = [None, None]
        self.handed_out: Exposure | None = None
        self.tracking = True

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the calibrated pinhole cameras of the delivered images."""
        return self._parts.calibration.cameras

    @property
    def true_cameras(self) -> tuple[Camera, ...]:
        """Return the true pinhole cameras of the delivered images."""
        return true_cameras(self._settings.cameras)

    def expose(self) -> None:
        """Record the exposures that have ended by now."""
        cameras, readout_s = self._settings.cameras, self._lab.readout_s
        while True:
            start = self._next / cameras.rate_hz
            end = start + cameras.exposure_s + readout_s
            if end > self._parts.servos.time_s + _CLOSE_S:
                return
            shares = (np.arange(cameras.moments) + 0.5) / cameras.moments
            begun = start + readout_s * np.array([[band.share] for band in self._bands])
            moments = begun + shares * cameras.exposure_s
            middle = start + 0.5 * (cameras.exposure_s + readout_s)
            at = self._parts.servos.positions_at
            exposure = Exposure(
                index=self._next,
                time_s=middle,
                stamp_s=self._stamp(middle),
                arrives_s=max(middle + cameras.latency_s, end),
                moments_s=moments,
                positions=np.array([[at(one) for one in band] for band in moments]),
                positions_at_time=at(middle),
                gains=(1.0,) * len(NAMES),
            )
            self._waiting.append(replace(exposure, gains=self._gains(exposure)))
            self._next += 1

    def newest(self) -> Instant | None:
        """Return the newest observation that has arrived and was not returned yet, or None."""
        now = self._parts.servos.time_s
        begun = now - (self._lab.track_s if self.tracking else self._lab.search_s)
        if begun < self._free_s - _CLOSE_S:
            return None
        found = None
        while self._waiting and self._waiting[0].arrives_s <= begun + _CLOSE_S:
            exposure = self._waiting.popleft()
            if not all(self._drops(exposure, camera) for camera in range(len(NAMES))):
                found = exposure
        if found is None:
            return None
        self.handed_out, self._free_s = found, now
        return self._instant(found)

    def _instant(self, found: Exposure) -> Instant:
        """Return an observation as software receives it, with the errors of the laboratory."""
        parts = self._parts
        lost = [self._drops(found, camera) for camera in range(len(NAMES))]
        images = [
            None if lost[camera] else self._image(found, camera) for camera in range(len(NAMES))
        ]
        return Instant(
            index=found.index,
            time_s=found.stamp_s,
            world_from_camera=parts.calibration.world_from_eyes(
                parts.encoders.positions_at(found.stamp_s)
            ),
            images=tuple(images),
            notices=tuple(
                f"camera {name}: its image was lost"
                for name, gone in zip(NAMES, lost, strict=True)
                if gone
            ),
            names=NAMES,
        )

    def _image(self, exposure: Exposure, camera: int) -> Image:
        """Render an image, or return the last one if the camera is frozen."""
        kept = self._shown[camera]
        if kept is not None and self._is(FreezeCamera, exposure, camera):
            return kept.copy()
        drawn = [
            self._parts.renderer.image(self._shot(exposure, camera, number))
            for number in range(len(self._bands))
        ]
        image = self._ideal.image(drawn[0] if len(drawn) == 1 else np.concatenate(drawn))
        self._shown[camera] = image
        return image

    def _shot(self, exposure: Exposure, camera: int, number: int) -> Shot:
        """Return the exposure parameters of a band of an image."""
        parts, settings = self._parts, self._settings
        positions, moments = exposure.positions[number], exposure.moments_s[number]
        eyes = [parts.kinematics.world_from_eyes(row)[camera] for row in positions]
        pairs = list(zip(positions, moments, strict=True))
        visuals = [parts.layout.world_from_visuals(row, moment) for row, moment in pairs]
        seed = settings.seed * _NOISE_STRIDE + len(NAMES) * exposure.index + camera
        return Shot(
            lens=lens_of(self._lens, self._bands[number]),
            world_from_lens=np.array([row_of(eye) for eye in eyes]),
            world_from_visuals=np.array(visuals),
            toward=settings.light.toward,
            level=exposure.gains[camera] * parts.timeline.level_at(exposure.time_s),
            samples=settings.cameras.samples,
            noise=settings.cameras.noise,
            seed=(seed + number * _BAND_STRIDE) % _SEEDS,
            threads=settings.threads,
        )

    def _stamp(self, time_s: float) -> float:
        """Return the time stamp of the next exposure, later than the last one."""
        stamp_s = time_s + self._parts.lab.stamp_error(self._next)
        self._stamped_s = max(stamp_s, self._stamped_s + _LATER_S)
        return self._stamped_s

    def _metering(self) -> tuple[Metering, ...]:
        """Return the exposure control of each camera; empty if exposure is fixed."""
        constant_s, rate_hz = self._lab.auto_exposure_s, self._settings.cameras.rate_hz
        if constant_s == 0.0:
            return ()
        return tuple(Metering(self._lens, 1.0 / rate_hz, constant_s) for _ in NAMES)

    def _gains(self, exposure: Exposure) -> tuple[float, ...]:
        """Return the gain of each camera for this exposure."""
        if not self._meters:
            return exposure.gains
        parts, settings = self._parts, self._settings
        eyes = parts.kinematics.world_from_eyes(exposure.positions_at_time)
        visuals = parts.layout.world_from_visuals(exposure.positions_at_time, exposure.time_s)
        level = parts.timeline.level_at(exposure.time_s)
        return tuple(
            meter.meter(
                parts.renderer,
                Shot(
                    lens=meter.lens,
                    world_from_lens=row_of(eye)[None],
                    world_from_visuals=visuals[None],
                    toward=settings.light.toward,
                    level=meter.gain * level,
                    samples=1,
                    threads=1,
                ),
            )
            for meter, eye in zip(self._meters, eyes, strict=True)
        )

    def _drops(self, exposure: Exposure, camera: int) -> bool:
        return self._is(DropImages, exposure, camera)

    def _is(
        self, kind: type[DropImages] | type[FreezeCamera], exposure: Exposure, camera: int
    ) -> bool:
        """Return whether a fault of this kind affects an exposure of a camera."""
        started = self._parts.timeline.path_starts_s
        return started is not None and any(
            isinstance(fault, kind)
            and concerns(fault, camera)
            and is_on(fault, exposure.time_s - started)
            for fault in self._settings.faults
        )


def true_cameras(cameras: CameraSettings) -> tuple[Camera, ...]:
    """Return the true pinhole cameras that replace a world's lenses.

    Raises:
        CameraError: there is no such lens.

    """
    return (undistortion(make_lens(cameras)).camera,) * len(NAMES)


def make_lens(cameras: CameraSettings) -> Lens:
    """Return the lens of a world's cameras, with its axis in the middle of the image.

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


@dataclass(frozen=True)
class Band:
    """Rows of an image from `top` to before `bottom`, read out after a `share` of the read-out."""

    top: int
    bottom: int
    share: float


def bands(height: int, readout_s: float) -> tuple[Band, ...]:
    """Return the bands of an image, top first; a single one for a global shutter."""
    if readout_s == 0.0:
        return (Band(0, height, 0.0),)
    tops = range(0, height, _BAND_PX)
    last = max(height - 1, 1)
    return tuple(
        Band(top, bottom, 0.5 * (top + bottom - 1) / last)
        for top, bottom in ((top, min(top + _BAND_PX, height)) for top in tops)
    )


def lens_of(lens: Lens, band: Band) -> Lens:
    """Return the lens that sees only a band."""
    width, height = lens.size_px
    if (band.top, band.bottom) == (0, height):
        return lens
    return Lens(
        model=lens.model,
        size_px=(width, band.bottom - band.top),
        focal_px=lens.focal_px,
        center_px=(lens.center_px[0], lens.center_px[1] - band.top),
        distortion=lens.distortion,
    )
