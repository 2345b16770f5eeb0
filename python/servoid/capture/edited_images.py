"""Checks whether images of a rig were shifted, turned or enlarged after they were taken.

A phone or a camera that stabilises or zooms digitally does so, and then the object is measured
where it is not. What the images of a rig at rest show of its surroundings stays. If the whole image
moves as one instead, the cameras may have moved, which a rig without poses may do: its poses are
those in the frame of its first camera. So what two cameras locate is compared with the images as
well: no motion of cameras shifts, turns and enlarges what is near exactly as what is far away.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.capture.capture import Capture
from servoid.capture.matched_features import (
    LONG_PX,
    MatchedFeatures,
    closest_points,
    unit_px,
    unit_rays,
)
from servoid.capture.neighbours import Album, PosedView, second_from_first
from servoid.capture.rig_sightings import Balls
from servoid.capture.surroundings import instants, match_surroundings
from servoid.pose import Floats, exact
from servoid.words import camera_called, digits

_PLACES = 4  # in the recording, that are compared with its first observation
_LEAST_UNIT_PX = 0.8  # in small images, as features are off by a share of a pixel
_LEAST = 40  # features of two instants
_LEAST_EDITED = 2  # instants
_MOVED = 6.0  # thousandths of the diagonal: less is of no weight
_ONE = 1.0  # thousandth of the diagonal: farther off, a change does not explain a feature
_WELL = 0.5  # thousandths of the diagonal: nearer, it does
_WHOLE = 0.75  # share of the features that move as one image
_AGAINST = 0.05  # share of the located features that no motion of cameras explains
_LEAST_AGAINST = 12
_TIMES = 4  # as many as those that only a motion of cameras explains
_MOST_ERROR = 0.9  # of a distance, as a share of it: beyond, it may be infinite
_TRIES = 1000
_REFINED = 4

Change = NDArray[np.float64]
"""How an image was shifted, turned and enlarged: (2, 3), pixels from pixels."""


@dataclass(frozen=True, eq=False)
class _Both:
    """Features of the first camera at two instants, (N, 2) px; `unit` is that of lengths, in px."""

    first_px: Floats
    second_px: Floats
    unit: float

    def part(self, kept: NDArray[np.bool_]) -> "_Both":
        return _Both(self.first_px[kept], self.second_px[kept], self.unit)

    def off(self, change: Change) -> Floats:
        """Return how far features are from where a change of the image puts them, (N,)."""
        return exact.lengths(_changed(change, self.first_px) - self.second_px) / self.unit

    def change(self) -> Change | None:
        """Estimate how the image was changed as a whole; None if most of it moves otherwise."""
        import cv2

        affine, _ = cv2.estimateAffinePartial2D(
            self.first_px,
            self.second_px,
            method=cv2.RANSAC,
            ransacReprojThreshold=_ONE * self.unit,
            maxIters=_TRIES,
        )
        if affine is None:
            return None
        found = affine.astype(np.float64)
        is_whole = np.mean(self.off(found) < _ONE) > _WHOLE
        shifts = exact.lengths(_changed(found, self.first_px) - self.first_px) / self.unit
        return found if is_whole and np.median(shifts) > _MOVED else None


def _changed(change: Change, pixels: Floats) -> Floats:
    return exact.product(pixels, np.ascontiguousarray(change[:, :2].T)) + change[:, 2]


def doubt_edited(
    capture: Capture, may_move: Balls | None = None, *, among: Sequence[int] | None = None
) -> str | None:
    """Return a message if the images of a rig at rest were changed digitally, else None.

    Two cameras must see its surroundings, of which some is nearer than the rest. What is inside of
    `may_move` does not count. Observations `among` these indices are compared; without, among all.
    """
    poses = capture.world_from_rig
    is_at_rest = all(pose == poses[0] for pose in poses)
    if not capture.is_recording or len(capture.cameras) < 2 or not is_at_rest:
        return None
    rough, fine = Album(capture, long_px=LONG_PX // 2), Album(capture)
    start, *later = instants(capture, among, _PLACES) or [0]
    balls = may_move or (lambda _: ())
    edited = []
    for index in later:
        # In small images, most rigs are seen to rest, which is all that is asked of them.
        both = _matched(rough, (start, index), balls)
        if both is None or both.change() is None:
            continue
        both = _matched(fine, (start, index), balls)
        change = None if both is None else both.change()
        if both is not None and change is not None and _is_digital(fine, start, both, change):
            edited.append((both, change))
    return _words(capture, edited) if len(edited) >= _LEAST_EDITED else None


def _matched(album: Album, indices: tuple[int, int], balls: Balls) -> _Both | None:
    """Match the surroundings in the first camera's images of two instants; None if too few."""
    seen = match_surroundings(album, 0, indices, balls)
    if seen is None:
        return None
    both = _Both(*seen, max(unit_px(album.capture.cameras[0].lens), _LEAST_UNIT_PX))
    return both if len(both.first_px) >= _LEAST else None


