"""RealSense cameras: the rectified infrared pair with the emitter off, and depth."""

import time
from collections import deque
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.camera import Lens
from servoid.config import is_file
from servoid.errors import CaptureError, MissingExtraError
from servoid.pose import Pose
from servoid.source.controls import Controls
from servoid.source.delivery import Delivery, EndedError, LostDeviceError
from servoid.source.devices.found import FoundDevice, describe_devices
from servoid.source.devices.pairing import Moment, Pairing
from servoid.source.devices.realsense_controls import RealSenseControls
from servoid.source.devices.realsense_streams import Streams, choose_streams
from servoid.source.live import LiveCamera
from servoid.words import in_one_line

_WAIT_MS = 100  # for an image, before the device's presence is checked
_QUEUE = 32  # images that librealsense queues
_SILENT_S = 1.0  # without a pair, after which the device must be gone
_RESTING_S = 0.05  # after which a paused player no longer reads
_APART = 0.4  # of a period; stamps are equal, unless a host without metadata makes them up
EYES = ("left", "right")


def load_library() -> Any:
    """Import pyrealsense2.

    Raises:
        MissingExtraError: it is not installed, or lacks a library of the system.

    """
    try:
        return import_module("pyrealsense2")
    except ModuleNotFoundError as reason:
        raise MissingExtraError(
            "RealSense cameras need pyrealsense2, which is not installed; install it with: "
            "pip install 'servoid[realsense]' (on ARM it has to be built from librealsense's "
            "source), and the system's libusb 1.0 (Debian and Ubuntu: apt install libusb-1.0-0)"
        ) from reason
    except ImportError as reason:
        raise MissingExtraError(
            f"pyrealsense2 is installed, but cannot be imported ({in_one_line(reason)}); install "
            "the system's library that it names: of libusb on Debian and Ubuntu, apt install "
            "libusb-1.0-0"
        ) from reason


def list_realsense() -> tuple[FoundDevice, ...]:
    """List the connected RealSense cameras.

    Raises:
        MissingExtraError: pyrealsense2 is not installed.

    """
    library = load_library()
    return tuple(
        FoundDevice(_info(library, one, "serial_number"), _info(library, one, "name"))
        for one in _context(library).query_devices()
    )


def open_realsense(
    serial: str = "", controls: Controls | None = None, *, depth: bool = True
) -> tuple[LiveCamera, LiveCamera]:
    """Open the infrared pair of a RealSense camera, or of its recording, for `Live`.

    The emitter is off, and the calibration of the eyes comes from the device. With `depth` its
    depth images are delivered, too. Arguments and errors are those of `RealSenseVideo`.
    """
    video = RealSenseVideo(serial, controls, depth=depth)
    left, right = (
        LiveCamera(name, video, lens, pose)
        for name, lens, pose in zip(EYES, video.lenses, video.rig_from_eyes, strict=True)
    )
    return left, right


