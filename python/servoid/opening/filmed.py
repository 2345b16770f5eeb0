"""Opens what a SOURCE names among recorded things as images whose poses are to be found."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from servoid._native import Lens
from servoid.capture import Capture, CaptureCamera
from servoid.errors import CaptureError
from servoid.exchange.opening import is_capture
from servoid.opening.known import Known, any_cameras
from servoid.opening.recorded import count_untold, open_recorded
from servoid.opening.word import Kind, SourceWord
from servoid.scan import Footage, Partner, Recorded, holds_photographs, open_footage

_FISHEYE = "kannala_brandt"


@dataclass(frozen=True)
class Filmed:
    """The images of one camera, and what is known beside them.

    `partner` is the second eye of a pair, where it is known how far it is away. `lens` is how the
    camera sees as far as that is told, and `notes` are sentences for people.
    """

    footage: Footage
    partner: Partner | None = None
    lens: Lens | None = None
    notes: tuple[str, ...] = ()


def open_filmed(
    word: SourceWord, known: Known | None = None, *, topics: Sequence[str] = ()
) -> Filmed:
    """Open a recorded source for a scan: the images of its first camera, in their order.

    Of two cameras the second one tells the scale, if a calibration, or the baseline of two that
    look in parallel, says how far it is away.

    Raises:
        CaptureError: the source is live or damaged.
        ScanError: it holds no photograph.
        CameraError, ImageError, PoseError: as for the reader that opens it.

    """
    known = known or Known()
    if word.kind in (Kind.VIDEO, Kind.IMAGES) and not word.halves:
        lens = open_recorded(word, known).capture.cameras[0].lens if known.tells_lens else None
        return Filmed(open_footage(word.place if word.kind is Kind.VIDEO else word.text), lens=lens)
    if word.kind is Kind.CAPTURE and (holds_photographs(word.place) or not is_capture(word.place)):
        known.refuse(word.text)
        return Filmed(open_footage(word.place))
    if not word.is_live and count_untold(word, topics):
        return _of_untold(word, known, topics)
    opened = open_recorded(word, known, topics=topics, rests=True)  # refuses live ones
    return _of_rig(word, opened.capture)


def _of_untold(word: SourceWord, known: Known, topics: Sequence[str]) -> Filmed:
    """Open cameras of which only a person may have told how they see and where they sit."""
    if known.calibration is not None:
        return _of_rig(word, open_recorded(word, known, topics=topics, rests=True).capture)
    opened = open_recorded(word, any_cameras(known), topics=topics, rests=True)
    made = _of_rig(word, opened.capture)
    lens = made.lens if known.tells_lens else None
    if opened.is_made_up:
        note = (
            "the second eye is not used, as nothing says how far it is from the first one; "
            "--baseline or --calibration does, and gives metres"
        )
        return Filmed(made.footage, lens=lens, notes=(*made.notes, note))
    return replace(made, lens=lens)


def _of_rig(word: SourceWord, capture: Capture) -> Filmed:
    """Take the first camera of a rig, and the second one where there is one."""
    cameras, told = list(capture.cameras), capture.notes
    if cameras[0].lens.model == _FISHEYE:
        raise CaptureError(
            f"{word}: camera '{cameras[0].name}' has a fisheye, which a scan cannot find; rectify "
            "the images first"
        )
    if len(cameras) > 2:
        others = ", ".join(camera.name for camera in cameras[2:])
        told = (*told, f"camera {cameras[0].name} is scanned; {others} are not used")
    first = _footage(word, cameras[0])
    if len(cameras) == 1:
        return Filmed(first, lens=cameras[0].lens, notes=told)
    apart = cameras[0].rig_from_camera.inverse() @ cameras[1].rig_from_camera
    metres = float(np.linalg.norm(apart.translation))
    if not metres > 0.0 or not capture.metric:
        return Filmed(first, lens=cameras[0].lens, notes=told)
    partner = Partner(_footage(word, cameras[1]), metres)
    return Filmed(first, partner, cameras[0].lens, told)


def _footage(word: SourceWord, camera: CaptureCamera) -> Recorded:
    if not any(camera.pictures):
        raise CaptureError(f"{word} has no image of camera '{camera.name}'; choose another one")
    return Recorded(word.place, tuple(camera.pictures), camera.lens.size_px)
