"""Opens a recorded SOURCE as a capture."""

import statistics
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid._native import Pose
from servoid.brief import brief
from servoid.camera import Picture, VideoFacts, describe_video, read_exif, read_image_size, shrink
from servoid.capture import (
    Capture,
    CaptureCamera,
    MountedLens,
    check_pictured_once,
    count_uncalibrated,
    examined,
    open_capture,
    order_note,
)
from servoid.config import IMAGE_FILE, read_bytes
from servoid.errors import CaptureError, ImageError
from servoid.exchange import holds_capture_file, open_any, open_bag
from servoid.exchange.bags import SuppliedCamera, why_uncalibrated
from servoid.opening.given_calibration import GivenCalibration, Rig, remedies
from servoid.opening.openable import check_openable
from servoid.opening.word import Kind, SourceWord
from servoid.source import ASSUMED_HZ, MountedCamera
from servoid.words import counted, digits

_LONE, _PAIR = ("camera",), ("left", "right")
_HALF_TURN = 180


@dataclass(frozen=True)
class Opened:
    """A recorded source as a capture, and the assumptions, as messages for the user.

    With `is_made_up` the poses of the cameras on the rig are arbitrary, as only images matter.
    """

    capture: Capture
    notes: tuple[str, ...] = ()
    is_made_up: bool = False

    __repr__ = brief


@dataclass(frozen=True)
class HalfPicture(Picture):
    """The left or right half of an image on disk; a middle column of odd widths is left out."""

    is_right: bool = False
    whole_px: tuple[int, int] = (0, 0)

    def read(self, size_px: tuple[int, int], by: int = 1) -> NDArray[np.uint8]:
        """Read the half, whose size (width, height) is given; otherwise as `Picture.read`."""
        width = size_px[0]
        whole = super().read(self.whole_px)
        half = whole[:, -width:] if self.is_right else whole[:, :width]
        return np.ascontiguousarray(shrink(half, by), dtype=np.uint8)


def open_recorded(
    word: SourceWord,
    known: GivenCalibration | None = None,
    *,
    bop_object: int | None = None,
    images: str | Path | None = None,
    topics: Sequence[str] = (),
    world: str | None = None,
    unit_m: float | None = None,
    rests: bool = False,
) -> Opened:
    """Open a recorded source as a capture; images are listed, not read.

    A video or images without a calibration become a recording of stationary cameras at the world's
    origin, in which the object may move; `known` supplies the calibration. The other arguments are
    those of `open_any`, and of `open_bag`.

    Raises:
        CaptureError: the source is live or damaged, has no calibration, or is nothing that servoid
            opens.
        CameraError, ImageError, PoseError: as for the reader that opens it.

    """
    known = known or GivenCalibration()
    if word.is_live:
        raise CaptureError(
            f"{word} is live, but a recorded source is needed; record one with "
            f"servoid record {word} --out run, and give that folder"
        )
    is_plain = bop_object is None and images is None and unit_m is None
    if is_plain:  # otherwise `open_any` says what these need
        check_openable(word)
    if word.kind in (Kind.CAPTURE, Kind.BAG):
        if word.kind is Kind.BAG and is_plain:
            opened = _open_bag(word, known, topics, world=world, rests=rests)
        elif (
            word.kind is Kind.CAPTURE
            and known.supplies_calibration
            and count_uncalibrated_cameras(word)
        ):
            calibration = _UserCalibration(word, known)
            opened = calibration.opened(open_capture(word.place, supplier=calibration.mounted))
        else:
            known.refuse(word.text)
            capture = open_any(
                word.place,
                bop_object=bop_object,
                images=images,
                topics=topics,
                world=world,
                unit_m=unit_m,
            )
            opened = Opened(capture)
        if known.rate_hz is not None:
            if opened.capture.times_s is not None:
                raise CaptureError(f"{word} has its own times; leave --rate out")
            opened = replace(opened, capture=replace(opened.capture, rate_hz=known.rate_hz))
        return opened
    if bop_object is not None or images is not None:
        raise CaptureError(
            f"{word} is neither a BOP scene nor a COLMAP model; only these take an object or a "
            "folder of images; leave these out"
        )
    if unit_m is not None:
        raise CaptureError(
            f"{word} is neither a COLMAP model nor a transforms.json; only their lengths are in a "
            "unit that can be given; leave it out"
        )
    if topics or world is not None:
        raise CaptureError(f"{word} is not a bag; topics and frames can be chosen only in a bag")
    return _open_images(word, known) if word.kind is Kind.IMAGES else _open_videos(word, known)


