"""Live cameras as a source: a thread per device fetches images, and the newest are paired."""

import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from os import PathLike, fspath
from typing import Annotated, Any

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from servoid._native import Camera, Lens, Pose
from servoid.camera import IdealCamera, to_metres
from servoid.config import Checked
from servoid.errors import CaptureError
from servoid.source.controls import Controls
from servoid.source.device import Device, is_stream, opened, reopening
from servoid.source.grabbing import TRIES, Grabber, Shot, Video
from servoid.source.host_clock import HostClock, HostTime
from servoid.source.instants import tidy_image
from servoid.source.raw import MountedCamera, RawImage, RawInstant, instant_of
from servoid.source.source import Instant
from servoid.words import camera_called, counted

_TRIES_OF_STREAM = 1  # a broken connection does not recover


@dataclass(frozen=True, eq=False)
class LiveCamera:
    """A camera of a live rig.

    `device` is its number, or a file, an address or a GStreamer pipeline that OpenCV opens, or an
    object with `grab`, `retrieve` and `release` like `cv2.VideoCapture`. Cameras with the same
    object are its eyes, in the order of its images. `controls` are applied to a webcam or an
    industrial camera that is given by its number or name. A recorded video stands for a camera that
    sends its images at their times in the film, and is then over; `servoid.capture` reads a video
    image by image, at any speed.
    """

    name: str
    device: Device
    lens: Lens
    rig_from_camera: Pose
    controls: Controls | None = None

    def __post_init__(self) -> None:
        """Check what is not a number; a path as the device is the name of its file.

        Raises:
            CaptureError: a member is of another type.

        """
        if isinstance(self.device, PathLike):
            object.__setattr__(self, "device", fspath(self.device))
        for name, value, kind, what in (
            ("name", self.name, str, "a text"),
            (
                "device",
                self.device,
                int | str | Video,
                "a number, a text, or an object with grab, retrieve and release",
            ),
            ("lens", self.lens, Lens, "a servoid.camera.Lens"),
            ("rig_from_camera", self.rig_from_camera, Pose, "a servoid.pose.Pose"),
        ):
            if not isinstance(value, kind):
                raise CaptureError(
                    f"LiveCamera.{name} must be {what}, but is of type {type(value).__name__}"
                )


