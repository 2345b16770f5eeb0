"""Checks that depth images agree with what stereo measures of the same object, and with masks."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.capture import CaptureView, check_not_exchanged
from servoid.errors import CameraError, CaptureError, TargetError
from servoid.model.range_samples import depth_of_pair
from servoid.segment import Depth, Parting, parted_by_depth
from servoid.words import digits

TWO_SURFACES = "the mask covers two surfaces that are far apart"

_MOST_VIEWS = 3
_LEAST_PX = 60  # that both measure
_APART = 1.15  # ratio of the distances from which on they contradict each other
_AROUND_PX = 6  # beyond a mask, where its background is
_AS_FAR = 0.5  # of the gap between two surfaces, by which the background may be behind the far one
# Masks of right captures, 8 recorded and 11 drawn, hold no two surfaces; those with the table or a
# wall in them have gaps of 1.5 widths and more, and a fifth of their border on the far one.
_SURE_GAP, _SURE_BORDER = 1.0, 0.15
_BORDER_PX = 4  # of a mask, inside of its border
_EVEN = 0.1  # relative spread of the ratio within which a wrong unit explains it


@dataclass(frozen=True)
class _Compared:
    """The depth of a view divided by what stereo measures: its median and the middle half."""

    view: CaptureView
    other: CaptureView
    low: float
    ratio: float
    high: float
    depth_m: float
    stereo_m: float

    @property
    def agrees(self) -> bool:
        """Return whether both measure about the same."""
        return 1.0 / _APART < self.ratio < _APART


def check_depth_agrees(pairs: Sequence[tuple[CaptureView, CaptureView]]) -> None:
    """Check that the depth images of views agree with stereo, within 15 % in most of three views.

    Each view comes with another view of the same instant. Views without a depth image, and pairs
    that cannot be matched, are not compared.

    Raises:
        CaptureError: they contradict each other.
        CameraError: the images of a pair are exchanged.

    """
    pairs = [pair for pair in pairs if pair[0].has_depth]
    if not pairs:
        return
    chosen = np.unique(np.linspace(0, len(pairs) - 1, _MOST_VIEWS).round())
    compared = [one for number in chosen if (one := _compare(*pairs[int(number)])) is not None]
    apart = [one for one in compared if not one.agrees]
    if 2 * len(apart) > len(compared):
        raise CaptureError(_contradiction(apart[0]))


def with_twins(
    views: Sequence[CaptureView], everything: Sequence[CaptureView]
) -> list[tuple[CaptureView, CaptureView]]:
    """Pair each view with the first other view of its instant; leave out those without one."""
    pairs = []
    for view in views:
        twins = (one for one in everything if one.index == view.index and one.name != view.name)
        if (twin := next(twins, None)) is not None:
            pairs.append((view, twin))
    return pairs


@dataclass(frozen=True)
class Parted:
    """A view whose mask covers two surfaces, in words; surely if they are far apart."""

    words: str
    is_sure: bool


def parted_notes(views: Iterable[CaptureView]) -> list[Parted]:
    """Report views whose mask covers two surfaces in their depth image."""
    notes = []
    for view in views:
        depth = view.depth() if view.has_depth else None
        if depth is None:
            continue
        mask = view.mask()
        parting = parted_by_depth(mask, Depth(depth, view.camera.focal_px[0]))
        if parting is not None and _is_around(mask, depth, parting):
            words = (
                f"{view.name}: {parting.words}; if it is the object's mask, register the depth "
                "image to the colour image (align), or correct how the depth camera is mounted"
            )
            notes.append(Parted(words, _is_sure(mask, parting)))
    return notes


def parted_by_stereo(
    view: CaptureView, other: CaptureView, depth: NDArray[np.float32]
) -> Parted | None:
    """Report a view whose mask covers two surfaces by the depth that stereo measures in it.

    `depth` (H, W) float32 is that depth, in metres, inside the mask. None if it covers one.
    """
    import cv2

    mask = view.mask()
    parting = parted_by_depth(mask, Depth(depth, view.camera.focal_px[0]))
    if parting is None:
        return None
    wide = np.asarray(cv2.dilate(mask, _kernel(_AROUND_PX)), np.uint8)
    if not _is_around(mask, depth_of_pair(view, other, wide), parting):
        return None
    words = f"{view.name}: {parting.words}; mark the object alone"
    return Parted(words, _is_sure(mask, parting))


def _is_around(mask: NDArray[np.uint8], depth: NDArray[np.float32], parting: Parting) -> bool:
    """Return whether the far part is as far as what is around the mask, as its background is.

    Of an object that has a part towards the camera it is nearer.
    """
    import cv2

    ring = (np.asarray(cv2.dilate(mask, _kernel(_AROUND_PX))) != 0) & (mask == 0)
    around, far = (
        depth[part & np.isfinite(depth) & (depth > 0.0)] for part in (ring, parting.far != 0)
    )
    if not len(around) or not len(far):
        return False
    return bool(np.median(around) < np.median(far) + _AS_FAR * parting.gap)


def _is_sure(mask: NDArray[np.uint8], parting: Parting) -> bool:
    """Return whether two surfaces are far apart, and the far one is no hole in the object."""
    import cv2

    band = (mask != 0) & (np.asarray(cv2.erode(mask, _kernel(_BORDER_PX))) == 0)
    far, near = (int((band & (part != 0)).sum()) for part in (parting.far, parting.near))
    at_border = far >= _SURE_BORDER * (far + near) > 0.0
    return at_border and parting.gap > _SURE_GAP * parting.width


def _kernel(reach_px: int) -> NDArray[np.uint8]:
    return np.ones((2 * reach_px + 1,) * 2, np.uint8)


def _compare(view: CaptureView, other: CaptureView) -> _Compared | None:
    depth = view.depth()
    if depth is None:
        return None
    check_not_exchanged(view, other)
    try:
        measured = depth_of_pair(view, other)
    except (CameraError, TargetError):
        return None
    both = np.isfinite(measured) & np.isfinite(depth) & (depth > 0.0)
    if both.sum() < _LEAST_PX:
        return None
    low, ratio, high = map(float, np.quantile(depth[both] / measured[both], (0.25, 0.5, 0.75)))
    far, near = (float(np.median(one[both])) for one in (depth, measured))
    return _Compared(view, other, low, ratio, high, far, near)


def _contradiction(found: _Compared) -> str:
    is_even = found.high - found.low < _EVEN * found.ratio
    cure = _unit(found.view, found.ratio) if is_even else "leave the depth images out"
    return (
        f"{found.view.name}: the object is {_rounded(found.depth_m)} m away in its depth image, "
        f"and {_rounded(found.stereo_m)} m by stereo with {found.other.name}: "
        f"{_rounded(found.ratio)} times as far; if the pair is right, {cure}; if the depth is "
        "right, correct the poses of the cameras"
    )


def _unit(view: CaptureView, ratio: float) -> str:
    if view.depth_scale_m is not None and view.depth_m is None:
        return (
            f"set depth_scale_m = {_rounded(view.depth_scale_m / ratio)} instead of "
            f"{digits(view.depth_scale_m)}"
        )
    return f"multiply the depths by {_rounded(1.0 / ratio)}"


def _rounded(value: float) -> str:
    return digits(float(f"{value:.3g}"))