def count_uncalibrated_cameras(word: SourceWord, topics: Sequence[str] = ()) -> int:
    """Count the cameras of a recorded source that has no calibration; 0 if it has one.

    `topics` are the topics that are chosen in a bag.

    Raises:
        CaptureError: the file of a capture is malformed, or a bag is damaged.
        MissingExtraError: the library that reads bags is missing.

    """
    if word.kind is Kind.BAG:
        return len(why_uncalibrated(word.place, topics))
    if word.kind is Kind.VIDEOS or word.halves:
        return 2
    if word.kind in (Kind.VIDEO, Kind.IMAGES):
        return 1
    if word.kind is Kind.CAPTURE and holds_capture_file(word.place):
        return count_uncalibrated(word.place)
    return 0


def _open_bag(
    word: SourceWord,
    known: GivenCalibration,
    topics: Sequence[str],
    *,
    world: str | None,
    rests: bool,
) -> Opened:
    why = why_uncalibrated(word.place, topics)
    if not why:
        known.refuse(word.text)
        return Opened(open_bag(word.place, topics, world=world, rests=rests))
    if not known.supplies_calibration:
        reason = next(filter(None, why))
        raise CaptureError(f"{reason}; {remedies(len(why))}; --topic chooses other cameras")
    calibration = _UserCalibration(word, known)
    return calibration.opened(
        open_bag(word.place, topics, world=world, supplier=calibration, rests=rests)
    )


class _UserCalibration:
    """Supplies the calibration of a source's cameras, and keeps the assumptions that it made."""

    def __init__(self, word: SourceWord, known: GivenCalibration) -> None:
        self._word, self._known = word, known
        self._rig = Rig(())

    def __call__(
        self, names: Sequence[str], sizes_px: Sequence[tuple[int, int]], /, *, is_placed: bool
    ) -> list[SuppliedCamera]:
        """Return the calibration of a bag's cameras."""
        known = self._known
        is_seated = is_placed or known.is_any or known.calibration is not None
        if len(names) > 1 and not is_seated and known.baseline_m is None:
            raise CaptureError(
                f"{self._word}: neither TF nor the options give the poses of its cameras "
                f"{', '.join(names)}; give --calibration FILE, or --baseline for two that are "
                "parallel, or choose one of them with --topic"
            )
        rig = self._rig = known.rig(self._word.text, names, sizes_px, is_placed=is_placed)
        return [
            SuppliedCamera(one.lens, one.rig_from_camera if rig.is_seated else None)
            for one in rig.cameras
        ]

    def mounted(
        self, names: Sequence[str], sizes_px: Sequence[tuple[int, int]]
    ) -> list[MountedLens]:
        """Return the calibration of a capture's cameras."""
        # A capture has the poses of its rig, but not those of several cameras on the rig.
        is_placed = len(names) == 1
        self._rig = self._known.rig(self._word.text, names, sizes_px, is_placed=is_placed)
        return [MountedLens(one.lens, one.rig_from_camera) for one in self._rig.cameras]

    def opened(self, capture: Capture) -> Opened:
        """Return the capture that was opened with this calibration, with the assumptions made."""
        told = replace(capture, measured=self._known.is_measured)
        return Opened(told, self._rig.notes, self._rig.is_made_up)