class RealSenseVideo:
    """A camera, or a recording of one by librealsense, as `Video` with two eyes.

    `lenses` and `rig_from_eyes` are those of the left and the right eye, from the device; the rig
    is the left eye. Depth images are in the left eye's pixels.
    """

    def __init__(
        self, serial: str = "", controls: Controls | None = None, *, depth: bool = True
    ) -> None:
        """Open a camera by its serial number, or a recording by its path, and start it.

        Without a serial number, the only connected camera is used.

        Raises:
            CaptureError: there is no such camera or recording, or it has no infrared pair.
            MissingExtraError: pyrealsense2 is not installed.

        """
        self._serial, self._controls, self._depth = serial, controls or Controls(), depth
        self._library = load_library()
        self._is_recording = is_file(Path(serial)) if serial else False
        self._context = self._library.context() if self._is_recording else _context(self._library)
        opened = _played if self._is_recording else _plugged_in
        self._device = opened(self._context, self._library, serial)
        self._streams: Streams = choose_streams(
            self._library, self._device, self._controls.rate_hz, depth
        )
        self.lenses: tuple[Lens, Lens] = self._streams.lenses
        self.rig_from_eyes: tuple[Pose, Pose] = self._streams.rig_from_eyes
        wanted = ("depth",) if self._streams.depth is not None else ()
        self._pairing = Pairing(EYES, wanted, apart_s=_APART / self._streams.rate_hz)
        sensor = None if self._is_recording else self._streams.sensor
        self._watch = RealSenseControls(self._library, sensor, self._controls)
        self._notices = *self._watch.notices, *self._streams.notices
        self._ready: deque[Moment] = deque()
        self._number: int | None = None
        self._missing = 0
        self._domain: str | None = None
        self._queue = self._library.frame_queue(_QUEUE, keep_frames=True)
        self._is_running = self._has_played = False
        self._start()

    def grab(self) -> bool:
        """Wait for the next pair; return whether there is one.

        Raises:
            EndedError: the recording has ended.
            LostDeviceError: the device is gone.

        """
        while not self._ready:
            found, frame = self._queue.try_wait_for_frame(_WAIT_MS)
            if not found:
                self._check_presence()
                return False
            self._take(frame)
        return True

    def retrieve(self) -> tuple[bool, Delivery | None]:
        """Return the last grabbed pair, with its timestamp and depth."""
        if not self._ready:
            return False, None
        moment = self._ready.popleft()
        depth, _ = moment.images.get("depth", (None, ()))
        notices = [*self._notices, *self._pairing.alone()]
        for _, messages in moment.images.values():
            notices += messages
        if self._streams.depth is not None and depth is None:
            notices.append("its depth image did not come")
        missing, self._missing, self._notices = self._missing, 0, ()
        self._last_s = time.monotonic()
        return True, Delivery(
            images=tuple(moment.images[eye][0] for eye in EYES),
            stamp_s=moment.stamp_s,
            depths=() if depth is None else (depth, None),
            missing=missing,
            notices=tuple(notices),
        )

    def release(self) -> None:
        """Stop the camera and close it."""
        if self._is_running:
            self._is_running = False
            try:
                if self._is_recording:  # stopping librealsense while it reads crashes it
                    self._device.as_playback().pause()
                    time.sleep(_RESTING_S)
                self._streams.sensor.stop()
                self._streams.sensor.close()
            except RuntimeError:
                pass  # the device is gone, so it has stopped

    def reopened(self) -> "RealSenseVideo":
        """Reopen the same camera.

        Raises:
            CaptureError: it is not connected.

        """
        return RealSenseVideo(self._serial, self._controls, depth=self._depth)

    def _start(self) -> None:
        sensor = self._streams.sensor
        try:
            sensor.open([one for one in self._streams.profiles if one is not None])
            self._is_running = True
            sensor.start(self._queue)
        except RuntimeError as reason:
            self.release()
            raise CaptureError(
                f"realsense:{self._serial} cannot be started ({reason}); check that no other "
                "program holds it"
            ) from reason
        self._last_s = time.monotonic()

    def _take(self, frame: Any) -> None:
        """Group an image with those of the same instant."""
        self._has_played = True
        stream = self._streams.name_of(frame)
        if stream is None:
            return
        is_left = stream == EYES[0]
        if is_left:
            self._count_missing(frame.get_frame_number())
        notices = (*self._watch.watch(frame), *self._other_clock(frame)) if is_left else ()
        image = np.array(np.asanyarray(frame.get_data()))
        if stream == "depth":
            image = _metres(image, self._streams.depth_unit_m)
        stamp_s = 1e-3 * frame.get_timestamp()
        self._ready.extend(self._pairing.add(stream, stamp_s, (image, notices)))

    def _count_missing(self, number: int) -> None:
        """Count the images that are missing before an image of the left eye."""
        last, self._number = self._number, number
        if last is not None and number > last:
            self._missing += number - last - 1

    def _other_clock(self, frame: Any) -> tuple[str, ...]:
        """Report that timestamps now come from another clock than before."""
        last, self._domain = self._domain, frame.get_frame_timestamp_domain().name
        if last is None or last == self._domain:
            return ()
        return (f"its stamps are of the {self._domain} now, and were of the {last}",)

    def _check_presence(self) -> None:
        if self._is_recording:
            stopped = self._library.playback_status.stopped
            if self._has_played and self._device.as_playback().current_status() == stopped:
                raise EndedError(f"the recording {self._serial} is over")
            return
        silent_s = time.monotonic() - self._last_s
        if silent_s > _SILENT_S:
            raise LostDeviceError(f"the camera has been silent for {silent_s:.1f} s")


def _played(context: Any, _library: Any, path: str) -> Any:
    """Return the device of a recording."""
    try:
        return context.load_device(path)
    except RuntimeError as reason:
        raise CaptureError(
            f"{path} is not a recording that librealsense can play ({reason})"
        ) from reason


@lru_cache(maxsize=1)
def _context(library: Any) -> Any:
    """Return the context that lists connected devices; slow to create."""
    return library.context()


def _plugged_in(context: Any, library: Any, serial: str) -> Any:
    """Return the device with a serial number."""
    devices = list(context.query_devices())
    fitting = [one for one in devices if serial in ("", _info(library, one, "serial_number"))]
    if len(fitting) == 1:
        return fitting[0]
    known = describe_devices(
        FoundDevice(_info(library, one, "serial_number"), _info(library, one, "name"))
        for one in devices
    )
    if fitting:
        raise CaptureError(f"several RealSense cameras are plugged in; give one's number; {known}")
    named = f"of serial number {serial}" if serial else "plugged in"
    raise CaptureError(
        f"there is no RealSense camera {named}; {known}; a recording is given by the path of its "
        "file"
    )


def _info(library: Any, device: Any, what: str) -> str:
    key = getattr(library.camera_info, what)
    return device.get_info(key) if device.supports(key) else "?"


def _metres(raw: NDArray[np.uint16], unit_m: float) -> NDArray[np.float32]:
    """Convert a depth image to metres (H, W) float32, NaN where nothing was measured."""
    depth = raw.astype(np.float32) * np.float32(unit_m)
    depth[raw == 0] = np.nan
    return depth
