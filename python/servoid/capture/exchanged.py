"""Finds pairs of cameras whose images are exchanged, or are all those of one camera.

What a pair sees is in front of both cameras. With exchanged images the disparity has the wrong
sign, so that features lie behind the cameras, and in front of them if the images change places.
"""

from collections.abc import Iterable

import numpy as np

from servoid._native import Lens
from servoid.capture.capture import CaptureView
from servoid.capture.matched_features import MatchedFeatures, PosedPicture, match_features
from servoid.errors import CameraError, CaptureError, ImageError
from servoid.pose import Floats, exact

_LEAST = 20  # features that support an order of the images
_RATIO = 4.0  # of those to the features that support the other order
_OFF_PX = 2.0  # at 1000 px of diagonal: from a feature's epipolar line
_PARALLAX_PX = 2.0  # at 1000 px of diagonal: below, a feature's side is noise


def exchange_note(names: tuple[str, str], pairs: Iterable[MatchedFeatures]) -> str | None:
    """Return a message if the images of two named cameras are exchanged, else None.

    The first pair that is clearly as given settles it: no further one is read.
    """
    matched = given = exchanged = 0
    for pair in pairs:
        as_given, as_exchanged = (_count_in_front(pair, exchanged=one) for one in (False, True))
        if _is_clear(as_given, as_exchanged):
            return None
        matched += len(pair.first_px)
        given += as_given
        exchanged += as_exchanged
    if not _is_clear(exchanged, given):
        return None
    one, other = names
    return (
        f"the images of {one} and {other} are exchanged: of {matched} features that match in both, "
        f"{given} are in front of the cameras as the images are given, and {exchanged} if each is "
        "the other camera's; exchange the files, or the lens and the pose of the two cameras"
    )


def repeated_note(names: tuple[str, str], one: PosedPicture, other: PosedPicture) -> str | None:
    """Return a message if two named images are equal to the last pixel, else None.

    The noise of two cameras differs, even where they look at the same thing from one place.
    """
    if one.lens.size_px != other.lens.size_px:
        return None
    try:
        first, second = (
            each.picture.read(each.recorded.size_px, each.recorded.by) for each in (one, other)
        )
    except (CaptureError, ImageError):
        return None
    if first.min() == first.max() or not np.array_equal(first, second):
        return None
    return (
        f"the images of {names[0]} and {names[1]} are the same to the last pixel, and not those "
        "of two cameras; give each camera its own images"
    )


def check_not_exchanged(view: CaptureView, other: CaptureView) -> None:
    """Check that two views of one instant show what their cameras see.

    Raises:
        CameraError: their images are exchanged, or are one and the same.

    """
    one, two = (PosedPicture(each.picture, each.lens, each.recorded) for each in (view, other))
    repeated = repeated_note((view.name, other.name), one, two)
    if repeated is not None:
        raise CameraError(repeated)
    pair = match_features(one, two, other.world_from_lens.inverse() @ view.world_from_lens)
    note = None if pair is None else exchange_note((view.name, other.name), [pair])
    if note is not None:
        raise CameraError(note)


def _is_clear(count: int, otherwise: int) -> bool:
    """Return whether far more features support one order of the images than the other."""
    return count >= _LEAST and count >= _RATIO * otherwise


def _count_in_front(pair: MatchedFeatures, *, exchanged: bool) -> int:
    """Count the features that both cameras see in front of them, with images `exchanged` or not."""
    pixels = (pair.second_px, pair.first_px) if exchanged else (pair.first_px, pair.second_px)
    one, other = (_rays(lens, part) for lens, part in zip(pair.lenses, pixels, strict=True))
    matrix = pair.second_from_first.matrix()
    offset = matrix[:3, 3]
    one = exact.product(one, np.ascontiguousarray(matrix[:3, :3].T))
    # Across both rays is how far they miss each other; along each is where they come closest.
    across = np.cross(one, other)
    size = np.square(across).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        along_one = -(np.cross(offset, other) * across).sum(axis=1) / size
        along_other = -(np.cross(offset, one) * across).sum(axis=1) / size
        missed = np.abs((across * offset).sum(axis=1)) / np.sqrt(size)
        nearest = np.minimum(along_one, along_other)
        unit = (
            exact.hypot(*map(float, pair.lenses[0].size_px)) / 1000.0 / pair.lenses[0].focal_px[0]
        )
        fits = (nearest > 0.0) & (missed / nearest < _OFF_PX * unit)
    return int((fits & (np.sqrt(size) > _PARALLAX_PX * unit)).sum())


def _rays(lens: Lens, pixels: Floats) -> Floats:
    rays = lens.rays(pixels)
    return rays / exact.lengths(rays)[:, None]