class LiveSettings(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of the timing of live images."""

    REFUSAL = CaptureError

    delay_s: Annotated[
        float, Meta(ge=0, description="from the middle of the exposure until an image is fetched")
    ] = 0.0
    apart_s: Annotated[
        float, Meta(ge=0, description="between images of one observation, at most")
    ] = 0.025
    silent_s: Annotated[
        float,
        Meta(
            gt=0,
            description="after which a camera without images is not waited for, a slow one later",
        ),
    ] = 0.2


@dataclass(frozen=True, eq=False)
class _Eye:
    """One camera: the index of its device among the grabbers, and which of the device's eyes."""

    device: int
    eye: int


class Live:
    """Implements `Source` and `RawSource` over live cameras; as a context manager, closes them.

    Each image has a time on `clock`: from its device's timestamp if there is one, else from when it
    was fetched, minus `delay_s`. If the rig moves, as on a hand, `world_from_cameras` returns the
    poses of its cameras at a time, by camera; otherwise the rig is at the world's origin. A camera
    that fails or lags gives None with a notice, while the others continue. If all fail there is no
    observation, and `silence` returns the reason.
    """

    def __init__(
        self,
        cameras: Sequence[LiveCamera],
        *,
        clock: Callable[[], float] = time.monotonic,
        world_from_cameras: Callable[[float], Sequence[Pose]] | None = None,
        settings: LiveSettings | None = None,
    ) -> None:
        """Open the cameras; `clock` is the arm's, and is called from several threads.

        Raises:
            CaptureError: there is no camera, one cannot be opened, or the clock returns no number.
            CameraError: a lens sees nothing of its image.

        """
        if not cameras:
            raise CaptureError("there is no camera; give at least one")
        other = next((one for one in cameras if not isinstance(one, LiveCamera)), None)
        if other is not None:
            raise CaptureError(
                f"Live takes a list of LiveCamera, but it holds {other!r:.60}; servoid.opening."
                "open_live opens what the command line takes, such as 0"
            )
        self._rig = tuple(
            MountedCamera(camera.name, camera.lens, camera.rig_from_camera) for camera in cameras
        )
        self._clock, self._settings = HostClock(clock), settings or LiveSettings()
        resting = tuple(camera.rig_from_camera for camera in cameras)
        self._world_from_lenses = world_from_cameras or (lambda _: resting)
        self._ideals = tuple(IdealCamera(camera.lens) for camera in cameras)
        self._cameras = tuple(ideal.camera for ideal in self._ideals)
        self._index, self._last_s = -1, -np.inf
        self._jumps, self._pending = 0, ""  # of the clock, and what is to be told of them
        first, self._eyes = _devices(cameras)
        self._used_s = [-np.inf] * len(first)
        self._used_number = [0] * len(first)
        with ExitStack() as stack:
            videos = []
            for camera in first:
                videos.append(_opened(camera))
                stack.callback(videos[-1].release)
            self._grabbers = tuple(
                Grabber(
                    camera.name,
                    video,
                    self._clock,
                    reopening(camera.name, camera.device, camera.lens.size_px, camera.controls),
                    tries=_TRIES_OF_STREAM if is_stream(camera.device) else TRIES,
                    silent_s=self._settings.silent_s,
                )
                for camera, video in zip(first, videos, strict=True)
            )
            stack.pop_all()  # all are open; from here on, `close` closes them

    def __enter__(self) -> "Live":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop the threads and close the cameras."""
        for grabber in self._grabbers:
            grabber.close()

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the ideal pinhole cameras whose images are delivered."""
        return self._cameras

    @property
    def rig(self) -> tuple[MountedCamera, ...]:
        """Return the real cameras, with their lenses."""
        return self._rig

    @property
    def is_over(self) -> bool:
        """Return whether all devices played recordings that have ended, up to the last image.

        An observation that was not yet returned comes first.
        """
        if not all(grabber.has_ended for grabber in self._grabbers):
            return False
        now = self._now()
        return not any(self._are_fresh([grabber.shots(now) for grabber in self._grabbers]))

    def silence(self) -> str | None:
        """Return why no image comes, if no device has sent any for a while; else None."""
        now = self._now()
        silences = [grabber.silence(now) for grabber in self._grabbers]
        if any(
            seconds <= grabber.patience_s
            for (seconds, _), grabber in zip(silences, self._grabbers, strict=True)
        ):
            return None
        return "; ".join(
            f"{camera_called(self._name(place))}: no image came for {seconds:.1f} s{reason}"
            for place, (seconds, reason) in enumerate(silences)
        )

    def newest(self) -> Instant | None:
        """Return the newest observation that has arrived and was not yet returned, else None."""
        raw = self.newest_raw()
        return None if raw is None else instant_of(raw, self._rig, self._ideals)

    def newest_raw(self) -> RawInstant | None:
        """Return what `newest` would, as recorded; each observation is returned by only one.

        Raises:
            CaptureError: the clock returns no number, or `world_from_cameras` not each pose.

        """
        now = self._now()
        shots = [grabber.shots(now) for grabber in self._grabbers]
        fresh = self._are_fresh(shots)
        if not any(fresh) or self._is_awaiting(now, shots, fresh):
            return None
        # The newest instant for which all delivering devices have an image.
        newest = [(known[-1].time_s, place) for place, known in enumerate(shots) if fresh[place]]
        moment_s, place = min(newest)
        # Images of that device that arrived and were not requested are counted, too.
        came = shots[place][-1].number - self._used_number[place]
        self._last_s, self._index = moment_s, self._index + (came if self._index >= 0 else 1)
        return self._observed(moment_s, now, shots)

    def _now(self) -> HostTime:
        """Return the present time; after the clock has gone back, everything counts as new."""
        now = self._clock.now()
        if now.jumps != self._jumps:
            self._jumps, self._pending = now.jumps, self._clock.jump()
            self._last_s, self._used_s = -np.inf, [-np.inf] * len(self._used_s)
        return now

    def _are_fresh(self, shots: Sequence[tuple[Shot, ...]]) -> list[bool]:
        """Return for each device whether its newest shot belongs to a new observation."""
        return [
            bool(known) and known[-1].time_s > max(self._last_s + self._slack_s(place), used_s)
            for place, (known, used_s) in enumerate(zip(shots, self._used_s, strict=True))
        ]

    def _slack_s(self, place: int) -> float:
        """Return how much later than an observation an image belongs to the next observation.

        An image that is too late to be paired must not become an observation of the same instant.
        """
        return min(self._settings.apart_s, 0.5 * self._grabbers[place].usual_s)

    def _is_awaiting(
        self, now: HostTime, shots: Sequence[tuple[Shot, ...]], fresh: Sequence[bool]
    ) -> bool:
        """Return whether an image is still expected that belongs to the available ones."""
        silences_s = [grabber.silence(now)[0] for grabber in self._grabbers]
        patiences_s = [grabber.patience_s for grabber in self._grabbers]
        lacking = [place for place, new in enumerate(fresh) if not new]
        if any(silences_s[place] <= patiences_s[place] for place in lacking):
            return True
        # Cameras that were silent together resume together, but not at exactly the same time.
        there = [place for place, new in enumerate(fresh) if new]
        are_back = all(
            len(shots[place]) > 1
            and shots[place][-1].time_s - shots[place][-2].time_s > patiences_s[place]
            for place in there
        )
        just_s = min(silences_s[place] for place in there)
        return bool(lacking) and are_back and just_s < self._settings.apart_s

    def _observed(
        self, moment_s: float, now: HostTime, shots: Sequence[tuple[Shot, ...]]
    ) -> RawInstant:
        """Combine the images that were taken nearest to an instant."""
        found = [self._nearest(place, moment_s, now, known) for place, known in enumerate(shots)]
        images: list[RawImage | None] = []
        notices = [self._pending] if self._pending else []
        self._pending = ""
        for eye, camera in zip(self._eyes, self._rig, strict=True):
            shot, notice = found[eye.device]
            image = None
            if shot is not None:
                image, notice = _raw_image(camera.lens, shot, eye.eye)
            images.append(image)
            if notice is not None:
                notices.append(f"{camera_called(camera.name)}: {notice}")
        for place, grabber in enumerate(self._grabbers):
            notices.extend(
                f"{camera_called(self._name(place))}: {text}" for text in grabber.notices()
            )
        time_s = moment_s - self._settings.delay_s
        return RawInstant(
            index=self._index,
            time_s=time_s,
            images=tuple(images),
            world_from_lens=_poses(self._world_from_lenses(time_s), self._rig),
            notices=tuple(dict.fromkeys(notices)),
        )

    def _nearest(
        self, place: int, moment_s: float, now: HostTime, known: Sequence[Shot]
    ) -> tuple[Shot | None, str | None]:
        """Return the shot of a device nearest to an instant, or None and what is wrong."""
        fresh = [one for one in known if one.time_s > self._used_s[place]]
        shot = min(fresh, key=lambda one: abs(one.time_s - moment_s), default=None)
        apart_s = np.inf if shot is None else abs(shot.time_s - moment_s)
        if shot is None or apart_s > self._settings.apart_s:
            silence_s, reason = self._grabbers[place].silence(now)
            if silence_s > self._grabbers[place].patience_s:
                return None, f"no image came for {silence_s:.1f} s{reason}"
            return None, f"its image was taken {1e3 * apart_s:.0f} ms apart"
        self._used_s[place], self._used_number[place] = shot.time_s, shot.number
        return shot, None

    def _name(self, place: int) -> str:
        """Return the name of a device: that of its first eye."""
        eyes = [
            camera.name
            for camera, eye in zip(self._rig, self._eyes, strict=True)
            if eye.device == place
        ]
        return eyes[0]


def _poses(given: object, rig: Sequence[MountedCamera]) -> tuple[Pose, ...]:
    """Return the poses of the cameras of a rig that moves, as its program gives them."""
    poses = tuple(given) if isinstance(given, Iterable) else None
    others = [type(one).__name__ for one in poses or () if not isinstance(one, Pose)]
    if poses is None:
        what = f"returned {type(given).__name__}"
    elif len(poses) != len(rig):
        what = f"returned {counted(len(poses), 'value')}"
    elif others:
        what = f"one it returned is {others[0]}; make a pose of a matrix (4, 4) by Pose(matrix)"
    else:
        return poses
    raise CaptureError(
        f"world_from_cameras of Live must return {counted(len(rig), 'pose')}, a servoid.pose.Pose "
        f"for each of {', '.join(camera.name for camera in rig)}, but {what}"
    )


def _opened(camera: LiveCamera) -> Video:
    return opened(camera.name, camera.device, camera.lens.size_px, camera.controls)


def _devices(cameras: Sequence[LiveCamera]) -> tuple[list[LiveCamera], tuple[_Eye, ...]]:
    """Return one camera per device, and for each camera its device and eye."""
    first: list[LiveCamera] = []
    counts: list[int] = []
    eyes: list[_Eye] = []
    for camera in cameras:
        shared = not isinstance(camera.device, (int, str))
        place = next(
            (at for at, one in enumerate(first) if shared and one.device is camera.device),
            len(first),
        )
        if place == len(first):
            first.append(camera)
            counts.append(0)
        eyes.append(_Eye(place, counts[place]))
        counts[place] += 1
    return first, tuple(eyes)


def _raw_image(lens: Lens, shot: Shot, eye: int) -> tuple[RawImage | None, str | None]:
    """Return an eye's image of a shot, in its lens's size, or None, and what is wrong with it."""
    given = shot.images[eye] if eye < len(shot.images) else None
    if given is None:
        return None, "there is no image"
    pixels, notice = tidy_image(_red_first(np.asanyarray(given)))
    if pixels is None:
        return None, notice
    width, height = lens.size_px
    if pixels.shape[:2] != (height, width):
        return None, (
            f"the image is {pixels.shape[1]}x{pixels.shape[0]} pixels, but the lens has "
            f"{width}x{height}; images and calibration must be of the same size"
        )
    if pixels.ndim == 2:  # as when a grey image is read from a file
        pixels = np.repeat(pixels[:, :, None], 3, axis=2)
    depth = shot.depths[eye] if eye < len(shot.depths) else None
    depth_m = None if depth is None else to_metres(np.asarray(depth), 1.0)
    return RawImage(pixels, shot.time_s, shot.number, depth_m, shot.encoded), notice


def _red_first(pixels: NDArray[Any]) -> NDArray[Any]:
    """Convert to RGB order, without an alpha channel."""
    return pixels[..., 2::-1] if pixels.ndim == 3 and pixels.shape[2] in (3, 4) else pixels
