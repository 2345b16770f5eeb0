"""Writes the observations of a rig as ROS 2 images, calibrations and transforms."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from servoid._native import Lens
from servoid.errors import OutputError
from servoid.exchange.bags.mcap import messages as ros
from servoid.exchange.bags.mcap.mcap_file import McapFile
from servoid.exchange.bags.mcap.raw_images import RawImage, RawObservation
from servoid.exchange.bags.names import (
    RIG,
    STATIC_TOPIC,
    TF_TOPIC,
    TIME_TOPIC,
    WORLD,
    frame_of,
    topic_of,
)
from servoid.exchange.bags.stored.header import NS_PER_S
from servoid.pose import Pose


class RecordedCamera(Protocol):
    """The properties of a camera whose images are recorded."""

    @property
    def name(self) -> str:
        """Return the camera's name."""
        ...

    @property
    def lens(self) -> Lens:
        """Return its lens."""
        ...

    @property
    def rig_from_camera(self) -> Pose:
        """Return its pose on the rig."""
        ...


class ObservationRecorder:
    """Writes the observations of one rig to a file."""

    def __init__(self, path: Path, file: McapFile, cameras: Sequence[RecordedCamera]) -> None:
        self._path, self._file, self._cameras = path, file, tuple(cameras)
        self._last_ns: int | None = None

    def add(self, observation: RawObservation) -> int:
        """Write one observation; return its timestamp in nanoseconds.

        Raises:
            OutputError: it is not after the one before, or the file cannot be written.

        """
        stamp_ns = stamp_of(observation.time_s)
        if self._last_ns is None:
            if not observation.world_from_cameras:
                self._begin(stamp_ns)
        elif stamp_ns <= self._last_ns:
            raise OutputError(
                f"cannot write {self._path}: an observation at {observation.time_s:g} s is not "
                f"after the one before, at {self._last_ns / NS_PER_S:g} s; sort them"
            )
        self._last_ns = stamp_ns
        made = self._file.messages
        self._file.add(TIME_TOPIC, ros.NUMBER, stamp_ns, made.number(observation.time_s))
        links = self._links(observation)
        self._file.add(TF_TOPIC, ros.TRANSFORMS, stamp_ns, made.transforms(stamp_ns, links))
        depths = observation.depths or (None,) * len(self._cameras)
        for camera, image, depth in zip(self._cameras, observation.images, depths, strict=True):
            # Even if the image is missing: the order of these topics is that of the cameras.
            info = made.camera_info(stamp_ns, frame_of(camera.name), camera.lens)
            self._file.add(topic_of(camera.name, "camera_info"), ros.CAMERA_INFO, stamp_ns, info)
            if image is not None:
                self._image(camera, "image_raw", stamp_ns, image)
            if depth is not None:
                raw = RawImage(depth, "32FC1")
                self._image(camera, "depth/image_raw", stamp_ns, raw)
        return stamp_ns

    def _links(self, observation: RawObservation) -> list[ros.Link]:
        """Return the transforms that change: of the rig, or of each camera."""
        if not observation.world_from_cameras:
            return [(WORLD, RIG, observation.world_from_rig)]
        both = zip(self._cameras, observation.world_from_cameras, strict=True)
        return [(WORLD, frame_of(camera.name), pose) for camera, pose in both]

    def _begin(self, stamp_ns: int) -> None:
        links = [(RIG, frame_of(camera.name), camera.rig_from_camera) for camera in self._cameras]
        made = self._file.messages.transforms(stamp_ns, links)
        self._file.add(STATIC_TOPIC, ros.TRANSFORMS, stamp_ns, made)

    def _image(self, camera: RecordedCamera, topic: str, stamp_ns: int, image: RawImage) -> None:
        frame = frame_of(camera.name)
        ending, kind, data = image.write(self._file.messages, stamp_ns, frame)
        self._file.add(f"{topic_of(camera.name, topic)}{ending}", kind, stamp_ns, data)


def stamp_of(time_s: float) -> int:
    """Return the nearest nanosecond to a time."""
    return round(time_s * NS_PER_S)
