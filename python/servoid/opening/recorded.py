"""Opens what a SOURCE names among recorded things, as a capture."""

import statistics
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid._native import Pose
from servoid.camera import Picture
from servoid.camera.exif import read_exif
from servoid.camera.image_size import read_image_size
from servoid.camera.images import shrink
from servoid.camera.video import VideoFacts, describe_video
from servoid.capture import Capture, CaptureCamera, count_uncalibrated, open_capture
from servoid.config.limits import IMAGE_FILE
from servoid.config.reading import read_bytes
from servoid.errors import CaptureError, ImageError
from servoid.exchange.opening import holds_capture_file, open_any
from servoid.opening.known import Known
from servoid.opening.word import Kind, SourceWord
from servoid.source import ASSUMED_HZ, MountedCamera
from servoid.words import counted, digits

_LONE, _PAIR = ("camera",), ("left", "right")
_HALF_TURN = 180


@dataclass(frozen=True)
class Opened:
    """A recorded source as a capture, and what had to be assumed, as sentences for people."""

    capture: Capture
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class HalfPicture(Picture):
    """The left or the right half of an image on disk; a column in the middle is left out."""

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
    known: Known | None = None,
    *,
    bop_object: int | None = None,
    images: str | Path | None = None,
    topics: Sequence[str] = (),
    world: str | None = None,
) -> Opened:
    """Open a recorded source as a capture; images are listed, not read.

    A video or images without a calibration become a recording, in which the object may move, of
    cameras at rest at the world's origin. `known` says how they see. The other arguments are those
    of `open_any`.

    Raises:
        CaptureError: the source is live or damaged, or nothing says how its cameras see.
        CameraError, ImageError, PoseError: as for the reader that opens it.

    """
    known = known or Known()
    if word.is_live:
        raise CaptureError(
            f"{word} is live, and this needs images that are recorded; keep some first with "
            f"servoid record {word} --out run, and give that folder"
        )
    if word.kind in (Kind.CAPTURE, Kind.BAG):
        if known.is_told and count_untold(word):
            capture = open_capture(word.place, told=partial(known.mounted, word.text))
        else:
            known.refuse(word.text)
            capture = open_any(
                word.place, bop_object=bop_object, images=images, topics=topics, world=world
            )
        if known.rate_hz is not None:
            if capture.times_s is not None:
                raise CaptureError(f"{word} knows its times itself; leave --rate out")
            capture = replace(capture, rate_hz=known.rate_hz)
        return Opened(capture)
    if bop_object is not None or images is not None:
        raise CaptureError(
            f"{word} is neither a BOP scene nor a COLMAP model, which alone need an object or a "
            "folder of images; leave these out"
        )
    if topics or world is not None:
        raise CaptureError(f"{word} is no bag, and only in such a one topics and frames are chosen")
    return _open_images(word, known) if word.kind is Kind.IMAGES else _open_videos(word, known)


def count_untold(word: SourceWord) -> int:
    """Count the cameras of a recorded source that does not say how they see; 0 if it does.

    Raises:
        CaptureError: the file of a capture is malformed.

    """
    if word.kind is Kind.VIDEOS or word.halves:
        return 2
    if word.kind in (Kind.VIDEO, Kind.IMAGES):
        return 1
    if word.kind is Kind.CAPTURE and holds_capture_file(word.place):
        return count_uncalibrated(word.place)
    return 0


def _open_videos(word: SourceWord, known: Known) -> Opened:
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
                f"{path} asks to be turned by {one.turn_deg} degrees when it is shown; it is not, "
                f"and pixels count in its {width}x{height} as they are stored"
            )
    rates = [one.rate_hz for one in facts if one.rate_hz is not None]
    if rates and max(rates) > 1.01 * min(rates):
        raise CaptureError(
            f"{word}: the videos have {' and '.join(digits(rate) for rate in rates)} images a "
            "second; images that were not taken at the same times are no pairs"
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


def _shown(stored_px: tuple[int, int], is_on_side: bool, known: Known) -> tuple[int, int]:
    """Return the size of upright images; a calibration says itself which size it is of."""
    width, height = stored_px
    return (height, width) if is_on_side and known.calibration is None else stored_px


def _times_s(facts: VideoFacts, count: int) -> tuple[float, ...] | None:
    if facts.times_s is not None:
        return facts.times_s[:count]
    if facts.rate_hz is not None:
        return tuple(index / facts.rate_hz for index in range(count))
    return None


def _open_images(word: SourceWord, known: Known) -> Opened:
    pictures = [Picture(path, upright=known.calibration is None) for path in word.places]
    exif = read_exif(read_bytes(word.place, ImageError, IMAGE_FILE))
    size_px = _shown(read_image_size(word.place), exif.is_on_side, known)
    return _capture(word, known, [pictures], [size_px], None, ())


def _capture(
    word: SourceWord,
    known: Known,
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
                f"{digits(rate_hz)} images a second are assumed, as nothing says their times; "
                "--rate says another",
            )
    capture = Capture(
        path=word.place,
        cameras=tuple(map(_camera, rig.cameras, pictures)),
        world_from_rig=(Pose.identity(),) * len(times_s),
        times_s=times_s,
        rate_hz=rate_hz,
    )
    return Opened(capture, (*rig.notes, *notes))


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
