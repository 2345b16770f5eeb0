"""Industrial cameras with GigE Vision or USB3 Vision, through Aravis."""

import ctypes
import socket
import time
from threading import Thread
from typing import Any

from servoid._native import Lens, Pose
from servoid.errors import CaptureError
from servoid.source.controls import Controls
from servoid.source.delivery import Delivery, LostDeviceError
from servoid.source.devices.aravis import Aravis, AravisError, aravis
from servoid.source.devices.found import FoundDevice, describe_devices
from servoid.source.devices.genicam_controls import apply_controls
from servoid.source.devices.pixels import FORMATS, decode_pixels, refused_format
from servoid.source.live import LiveCamera

_BUFFERS = 8  # buffers that the driver may fill before one is fetched
_WAIT_S = 0.1  # for an image, before the camera's presence is checked
_SILENT_S = 0.7  # without an expected image, after which a camera is reopened
_SILENT_PERIODS = 5.0
_QUERY_S = 1.0  # between presence checks of a camera that awaits a trigger
_NEAR_TRIES = 50  # all but one of which look for a lost camera at its old address, which is fast
_LAST_SHORT_NUMBER = 65535  # after which GigE Vision counts images from 1 again
_STATES = {
    1: "it was given back unfilled",
    2: "packets of it came too late",
    3: "packets of it were lost",
    4: "packets of it came in a wrong order",
    5: "it has another size than when the camera was opened",
    7: "the stream was broken off",
    8: "it carries no plain image",
}
_WRONG_SIZE = 5


_PORT = 3956  # of GigE Vision's control protocol
_DISCOVERY = bytes.fromhex("4211000200000001")  # key, answer requested, no payload
_ANSWER_S = 0.1


def list_genicam() -> tuple[FoundDevice, ...]:
    """List the cameras that answer; takes a second.

    Raises:
        MissingExtraError: libaravis is not installed.

    """
    library = aravis()
    library.call("update_device_list")
    found = []
    for place in range(library.call("get_n_devices")):
        name, vendor, model, serial, address, protocol = (
            library.call(f"get_device_{what}", place) or "?"
            for what in ("id", "vendor", "model", "serial_nbr", "address", "protocol")
        )
        description = f"{vendor} {model}, serial number {serial}, {protocol} at {address}"
        found.append(FoundDevice(name, description))
    return tuple(found)


def open_genicam(
    name: str, lens: Lens, rig_from_camera: Pose | None = None, controls: Controls | None = None
) -> LiveCamera:
    """Open an industrial camera for `Live`; it has no calibration, so `lens` supplies it.

    Raises:
        CaptureError: as `GenicamVideo`, or its images have another size than the lens.
        MissingExtraError: libaravis is not installed.

    """
    video = GenicamVideo(name, controls)
    if video.size_px != lens.size_px:
        video.release()
        raise CaptureError(
            f"genicam:{name} delivers {video.size_px[0]}x{video.size_px[1]} pixels, but the lens "
            f"has {lens.size_px[0]}x{lens.size_px[1]}; set the camera's region, or calibrate it "
            "with its current region"
        )
    return LiveCamera("camera", video, lens, rig_from_camera or Pose.identity())


