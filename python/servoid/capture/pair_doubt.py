"""Checks whether what two cameras of a rig see at the same instants contradicts their calibration.

Parallel cameras do not determine the focal length, but features that are behind them, or off their
epipolar lines, contradict their poses.
"""

from collections.abc import Iterator, Sequence

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
from servoid.capture.focal_fit import FocalFit, turned_note
from servoid.capture.matched_features import FIRST_OF_VIDEO, MatchedFeatures
from servoid.capture.neighbours import (
    Album,
    evenly,
    in_both,
    is_video,
    matched_at,
    second_from_first,
)
from servoid.capture.turn_fit import TurnFit
from servoid.pose import exact

_INSTANTS = 4
_ENOUGH = 600  # features
_FAR_BETTER = 1.4  # times nearer to epipolar lines, with a turn than with a focal length
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
        note = exchange_note(names, pairs) or _turn_note(names, _enough(pairs, matched))
        note = note or contradiction_note(names, pairs)
        return note or _doubt_end(album, last, all_sides(pairs))
    pairs = list(matched)
    return exchange_note(names, pairs) or _turned_note(names, pairs)


def _enough(
    pairs: Sequence[MatchedFeatures], more: Iterator[MatchedFeatures]
) -> list[MatchedFeatures]:
    """Return pairs of images with so many features that a small turn shows."""
    found = list(pairs)
    while sum(len(pair.first_px) for pair in found) < _ENOUGH:
        pair = next(more, None)
        if pair is None:
            break
        found.append(pair)
    return found


def _turn_note(names: tuple[str, str], pairs: Sequence[MatchedFeatures]) -> str | None:
    """Return what contradicts parallel cameras that somebody calibrated."""
    fit = TurnFit.of(pairs) if pairs else None
    return fit.note(names) if fit is not None and (fit.is_turned or fit.is_turned_or_bent) else None


def _turned_note(names: tuple[str, str], pairs: Sequence[MatchedFeatures]) -> str | None:
    """Return what contradicts cameras that are turned to each other; a turn if it fits better."""
    turn = TurnFit.of(pairs) if pairs else None
    if turn is None or not turn.is_turned or _is_focal(pairs, turn):
        return turned_note(names, pairs)
    return turn.note(names)


def _is_focal(pairs: Sequence[MatchedFeatures], turn: TurnFit) -> bool:
    """Return whether another focal length explains about as much as a turn."""
    focal = FocalFit.of(pairs)
    is_near = focal is not None and focal.best_px < _FAR_BETTER * turn.best_px
    return is_near and constrains_focal(pairs[0].second_from_first)


def is_refuted(capture: Capture) -> bool:
    """Return whether the images surely contradict the calibration of the first two cameras.

    Most features do, or all fit far better once the second camera is turned.

    It is surely wrong then, and so are poses that follow from it.
    """
    if len(capture.cameras) < 2:
        return False
    pairs = list(matched_at(Album(capture), (0, 1), evenly(len(capture), _INSTANTS)))
    fit = TurnFit.of(pairs) if pairs else None
    is_turned = fit is not None and fit.is_surely_turned and not _is_focal(pairs, fit)
    return all_sides(pairs).refute or is_turned


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
