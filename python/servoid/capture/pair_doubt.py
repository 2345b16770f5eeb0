"""Checks whether what two cameras of a rig see at the same instants contradicts their calibration.

Parallel cameras do not determine the focal length, but features that are behind them, or off their
epipolar lines, contradict their poses.
"""

import numpy as np

from servoid._native import Pose
from servoid.capture.capture import Capture
from servoid.capture.exchanged import (
    Sides,
    all_sides,
    contradiction_note,
    exchange_note,
    repeated_note,
    until_settled,
)
from servoid.capture.focal_fit import turned_note
from servoid.capture.matched_features import FIRST_OF_VIDEO
from servoid.capture.neighbours import (
    Album,
    evenly,
    in_both,
    is_video,
    matched_at,
    second_from_first,
)
from servoid.pose import exact

_INSTANTS = 4
_LEAST_TURN = 1e-4  # of the axes of two cameras, below which the focal length is unobservable
AT_END = "a camera was moved meanwhile, as at the end, though not at the start,"
"""Begins what only the last images say."""


def doubt_pair(album: Album, *, last: int | None) -> str | None:
    """Return a message if what the first two cameras see contradicts their calibration, else None.

    The focal length of parallel cameras is compared only if nobody measured it, and then only for
    their being parallel. Parallel cameras that the first images show to be right are compared again
    at the observation `last`, by default the capture's.
    """
    first, second = album.capture.cameras[:2]
    names = first.name, second.name
    repeated = _repeated(album)
    if repeated is not None:
        return repeated
    matched = matched_at(album, (0, 1), evenly(len(album.capture), _INSTANTS))
    if album.capture.measured and not constrains_focal(second_from_first(first, second)):
        pairs = list(until_settled(matched))
        note = exchange_note(names, pairs) or contradiction_note(names, pairs)
        return note or _doubt_end(album, last, all_sides(pairs))
    pairs = list(matched)
    return exchange_note(names, pairs) or turned_note(names, pairs)


def is_refuted(capture: Capture) -> bool:
    """Return whether most of what the first two cameras of a rig see contradicts their calibration.

    It is surely wrong then, and so are poses that follow from it.
    """
    if len(capture.cameras) < 2:
        return False
    matched = matched_at(Album(capture), (0, 1), evenly(len(capture), _INSTANTS))
    return all_sides(matched).refute


def _doubt_end(album: Album, last: int | None, at_first: Sides) -> str | None:
    """Return a message if the last images contradict the calibration, else None.

    The first ones do not, or nothing matches in them. A lens that is wrong throughout contradicts
    them somewhat as well, and no camera was moved.
    """
    first, second = album.capture.cameras[:2]
    there = [at for at in in_both(first, second) if last is None or at <= last]
    if len(there) < 2 or (there[-1] >= FIRST_OF_VIDEO and is_video(first)):
        return None
    pairs = list(matched_at(album, (0, 1), there[-1:]))
    note = contradiction_note((first.name, second.name), pairs)
    return note and (f"{AT_END} {note}" if all_sides(pairs).is_worse(at_first) else note)


def _repeated(album: Album) -> str | None:
    """Report two cameras whose images are equal at the first instant, the middle or the last."""
    one, other = album.capture.cameras[:2]
    both = in_both(one, other)
    if is_video(one) or is_video(other):
        both = both[:FIRST_OF_VIDEO]
    for place in evenly_placed(len(both)):
        first, second = (album.posed(camera, both[place]) for camera in (0, 1))
        if first is None or second is None:
            continue
        note = repeated_note((one.name, other.name), first, second)
        if note is not None:
            return note if place == 0 else f"in observation {both[place]}, {note}"
    return None


def evenly_placed(count: int) -> list[int]:
    """Return the first of `count` indices, the middle one and the last."""
    return sorted({0, count // 2, count - 1}) if count else []


def constrains_focal(second_from_first: Pose) -> bool:
    """Return whether the focal length moves the epipolar lines; parallel cameras' do not move."""
    shift = np.asarray(second_from_first.translation)
    length = exact.norm(shift)
    if not length > 0.0:
        return False
    along = abs(shift[2]) / length
    turned = 1.0 - float(second_from_first.matrix()[2, 2])
    return along > _LEAST_TURN or turned > _LEAST_TURN
