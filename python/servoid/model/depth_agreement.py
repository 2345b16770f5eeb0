"""Checks that depth images agree with what stereo measures of the same object."""

from collections.abc import Sequence

import numpy as np

from servoid.capture import CaptureView
from servoid.capture.exchanged import check_not_exchanged
from servoid.errors import CameraError, CaptureError, TargetError
from servoid.model.range_samples import depth_of_pair
from servoid.words import digits

_MOST_VIEWS = 3
_LEAST_PX = 60  # that both measure
_APART = 1.15  # ratio of the distances from which on they contradict each other
_EVEN = 0.1  # relative spread of the ratio within which a wrong unit explains it


def check_depth_agrees(pairs: Sequence[tuple[CaptureView, CaptureView]]) -> None:
    """Check that the depth images of views agree with stereo, within 15 %.

    Each view with a depth image comes with another view of the same instant. Pairs that cannot be
    matched are not compared.

    Raises:
        CaptureError: they contradict each other.
        CameraError: the images of a pair are exchanged.

    """
    if pairs:
        for number in np.unique(np.linspace(0, len(pairs) - 1, _MOST_VIEWS).round()):
            _check(*pairs[int(number)])


def _check(view: CaptureView, other: CaptureView) -> None:
    depth = view.depth()
    if depth is None:
        return
    check_not_exchanged(view, other)
    try:
        measured = depth_of_pair(view, other)
    except (CameraError, TargetError):
        return
    both = np.isfinite(measured) & np.isfinite(depth) & (depth > 0.0)
    if both.sum() < _LEAST_PX:
        return
    ratios = depth[both] / measured[both]
    low, ratio, high = (float(one) for one in np.quantile(ratios, (0.25, 0.5, 0.75)))
    if 1.0 / _APART < ratio < _APART:
        return
    far, near = (_rounded(float(np.median(one[both]))) for one in (depth, measured))
    cure = (
        f"; if the pair is right, {_unit(view, ratio)}"
        if high - low < _EVEN * ratio
        else "; if the pair is right, leave the depth images out"
    )
    raise CaptureError(
        f"{view.name}: the object is {far} m away in its depth image, and {near} m by stereo with "
        f"{other.name}: {_rounded(ratio)} times as far{cure}; if the depth is right, correct the "
        "poses of the cameras"
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


def with_twins(
    views: Sequence[CaptureView], everything: Sequence[CaptureView]
) -> list[tuple[CaptureView, CaptureView]]:
    """Pair each view with the first other view of its instant; leave out those without one."""
    pairs = []
    for view in views:
        twins = (one for one in everything if one.index == view.index and one.name != view.name)
        pairs.extend((view, twin) for twin in list(twins)[:1])
    return pairs
