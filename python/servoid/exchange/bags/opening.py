"""Opens a bag as a capture: combines topics, timestamps, calibrations and transforms."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from servoid.capture import Capture, CaptureCamera, examined
from servoid.config import MOST_CAMERAS
from servoid.errors import CaptureError
from servoid.exchange.bags.geometry.calibration import (
    BagCalibrationSupplier,
    Calibration,
    Info,
    calibration_of,
)
from servoid.exchange.bags.geometry.pairing import (
    APART_S,
    DEPTH_APART_NS,
    Moment,
    absence,
    allowed_ns,
    late_depth_note,
    nearest,
    pair,
    pairing_notes,
)
from servoid.exchange.bags.geometry.placing import Seat, lost_note, place_cameras
from servoid.exchange.bags.names import TIME_TOPIC, WORLD, short_names
from servoid.exchange.bags.stored.choosing import ImageTopic, choose
from servoid.exchange.bags.stored.content import Content, Shot, scan
from servoid.exchange.bags.stored.header import NS_PER_S
from servoid.exchange.bags.stored.pictures import BagDepth, BagPicture
from servoid.exchange.bags.stored.reader import Bag, open_files
from servoid.pose import Pose


def open_bag(
    path: str | Path,
    topics: Sequence[str] = (),
    *,
    world: str | None = None,
    apart_s: float = APART_S,
    supplier: BagCalibrationSupplier | None = None,
    rests: bool = False,
) -> Capture:
    """Open a ROS 1 bag, a rosbag2 folder or an MCAP file as a capture, which is a recording.

    `topics` are those of the images, one for each camera, and of depth that is registered to them;
    without any, the most likely ones are guessed, and `Capture.notes` report it. `world` is the TF
    frame of the poses, by default the top of the first camera's tree. Images of one observation
    were taken at most `apart_s` seconds apart.

    `supplier` returns the calibration if the bag lacks that of any camera, as `why_uncalibrated`
    reports; it then applies to all chosen cameras. If the rig `rests`, TF supplies the cameras'
    poses on it, but not its motion.

    The bag is read through once for its timestamps; images are read on request.

    Raises:
        CaptureError: there is no bag, it is damaged, or it lacks what a capture needs.
        CameraError: a camera cannot exist.
        PoseError: a transform is not a rigid motion.
        MissingExtraError: the library that reads bags is missing.

    """
    bag = open_files(Path(path))
    chosen = choose(bag, topics)
    if len(chosen.images) > MOST_CAMERAS:
        raise CaptureError(
            f"{path}: {len(chosen.images)} cameras; at most {MOST_CAMERAS} are allowed"
        )
    content = scan(bag, chosen)
    names = _names(chosen.images)
    if supplier is None:
        seats = [_seat(bag, image, content) for image in chosen.images]
    else:
        seats = _user_seats(bag, chosen.images, names, content, supplier)
    tracks = [
        _Track(name, seat, content.shots[seat.image.topic], _shots(content, depth))
        for name, seat, depth in zip(names, seats, chosen.depths, strict=True)
    ]
    stamps = [[shot.stamp_ns for shot in track.shots] for track in tracks]
    moments, most_ns = pair(stamps, apart_s), allowed_ns(stamps, apart_s)
    placing = place_cameras(
        str(bag.path),
        [track.seat for track in tracks],
        content.transforms,
        [moment.stamp_ns for moment in moments],
        WORLD if world is None and TIME_TOPIC in bag.kinds else world,
        rests=rests,
    )
    known = [
        (moment, pose)
        for moment, pose in zip(moments, placing.world_from_rig, strict=True)
        if pose is not None
    ]
    if not known:
        raise CaptureError(
            f"{bag.path}: TF has the cameras' poses at none of the images' times; record /tf "
            "for as long as the images, with the same clock"
        )
    lost = len(moments) - len(known)
    kept = [moment for moment, _ in known]
    capture = Capture(
        path=bag.path,
        cameras=tuple(
            track.camera(bag.path, pose, kept, index, most_ns)
            for index, (track, pose) in enumerate(zip(tracks, placing.rig_from_camera, strict=True))
        ),
        world_from_rig=tuple(pose for _, pose in known),
        times_s=tuple(content.times_s.get(one.stamp_ns, one.stamp_ns / NS_PER_S) for one in kept),
        rate_hz=_rate_hz(kept),
        notes=(
            *chosen.notes,
            *content.notes,
            *pairing_notes(names, stamps, moments),
            *(note for track in tracks if (note := track.depth_note()) is not None),
            *placing.notes,
            *([lost_note(lost, len(moments))] if lost else []),
        ),
    )
    return examined(capture)


def why_uncalibrated(path: str | Path, topics: Sequence[str] = ()) -> tuple[str, ...]:
    """Return for each camera of a bag why its calibration is missing; empty if none is missing.

    If one is missing, the user's calibration applies to all cameras; those that have one get an
    empty text. Arguments are those of `open_bag`.

    Raises:
        CaptureError: there is no bag, it is damaged, or it has no such images.
        MissingExtraError: the library that reads bags is missing.

    """
    bag = open_files(Path(path))
    why = tuple(_why_uncalibrated(bag, image) for image in choose(bag, topics).images)
    return why if any(why) else ()


def _why_uncalibrated(bag: Bag, image: ImageTopic) -> str:
    topic = image.info_topic
    if topic is None:
        return _no_info(bag, image)
    for message in bag.messages([topic]):
        if bag.decode(message, lambda decoded: Info.of(decoded, "").is_calibrated):
            return ""
    return _no_focal(bag, topic)


def _no_info(bag: Bag, image: ImageTopic) -> str:
    return f"{bag.path}: no camera_info belongs to {image.topic}"


def _no_focal(bag: Bag, topic: str) -> str:
    return f"{bag.path}: {topic} has no focal length: the camera is not calibrated"


@dataclass(frozen=True)
class _Track:
    """The images of one camera, and its depth images, both sorted by time."""

    name: str
    seat: Seat
    shots: Sequence[Shot]
    depths: Sequence[Shot]

    def camera(
        self,
        path: Path,
        rig_from_camera: Pose,
        moments: Sequence[Moment],
        index: int,
        most_ns: int,
    ) -> CaptureCamera:
        """Return the camera with its images at some instants; it is the `index`-th of the rig.

        Images of one instant are at most `most_ns` apart.
        """
        stamps = [shot.stamp_ns for shot in self.shots]
        depths_ns = [shot.stamp_ns for shot in self.depths]
        places = [moment.places[index] for moment in moments]
        shots = [None if place is None else self.shots[place] for place in places]
        pictures = (
            None if shot is None else BagPicture(path, label=f"{number:04}", at=shot.at)
            for number, shot in enumerate(shots)
        )
        return CaptureCamera(
            name=self.name,
            lens=self.seat.calibration.lens,
            rig_from_camera=rig_from_camera,
            pictures=tuple(pictures),
            mask_paths=(None,) * len(moments),
            depth_paths=tuple(self._depth(path, shot, depths_ns) for shot in shots),
            depth_scale_m=1.0 if self.depths else None,
            absences=tuple(
                absence(moment.stamp_ns, stamps, most_ns) if shot is None else None
                for moment, shot in zip(moments, shots, strict=True)
            ),
        )

    def depth_note(self) -> str | None:
        """Report depth images of which none was taken with an image; None if some were."""
        depths_ns = [shot.stamp_ns for shot in self.depths]
        return late_depth_note(self.name, [shot.stamp_ns for shot in self.shots], depths_ns)

    def _depth(self, path: Path, shot: Shot | None, depths_ns: Sequence[int]) -> BagDepth | None:
        """Return the depth image that was taken with an image."""
        place = None if shot is None else nearest(depths_ns, shot.stamp_ns)
        if shot is None or place is None:
            return None
        if abs(depths_ns[place] - shot.stamp_ns) > DEPTH_APART_NS:
            return None
        return BagDepth(path, self.depths[place].at)


def _seat(bag: Bag, image: ImageTopic, content: Content) -> Seat:
    """Combine a topic with its calibration."""
    topic = image.info_topic
    if topic is None:
        raise CaptureError(
            f"{_no_info(bag, image)}; record {image.camera}/camera_info too, or choose another "
            "topic"
        )
    info = content.infos.get(topic)
    if info is None:
        raise CaptureError(f"{_no_focal(bag, topic)}; calibrate it, or choose another camera")
    place = f"{bag.path}, {topic}"
    return Seat(image, calibration_of(info, image.size_px, place, is_rectified=image.is_rectified))


def _user_seats(
    bag: Bag,
    images: Sequence[ImageTopic],
    names: Sequence[str],
    content: Content,
    supplier: BagCalibrationSupplier,
) -> list[Seat]:
    """Combine topics with the calibration that the user supplies."""
    known = [image.info_topic for image in images if image.info_topic in content.infos]
    if len(known) == len(images):
        raise CaptureError(f"{bag.path} has its own calibration; leave the given calibration out")
    content.notes += [f"{topic} is not used, as another camera has none" for topic in known]
    frames = {image.frame for image in images}
    is_placed = len(frames) == len(images) and all(map(content.transforms.knows, frames))
    cameras = supplier(names, [image.size_px for image in images], is_placed=is_placed)
    return [
        Seat(image, Calibration.supplied(camera))
        for image, camera in zip(images, cameras, strict=True)
    ]


def _shots(content: Content, depth: ImageTopic | None) -> Sequence[Shot]:
    return () if depth is None else content.shots[depth.topic]


def _names(images: Sequence[ImageTopic]) -> list[str]:
    """Name cameras by their namespaces, or by their topics if these are ambiguous."""
    names = short_names([image.camera for image in images])
    if len(set(names)) == len(names):
        return names
    return [image.topic.strip("/").replace("/", "_") for image in images]


def _rate_hz(moments: Sequence[Moment]) -> float | None:
    """Return the usual rate; None for a single observation."""
    steps = np.diff([moment.stamp_ns for moment in moments])
    return NS_PER_S / float(np.median(steps)) if len(steps) else None
