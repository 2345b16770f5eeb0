"""Opens a recorded SOURCE as images for a scan, which estimates their poses."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from servoid._native import Lens
from servoid.brief import brief
from servoid.capture import Capture, CaptureCamera
from servoid.errors import CaptureError
from servoid.opening.given_calibration import GivenCalibration, any_cameras
from servoid.opening.openable import check_openable
from servoid.opening.recorded import count_uncalibrated_cameras, open_recorded
from servoid.opening.word import Kind, SourceWord
from servoid.scan import Footage, Partner, Recorded, holds_photographs, open_footage

_FISHEYE = "kannala_brandt"


@dataclass(frozen=True)
class Filmed:
    """The images of one camera, and what is known of the camera.

    `partner` is the second camera of a pair, if its distance is known. `lens` is the calibration as
    far as it is known, and `notes` are messages for the user.
    """

    footage: Footage
    partner: Partner | None = None
    lens: Lens | None = None
    notes: tuple[str, ...] = ()

    __repr__ = brief


def open_filmed(
    word: SourceWord, known: GivenCalibration | None = None, *, topics: Sequence[str] = ()
) -> Filmed:
    """Open a recorded source for a scan: the images of its first camera, in their order.

    A second camera determines the scale, if its distance is known from a calibration, or from the
    baseline of two parallel cameras.

    Raises:
        CaptureError: the source is live or damaged, or nothing that servoid opens.
        ScanError: two photographs have the same name.
        CameraError, ImageError, PoseError: as for the reader that opens it.

    """
    known = known or GivenCalibration()
    if word.kind in (Kind.VIDEO, Kind.IMAGES) and not word.halves:
        lens = open_recorded(word, known).capture.cameras[0].lens if known.supplies_lens else None
        return Filmed(open_footage(word.place if word.kind is Kind.VIDEO else word.text), lens=lens)
    if word.kind is Kind.CAPTURE and holds_photographs(word.place):
        known.refuse(word.text)
        return Filmed(open_footage(word.place))
    check_openable(word)
    if not word.is_live and count_uncalibrated_cameras(word, topics):
        return _of_uncalibrated(word, known, topics)
    opened = open_recorded(word, known, topics=topics, rests=True)  # refuses live sources
    return _of_rig(word, opened.capture)


def _of_uncalibrated(word: SourceWord, known: GivenCalibration, topics: Sequence[str]) -> Filmed:
    """Open cameras without a calibration of their own; the user may have given one."""
    if known.calibration is not None:
        return _of_rig(word, open_recorded(word, known, topics=topics, rests=True).capture)
    opened = open_recorded(word, any_cameras(known), topics=topics, rests=True)
    made = _of_rig(word, opened.capture)
    lens = made.lens if known.supplies_lens else None
    if opened.is_made_up:
        note = (
            "the second camera is not used, as its distance from the first is unknown; give "
            "--baseline or --calibration to get metres"
        )
        return Filmed(made.footage, lens=lens, notes=(*made.notes, note))
    return replace(made, lens=lens)


def _of_rig(word: SourceWord, capture: Capture) -> Filmed:
    """Take the first camera of a rig, and the second one if there is one."""
    cameras, notes = list(capture.cameras), capture.notes
    if cameras[0].lens.model == _FISHEYE:
        raise CaptureError(
            f"{word}: camera '{cameras[0].name}' has a fisheye, which a scan cannot estimate; "
            "rectify the images first"
        )
    if len(cameras) > 2:
        others = ", ".join(camera.name for camera in cameras[2:])
        notes = (*notes, f"camera {cameras[0].name} is scanned; {others} are not used")
    first = _footage(word, cameras[0])
    if len(cameras) == 1:
        return Filmed(first, lens=cameras[0].lens, notes=notes)
    apart = cameras[0].rig_from_camera.inverse() @ cameras[1].rig_from_camera
    metres = float(np.linalg.norm(apart.translation))
    if not metres > 0.0 or not capture.metric:
        return Filmed(first, lens=cameras[0].lens, notes=notes)
    partner = Partner(_footage(word, cameras[1]), metres)
    return Filmed(first, partner, cameras[0].lens, notes)


def _footage(word: SourceWord, camera: CaptureCamera) -> Recorded:
    if not any(camera.pictures):
        raise CaptureError(f"{word} has no image of camera '{camera.name}'; choose another one")
    return Recorded(word.place, tuple(camera.pictures), camera.lens.size_px)
