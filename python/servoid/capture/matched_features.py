"""Matches features of two images whose lenses and relative pose are known."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens, Pose
from servoid.camera import Picture, Recorded
from servoid.errors import CaptureError, ImageError
from servoid.pose import Floats, exact

FIRST_OF_VIDEO = 30
"""Images of a video that are compared: later ones take long to decode."""
LONG_PX = 640
"""Images are usually shrunk towards this before features are detected."""
_FEATURES = 1000
_ALIKE = 0.8  # largest ratio of the best match's distance to the second best's
_LEAST_OF_PAIR = 20
# Images whose features are kept, below 1 MB each: several checks of a command compare the same.
_KEPT = 48

Features = tuple[Floats, NDArray[np.float32]]
"""Positions in an image, (N, 2) px, and descriptors, (N, 128)."""


@dataclass(frozen=True, eq=False)
class MatchedFeatures:
    """Two images of one instant, or of a static scene, and features that match in both, (N, 2)."""

    lenses: tuple[Lens, Lens]
    second_from_first: Pose
    first_px: Floats
    second_px: Floats

    def part(self, kept: NDArray[np.bool_]) -> "MatchedFeatures":
        """Return the pair with those of its features that are `kept`, (N,)."""
        return MatchedFeatures(
            self.lenses, self.second_from_first, self.first_px[kept], self.second_px[kept]
        )

    def turned_round(self) -> "MatchedFeatures":
        """Return the pair with the second image first."""
        first, second = self.lenses
        first_from_second = self.second_from_first.inverse()
        return MatchedFeatures((second, first), first_from_second, self.second_px, self.first_px)


@dataclass(frozen=True, eq=False)
class PosedPicture:
    """An image in its file, and the lens that took it, in the pixels of the shrunk image.

    The image is shrunk towards `long_px` before features are detected.
    """

    picture: Picture
    lens: Lens
    recorded: Recorded
    long_px: int = LONG_PX

    @cached_property
    def digest(self) -> bytes | None:
        """Return what only equal images have in common; None if it is of one colour, or damaged."""
        try:
            pixels = self.picture.read(self.recorded.size_px, self.recorded.by)
        except (CaptureError, ImageError):
            return None
        if pixels.min() == pixels.max():
            return None
        shape = np.array(pixels.shape, np.int64).tobytes()
        return sha256(shape + pixels.tobytes()).digest()

    def grey(self, long_px: int) -> tuple[NDArray[np.uint8], int] | None:
        """Read the image in grey, shrunk towards `long_px`, and by which factor it is shrunk.

        None if it cannot be read.
        """
        import cv2

        by = 1
        while max(self.lens.size_px) // (2 * by) >= long_px:
            by *= 2
        try:
            pixels = self.picture.read(self.recorded.size_px, by * self.recorded.by)
        except (CaptureError, ImageError):
            return None
        return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY), np.uint8), by

    @cached_property
    def features(self) -> Features | None:
        """Find features; return None if there are too few."""
        shrunk = self.grey(self.long_px)
        if shrunk is None:
            return None
        grey, by = shrunk
        found = _features_of(grey.tobytes(), grey.shape)
        return None if found is None else ((found[0] + 0.5) * by - 0.5, found[1])


@lru_cache(maxsize=_KEPT)
def _features_of(grey: bytes, shape: tuple[int, ...]) -> Features | None:
    """Return what `features` says of the pixels of a grey image, (H, W)."""
    return features_on(np.frombuffer(grey, np.uint8).reshape(shape), None, _FEATURES)


def features_on(
    grey: NDArray[np.uint8], mask: NDArray[np.uint8] | None, most: int
) -> Features | None:
    """Find up to so many features of a grey image, (H, W), where a mask is not 0.

    None if there are too few.
    """
    import cv2

    points, looks = cv2.SIFT.create(most).detectAndCompute(grey, mask)  # pyright: ignore[reportCallIssue, reportArgumentType]
    if looks is None or len(points) < _LEAST_OF_PAIR:
        return None
    return np.array([point.pt for point in points], np.float64), np.asarray(looks, np.float32)


def unit_px(lens: Lens) -> float:
    """Return a thousandth of the diagonal of a lens's image, the unit of limits in pixels."""
    return exact.hypot(*map(float, lens.size_px)) / 1000.0


def unit_rays(lens: Lens, pixels: Floats) -> Floats:
    """Return unit vectors from a lens through pixels, (N, 3)."""
    rays = lens.rays(pixels)
    return rays / exact.lengths(rays)[:, None]