def _open_videos(word: SourceWord, known: GivenCalibration) -> Opened:
    facts = [describe_video(path) for path in word.places]
    count = min(one.count for one in facts)
    notes = []
    for path, one in zip(word.places, facts, strict=True):
        if one.count > count:
            more = counted(one.count - count, "image")
            notes.append(f"{path} has {more} more than the other, which are left out")
        if one.turn_deg and known.calibration is not None:
            width, height = one.size_px
            notes.append(
                f"{path} requests a rotation by {one.turn_deg} degrees for display, which is not "
                f"applied: pixel coordinates are those of its {width}x{height} as stored"
            )
    rates = [one.rate_hz for one in facts if one.rate_hz is not None]
    if rates and max(rates) > 1.01 * min(rates):
        raise CaptureError(
            f"{word}: the videos have {' and '.join(digits(rate) for rate in rates)} images per "
            "second; images that were not taken at the same times are not pairs"
        )
    upright = known.calibration is None
    pictures = [
        [Picture(path, index, upright=upright) for index in range(count)] for path in word.places
    ]
    times_s = None if known.rate_hz is not None else _times_s(facts[0], count)
    on_side = [one.turn_deg not in (0, _HALF_TURN) for one in facts]
    sizes_px = [
        _shown(one.size_px, turned, known) for one, turned in zip(facts, on_side, strict=True)
    ]
    return _capture(word, known, pictures, sizes_px, times_s, tuple(notes))


def _shown(
    stored_px: tuple[int, int], is_on_side: bool, known: GivenCalibration
) -> tuple[int, int]:
    """Return the size of upright images; a calibration has a size of its own."""
    width, height = stored_px
    return (height, width) if is_on_side and known.calibration is None else stored_px


def _times_s(facts: VideoFacts, count: int) -> tuple[float, ...] | None:
    if facts.times_s is not None:
        return facts.times_s[:count]
    if facts.rate_hz is not None:
        return tuple(index / facts.rate_hz for index in range(count))
    return None


def _open_images(word: SourceWord, known: GivenCalibration) -> Opened:
    check_pictured_once(word.places, word.text)
    note = order_note(word.places, f"the images of {word}")
    pictures = [Picture(path, upright=known.calibration is None) for path in word.places]
    exif = read_exif(read_bytes(word.place, ImageError, IMAGE_FILE))
    size_px = _shown(read_image_size(word.place), exif.is_on_side, known)
    return _capture(word, known, [pictures], [size_px], None, () if note is None else (note,))


def _capture(
    word: SourceWord,
    known: GivenCalibration,
    pictures: list[list[Picture]],
    sizes_px: list[tuple[int, int]],
    times_s: tuple[float, ...] | None,
    notes: tuple[str, ...],
) -> Opened:
    if word.halves:
        whole_px = sizes_px[0]
        width, height = whole_px
        sizes_px = [(width // 2, height)] * 2
        (whole,) = pictures
        pictures = [
            [
                HalfPicture(
                    one.path,
                    one.index,
                    upright=one.upright,
                    is_right=is_right,
                    whole_px=whole_px,
                )
                for one in whole
            ]
            for is_right in (False, True)
        ]
    names = _LONE if len(pictures) == 1 else _PAIR
    if len(pictures) > len(_PAIR):
        names = tuple(f"camera_{number}" for number in range(1, len(pictures) + 1))
    rig = known.rig(word.text, names, sizes_px)
    rate_hz = known.rate_hz or _rate_hz(times_s) or ASSUMED_HZ
    if times_s is None:
        times_s = tuple(index / rate_hz for index in range(len(pictures[0])))
        if known.rate_hz is None:
            notes = (
                *notes,
                f"{digits(rate_hz)} images per second are assumed, as their times are unknown; "
                "--rate sets another",
            )
    capture = Capture(
        path=word.place,
        cameras=tuple(map(_camera, rig.cameras, pictures)),
        world_from_rig=(Pose.identity(),) * len(times_s),
        times_s=times_s,
        rate_hz=rate_hz,
        measured=known.is_measured,
    )
    return Opened(examined(capture), (*rig.notes, *notes), rig.is_made_up)


def _rate_hz(times_s: tuple[float, ...] | None) -> float | None:
    if times_s is None or len(times_s) < 2:
        return None
    steps = [after - before for before, after in pairwise(times_s)]
    return 1.0 / statistics.median(steps)


def _camera(camera: MountedCamera, pictures: list[Picture]) -> CaptureCamera:
    nothing = (None,) * len(pictures)
    return CaptureCamera(
        name=camera.name,
        lens=camera.lens,
        rig_from_camera=camera.rig_from_camera,
        pictures=tuple(pictures),
        mask_paths=nothing,
        depth_paths=nothing,
    )
