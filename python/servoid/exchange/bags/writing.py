"""Writes observations as MCAP with ROS 2 messages, so that they replay to the same bits."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Protocol

from servoid._native import Lens
from servoid.errors import OutputError
from servoid.exchange.bags.mcap import messages as ros
from servoid.exchange.bags.mcap.mcap_file import McapFile, check_mcap, mcap_file
from servoid.exchange.bags.mcap.raw_images import RawImage, RawObservation, raw_observations
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

__all__ = [
    "RawImage",
    "RawObservation",
    "RecordedCamera",
    "check_mcap",
    "raw_observations",
    "write_mcap_recording",
]


class RecordedCamera(Protocol):
    """What is known of a camera whose images are recorded."""

    @property
    def name(self) -> str:
        """Return what the camera is called."""
        ...

    @property
    def lens(self) -> Lens:
        """Return how it sees."""
        ...

    @property
    def rig_from_camera(self) -> Pose:
        """Return where it is on its rig."""
        ...


def write_mcap_recording(
    path: str | Path,
    cameras: Sequence[RecordedCamera],
    observations: Iterable[RawObservation],
    watch: Callable[[int], None] | None = None,
) -> int:
    """Write observations as they come, and return how many there were.

    The file is at `path` when the last one is written; if anything fails, nothing is left of it.
    Compressed images stay compressed, and pixels are written as they are. `open_bag` makes a
    capture of the file with the same images, times and poses, to the last bit. `watch` hears how
    many observations there are by now.

    Raises:
        OutputError: the file cannot be written, there is no observation, or times do not increase.
        MissingExtraError: the library that writes bags is missing.
        Whatever `observations` raises.

    """
    count = 0
    with mcap_file(path) as file:
        recorder = ObservationRecorder(Path(path), file, cameras)
        for observation in observations:
            recorder.add(observation)
            count += 1
            if watch is not None:
                watch(count)
        if not count:
            raise OutputError(f"cannot write {path}: there is no observation to record")
    return count


class ObservationRecorder:
    """Writes the observations of one rig into a file."""

    def __init__(self, path: Path, file: McapFile, cameras: Sequence[RecordedCamera]) -> None:
        self._path, self._file, self._cameras = path, file, tuple(cameras)
        self._last_ns: int | None = None

    def add(self, observation: RawObservation) -> int:
        """Write one observation; return its stamp in nanoseconds.

        Raises:
            OutputError: it is not after the one before, or the file cannot be written.

        """
        stamp_ns = stamp_of(observation.time_s)
        if self._last_ns is None:
            self._begin(stamp_ns)
        elif stamp_ns <= self._last_ns:
            raise OutputError(
                f"cannot write {self._path}: an observation at {observation.time_s:g} s is not "
                f"after the one before, at {self._last_ns / NS_PER_S:g} s; bring them in order"
            )
        self._last_ns = stamp_ns
        made = self._file.messages
        self._file.add(TIME_TOPIC, ros.NUMBER, stamp_ns, made.number(observation.time_s))
        link = (WORLD, RIG, observation.world_from_rig)
        self._file.add(TF_TOPIC, ros.TRANSFORMS, stamp_ns, made.transforms(stamp_ns, [link]))
        depths = observation.depths or (None,) * len(self._cameras)
        for camera, image, depth in zip(self._cameras, observation.images, depths, strict=True):
            # Also where the image is missing: the order of the cameras is that of these topics.
            info = made.camera_info(stamp_ns, frame_of(camera.name), camera.lens)
            self._file.add(topic_of(camera.name, "camera_info"), ros.CAMERA_INFO, stamp_ns, info)
            if image is not None:
                self._image(camera, "image_raw", stamp_ns, image)
            if depth is not None:
                raw = RawImage(depth, "32FC1")
                self._image(camera, "depth/image_raw", stamp_ns, raw)
        return stamp_ns

    def _begin(self, stamp_ns: int) -> None:
        links = [(RIG, frame_of(camera.name), camera.rig_from_camera) for camera in self._cameras]
        made = self._file.messages.transforms(stamp_ns, links)
        self._file.add(STATIC_TOPIC, ros.TRANSFORMS, stamp_ns, made)

    def _image(self, camera: RecordedCamera, topic: str, stamp_ns: int, image: RawImage) -> None:
        frame = frame_of(camera.name)
        ending, kind, data = image.write(self._file.messages, stamp_ns, frame)
        self._file.add(f"{topic_of(camera.name, topic)}{ending}", kind, stamp_ns, data)


def stamp_of(time_s: float) -> int:
    """Return the nanosecond that is nearest to a time."""
    return round(time_s * NS_PER_S)
