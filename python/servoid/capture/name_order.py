"""Reports image names whose numbers are in another order than the names as text."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise
from pathlib import Path

from servoid.camera import IMAGE_SUFFIXES
from servoid.errors import CaptureError

# A fraction is part of its number: 1.25 comes before 1.5, as time stamps in seconds do.
_NUMBER = re.compile(r"([0-9]+)(?:\.[0-9]+)?")


@dataclass(frozen=True)
class _Disorder:
    """Two names in the order of text, not of their numbers; `padded` is how to write the second."""

    before: str
    after: str
    padded: str


def order_note(paths: Sequence[Path], whose: str) -> str | None:
    """Report images that are ordered by their names as text, but not by the numbers in the names.

    `paths` are in the order in which they are used, `whose` begins the message: `the images of
    camera 'left'`. Only names that differ in one number alone, as most in a folder do, are
    compared, as those of others, such as hashes, count nothing; likewise the names of the folders.
    Returns None where both orders are the same.
    """
    folders: dict[Path, list[Path]] = {}
    for path in paths:
        folders.setdefault(path.parent, []).append(path)
    beside: dict[Path, list[str]] = {}
    for folder in folders:
        beside.setdefault(folder.parent, []).append(folder.name)
    groups = [
        *(list(map(_parts, inside)) for inside in folders.values()),
        *([(name, "") for name in names] for names in beside.values()),
    ]
    found = next((one for one in map(_disorder, groups) if one is not None), None)
    if found is None:
        return None
    return (
        f"{whose} are used in the order of their names as text: {found.before} comes before "
        f"{found.after}; so times and poses that are given in order belong to other images "
        "if these were taken in the order of their numbers; pad the numbers with zeros to "
        f"one length, such as {found.padded}, and name masks and depth images alike"
    )


def _disorder(names: Sequence[tuple[str, str]]) -> _Disorder | None:
    """Return the first names, each a stem and a suffix, that are not ordered by their number."""
    alike: dict[str, list[tuple[str, str]]] = {}
    for stem, suffix in names:
        alike.setdefault(_NUMBER.sub("0", stem), []).append((stem, suffix))
    group = max(alike.values(), key=len)
    rows = [list(_NUMBER.finditer(stem)) for stem, _ in group]
    columns = [column for column in zip(*rows, strict=True) if len({one[0] for one in column}) > 1]
    if 2 * len(group) <= len(names) or len(columns) != 1:
        return None
    (numbers,) = columns
    longest = max(len(number[1]) for number in numbers)
    for place, (before, number) in enumerate(pairwise(numbers), 1):
        if _value(number) < _value(before):
            stem, suffix = group[place]
            padded = stem[: number.start()] + number[1].zfill(longest) + stem[number.end(1) :]
            return _Disorder("".join(group[place - 1]), stem + suffix, padded + suffix)
    return None


def _value(number: re.Match[str]) -> Decimal:
    return Decimal(number[0])


def _parts(path: Path) -> tuple[str, str]:
    """Return a name without its suffix, and this; `frame.0001` has a number but no suffix."""
    return (path.stem, path.suffix) if _is_named_as_image(path) else (path.name, "")


def _is_named_as_image(path: Path) -> bool:
    return path.suffix.lower() in IMAGE_SUFFIXES


def check_pictured_once(paths: Sequence[Path], place: str) -> None:
    """Check that no two images differ only in the suffix, which would be one image twice.

    Raises:
        CaptureError: two do; `place` begins the message.

    """
    images = filter(_is_named_as_image, paths)
    for before, path in pairwise(sorted(images, key=lambda one: (one.parent, one.stem))):
        if before.parent == path.parent and before.stem == path.stem:
            raise CaptureError(
                f"{place}: {before} and {path.name} have the same name but for the suffix, and "
                "would count as two images; keep one of them, or give a pattern that matches one "
                f"kind, such as '*{before.suffix}'"
            )