def _is_digital(album: Album, index: int, both: _Both, change: Change) -> bool:
    """Return whether a change of the image explains what no motion of the cameras does."""
    first, second = album.capture.cameras[:2]
    poses = [album.capture.world_from_rig[index] @ one.rig_from_camera for one in (first, second)]
    pair = album.match(PosedView(0, index, poses[0]), PosedView(1, index, poses[1]))
    if pair is None or not exact.norm(np.asarray(second_from_first(first, second).translation)):
        return False
    rows = {tuple(pixel): row for row, pixel in enumerate(pair.first_px.tolist())}
    found = np.array([rows.get(tuple(pixel), -1) for pixel in both.first_px.tolist()])
    seen, pair = both.part(found >= 0), pair.part(found[found >= 0])
    nearest = _off_as_moved(pair, seen)
    if nearest is None:
        return False
    off = seen.off(change)
    against = int(((off < _WELL) & (nearest > _ONE)).sum())
    in_favour = int(((off > _ONE) & (nearest < _WELL)).sum())
    least = max(_LEAST_AGAINST, _AGAINST * len(off), _TIMES * in_favour)
    return against >= least


def _off_as_moved(pair: MatchedFeatures, seen: _Both) -> Floats | None:
    """Return how far features are off if the first camera moved, (N,); None if too few are located.

    The motion is that which explains most, and each feature may be nearer or farther away by what
    an error of matching makes of it.
    """
    import cv2

    lens = pair.lenses[0]
    points, rays = closest_points(pair)[0], unit_rays(lens, seen.second_px)
    usable = np.isfinite(points).all(axis=1) & (points[:, 2] > 0.0) & (rays[:, 2] > 0.0)
    if usable.sum() < _LEAST:
        return None
    unit = seen.unit / lens.focal_px[0]
    at = rays[usable, :2] / rays[usable, 2:]
    known, eye = points[usable], np.eye(3)
    error = _ONE * unit
    found, turn, shift, _ = cv2.solvePnPRansac(  # pyright: ignore[reportCallIssue]
        known,
        at,
        eye,
        None,  # pyright: ignore[reportArgumentType]
        reprojectionError=error,
        iterationsCount=_TRIES,
    )
    if not found:
        return None
    for _ in range(_REFINED):
        off = exact.lengths(_projected(known, turn, shift) - at) / unit
        near = off <= max(3.0 * float(np.median(off)), _WELL)
        turn, shift = cv2.solvePnPRefineLM(known[near], at[near], eye, None, turn, shift)  # pyright: ignore[reportCallIssue, reportArgumentType]
    apart = exact.norm(np.asarray(pair.second_from_first.translation))
    share = error * known[:, 2] / apart  # of a distance
    ends = [
        _projected(known / (1.0 + sign * np.minimum(share, _MOST_ERROR))[:, None], turn, shift)
        for sign in (-1.0, 1.0)
    ]
    result = np.zeros(len(points))  # what is not located is explained by some distance
    result[usable] = _off_segments(at, *ends) / unit
    return result


def _projected(points: Floats, turn: NDArray[Any], shift: NDArray[Any]) -> Floats:
    """Return where a camera that moved sees points, (N, 2), at a distance of 1."""
    import cv2

    seen = cv2.projectPoints(points, turn, shift, np.eye(3), None)[0]  # pyright: ignore[reportCallIssue, reportArgumentType]
    return seen[:, 0].astype(np.float64)


def _off_segments(at: Floats, start: Floats, end: Floats) -> Floats:
    """Return the distance of each place, (N, 2), from the segment between two others."""
    along = end - start
    size = np.maximum(np.square(along).sum(axis=1), np.finfo(np.float64).tiny)
    share = np.clip(((at - start) * along).sum(axis=1) / size, 0.0, 1.0)
    return exact.lengths(at - start - share[:, None] * along)


def _words(capture: Capture, edited: Sequence[tuple[_Both, Change]]) -> str:
    """Say what was found in the image that was changed most."""
    both, change = max(
        edited, key=lambda one: float(np.median(exact.lengths(one[0].second_px - one[0].first_px)))
    )
    shift_px = float(np.median(exact.lengths(both.second_px - both.first_px)))
    times = exact.hypot(float(change[0, 0]), float(change[1, 0]))
    fits = int((both.off(change) < _ONE).sum())
    return (
        f"the images of {camera_called(capture.cameras[0].name)} were shifted or enlarged after "
        f"they were taken: of {len(both.first_px)} features of its surroundings, {fits} moved as "
        f"one image ({digits(round(shift_px))} px, {times:.2f} times as large), near ones as far "
        "ones, which no motion of the cameras does; switch off digital stabilisation and zoom, "
        "and record again"
    )
