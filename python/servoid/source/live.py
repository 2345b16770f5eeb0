"""Live cameras as a source: one thread a camera fetches images, and the newest are paired."""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from types import TracebackType
from typing import Annotated

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from servoid._native import Camera, Lens, Pose
from servoid.camera.ideal import Ideal
from servoid.config.checked import Checked
from servoid.errors import CaptureError, ServoidError
from servoid.source.grabbing import Grabber, Shot, Video, opened, reopening
from servoid.source.instants import ideal_image
from servoid.source.source import Instant


@dataclass(frozen=True, eq=False)
class LiveCamera:
    """A camera of a live rig.

    `device` is its number, or a file, an address or a GStreamer pipeline that OpenCV opens, or an
    object with `grab`, `retrieve` and `release` as `cv2.VideoCapture` has them.
    """

    name: str
    device: int | str | Video
    lens: Lens
    rig_from_camera: Pose


class LiveSettings(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is known of the times of live images."""

    def refusal(self, message: str) -> ServoidError:
        """Return the error that refuses a value."""
        return CaptureError(message)

    delay_s: Annotated[
        float, Meta(ge=0, description="from the middle of the exposure until an image is fetched")
    ] = 0.0
    apart_s: Annotated[
        float, Meta(ge=0, description="between images of one observation, at most")
    ] = 0.025
    silent_s: Annotated[
        float, Meta(gt=0, description="after which a camera without images is not waited for")
    ] = 0.2


class Live:
    """Implements `Source` over cameras that run; a context that closes them.

    Each image is stamped on `clock` when it is fetched, less `delay_s`. Where the rig moves, as on
    a hand, `world_from_cameras` says where its cameras were at a time, by camera; else the rig
    rests at the world's origin. A camera that fails or lags gives None with a notice, while the
    others go on; if all fail there is no observation.
    """

    def __init__(
        self,
        cameras: Sequence[LiveCamera],
        *,
        clock: Callable[[], float] = time.monotonic,
        world_from_cameras: Callable[[float], Sequence[Pose]] | None = None,
        settings: LiveSettings | None = None,
    ) -> None:
        """Open the cameras; `clock` is the arm's, and is asked by several threads.

        Raises:
            CaptureError: there is no camera, or one cannot be opened.
            CameraError: a lens sees nothing of its image.

        """
        if not cameras:
            raise CaptureError("there is no camera; give at least one")
        self._rig, self._clock = tuple(cameras), clock
        self._settings = settings or LiveSettings()
        resting = tuple(camera.rig_from_camera for camera in cameras)
        self._world_from_lenses = world_from_cameras or (lambda _: resting)
        self._ideals = tuple(Ideal(camera.lens) for camera in cameras)
        self._cameras = tuple(ideal.camera for ideal in self._ideals)
        self._index, self._last_s = -1, -np.inf
        self._used_s = [-np.inf] * len(cameras)
        self._used_number = [0] * len(cameras)
        with ExitStack() as stack:
            videos = []
            for camera in cameras:
                videos.append(opened(camera.name, camera.device, camera.lens.size_px))
                stack.callback(videos[-1].release)
            self._grabbers = tuple(
                Grabber(
                    camera.name,
                    video,
                    clock,
                    reopening(camera.name, camera.device, camera.lens.size_px),
                )
                for camera, video in zip(cameras, videos, strict=True)
            )
            stack.pop_all()  # all are open; from now on `close` closes them

    def __enter__(self) -> "Live":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the threads and close the cameras."""
        for grabber in self._grabbers:
            grabber.close()

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the ideal pinhole cameras whose images are delivered."""
        return self._cameras

    def newest(self) -> Instant | None:
        """Return the newest observation that has arrived and was not returned yet, else None."""
        now_s = self._clock()
        shots = [grabber.shots() for grabber in self._grabbers]
        fresh = [
            bool(known) and known[-1].time_s > max(self._last_s, used_s)
            for known, used_s in zip(shots, self._used_s, strict=True)
        ]
        awaited = [
            grabber.silence(now_s)[0] <= self._settings.silent_s for grabber in self._grabbers
        ]
        if not any(fresh) or any(
            wait and not new for wait, new in zip(awaited, fresh, strict=True)
        ):
            return None
        # The newest moment of which all cameras that deliver have an image.
        newest = [(known[-1].time_s, place) for place, known in enumerate(shots) if fresh[place]]
        moment_s, place = min(newest)
        # Images of that camera that came and were not asked for are counted, too.
        came = shots[place][-1].number - self._used_number[place]
        self._last_s, self._index = moment_s, self._index + (came if self._index >= 0 else 1)
        return self._observed(moment_s, now_s, shots)

    def _observed(
        self, moment_s: float, now_s: float, shots: Sequence[tuple[Shot, ...]]
    ) -> Instant:
        """Join the images that were taken nearest to a moment."""
        images: list[NDArray[np.uint8] | None] = []
        notices: list[str] = []
        for place, known in enumerate(shots):
            image, notice = self._image(place, moment_s, now_s, known)
            images.append(image)
            if notice is not None:
                notices.append(notice)
        time_s = moment_s - self._settings.delay_s
        lenses = self._world_from_lenses(time_s)
        return Instant(
            index=self._index,
            time_s=time_s,
            world_from_camera=tuple(
                pose @ ideal.lens_from_camera
                for pose, ideal in zip(lenses, self._ideals, strict=True)
            ),
            images=tuple(images),
            notices=tuple(notices),
            names=tuple(camera.name for camera in self._rig),
        )

    def _image(
        self, place: int, moment_s: float, now_s: float, known: Sequence[Shot]
    ) -> tuple[NDArray[np.uint8] | None, str | None]:
        """Return the image of a camera nearest to a moment, and what is wrong with it, or None."""
        name = self._rig[place].name
        fresh = [one for one in known if one.time_s > self._used_s[place]]
        shot = min(fresh, key=lambda one: abs(one.time_s - moment_s), default=None)
        apart_s = np.inf if shot is None else abs(shot.time_s - moment_s)
        if shot is None or apart_s > self._settings.apart_s:
            silence_s, reason = self._grabbers[place].silence(now_s)
            if silence_s > self._settings.silent_s:
                return None, f"camera {name}: no image came for {silence_s:.1f} s{reason}"
            return None, f"camera {name}: its image was taken {1e3 * apart_s:.0f} ms apart"
        self._used_s[place], self._used_number[place] = shot.time_s, shot.number
        pixels = np.asarray(shot.pixels)
        if pixels.ndim == 3 and pixels.shape[2] in (3, 4):
            pixels = pixels[..., 2::-1]  # blue comes first
        return ideal_image(name, self._ideals[place], pixels)
