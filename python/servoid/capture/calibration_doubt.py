"""Checks whether images contradict a capture's focal length or the poses of its cameras.

Matched features in two images lie on each other's epipolar lines. If the capture's lens and poses
contradict this, and another focal length fits better, that focal length is reported. Finding the
features needs no calibration, so a wrong one does not hide them.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from servoid._native import Lens, Pose
from servoid.camera import Picture, Recorded, off_center_note, outside_note
from servoid.capture.capture import Capture, CaptureCamera
from servoid.capture.exchanged import (
    contradiction_note,
    exchange_note,
    repeated_note,
    until_settled,
)
from servoid.capture.matched_features import (
    FIRST_OF_VIDEO,
    MatchedFeatures,
    PosedPicture,
    match_features,
    unit_px,
)
from servoid.pose import Floats, exact
from servoid.words import camera_called, digits

_PAIRS = 4
_LEAST = 60  # matches
_APART = 0.1  # of the spread of the views: nearer ones constrain nothing
_LEAST_TURN = 1e-4  # of the axes of two cameras, below which the focal length is unobservable
# The focal lengths to try, as factors of the given one.
_TRIED = exact.exp(np.linspace(-0.8, 0.8, 321))
_CLOSE = 0.02  # relative error of the focal length that is not reported
_BETTER = 1.1  # factor by which the distances of features to their lines must decrease
# The same where features contradict a pair: 11 and more for wrong focal lengths, 1.7 to 2.2 for a
# recorded camera that is turned by 2 degrees.
_EXPLAINED = 4.0
_PARTS = 8  # of the matches, for leave-one-part-out; all parts must agree
_SURE = 4.0  # standard deviations
_FIT_PX = 1.0  # at 1000 px of diagonal: features that fit are nearer to their lines than this
_OFF_PX = 2.5  # at 1000 px of diagonal: features further off contradict the cameras' poses
_AT_END = "a camera was moved meanwhile, as at the end, though not at the start,"


def doubt_calibration(
    capture: Capture, *, is_assumed: bool = False, last: int | None = None
) -> str | None:
    """Return a message if images contradict the calibration of a capture's cameras, else None.

    Two cameras are compared at the same instants, one camera at views of a static scene. Images
    that the two cameras have exchanged are reported first, and features that would be behind two
    cameras, or do not fit their poses, last. Parallel cameras do not determine the focal length; it
    is compared only if it `is_assumed`, and then only for their being parallel. One stationary
    camera determines nothing. Parallel cameras that the first images show to be right are compared
    again at the observation `last`, by default the capture's, unless it is late in a video. A
    principal point outside of the image, as of a calibration for larger images, is reported without
    looking at them, and one far from the middle beside what they say.
    """
    outside = _first_note(outside_note, capture.cameras)
    if outside is not None:
        return outside
    notes = (
        _first_note(off_center_note, capture.cameras),
        _doubt_images(capture, is_assumed=is_assumed, last=last),
    )
    return "; ".join(note for note in notes if note is not None) or None


def _first_note(
    note_of: Callable[[str, Lens], str | None], cameras: Sequence[CaptureCamera]
) -> str | None:
    """Return the note on the first of the cameras that has one."""
    notes = (note_of(camera_called(camera.name), camera.lens) for camera in cameras)
    return next((note for note in notes if note is not None), None)


def _doubt_images(capture: Capture, *, is_assumed: bool, last: int | None) -> str | None:
    """Return a message if matched features contradict the calibration, else None."""
    matched = _pairs(capture)
    if len(capture.cameras) == 1:
        return _doubt_fit(list(matched), is_rig=False)
    first, second = capture.cameras[:2]
    names = first.name, second.name
    repeated = _repeated(first, second)
    if repeated is not None:
        return repeated
    if not (is_assumed or _constrains_focal(_second_from_first(first, second))):
        pairs = list(until_settled(matched))
        note = exchange_note(names, pairs) or contradiction_note(names, pairs)
        return note or _doubt_end(capture, names, last, is_settled=bool(pairs))
    pairs = list(matched)
    return exchange_note(names, pairs) or _doubt_turned(names, pairs)


def _doubt_end(
    capture: Capture, names: tuple[str, str], last: int | None, *, is_settled: bool
) -> str | None:
    """Return a message if the last images contradict the calibration, else None.

    `is_settled` says that the first ones do not.
    """
    first, second = capture.cameras[:2]
    there = [at for at, _ in _of_both(first, second) if last is None or at <= last]
    if len(there) < 2 or (there[-1] >= FIRST_OF_VIDEO and _is_video(first)):
        return None
    pair = _pair((first, second), (there[-1], there[-1]), _second_from_first(first, second))
    note = contradiction_note(names, pair)
    return note and (f"{_AT_END} {note}" if is_settled else note)


def _of_both(one: CaptureCamera, other: CaptureCamera) -> list[tuple[int, tuple[Picture, Picture]]]:
    """Return the instants at which two cameras have images, each with these."""
    pairs = enumerate(zip(one.pictures, other.pictures, strict=True))
    return [(at, (a, b)) for at, (a, b) in pairs if a is not None and b is not None]


def _is_video(camera: CaptureCamera) -> bool:
    """Return whether its images are those of a video, where late ones take long to reach."""
    return any(picture is not None and picture.index is not None for picture in camera.pictures)


def _doubt_turned(names: tuple[str, str], pairs: Sequence[MatchedFeatures]) -> str | None:
    """Return a message if features contradict two cameras that are turned to each other.

    A focal length is named only if it explains what contradicts them: where a camera is turned, a
    longer one also fits better, but not well.
    """
    note = contradiction_note(names, pairs)
    if note is None:
        return _doubt_fit(pairs, is_rig=True)
    _, off_px, best_px = _best(pairs)
    may_be_focal = off_px > _EXPLAINED * best_px
    return _doubt_fit(pairs, is_rig=True, may_be_focal=may_be_focal) or note


def _second_from_first(first: CaptureCamera, second: CaptureCamera) -> Pose:
    return second.rig_from_camera.inverse() @ first.rig_from_camera


def _doubt_fit(
    pairs: Sequence[MatchedFeatures], *, is_rig: bool, may_be_focal: bool = True
) -> str | None:
    """Return a message if features are far from their epipolar lines, else None."""
    if sum(len(pair.first_px) for pair in pairs) < _LEAST:
        return None
    given_px = float(np.mean(pairs[0].lenses[0].focal_px))
    unit = unit_px(pairs[0].lenses[0])
    share, off_px, best_px = _best(pairs)
    # An object on a turntable before a static room fits no focal length.
    is_found = may_be_focal and best_px < _FIT_PX * unit
    if is_found and off_px > _BETTER * best_px and abs(share - 1.0) > _CLOSE:
        others = np.array(
            [_best([_without(pair, number) for pair in pairs])[0] for number in range(_PARTS)]
        )
        deviation = float(np.sqrt((_PARTS - 1) * np.mean(np.square(others - share))))
        if abs(share - 1.0) > _SURE * deviation:
            bound = {_TRIED[0]: "at most", _TRIED[-1]: "at least"}.get(share, "about")
            return (
                f"the images fit a focal length of {bound} {share * given_px:.0f} px better than "
                f"{given_px:.0f} px: features are {digits(round(best_px, 2))} px from where the "
                f"other image predicts them, instead of {digits(round(off_px, 2))}; calibrate again"
            )
    if is_rig and min(off_px, best_px) > _OFF_PX * unit:
        return (
            f"the images contradict the poses of the cameras: features are {off_px:.1f} px "
            "from where the other image predicts them; calibrate again"
        )
    return None


def _repeated(one: CaptureCamera, other: CaptureCamera) -> str | None:
    """Report two cameras whose images are equal at the first instant, the middle or the last."""
    both = _of_both(one, other)
    if _is_video(one) or _is_video(other):
        both = both[:FIRST_OF_VIDEO]
    for place in sorted({0, len(both) // 2, len(both) - 1}) if both else ():
        at, pictures = both[place]
        first, second = (
            PosedPicture(picture, camera.lens, Recorded(camera.lens.size_px))
            for picture, camera in zip(pictures, (one, other), strict=True)
        )
        note = repeated_note((one.name, other.name), first, second)
        if note is not None:
            return note if place == 0 else f"in observation {at}, {note}"
    return None


def _best(pairs: Sequence[MatchedFeatures]) -> tuple[float, float, float]:
    """Return the best factor of the focal length, and the median distances as given and with it."""

    def off_px(share: float) -> float:
        return float(np.median(np.concatenate([_off_px(pair, share) for pair in pairs])))

    offs = [off_px(float(share)) for share in _TRIED]
    least = int(np.argmin(offs))
    return float(_TRIED[least]), off_px(1.0), offs[least]


def _without(pair: MatchedFeatures, number: int) -> MatchedFeatures:
    """Return a pair without one part of its features."""
    return pair.part(np.arange(len(pair.first_px)) % _PARTS != number)


def _off_px(pair: MatchedFeatures, share: float) -> Floats:
    """Return the distances of features to their epipolar lines for a focal length factor."""
    first, second = (
        _flat(lens, pixels, share)
        for lens, pixels in zip(pair.lenses, (pair.first_px, pair.second_px), strict=True)
    )
    matrix = pair.second_from_first.matrix()
    x, y, z = matrix[:3, 3] / exact.norm(matrix[:3, 3])
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    essential = exact.product(cross, matrix[:3, :3])
    there, back = exact.product(first, essential.T), exact.product(second, essential)
    slope = exact.hypot(exact.lengths(there[:, :2]), exact.lengths(back[:, :2]))
    off = np.abs((second * there).sum(axis=1)) / np.maximum(slope, 1e-12)
    # Where a shorter focal length puts a feature, a lens with strong distortion may see nothing.
    return np.where(np.isfinite(off), off * share * pair.lenses[0].focal_px[0], np.inf)


def _flat(lens: Lens, pixels: Floats, share: float) -> Floats:
    """Return rays, (N, 3) with z = 1, for a lens whose focal length is multiplied by a factor."""
    center = np.array(lens.center_px)
    rays = lens.rays((pixels - center) / share + center)
    return rays / rays[:, 2:]


def _pairs(capture: Capture) -> Iterator[MatchedFeatures]:
    """Match features in some pairs of images whose lenses and relative pose are known."""
    first = capture.cameras[0]
    count = len(first.pictures)
    if count == 0:
        return
    some = [int(one) for one in np.unique(np.linspace(0, count - 1, _PAIRS).round())]
    if len(capture.cameras) > 1:
        other = capture.cameras[1]
        for index in some:
            yield from _pair((first, other), (index, index), _second_from_first(first, other))
    elif not capture.is_recording:
        places = np.array([pose.translation for pose in capture.world_from_rig])
        least = _APART * float(np.sqrt(places.var(axis=0).sum()))
        for index in some:
            apart = exact.lengths(places - places[index])
            apart[apart <= least] = np.inf
            nearest = int(apart.argmin())
            if np.isfinite(apart[nearest]):
                both = index, nearest
                world_from_both = [
                    capture.world_from_rig[one] @ first.rig_from_camera for one in both
                ]
                second_from_first = world_from_both[1].inverse() @ world_from_both[0]
                yield from _pair((first, first), both, second_from_first)


def _constrains_focal(second_from_first: Pose) -> bool:
    """Return whether the focal length moves the epipolar lines; parallel cameras' do not move."""
    shift = np.asarray(second_from_first.translation)
    length = exact.norm(shift)
    if not length > 0.0:
        return False
    along = abs(shift[2]) / length
    turned = 1.0 - float(second_from_first.matrix()[2, 2])
    return along > _LEAST_TURN or turned > _LEAST_TURN


def _pair(
    cameras: tuple[CaptureCamera, CaptureCamera], indices: tuple[int, int], second_from_first: Pose
) -> Iterator[MatchedFeatures]:
    """Yield the matched features of two images, if there are enough."""
    images = []
    for camera, index in zip(cameras, indices, strict=True):
        picture = camera.pictures[index]
        if picture is None:
            return
        images.append(PosedPicture(picture, camera.lens, Recorded(camera.lens.size_px)))
    pair = match_features(images[0], images[1], second_from_first)
    if pair is not None:
        yield pair
