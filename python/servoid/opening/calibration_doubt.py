"""Says if images contradict the focal length, or the places of the cameras, that a capture tells.

Features that look alike in two images lie on each other's epipolar lines. Where the lens and the
poses of a capture say that they do not, and another focal length would bring them there, that one
is named. No calibration is needed to find the features, so a wrong one does not hide them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens, Pose
from servoid.camera import Picture
from servoid.capture import Capture, CaptureCamera
from servoid.errors import CaptureError, ImageError
from servoid.words import digits

_PAIRS = 4
_LONG_PX = 640  # images are shrunk towards this before features are sought
_FEATURES = 1000
_ALIKE = 0.8  # how much nearer the best match must be than the second best
_LEAST_OF_PAIR, _LEAST = 20, 60  # matches
_APART = 0.1  # of the spread of the views: nearer ones tell nothing
_LEAST_TURN = 1e-4  # of the axes of two cameras, below which no focal length shows
# Focal lengths that are tried, as shares of the one that is told.
_TRIED = np.exp(np.linspace(-0.35, 0.35, 141))
_CLOSE = 0.02  # a share by which a focal length may be off, untold
_BETTER = 1.1  # times by which features must come nearer to their lines
_PARTS = 8  # of the matches, each left out once, which must all agree
_SURE = 4.0  # standard deviations
_FIT_PX = 1.0  # at 1000 px of diagonal: features that fit are nearer to their lines
_OFF_PX = 2.5  # at 1000 px of diagonal: features further off contradict the cameras' places

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two images of one moment, or of a scene at rest, and features that look alike in both."""

    lenses: tuple[Lens, Lens]
    second_from_first: Pose
    first_px: Floats
    second_px: Floats

    def part(self, number: int) -> "_Pair":
        """Return the pair without one part of its features."""
        kept = np.arange(len(self.first_px)) % _PARTS != number
        return _Pair(self.lenses, self.second_from_first, self.first_px[kept], self.second_px[kept])

    def off_px(self, share: float) -> Floats:
        """Return how far features lie beside epipolar lines with a share of the focal length."""
        first, second = (
            _flat(lens, pixels, share)
            for lens, pixels in zip(self.lenses, (self.first_px, self.second_px), strict=True)
        )
        matrix = self.second_from_first.matrix()
        x, y, z = matrix[:3, 3] / np.linalg.norm(matrix[:3, 3])
        essential = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ matrix[:3, :3]
        there, back = first @ essential.T, second @ essential
        slope = np.sqrt((there[:, :2] ** 2).sum(axis=1) + (back[:, :2] ** 2).sum(axis=1))
        off = np.abs((second * there).sum(axis=1)) / np.maximum(slope, 1e-12)
        # A lens that bends much sees nothing where a shorter focal length would put a feature.
        return np.where(np.isfinite(off), off * share * self.lenses[0].focal_px[0], np.inf)


def doubt_calibration(capture: Capture, *, is_assumed: bool = False) -> str | None:
    """Return a sentence if images contradict how a capture says that its cameras see, else None.

    Two cameras are compared at the same moments, one camera at views of a scene at rest. Cameras
    in parallel tell no focal length; only if their calibration `is_assumed` it is said if they do
    not look in parallel. One camera at rest tells nothing.
    """
    pairs = list(_pairs(capture, is_assumed=is_assumed))
    if sum(len(pair.first_px) for pair in pairs) < _LEAST:
        return None
    told_px = float(np.mean(pairs[0].lenses[0].focal_px))
    unit_px = float(np.hypot(*pairs[0].lenses[0].size_px)) / 1000.0
    share, off_px, best_px = _best(pairs)
    # An object on a turntable before a room at rest fits with no focal length.
    is_found = _TRIED[0] < share < _TRIED[-1] and best_px < _FIT_PX * unit_px
    if is_found and off_px > _BETTER * best_px and abs(share - 1.0) > _CLOSE:
        others = np.array(
            [_best([pair.part(number) for pair in pairs])[0] for number in range(_PARTS)]
        )
        deviation = float(np.sqrt((_PARTS - 1) * np.mean((others - share) ** 2)))
        if abs(share - 1.0) > _SURE * deviation:
            return (
                f"the images fit a focal length of about {share * told_px:.0f} px better than "
                f"{told_px:.0f} px: features lie {digits(round(best_px, 2))} px beside where the "
                f"other image expects them, instead of {digits(round(off_px, 2))}; calibrate again"
            )
    if len(capture.cameras) > 1 and min(off_px, best_px) > _OFF_PX * unit_px:
        return (
            f"the images contradict where the cameras are said to be: features lie {off_px:.1f} px "
            "beside where the other image expects them; calibrate again"
        )
    return None