class GenicamVideo:
    """A camera as `Video`; its images have the timestamps of its own clock.

    `size_px` is the (width, height) of its images. The camera keeps its region: changing it would
    invalidate the calibration.
    """

    def __init__(self, name: str, controls: Controls | None = None) -> None:
        """Open a camera by its name, serial number or address, and start it.

        Raises:
            CaptureError: there is no such camera, another program holds it, or its images cannot
                be read.
            MissingExtraError: libaravis is not installed.

        """
        self._name, self._controls = name, controls or Controls()
        self._library, self._stream = aravis(), None
        self._camera = _opened(self._library, name)
        self._number: int | None = None
        self._is_lost, self._tries = False, 0
        self._data: Delivery | None = None
        self._device = self._call("camera_get_device", self._camera)
        self._is_gige = bool(self._call("camera_is_gv_device", self._camera))
        try:
            self._check_control()
            self._notices: tuple[str, ...] = apply_controls(
                self._library, self._camera, self._controls
            )
            self.size_px: tuple[int, int] = self._integer("Width"), self._integer("Height")
            self._check_format()
            self._start()
        except AravisError as reason:
            self.release()
            raise CaptureError(f"genicam:{name} cannot be set up: {reason}") from reason
        except BaseException:
            self.release()
            raise

    def grab(self) -> bool:
        """Wait for the next image; return whether there is one.

        Raises:
            LostDeviceError: the camera is gone, or silent for too long.

        """
        buffer = self._call("stream_timeout_pop_buffer", self._stream, int(1e6 * _WAIT_S))
        now_s = time.monotonic()
        if not buffer:
            self._check_presence(now_s - self._last_s)
            return False
        self._last_s = now_s
        try:
            self._data = self._delivery(buffer)
        finally:
            self._call("stream_push_buffer", self._stream, buffer)
        return True

    def retrieve(self) -> tuple[bool, Delivery | None]:
        """Return the last grabbed image, with its timestamp."""
        data, self._data = self._data, None
        return data is not None, data

    @property
    def may_be_silent(self) -> bool:
        """Return whether the camera awaits a trigger, or reports no rate of images."""
        return self._patience_s is None

    def release(self) -> None:
        """Stop the camera and close it; a lost one is closed in the background."""
        camera, stream, self._camera = self._camera, self._stream, None
        if camera is None:
            return
        if self._is_lost:  # each message to it would wait for a timeout
            Thread(target=_close, args=(self._library, camera, stream), daemon=True).start()
            return
        try:
            if stream is not None:
                self._call("camera_stop_acquisition", camera)
        except AravisError:
            pass  # it is gone, so it has stopped
        finally:
            _close(self._library, camera, stream)

    def reopened(self) -> "GenicamVideo":
        """Reopen the same camera, once it is connected again.

        Raises:
            CaptureError: it is not connected.

        """
        self._tries += 1
        if (
            self._address is not None
            and self._tries % _NEAR_TRIES
            and not _gige_answers(self._address)
        ):
            raise CaptureError(f"nothing answers at {self._address}")
        return GenicamVideo(self._name, self._controls)

    def _call(self, name: str, *arguments: Any) -> Any:
        return self._library.call(name, *arguments)

    def _integer(self, feature: str) -> int:
        return int(self._call("camera_get_integer", self._camera, feature))

    def _check_control(self) -> None:
        if self._is_gige and not self._call("gv_device_is_controller", self._device):
            raise CaptureError(
                f"genicam:{self._name} is in use by another program; stop it, or wait a few "
                "seconds if it was killed"
            )

    def _check_format(self) -> None:
        name = self._call("camera_get_string", self._camera, "PixelFormat")
        if name not in FORMATS:
            raise CaptureError(f"genicam:{self._name}: {refused_format(name)}")

    def _start(self) -> None:
        """Give buffers to the driver, and start the acquisition."""
        self._address = _address(self._library, self._device) if self._is_gige else None
        if self._is_gige:
            self._call("camera_gv_auto_packet_size", self._camera)
        self._stream = self._call("camera_create_stream", self._camera, None, None)
        payload = self._call("camera_get_payload", self._camera)
        for _ in range(_BUFFERS):
            self._call(
                "stream_push_buffer", self._stream, self._call("buffer_new_allocate", payload)
            )
        self._call("camera_start_acquisition", self._camera)
        self._patience_s, self._last_s = self._patience(), time.monotonic()
        self._queried_s = self._last_s

    def _patience(self) -> float | None:
        """Return after how many silent seconds the camera must be gone; None if it is triggered."""
        try:
            if self._call("camera_get_string", self._camera, "TriggerMode") == "On":
                return None
            rate_hz = self._call("camera_get_frame_rate", self._camera)
        except AravisError:
            return None  # the time of the next image is unknown
        return max(_SILENT_S, _SILENT_PERIODS / rate_hz) if rate_hz > 0.0 else None

    def _check_presence(self, silent_s: float) -> None:
        if self._is_gige and not self._call("gv_device_is_controller", self._device):
            raise self._lost("the camera was restarted, or another program took it")
        if self._patience_s is not None and silent_s > self._patience_s:
            raise self._lost(f"the camera has been silent for {silent_s:.1f} s")
        if self._patience_s is None and time.monotonic() - self._queried_s > _QUERY_S:
            self._query()

    def _query(self) -> None:
        """Check that a camera that may be silent still answers."""
        self._queried_s = time.monotonic()
        try:
            self._integer("Width")
        except AravisError as reason:
            raise self._lost(f"the camera does not answer ({reason})") from reason

    def _lost(self, reason: str) -> LostDeviceError:
        self._is_lost = True
        return LostDeviceError(reason)

    def _delivery(self, buffer: Any) -> Delivery:
        state = self._call("buffer_get_status", buffer)
        missing = self._missing(self._call("buffer_get_frame_id", buffer))
        notices, self._notices = self._notices, ()
        if state == _WRONG_SIZE:
            raise LostDeviceError(f"an image is left out: {_STATES[state]}")  # still connected
        if state != 0:
            reason = _STATES.get(state, "its state is unknown to the driver")
            notices = *notices, f"an image is left out: {reason}"
            return Delivery(missing=missing, notices=notices)
        stamp_ns = self._call("buffer_get_timestamp", buffer)
        return Delivery(
            images=(self._pixels(buffer),),
            stamp_s=1e-9 * stamp_ns if stamp_ns else None,
            missing=missing,
            notices=notices,
        )

    def _pixels(self, buffer: Any) -> Any:
        length, across, below = ctypes.c_size_t(), ctypes.c_int(), ctypes.c_int()
        start = self._call("buffer_get_image_data", buffer, ctypes.byref(length))
        self._call("buffer_get_image_padding", buffer, ctypes.byref(across), ctypes.byref(below))
        return decode_pixels(
            ctypes.string_at(start, length.value),
            self._call("buffer_get_image_pixel_format", buffer),
            (
                self._call("buffer_get_image_width", buffer),
                self._call("buffer_get_image_height", buffer),
            ),
            across.value,
        )

    def _missing(self, number: int) -> int:
        """Return the number of images that are missing before the image with a number."""
        last, self._number = self._number, number
        if last is None:
            return 0
        count = number - last - 1
        if count < 0:  # numbers wrap to 1, as 0 is not used
            count += _LAST_SHORT_NUMBER
        return count if 0 < count < _LAST_SHORT_NUMBER // 2 else 0


def _opened(library: Aravis, name: str) -> Any:
    try:
        return library.call("camera_new", name)
    except AravisError as reason:
        raise CaptureError(
            f"no camera can be opened as genicam:{name} ({reason}); "
            f"{describe_devices(list_genicam())}; one that another program uses must be released "
            "first"
        ) from reason


def _address(library: Aravis, device: Any) -> str:
    """Return the IP address of a GigE Vision camera."""
    socket = library.call("gv_device_get_device_address", device)  # still owned by the device
    address = library.call("g_inet_socket_address_get_address", socket)
    return library.call("g_inet_address_to_string", address)


def _close(library: Aravis, camera: Any, stream: Any) -> None:
    if stream is not None:
        library.call("g_object_unref", stream)
    library.call("g_object_unref", camera)


def _gige_answers(address: str) -> bool:
    """Return whether a GigE Vision camera answers at an IP address, within a short time."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.settimeout(_ANSWER_S)
        try:
            channel.connect((address, _PORT))
            channel.send(_DISCOVERY)
            return len(channel.recv(1024)) > 0
        except OSError:  # no camera listens there, or none answered in time
            return False
