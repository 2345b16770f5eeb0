"""Checks whether images contradict a capture's focal length or the poses of its cameras.

Matched features in two images lie on each other's epipolar lines. If the capture's lens and poses
contradict this, and another focal length fits better, that focal length is reported. Finding the
features needs no calibration, so a wrong one does not hide them.
"""

from collections.abc import Callable, Sequence

from servoid._native import Lens
from servoid.camera import off_center_note, outside_note, square_note
from servoid.capture.capture import Capture, CaptureCamera
from servoid.capture.moving_rig import doubt_rig_poses
from servoid.capture.neighbours import Album
from servoid.capture.pair_doubt import doubt_pair
from servoid.capture.rig_doubt import doubt_rig
from servoid.capture.scan_doubt import scan_doubt
from servoid.capture.step_doubt import doubt_step
from servoid.capture.view_doubt import doubt_views
from servoid.words import camera_called


def doubt_calibration(
    capture: Capture, *, last: int | None = None, rests: bool = False
) -> str | None:
    """Return a message if images contradict the calibration of a capture's cameras, else None.

    The cameras of a rig are compared at the same instants, and views of a static scene with those
    from near places. A recording is taken for static only if it `rests`: most of what the cameras
    see, as for a model. Images that two cameras have exchanged are reported first, and features
    that would be behind two cameras, or do not fit their poses, last. Parallel cameras at one pose
    do not determine the focal length; it is compared only if nobody measured it, and then only for
    their being parallel. One stationary camera determines nothing. Parallel cameras that the first
    images show to be right are compared again at the observation `last`, by default the capture's,
    unless it is late in a video. A principal point outside of the image, as of a calibration for
    larger images, is reported without looking at them, and one far from the middle, or pixels that
    are not square, beside what they say.
    """
    outside = _first_note(outside_note, capture.cameras)
    if outside is not None:
        return outside
    notes = (
        _first_note(off_center_note, capture.cameras),
        _first_note(square_note, capture.cameras),
        _doubt_images(capture, last=last, rests=rests),
    )
    return "; ".join(note for note in notes if note is not None) or None


def doubt_for_model(capture: Capture) -> str | None:
    """Return a message if images contradict the calibration or the poses of a model's capture.

    What is modelled must rest, so that images from several poses are compared, those of a recording
    as well. What a scan doubts of its own poses is reported before what the images say.
    """
    notes = (scan_doubt(capture), _doubt_resting(capture))
    return "; ".join(note for note in notes if note is not None) or None


def _doubt_resting(capture: Capture) -> str | None:
    """Return a message if images of what rests contradict the calibration or the poses, else None.

    Cameras out of step are reported first: what they see of moving things contradicts a right
    calibration.
    """
    late = doubt_step(capture)
    if late is not None:
        return late
    doubt = doubt_calibration(capture, rests=True)
    is_still = all(pose == capture.world_from_rig[0] for pose in capture.world_from_rig)
    return doubt if doubt is not None or is_still else doubt_rig_poses(capture)


def _first_note(
    note_of: Callable[[str, Lens], str | None], cameras: Sequence[CaptureCamera]
) -> str | None:
    """Return the note on the first of the cameras that has one."""
    notes = (note_of(camera_called(camera.name), camera.lens) for camera in cameras)
    return next((note for note in notes if note is not None), None)


def _doubt_images(capture: Capture, *, last: int | None, rests: bool) -> str | None:
    """Return a message if matched features contradict the calibration, else None."""
    album, cameras, note = Album(capture), capture.cameras, None
    if len(cameras) > 1 and _share_instants(cameras):
        doubt = doubt_pair if len(cameras) == 2 else doubt_rig
        note = doubt(album, last=last)
    if note is None and (rests or not capture.is_recording):
        return doubt_views(album)
    return note


def _share_instants(cameras: Sequence[CaptureCamera]) -> bool:
    """Return whether two of the cameras have images of one observation.

    Images that were each taken from a pose of its own are observations of their own.
    """
    counts = (sum(picture is not None for picture in camera.pictures) for camera in cameras)
    seen = zip(*(camera.pictures for camera in cameras), strict=True)
    return sum(counts) > sum(any(one is not None for one in each) for each in seen)