def _best(pairs: Sequence[_Pair]) -> tuple[float, float, float]:
    """Return the best share of the focal length, and how far features are off as told and so."""

    def off_px(share: float) -> float:
        return float(np.median(np.concatenate([pair.off_px(share) for pair in pairs])))

    offs = [off_px(float(share)) for share in _TRIED]
    least = int(np.argmin(offs))
    return float(_TRIED[least]), off_px(1.0), offs[least]


def _flat(lens: Lens, pixels: Floats, share: float) -> Floats:
    """Return lines of sight, (N, 3) with z = 1, as a lens with a share of the focal length has."""
    center = np.array(lens.center_px)
    rays = lens.rays((pixels - center) / share + center)
    return rays / rays[:, 2:]


def _pairs(capture: Capture, *, is_assumed: bool) -> Iterator[_Pair]:
    """Find features in some pairs of images whose lenses and relative pose are told."""
    first = capture.cameras[0]
    count = len(first.pictures)
    if count == 0:
        return
    some = [int(one) for one in np.unique(np.linspace(0, count - 1, _PAIRS).round())]
    if len(capture.cameras) > 1:
        other = capture.cameras[1]
        second_from_first = other.rig_from_camera.inverse() @ first.rig_from_camera
        if is_assumed or _tells_focal(second_from_first):
            for index in some:
                yield from _pair((first, other), (index, index), second_from_first)
    elif not capture.is_recording:
        places = np.array([pose.translation for pose in capture.world_from_rig])
        least = _APART * float(np.sqrt(places.var(axis=0).sum()))
        for index in some:
            apart = np.linalg.norm(places - places[index], axis=1)
            apart[apart <= least] = np.inf
            nearest = int(apart.argmin())
            if np.isfinite(apart[nearest]):
                both = index, nearest
                world_from_both = [
                    capture.world_from_rig[one] @ first.rig_from_camera for one in both
                ]
                second_from_first = world_from_both[1].inverse() @ world_from_both[0]
                yield from _pair((first, first), both, second_from_first)


def _tells_focal(second_from_first: Pose) -> bool:
    """Return whether epipolar lines move with the focal length, which those of parallel cameras do not."""
    shift = np.asarray(second_from_first.translation)
    if not np.linalg.norm(shift) > 0.0:
        return False
    along = abs(shift[2]) / float(np.linalg.norm(shift))
    turned = 1.0 - float(second_from_first.matrix()[2, 2])
    return along > _LEAST_TURN or turned > _LEAST_TURN


def _pair(
    cameras: tuple[CaptureCamera, CaptureCamera], indices: tuple[int, int], second_from_first: Pose
) -> Iterator[_Pair]:
    """Give the features that look alike in two images, where there are enough."""
    import cv2

    lenses = cameras[0].lens, cameras[1].lens
    found = []
    for camera, index in zip(cameras, indices, strict=True):
        picture = camera.pictures[index]
        features = None if picture is None else _features(picture, camera.lens)
        if features is None or len(features[0]) < _LEAST_OF_PAIR:
            return
        found.append(features)
    near = cv2.BFMatcher().knnMatch(found[0][1], found[1][1], k=2)
    kept = {one.trainIdx: one for one, two in near if one.distance < _ALIKE * two.distance}
    rows = np.array([(one.queryIdx, one.trainIdx) for one in kept.values()]).reshape(-1, 2)
    if len(rows) < _LEAST_OF_PAIR:
        return
    one, other = found[0][0][rows[:, 0]], found[1][0][rows[:, 1]]
    off_px = float(np.hypot(*lenses[0].size_px)) / 1000.0
    _, agree = cv2.findFundamentalMat(one, other, cv2.USAC_MAGSAC, off_px, 0.999, 2000)
    if agree is None or agree.sum() < _LEAST_OF_PAIR:
        return
    same = agree.ravel() > 0
    yield _Pair(lenses, second_from_first, one[same], other[same])


def _features(picture: Picture, lens: Lens) -> tuple[Floats, NDArray[np.float32]] | None:
    """Return where features of an image are, (N, 2) px, and how they look; None without any."""
    import cv2

    by = 1
    while max(lens.size_px) // (2 * by) >= _LONG_PX:
        by *= 2
    try:
        image = picture.read(lens.size_px, by)
    except (CaptureError, ImageError):
        return None
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    points, looks = cv2.SIFT.create(_FEATURES).detectAndCompute(grey, None)  # pyright: ignore[reportCallIssue, reportArgumentType]
    if looks is None:
        return None
    pixels = np.array([point.pt for point in points], np.float64)
    return (pixels + 0.5) * by - 0.5, np.asarray(looks, np.float32)