def alike_features(first: PosedPicture, second: PosedPicture) -> tuple[Floats, Floats] | None:
    """Return where features that look alike are in two images, (N, 2) each; None if too few.

    Each is in the second image at most once.
    """
    return alike(first.features, second.features)


def alike(first: Features | None, second: Features | None) -> tuple[Floats, Floats] | None:
    """Return where features that look alike are, as `alike_features` does."""
    if first is None or second is None:
        return None
    (one_px, one), (other_px, other) = first, second
    nearest, least, next_least = _nearest(one, other)
    rows = np.flatnonzero(least < _ALIKE * next_least).tolist()
    kept = {int(nearest[row]): row for row in rows}
    if len(kept) < _LEAST_OF_PAIR:
        return None
    return one_px[list(kept.values())], other_px[list(kept)]


def _nearest(
    one: NDArray[np.float32], other: NDArray[np.float32]
) -> tuple[NDArray[np.int64], Floats, Floats]:
    """Return for each descriptor, (N, 128), the nearest other, and the two least distances, (N,).

    Descriptors are whole numbers below 256, with a norm of about 512. So are their products, which
    float32 holds exactly, in whichever order they are added.
    """
    import cv2

    squares = cv2.gemm(one, other, -2.0, None, 0.0, flags=cv2.GEMM_2_T)  # pyright: ignore[reportCallIssue, reportArgumentType]
    squares += (one * one).sum(axis=1)[:, None] + (other * other).sum(axis=1)
    rows, nearest = np.arange(len(one)), squares.argmin(axis=1)
    least = squares[rows, nearest]
    squares[rows, nearest] = np.inf
    next_least = squares.min(axis=1)
    return nearest, np.sqrt(least).astype(np.float64), np.sqrt(next_least).astype(np.float64)


def match_features(
    first: PosedPicture, second: PosedPicture, second_from_first: Pose
) -> MatchedFeatures | None:
    """Match the features of two images; return None if there are too few, or no image."""
    found = of_one_motion(alike_features(first, second), unit_px(first.lens))
    return found and MatchedFeatures((first.lens, second.lens), second_from_first, *found)


def of_one_motion(
    both_px: tuple[Floats, Floats] | None, off_px: float
) -> tuple[Floats, Floats] | None:
    """Return those of the features in two images that some motion of one camera explains.

    They are nearer than `off_px` to their epipolar lines. None if they are too few.
    """
    import cv2

    if both_px is None:
        return None
    try:
        _, agree = cv2.findFundamentalMat(*both_px, cv2.USAC_MAGSAC, off_px, 0.999, 2000)
    except cv2.error:  # no sample of features has a motion
        return None
    if agree is None or agree.sum() < _LEAST_OF_PAIR:
        return None
    same = agree.ravel() > 0
    return both_px[0][same], both_px[1][same]


def closest_points(pair: MatchedFeatures) -> tuple[Floats, Floats]:
    """Return where the rays of two cameras come closest, (N, 3) in the first one's frame.

    They are not finite for parallel rays, whose sines, the second result, (N,), are 0.
    """
    one, other = unit_rays(pair.lenses[0], pair.first_px), unit_rays(pair.lenses[1], pair.second_px)
    matrix = pair.second_from_first.inverse().matrix()
    other = exact.product(other, np.ascontiguousarray(matrix[:3, :3].T))
    across = np.cross(one, other)
    size = np.square(across).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (np.cross(matrix[:3, 3], other) * across).sum(axis=1) / size
        return one * along[:, None], np.sqrt(size)


def closest(one: Floats, other: Floats, offset: Floats) -> tuple[Floats, Floats, Floats]:
    """Return where pairs of rays come closest, (N,) each, not finite for parallel ones.

    `one` and `other` are directions, (N, 3), and the first rays begin at `offset`, (3,), from the
    second. The results are the lesser of the distances along both, negative behind a camera; by how
    much they miss each other; and the length of the cross product of the directions.
    """
    across = np.cross(one, other)
    size = np.square(across).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        along_one = -(np.cross(offset, other) * across).sum(axis=1) / size
        along_other = -(np.cross(offset, one) * across).sum(axis=1) / size
        missed = np.abs((across * offset).sum(axis=1)) / np.sqrt(size)
    return np.minimum(along_one, along_other), missed, np.sqrt(size)
