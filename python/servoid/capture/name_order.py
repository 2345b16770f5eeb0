"""Reports image names whose numbers are in another order than the names as text."""

import re
from collections.abc import Sequence
from decimal import Decimal
from itertools import pairwise
from pathlib import Path

from servoid.errors import CaptureError

# A fraction is part of its number: 1.25 comes before 1.5, as time stamps in seconds do.
_NUMBER = re.compile(r"[0-9]+(?:\.[0-9]+)?")


def order_note(paths: Sequence[Path], whose: str) -> str | None:
    """Report images that are ordered by their names as text, but not by the numbers in the names.

    `paths` are in the order in which they are used, `whose` begins the message: `the images of
    camera 'left'`. Only names that differ in nothing but numbers are compared, as others, such as
    hashes, count nothing. Returns None where both orders are the same.
    """
    last: dict[tuple[str, str], tuple[list[Decimal], Path]] = {}
    for path in paths:
        numbers = [Decimal(number) for number in _NUMBER.findall(path.stem)]
        kind = (str(path.parent), _NUMBER.sub("0", path.stem))
        if kind in last and numbers < last[kind][0]:
            before = last[kind][1]
            return (
                f"{whose} are used in the order of their names as text: {before.name} comes before "
                f"{path.name}; so times and poses that are given in order belong to other images "
                "if these were taken in the order of their numbers; pad the numbers with zeros to "
                f"one length, such as {_padded(path, paths)}, and name masks and depth images alike"
            )
        last[kind] = numbers, path
    return None


def _padded(path: Path, paths: Sequence[Path]) -> str:
    """Return an image's name with its last number as long as the longest one of all names."""
    longest = max(len(ends[-1]) for one in paths if (ends := _wholes(one.stem)))
    *_, last = re.finditer(r"[0-9]+", path.stem)
    stem = path.stem[: last.start()] + last[0].zfill(longest) + path.stem[last.end() :]
    return stem + path.suffix


def _wholes(stem: str) -> list[str]:
    return re.findall(r"[0-9]+", stem)


def check_pictured_once(paths: Sequence[Path], place: str) -> None:
    """Check that no two images differ only in the suffix, which would be one image twice.

    Raises:
        CaptureError: two do; `place` begins the message.

    """
    for before, path in pairwise(sorted(paths, key=lambda one: (one.parent, one.stem))):
        if before.parent == path.parent and before.stem == path.stem:
            raise CaptureError(
                f"{place}: {before} and {path.name} have the same name but for the suffix, and "
                "would count as two images; keep one of them, or give a pattern that matches one "
                f"kind, such as '*{before.suffix}'"
            )
