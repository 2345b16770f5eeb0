"""Detects from matches what cannot be reconstructed: no features, no motion, pure rotation."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from servoid.errors import ScanError
from servoid.pose import Floats
from servoid.scan.matching import Matched, Pair

_FEW_FEATURES = 60  # in the median image: a blank wall
_STILL = 0.003  # of the diagonal: matches that move less are stationary
_MOVED = (0.008, 0.15)  # of the diagonal: matches that move by this may be on one moving object
_STATIONARY = 0.5  # share of matches that are stationary if the camera is stationary
_OTHER, _OTHER_COUNT = 0.02, 8  # share and number of matches that move before a stationary camera
_NEXT = 2  # images apart: neighbours
_WIDE = 0.03  # of the diagonal: pairs with less image motion do not constrain the camera's motion
_LEAST_MATCHES = 30
_MOST_PAIRS = 40
_TURN_PX = 0.003  # of the diagonal: error below which a match follows a rotation
_ONLY_TURNS = 0.9  # share of matches that follow rotation alone
_FOCALS = np.geomspace(0.4, 4.0, 13)  # of the diagonal


@dataclass(frozen=True)
class PairMotion:
    """The evidence in a pair of images that the camera is stationary: shares of its matches."""

    still: float
    moved: float
    moved_count: int


def check_features(matched: Matched) -> None:
    """Check that the images have enough features.

    Raises:
        ScanError: most of them have hardly any feature.

    """
    counts = np.array([len(one) for one in matched.keypoints])
    if np.median(counts) >= _FEW_FEATURES:
        return
    raise ScanError(
        f"the images have too few features: {np.median(counts):.0f} features in the median "
        f"one, and at least {_FEW_FEATURES} are needed; a blank wall or a plain table has none, "
        "and neither does a blurred or dark image: put printed paper around the object, light it, "
        "and hold the camera still for each photograph"
    )


def check_camera_moves(matched: Matched) -> None:
    """Check that the camera is not stationary.

    Raises:
        ScanError: it is; the message reports if an object moves before it.

    """
    motions = {
        pair: _pair_motion(matched, pair, matches)
        for pair, matches in sorted(matched.alike.items())
        if len(matches) >= _LEAST_MATCHES
    }
    still = float(np.median([one.still for one in motions.values()])) if motions else 0.0
    if still < _STATIONARY:
        return
    # A turning object matches only between neighbouring images.
    near = [one for (first, second), one in motions.items() if second - first <= _NEXT]
    moving = [one for one in near if one.moved >= _OTHER and one.moved_count >= _OTHER_COUNT]
    if 2 * len(moving) >= max(1, len(near)):
        share = np.median([one.moved for one in moving])
        raise ScanError(
            "the camera does not move, and an object moves before a static background: "
            f"{100 * still:.0f} % of the matches stay at their "
            f"position in the image, and {100 * share:.0f} % move between neighbouring images, so "
            "that the scan would reconstruct the background; use 'servoid track' with --target, "
            "which models what moves, or scan with --turntable, which ignores what does "
            "not move, or with --inside and masks of the object"
        )
    raise ScanError(
        "the camera does not move: "
        f"{100 * still:.0f} % of the matches stay at their position "
        "in the image; walk around the object while you film it, or take photographs from "
        "15 to 50 positions around it"
    )


def _pair_motion(matched: Matched, pair: Pair, matches: NDArray[np.int64]) -> PairMotion:
    one, other = matched.places(pair, matches)
    ways = np.linalg.norm(other - one, axis=1) / matched.diagonal_px
    moved = (ways > _MOVED[0]) & (ways < _MOVED[1])
    return PairMotion(float((ways < _STILL).mean()), float(moved.mean()), int(moved.sum()))


def check_turning(matched: Matched) -> None:
    """Check that the camera does more than rotate in place.

    Raises:
        ScanError: rotation alone explains nearly all matches.

    """
    share = turning_share(matched)
    if share is not None and share > _ONLY_TURNS:
        raise ScanError(
            f"the camera only rotates, or passes by a flat scene: rotation in place explains "
            f"{100 * share:.0f} % of the image motion, which does not determine distances; walk "
            "sideways around the object and keep it in the middle of the image; before a wall or "
            "above a floor, have things in view that stand out from it"
        )


def turning_share(matched: Matched) -> float | None:
    """Return the share of matches that a camera rotating in place explains; None if unknown.

    The focal length is the one for which rotation explains most.
    """
    pairs = _wide_pairs(matched)
    if not pairs:
        return None
    center = (np.array(matched.size_px) - 1.0) / 2.0
    sides = [
        tuple((side - center) / matched.diagonal_px for side in matched.places(pair, matches))
        for pair, matches in pairs
    ]
    return max(
        float(np.median([_following(one, other, focal) for one, other in sides]))
        for focal in _FOCALS
    )


def _wide_pairs(matched: Matched) -> Sequence[tuple[Pair, NDArray[np.int64]]]:
    """Return the pairs of images with the largest image motion, spread over all images."""
    wide = []
    for pair, matches in sorted(matched.agreeing.items()):
        one, other = matched.places(pair, matches)
        way = np.median(np.linalg.norm(other - one, axis=1)) / matched.diagonal_px
        if len(matches) >= _LEAST_MATCHES and way > _WIDE:
            wide.append((pair, matches))
    step = max(1, len(wide) // _MOST_PAIRS)
    return wide[::step]


def _following(one: Floats, other: Floats, focal: float) -> float:
    """Return the share of matches (M, 2), in diagonals, that the best rotation explains."""
    before, after = _rays(one, focal), _rays(other, focal)
    kept = np.ones(len(one), bool)
    near = kept
    for _ in range(3):
        turn = _turn(before[kept], after[kept])
        moved = before @ turn.T
        ahead = np.maximum(moved[:, 2:], 1e-6)
        off = np.linalg.norm(focal * moved[:, :2] / ahead - other, axis=1)
        near = off < _TURN_PX
        kept = off <= np.median(off)
    return float(near.mean())


def _rays(places: Floats, focal: float) -> Floats:
    rays = np.concatenate([places / focal, np.ones((len(places), 1))], axis=1)
    return rays / np.linalg.norm(rays, axis=1)[:, None]


def _turn(before: Floats, after: Floats) -> Floats:
    """Return the rotation (3, 3) that best aligns rays with others, by Kabsch's method."""
    left, _, right = np.linalg.svd(after.T @ before)
    sign = np.sign(np.linalg.det(left @ right))
    return left @ np.diag([1.0, 1.0, sign]) @ right


def refuse_unplaced(matched: Matched) -> NoReturn:
    """Report why no poses were found.

    Raises:
        ScanError: always.

    """
    joined = sum(len(matches) >= _LEAST_MATCHES for matches in matched.agreeing.values())
    if joined < len(matched.names) - 1:
        raise ScanError(
            "the images share too little of the scene: only "
            f"{joined} of {len(matched.names) * (len(matched.names) - 1) // 2} pairs overlap "
            "enough; take them closer together, and lay printed paper around a plain object"
        )
    raise ScanError(
        "the images do not determine distances: all that they share is in one plane, or the "
        "camera hardly moved sideways; walk around an object that has a background"
    )
