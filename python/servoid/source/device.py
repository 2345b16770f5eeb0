"""Opens live devices by number, file, address or driver object."""

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

from servoid.errors import CaptureError
from servoid.source.controls import Controls
from servoid.source.grabbing import Reopened, Video
from servoid.source.streams.film import FilmVideo
from servoid.source.streams.mjpeg import NoImagesError, failure_of, open_mjpeg
from servoid.words import camera_called

if TYPE_CHECKING:
    import cv2

Device = int | str | Video

_ADDRESS = "://"
_DEVICE_FILE = "/dev/"
_GENICAM = "genicam:"
_HTTP = ("http://", "https://")
_STORED = (*_HTTP, "file://")  # addresses that may be those of a recorded video
_PASSWORD = re.compile(r"//[^/@]*@")  # in an address; messages must not show it
_PIPELINE = " ! "  # joins the parts of a GStreamer pipeline
_OPEN_MS, _READ_MS = 5000, 3000  # for which OpenCV waits for a stream


def reopening(
    name: str, device: Device, size_px: tuple[int, int], controls: Controls | None = None
) -> Callable[[], Video] | None:
    """Return a function that reopens a device; None for a file, or a driver that cannot."""
    if isinstance(device, Reopened):
        return device.reopened
    comes_back = isinstance(device, int) or (
        isinstance(device, str)
        and (_ADDRESS in device or device.startswith((_DEVICE_FILE, _GENICAM)))
    )
    return (lambda: opened(name, device, size_px, controls)) if comes_back else None


def opened(
    name: str,
    device: Device,
    size_px: tuple[int, int] | None = None,
    controls: Controls | None = None,
) -> Video:
    """Open a device by its number, or a file, an address, a GStreamer pipeline or genicam:NAME.

    `size_px` (width, height), if given, is requested from a camera that is given by number.
    `controls` are applied to webcams and industrial cameras. A recorded video, also as a
    `cv2.VideoCapture`, is played once and at its own rate.

    Raises:
        CaptureError: it cannot be opened.
        MissingExtraError: a driver's library is not installed.

    """
    if not isinstance(device, (int, str)):
        return _paced(device)
    if isinstance(device, str) and device.startswith(_GENICAM):
        from servoid.source.devices.genicam import GenicamVideo

        return GenicamVideo(device.removeprefix(_GENICAM), controls)
    if isinstance(device, str) and device.lower().startswith(_HTTP):
        try:
            video = open_mjpeg(device)
        except NoImagesError as error:
            raise CaptureError(f"{camera_called(name)}: '{shown(device)}' {error}") from error
        except (OSError, ValueError) as error:
            raise CaptureError(
                f"{camera_called(name)}: '{shown(device)}' does not answer: {failure_of(error)}; "
                "check that it is connected and reachable from this computer"
            ) from error
        if video is not None:
            return video
    video = _by_opencv(name, device, size_px)
    is_webcam = isinstance(device, int) or device.startswith(_DEVICE_FILE)
    if isinstance(device, str) and not is_webcam and _may_be_stored(device):
        return _paced(video)
    if controls is None or not is_webcam:
        return video
    from servoid.source.devices.uvc import Webcam

    return Webcam(video, controls)


def _by_opencv(name: str, device: int | str, size_px: tuple[int, int] | None) -> "cv2.VideoCapture":
    import cv2

    if isinstance(device, str) and _PIPELINE in device:
        video = cv2.VideoCapture(device, cv2.CAP_GSTREAMER)
    elif isinstance(device, str) and _ADDRESS in device:
        waits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, _OPEN_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, _READ_MS]
        video = cv2.VideoCapture(device, cv2.CAP_FFMPEG, waits)
    else:
        video = cv2.VideoCapture(device, cv2.CAP_ANY)
    if not video.isOpened():
        raise CaptureError(
            f"{camera_called(name)}: OpenCV cannot open '{shown(device)}'; {_remedy(device)}"
        )
    if isinstance(device, int) and size_px is not None:
        width, height = size_px
        video.set(cv2.CAP_PROP_FRAME_WIDTH, width)
        video.set(cv2.CAP_PROP_FRAME_HEIGHT, height)
    if isinstance(device, int):
        video.set(cv2.CAP_PROP_BUFFERSIZE, 1)  # images in a queue are outdated
    return video


def _remedy(device: int | str) -> str:
    """Return what to do about a device that OpenCV cannot open."""
    if isinstance(device, str) and _PIPELINE in device:
        return (
            "check the pipeline, and that OpenCV was built with GStreamer, or give an object with "
            "grab, retrieve and release as the device"
        )
    if isinstance(device, str) and _ADDRESS in device:
        return "check the address, and that its server can be reached from this computer"
    if isinstance(device, int) or device.startswith(_DEVICE_FILE):
        return (
            "check that it is connected and that no other program uses it; servoid sources lists "
            "the cameras that are found"
        )
    return "check that it is a video, and that it is whole"


def _may_be_stored(device: str) -> bool:
    """Return whether a file or an address may be a recorded video, other than those of cameras."""
    if _PIPELINE in device:
        return False
    return _ADDRESS not in device or device.lower().startswith(_STORED)


def _paced(video: "Video | cv2.VideoCapture") -> Video:
    """Return a video of OpenCV that is recorded so that it plays at its own rate, others as is.

    OpenCV would deliver its images as fast as it decodes them.
    """
    import cv2

    if isinstance(video, cv2.VideoCapture) and video.get(cv2.CAP_PROP_FRAME_COUNT) > 0:
        return FilmVideo(video)
    return video


def is_stream(device: Device) -> bool:
    """Return whether a device is a connection, which does not recover once it is broken."""
    return isinstance(device, str) and (_ADDRESS in device or _PIPELINE in device)


def shown(device: int | str) -> str:
    """Return the device's name for messages; an address is shown without its password."""
    return _PASSWORD.sub("//***@", str(device))
