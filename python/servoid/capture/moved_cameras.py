"""Checks whether cameras of a rig at rest were moved while it recorded, such as by a kick.

The surroundings of a camera at rest stay in its image. If they move as one in one camera and stay
in another, the first was turned, and its calibration holds no more from there on: a mount that sags
does so, slowly, and the depth of all that two cameras see is wrong long before features leave their
epipolar lines. If they move in all cameras of a rig that rests otherwise, the rig was moved.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from servoid.capture.capture import Capture
from servoid.capture.matched_features import LONG_PX, unit_px, unit_rays
from servoid.capture.neighbours import Album
from servoid.capture.rig_sightings import Balls
from servoid.capture.surroundings import instants, match_surroundings
from servoid.pose import Floats, exact
from servoid.words import camera_called

_PLACES = 8  # in the recording, that are compared with its first observation
_LEAST = 40  # features of two instants
_LEAST_MOVED = 2  # observations
_LEAST_UNIT_PX = 0.8  # as features are off by a share of a pixel
_ONE = 1.0  # thousandth of the diagonal: nearer, a feature is where it was, or is predicted
# In thousandths of the diagonal, about 0.2 degrees: poses by cameras 0.1 m apart were 8 to 13 mm
# wrong from there on, and 20 mm at twice as much. At rest, it is 0.3 at most (recorded pairs).
_MOVED = 2.5
_LEAST_MOVED_PX = 1.0
_MOST = 0.6  # share of the features that stay, or move as one; at rest, 0.7 and more of them stay
_RESTS = 0.5  # share of the time in which a rig that was moved rests
_QUARTERS = 3  # of the image, in which what moves as one must be: an arm is in fewer
_LEAST_IN_QUARTER = 0.05  # share of the features
_TRIES = 1000


@dataclass(frozen=True)
class MovedDoubt:
    """What the surroundings say of cameras that should rest, in words.

    It is so from the observation `since` on. With `is_apart`, some cameras were moved and others
    were not, so that poses are wrong; otherwise the whole rig was.
    """

    words: str
    since: int
    is_apart: bool


@dataclass(frozen=True)
class _Shift:
    """How the surroundings moved in an image.

    They stay if `px` is 0, and `is_moved` tells whether the motion is so large that it counts.
    """

    px: float = 0.0
    degrees: float = 0.0
    is_moved: bool = False


def doubt_moved(
    capture: Capture, may_move: Balls | None = None, *, among: Sequence[int] | None = None
) -> MovedDoubt | None:
    """Return a message if some or all cameras of a rig at rest were moved meanwhile, else None.

    What is inside of `may_move` does not count. Observations `among` these indices are compared;
    without, among all. A rig that moves all the time, without poses, is not reported: its poses are
    those in the frame of its first camera.
    """
    poses = capture.world_from_rig
    is_at_rest = all(pose == poses[0] for pose in poses)
    if not capture.is_recording or len(capture.cameras) < 2 or not is_at_rest:
        return None
    # Small images are enough: what moves by a share of a pixel in them is not reported.
    album, balls = Album(capture, long_px=LONG_PX // 2), may_move or (lambda _: ())
    chosen = instants(capture, among, _PLACES)

    def shifts(index: int, start: int = chosen[0] if chosen else 0) -> list[_Shift | None]:
        places = range(len(capture.cameras))
        return [_shift(album, place, (start, index), balls) for place in places]

    indices = list(range(len(capture)) if among is None else among)
    seen = [shifts(index) for index in chosen[1:]]
    for tells, words in ((_is_apart, _apart_words), (_is_together, _together_words)):
        told = [place for place, one in enumerate(seen) if tells(one)]
        if not told or (tells is _is_together and not _rests(chosen, shifts)):
            continue
        before, at = chosen[told[0]], chosen[told[0] + 1]
        since = _first_moved(indices, (before, at), shifts)
        if len(indices) - indices.index(since) >= _LEAST_MOVED:
            # The largest motion says most of what happened.
            largest = max((seen[place] for place in told), key=_largest_px)
            return MovedDoubt(words(capture, largest, since), since, tells is _is_apart)
    return None


def _shift(album: Album, place: int, indices: tuple[int, int], balls: Balls) -> _Shift | None:
    """Return how the surroundings moved in a camera's image; None if they do not tell."""
    import cv2

    both = match_surroundings(album, place, indices, balls)
    if both is None or len(both[0]) < _LEAST:
        return None
    first_px, second_px = both
    lens = album.capture.cameras[place].lens
    unit = max(unit_px(lens), _LEAST_UNIT_PX)
    if np.mean(exact.lengths(second_px - first_px) < _ONE * unit) > _MOST:
        return _Shift()
    # A camera that turns moves all that it sees by one homography, near things as far ones.
    change, _ = cv2.findHomography(first_px, second_px, cv2.RANSAC, _ONE * unit, maxIters=_TRIES)
    if change is None:
        return None
    there = np.column_stack([first_px, np.ones(len(first_px))])
    moved = exact.product(there, np.ascontiguousarray(change.astype(np.float64).T))
    with np.errstate(divide="ignore", invalid="ignore"):
        moved_px = moved[:, :2] / moved[:, 2:]
        fits = exact.lengths(moved_px - second_px) < _ONE * unit
    if np.mean(fits) <= _MOST or not _is_spread(first_px[fits], lens.size_px):
        return None
    px = float(np.median(exact.lengths(moved_px[fits] - first_px[fits])))
    is_moved = px > max(_MOVED * unit_px(lens), _LEAST_MOVED_PX)
    sines = np.cross(unit_rays(lens, first_px[fits]), unit_rays(lens, moved_px[fits]))
    turn_rad = float(exact.arcsin(np.minimum(np.median(exact.lengths(sines)), 1.0)))
    return _Shift(px, float(np.degrees(turn_rad)), is_moved)


