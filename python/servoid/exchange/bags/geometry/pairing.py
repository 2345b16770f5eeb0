"""Groups images of several cameras by the time at which they were taken."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid.exchange.bags.stored.header import NS_PER_S
from servoid.words import counted, measured

APART_S = 0.025
"""Maximum seconds between images of one observation; less at higher image rates."""

DEPTH_APART_NS = NS_PER_S // 100
"""Maximum nanoseconds between an image and its registered depth image."""

_REPORTED_NS = NS_PER_S // 1000
_MS_PER_NS = 1e-6


@dataclass(frozen=True)
class Moment:
    """One observation: its time, and the index of each camera's image in its list, or None."""

    stamp_ns: int
    places: tuple[int | None, ...]


def pair(stamps_ns: Sequence[Sequence[int]], apart_s: float = APART_S) -> list[Moment]:
    """Group images by their timestamps, which increase for each camera.

    Images belong together if they are at most `apart_s` apart, and at most half the usual period
    between images. The time is that of the first camera that has an image in the group.
    """
    apart_ns = allowed_ns(stamps_ns, apart_s)
    heads = [0] * len(stamps_ns)
    moments = []
    while True:
        waiting = [
            stamps[head]
            for stamps, head in zip(stamps_ns, heads, strict=True)
            if head < len(stamps)
        ]
        if not waiting:
            return moments
        last = min(waiting) + apart_ns
        places: list[int | None] = []
        for camera, stamps in enumerate(stamps_ns):
            head = heads[camera]
            has = head < len(stamps) and stamps[head] <= last
            places.append(head if has else None)
            heads[camera] += has
        stamp = next(
            stamps[place]
            for stamps, place in zip(stamps_ns, places, strict=True)
            if place is not None
        )
        moments.append(Moment(stamp, tuple(places)))


def pairing_notes(
    names: Sequence[str], stamps_ns: Sequence[Sequence[int]], moments: Sequence[Moment]
) -> list[str]:
    """Return messages for the user on how images were grouped."""
    notes = []
    for camera, name in enumerate(names):
        missing = sum(moment.places[camera] is None for moment in moments)
        if missing:
            count = counted(len(moments), "observation")
            notes.append(
                f"{missing} of {count} lack an image of {name}: none was taken at that time"
            )
    for camera, name in enumerate(names[1:], start=1):
        off = [
            abs(stamps_ns[camera][there] - stamps_ns[0][here])
            for here, there in ((one.places[0], one.places[camera]) for one in moments)
            if here is not None and there is not None
        ]
        if off and float(np.median(off)) > _REPORTED_NS:
            usual, worst = (_MS_PER_NS * float(one) for one in (np.median(off), max(off)))
            notes.append(
                f"images of {names[0]} and {name} were taken {measured(usual)} ms apart, at most "
                f"{measured(worst)} ms; moving objects appear at two positions, so let one clock "
                "trigger both"
            )
    return notes


def absence(stamp_ns: int, stamps_ns: Sequence[int], most_ns: int) -> str | None:
    """Report how far a camera's nearest image is from an observation that lacks one of it.

    `stamps_ns` increase; images of one observation are at most `most_ns` apart. None without any.
    """
    place = nearest(stamps_ns, stamp_ns)
    if place is None:
        return None
    there_ns = stamps_ns[place]
    off, most = (_MS_PER_NS * one for one in (abs(there_ns - stamp_ns), most_ns))
    return (
        f"the nearest was taken {measured(off)} ms {'before' if there_ns < stamp_ns else 'after'} "
        f"it by their time stamps, and images of one observation are at most {measured(most)} ms "
        "apart; if none was lost, synchronise the cameras: let one clock stamp both"
    )


def nearest(stamps_ns: Sequence[int], stamp_ns: int) -> int | None:
    """Return the place of the stamp that is nearest to another one; None without any.

    `stamps_ns` increase.
    """
    after = bisect_left(stamps_ns, stamp_ns)
    near = range(max(0, after - 1), min(after + 1, len(stamps_ns)))
    return min(near, key=lambda place: abs(stamps_ns[place] - stamp_ns), default=None)


def late_depth_note(name: str, stamps_ns: Sequence[int], depths_ns: Sequence[int]) -> str | None:
    """Report depth images of which none was taken with an image of the camera `name`.

    Both kinds of stamps increase. None without any, or if some were taken with images.
    """
    places = [nearest(depths_ns, stamp) for stamp in stamps_ns]
    off = [
        depths_ns[place] - stamp
        for place, stamp in zip(places, stamps_ns, strict=True)
        if place is not None
    ]
    if not off or min(map(abs, off)) <= DEPTH_APART_NS:
        return None
    usual = float(np.median(off))
    return (
        f"no depth image is within {_MS_PER_NS * DEPTH_APART_NS:.0f} ms of an image of {name} by "
        f"their time stamps, so none is used: the nearest is "
        f"{measured(_MS_PER_NS * min(map(abs, off)))} ms off, and the usual one "
        f"{measured(_MS_PER_NS * abs(usual))} ms {'before' if usual < 0.0 else 'after'} its image; "
        "let the camera stamp both alike"
    )


def allowed_ns(stamps_ns: Sequence[Sequence[int]], apart_s: float) -> int:
    """Return the maximum time between images of one observation."""
    usual = [float(np.median(np.diff(stamps))) for stamps in stamps_ns if len(stamps) > 1]
    most = round(apart_s * NS_PER_S)
    # Slightly less than half, so that an image in the middle belongs to no group.
    return most if not usual else min(most, int(0.49 * min(usual)))
