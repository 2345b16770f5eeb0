"""Finds cameras that gave nothing from some observation on, though others went on."""

import re
from collections.abc import Sequence

from servoid.words import camera_called, counted

_NOTHING = re.compile(
    r"camera ([^:]+?)(?:: the image (?:repeats the previous one|shows nothing)"
    r"| delivered no image|: no image came|: there is no image)"
)
_LEAST = 10  # observations
_LEAST_SHARE = 0.2


def gone_note(
    notices: Sequence[Sequence[str]], times_s: Sequence[float], cameras: int
) -> str | None:
    """Say which of the cameras gave nothing from some time on; None if all did, or none.

    `notices` are those of each observation. Images that all cameras repeat show an object at rest,
    or a recording that stands still.
    """
    gone = _gone(notices)
    if not 0 < len(gone) < cameras:
        return None
    parts = [
        f"{camera_called(name)} gave no new image from {times_s[first]:.2f} s on, in the last "
        f"{len(notices) - first} of {counted(len(notices), 'observation')}"
        for name, first in gone
    ]
    left = counted(cameras - len(gone), "other camera")
    return f"{'; '.join(parts)}: what was tracked since rests on {left}"


def _gone(notices: Sequence[Sequence[str]]) -> list[tuple[str, int]]:
    """Return the cameras that gave nothing at the end, and the place from which on they did not.

    Short ends are left out.
    """
    said = [
        {found[1] for notice in each if (found := _NOTHING.match(notice)) is not None}
        for each in notices
    ]
    gone = []
    for name in sorted(said[-1]) if said else []:
        first = len(said)
        while first > 0 and name in said[first - 1]:
            first -= 1
        count = len(said) - first
        if first > 0 and count >= max(_LEAST, _LEAST_SHARE * len(said)):
            gone.append((name, first))
    return gone