def _is_spread(pixels: Floats, size_px: tuple[int, int]) -> bool:
    """Return whether features are in most quarters of an image."""
    right, below = (pixels > np.array(size_px) / 2.0).T
    shares = [np.mean((right == x) & (below == y)) for x in (False, True) for y in (False, True)]
    return sum(share >= _LEAST_IN_QUARTER for share in shares) >= _QUARTERS


def _is_apart(shifts: Sequence[_Shift | None]) -> bool:
    """Return whether a camera moved, and another did not."""
    known = [one for one in shifts if one is not None]
    return any(one.px == 0.0 for one in known) and any(one.is_moved for one in known)


def _is_together(shifts: Sequence[_Shift | None]) -> bool:
    """Return whether all cameras moved."""
    return all(one is not None and one.is_moved for one in shifts)


def _is_still(shifts: Sequence[_Shift | None]) -> bool:
    return all(one is not None and not one.is_moved for one in shifts)


def _largest_px(shifts: Sequence[_Shift | None]) -> float:
    return max(one.px for one in shifts if one is not None)


def _rests(chosen: Sequence[int], shifts: Callable[[int, int], list[_Shift | None]]) -> bool:
    """Return whether the surroundings mostly stay from one of the chosen instants to the next."""
    still = [_is_still(shifts(later, earlier)) for earlier, later in pairwise(chosen)]
    return bool(np.mean(still) > _RESTS)


def _first_moved(
    indices: Sequence[int],
    between: tuple[int, int],
    shifts: Callable[[int], list[_Shift | None]],
) -> int:
    """Return the first of the observations in which not all cameras are where they were."""
    still, moved = (indices.index(index) for index in between)
    while moved - still > 1:
        middle = (still + moved) // 2
        if _is_still(shifts(indices[middle])):
            still = middle
        else:
            moved = middle
    return indices[moved]


def _apart_words(capture: Capture, shifts: Sequence[_Shift | None], since: int) -> str:
    """Say which camera moved most, and by how much."""
    parts = list(zip(capture.cameras, shifts, strict=True))
    moved = [(camera, one) for camera, one in parts if one is not None and one.is_moved]
    rest = [camera for camera, one in parts if one is not None and one.px == 0.0]
    camera, one = max(moved, key=lambda each: each[1].px)
    return (
        f"{camera_called(camera.name)} was moved or zoomed meanwhile: from observation {since} "
        f"on, its surroundings move as one in its image, by up to {_amount(one)}, and stay in that "
        f"of {camera_called(rest[0].name)}, so that its calibration holds no more and poses are "
        "wrong; fasten the camera, its zoom and its focus, calibrate and record again, or use only "
        "the observations before"
    )


def _together_words(_: Capture, shifts: Sequence[_Shift | None], since: int) -> str:
    """Say by how much all cameras moved."""
    one = max((each for each in shifts if each is not None), key=lambda each: each.px)
    return (
        "the cameras were moved or zoomed meanwhile, all of them: from observation "
        f"{since} on, their surroundings move as one in their images, by up to {_amount(one)}; "
        "poses from there on are relative to the cameras where they are then, and are not "
        "comparable with those before in the world; record again with cameras at rest, or give the "
        "poses of the rig"
    )


def _amount(one: _Shift) -> str:
    return f"{one.px:.1f} px, as by a turn of {one.degrees:.1f} degrees"
