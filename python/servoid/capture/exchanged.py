"""Finds pairs of cameras whose images are exchanged, are all of one camera, or contradict the rig.

What a pair sees is in front of both cameras. With exchanged images the disparity has the wrong
sign, so that features lie behind the cameras, and in front of them if the images change places. If
they do not then either, the calibration is wrong.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from servoid.capture.capture import CaptureView
from servoid.capture.matched_features import (
    MatchedFeatures,
    PosedPicture,
    closest,
    match_features,
    unit_px,
    unit_rays,
)
from servoid.errors import CameraError
from servoid.pose import exact

_LEAST = 20  # features that support an order of the images
_RATIO = 4.0  # of those to the features that support the other order
_OFF_PX = 2.0  # at 1000 px of diagonal: from a feature's epipolar line
_PARALLAX_PX = 2.0  # at 1000 px of diagonal: below, a feature's side is noise
# Shares of features that contradict a rig. Of right ones at most 3 % do, and 4 % in a pair of
# images (recorded pairs); of rigs that are off by 2 degrees or 60 px mostly more than 15 %.
_DOUBTED = 0.1
_SURELY = 0.5  # from this share on, the rig is wrong
_WORSE = 2.0  # such shares of a camera that was moved, and of one whose lens is wrong throughout
_TINY_M = 1e-9  # what two cameras at one place see differently is nearer: nothing is there
_REFUSED = 0.8  # if this share is behind the cameras


@dataclass(frozen=True)
class Sides:
    """How many matched features are in front of both cameras, behind one, or off their lines.

    Those too far away for their parallax to tell are in `matched` alone.
    """

    matched: int = 0
    front: int = 0
    behind: int = 0
    off: int = 0

    def __add__(self, other: "Sides") -> "Sides":
        return Sides(
            self.matched + other.matched,
            self.front + other.front,
            self.behind + other.behind,
            self.off + other.off,
        )

    @property
    def agree(self) -> bool:
        """Return whether features support the rig, and few contradict it."""
        return self.front >= _LEAST and not self.contradict

    @property
    def against(self) -> int:
        """Return the number of features that contradict the rig."""
        return self.behind + self.off

    @property
    def contradict(self) -> bool:
        """Return whether so many features contradict the rig that it is probably wrong."""
        return self._exceeds(_DOUBTED)

    @property
    def refute(self) -> bool:
        """Return whether most features contradict the rig, which is surely wrong then."""
        return self._exceeds(_SURELY)

    def _exceeds(self, share: float) -> bool:
        return self.against >= _LEAST and self.against > share * self.matched

    def is_worse(self, earlier: "Sides") -> bool:
        """Return whether a far greater share of these contradicts the rig than of earlier ones."""
        return self.against * earlier.matched > _WORSE * earlier.against * self.matched


def exchange_note(names: tuple[str, str], pairs: Iterable[MatchedFeatures]) -> str | None:
    """Return a message if the images of two named cameras are exchanged, else None.

    The first pair that is clearly as given settles it: no further one is read.
    """
    matched = given = exchanged = 0
    for pair in pairs:
        as_given, as_exchanged = (sides_of(pair, exchanged=one).front for one in (False, True))
        if _is_clear(as_given, as_exchanged):
            return None
        matched += len(pair.first_px)
        given += as_given
        exchanged += as_exchanged
    if not _is_clear(exchanged, given):
        return None
    return exchange_words(names, matched, given, exchanged)


def exchange_words(names: tuple[str, str], matched: int, given: int, exchanged: int) -> str:
    """Say that images of two named cameras are exchanged.

    Of the `matched` features, so many are in front of the cameras as the images are `given`, and as
    they are `exchanged`.
    """
    one, other = names
    return (
        f"the images of {one} and {other} are exchanged: of {matched} features that match in both, "
        f"{given} are in front of the cameras as the images are given, and {exchanged} if each is "
        "the other camera's; exchange the files, or the lens and the pose of the two cameras; or "
        "are both images mirrored, or turned by 180 degrees?"
    )


def until_settled(pairs: Iterable[MatchedFeatures]) -> Iterator[MatchedFeatures]:
    """Yield pairs of images up to the first that shows the rig to be right as it is given."""
    for pair in pairs:
        yield pair
        sides = sides_of(pair)
        if not sides.contradict and _is_clear(sides.front, sides_of(pair, exchanged=True).front):
            return


def contradiction_note(names: tuple[str, str], pairs: Iterable[MatchedFeatures]) -> str | None:
    """Return a message if features contradict the calibration of two named cameras, else None."""
    total = all_sides(pairs)
    return _contradiction(names, total) if total.contradict else None


def all_sides(pairs: Iterable[MatchedFeatures]) -> Sides:
    """Count on which side of the cameras the features of several pairs of images are."""
    return sum((sides_of(pair) for pair in pairs), Sides())


def repeated_note(names: tuple[str, str], one: PosedPicture, other: PosedPicture) -> str | None:
    """Return a message if two named images are equal to the last pixel, else None.

    The noise of two cameras differs, even where they look at the same thing from one place.
    """
    if one.digest is None or one.digest != other.digest:
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
    _matched_unexchanged(view, other)


def check_measurable(view: CaptureView, other: CaptureView) -> None:
    """Check that two views of one instant may measure depth.

    Raises:
        CameraError: their images are exchanged, or are one and the same, or nearly all that they
            see would be behind the cameras.

    """
    pair = _matched_unexchanged(view, other)
    sides = Sides() if pair is None else sides_of(pair)
    if sides.behind >= max(_LEAST, _REFUSED * sides.matched):
        raise CameraError(_contradiction((view.name, other.name), sides))


def _matched_unexchanged(view: CaptureView, other: CaptureView) -> MatchedFeatures | None:
    one, two = (PosedPicture(each.picture, each.lens, each.recorded) for each in (view, other))
    repeated = repeated_note((view.name, other.name), one, two)
    if repeated is not None:
        raise CameraError(repeated)
    pair = match_features(one, two, other.world_from_lens.inverse() @ view.world_from_lens)
    note = None if pair is None else exchange_note((view.name, other.name), [pair])
    if note is not None:
        raise CameraError(note)
    return pair


def _contradiction(names: tuple[str, str], sides: Sides) -> str:
    one, other = names
    return (
        f"the images contradict the calibration of {one} and {other}: of {sides.matched} features "
        f"that match in both, {sides.behind} would be behind the cameras, and {sides.off} are far "
        "from where the other image predicts them; correct the pose of one camera relative to the "
        "other, or their center_px, focal_px and distortion, or calibrate again"
    )


def _is_clear(count: int, otherwise: int) -> bool:
    """Return whether far more features support one order of the images than the other."""
    return count >= _LEAST and count >= _RATIO * otherwise


def sides_of(pair: MatchedFeatures, *, exchanged: bool = False) -> Sides:
    """Count on which side of the cameras features are, with images `exchanged` or not."""
    pixels = (pair.second_px, pair.first_px) if exchanged else (pair.first_px, pair.second_px)
    one, other = (unit_rays(lens, part) for lens, part in zip(pair.lenses, pixels, strict=True))
    matrix = pair.second_from_first.matrix()
    offset = matrix[:3, 3]
    one = exact.product(one, np.ascontiguousarray(matrix[:3, :3].T))
    nearest, missed, sines = closest(one, other, offset)
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = unit_px(pair.lenses[0]) / pair.lenses[0].focal_px[0]
        is_near = sines > _PARALLAX_PX * unit
        is_behind = is_near & ~(nearest > _TINY_M)
        fits = is_near & (nearest > _TINY_M) & (missed / nearest < _OFF_PX * unit)
    front, behind = int(fits.sum()), int(is_behind.sum())
    return Sides(len(sines), front, behind, int(is_near.sum()) - front - behind)
