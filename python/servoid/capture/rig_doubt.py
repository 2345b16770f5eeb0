"""Checks whether what three or more cameras of a rig see at one instant contradicts their poses.

Each camera is compared with those that look the same way from near it. What two of them locate has
a place in a third, which shows what pairs do not: distances between parallel cameras, and angles
about the axis across them. The cameras in all contradictions, and in the fewest agreements, are
named.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from servoid.capture.exchanged import (
    Sides,
    contradiction_note,
    exchange_note,
    exchange_words,
    repeated_note,
    sides_of,
)
from servoid.capture.focal_fit import OFF_PX, focal_note
from servoid.capture.located import off_in_third
from servoid.capture.matched_features import FIRST_OF_VIDEO, MatchedFeatures
from servoid.capture.neighbours import (
    Album,
    evenly,
    is_video,
    matched_at,
    second_from_first,
)
from servoid.capture.pair_doubt import AT_END, constrains_focal, evenly_placed
from servoid.pose import exact
from servoid.words import joined

_INSTANTS = 3  # at which a pair is sought that has features in common
_NEAREST = 2  # other cameras with which each is compared, if there are many
_FEW = 4  # cameras, of which all pairs are compared
_TINY_M = 1e-9  # keeps cameras at one place from a division by zero

Pair = tuple[int, int]


@dataclass(frozen=True)
class _Finding:
    """What some cameras show together: nothing against their calibration, or what `note` says."""

    cameras: frozenset[int]
    note: str | None


def doubt_rig(album: Album, *, last: int | None) -> str | None:
    """Return a message if what the cameras see contradicts their calibration, else None.

    The images at the observation `last`, by default the capture's, are compared as well.
    """
    repeated = _repeated(album)
    if repeated is not None:
        return repeated
    count = len(album.capture) if last is None else min(last + 1, len(album.capture))
    if any(is_video(camera) for camera in album.capture.cameras):
        count = min(count, FIRST_OF_VIDEO)
    note = _doubt_at(album, evenly(count, _INSTANTS))
    if note is not None or count < 2 or len(album.capture.cameras) > _FEW:
        return note
    late = _doubt_at(album, [count - 1])
    return late and f"{AT_END} {late}"


def _doubt_at(album: Album, indices: Sequence[int]) -> str | None:
    """Compare the cameras at the first of some instants at which they have features in common."""
    matched = {}
    for pair in _partners(album):
        one = next(matched_at(album, pair, indices), None)
        if one is not None:
            matched[pair] = one
    cameras = album.capture.cameras
    names = [camera.name for camera in cameras]
    exchanged = _exchanged(album, names, matched)
    if exchanged is not None:
        return exchanged
    found = [*_of_pairs(names, matched), *_of_three(names, matched)]
    turned = [
        one
        for (first, second), one in matched.items()
        if not album.capture.measured
        or constrains_focal(second_from_first(cameras[first], cameras[second]))
    ]
    blamed = _blamed(names, found)
    is_right = blamed is None
    return focal_note(turned, is_rig=is_right, must_explain=not is_right) or blamed


def _partners(album: Album) -> list[Pair]:
    """List the pairs of cameras that are compared: those that look the same way and are near."""
    poses = [camera.rig_from_camera.matrix() for camera in album.capture.cameras]
    count = len(poses)
    aside = np.array([[1.0 - exact.dot(a[:3, 2], b[:3, 2]) for b in poses] for a in poses])
    apart = np.array([[exact.norm(a[:3, 3] - b[:3, 3]) for b in poses] for a in poses])
    unlike = aside + apart / max(float(apart.max()), _TINY_M)
    np.fill_diagonal(unlike, np.inf)
    most = count - 1 if count <= _FEW else _NEAREST
    return sorted(
        {
            (min(one, other), max(one, other))
            for one in range(count)
            for other in np.argsort(unlike[one], kind="stable")[:most].tolist()
        }
    )


def _of_pairs(names: Sequence[str], matched: dict[Pair, MatchedFeatures]) -> Iterator[_Finding]:
    for (one, other), pair in matched.items():
        note = contradiction_note((names[one], names[other]), [pair])
        yield _Finding(frozenset((one, other)), note)


def _of_three(names: Sequence[str], matched: dict[Pair, MatchedFeatures]) -> Iterator[_Finding]:
    """Compare what two cameras locate with where a third one has it."""
    done: set[frozenset[int]] = set()
    for middle in range(len(names)):
        beside = {
            one + other - middle: pair if one == middle else pair.turned_round()
            for (one, other), pair in matched.items()
            if middle in (one, other)
        }
        for second, third in combinations(beside, 2):
            cameras = frozenset((middle, second, third))
            if cameras in done:
                continue
            off = off_in_third(beside[second], beside[third], allowed=OFF_PX)
            if off is None:
                continue
            done.add(cameras)
            yield _Finding(cameras, off.note([names[at] for at in sorted(cameras)]))


def _blamed(names: Sequence[str], findings: Sequence[_Finding]) -> str | None:
    """Return what the findings say, after the cameras that are in all that contradict."""
    wrong = [finding for finding in findings if finding.note is not None]
    if not wrong:
        return None
    note = min(wrong, key=lambda finding: len(finding.cameras)).note
    suspects: frozenset[int] = frozenset.intersection(*(finding.cameras for finding in wrong))
    if not suspects:
        return note
    right = {at: sum(at in one.cameras for one in findings if one.note is None) for at in suspects}
    least = min(right.values())
    named = [names[at] for at in sorted(suspects) if right[at] == least]
    if len(named) == 1:
        return f"camera {named[0]} does not fit the others: {note}"
    return f"of the cameras {joined(named, 'or')}, one does not fit the others: {note}"


def _exchanged(
    album: Album, names: Sequence[str], matched: dict[Pair, MatchedFeatures]
) -> str | None:
    """Name the two cameras with which all fits if each has the other's images."""
    notes = {
        pair: exchange_note((names[pair[0]], names[pair[1]]), [one])
        for pair, one in matched.items()
    }
    first = next((note for note in notes.values() if note is not None), None)
    if first is None:
        return None
    found: dict[Pair, tuple[int, int, int]] = {}
    for swap in combinations(range(len(names)), 2):
        sides = [
            (sides_of(one), sides_of(_swapped(album, one, pair, swap)))
            for pair, one in matched.items()
            if set(pair) & set(swap)
        ]
        if sides and all(after.agree for _, after in sides):
            given, after = (sum(each, Sides()) for each in zip(*sides, strict=True))
            found[swap] = given.matched, given.front, after.front
    if len(found) == 1:
        [(one, other)] = found
        return exchange_words((names[one], names[other]), *found[one, other])
    return None if any(sides_of(one).agree for one in matched.values()) else first


def _swapped(album: Album, one: MatchedFeatures, pair: Pair, swap: Pair) -> MatchedFeatures:
    """Return a pair of images as it were if two cameras had each other's images."""
    other_of = {swap[0]: swap[1], swap[1]: swap[0]}
    first, second = (album.capture.cameras[other_of.get(at, at)] for at in pair)
    return MatchedFeatures(
        (first.lens, second.lens), second_from_first(first, second), one.first_px, one.second_px
    )


def _repeated(album: Album) -> str | None:
    """Report two cameras whose images are equal at the first instant, the middle or the last."""
    cameras = album.capture.cameras
    count = len(album.capture)
    if any(is_video(camera) for camera in cameras):
        count = min(count, FIRST_OF_VIDEO)
    for index in evenly_placed(count):
        images = [(at, album.posed(at, index)) for at in range(len(cameras))]
        there = [(at, image) for at, image in images if image is not None]
        for (one, first), (other, second) in combinations(there, 2):
            note = repeated_note((cameras[one].name, cameras[other].name), first, second)
            if note is not None:
                return note if index == 0 else f"in observation {index}, {note}"
    return None
