"""Parses numbers as people and programs write them, and formats them for people."""

import math
import re
from collections.abc import Iterable, Sequence
from typing import TypeVar

_WHOLE = re.compile(r"[+-]?[0-9]+")
_NUMBER = re.compile(
    r"[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|inf(?:inity)?|nan)", re.IGNORECASE
)

_COUNTED = re.compile(r"\d+(?:\.\d+)?")

_ALIKE = 0.65  # share of letters that two names must have in common, in order

_T = TypeVar("_T")


def number_of(text: str) -> float:
    """Parse a text, with optional blanks around it, as a number; NaN and infinity are allowed.

    Python's own `float` also accepts digits of other scripts and `1_000`, which other programs do
    not.

    Raises:
        ValueError: the text is no number.

    """
    text = text.strip()
    if _NUMBER.fullmatch(text) is None:
        raise ValueError(f"'{text[:40]}' is no number")
    return float(text)


def whole_number_of(text: str) -> int:
    """Parse a text as a whole number, as `number_of` does.

    Raises:
        ValueError: the text is no whole number.

    """
    text = text.strip()
    if _WHOLE.fullmatch(text) is None:
        raise ValueError(f"'{text[:40]}' is no whole number")
    return int(text)


def digits(number: float) -> str:
    """Format a number with six digits at most, and an exponent if it is very large or small."""
    return f"{number:.6g}"


def reason_of(error: OSError) -> str:
    """Return why the operating system refused, in words such as `is a directory`."""
    return (error.strerror or str(error)).lower()


def measured(number: float) -> str:
    """Format what was measured with four significant digits at most."""
    return digits(float(f"{number:.4g}"))


def four_digits(number: float) -> str:
    """Format a number with four significant digits at most, and never with an exponent."""
    import numpy as np

    return np.format_float_positional(number, precision=4, fractional=False, trim="-")


def lengths(values: Sequence[float]) -> str:
    """Format lengths with the same number of decimals: three digits of the longest."""
    decimals = max(0, 2 - math.floor(math.log10(max(values))))
    return " × ".join(f"{value:.{decimals}f}" for value in values)


def hundredths(number: float) -> str:
    """Format a number with two decimals, and zero without a sign."""
    text = f"{number:.2f}"
    return "0.00" if text == "-0.00" else text


def finite(number: float) -> float | None:
    """Return a number for JSON, which has neither NaN nor infinity: None in place of them."""
    return float(number) if math.isfinite(number) else None


def in_one_line(error: object) -> str:
    """Format an error of another library in one line."""
    return " ".join(str(error).split())


def counted(count: int, thing: str, things: str = "") -> str:
    """Format a count of things: `1 image`, `3 images`, `1 value was`, `2 values were`."""
    return f"{count} {thing if count == 1 else things or thing + 's'}"


def joined(names: Sequence[str], last: str = "and") -> str:
    """Join names as in a sentence: `left, top and right`."""
    return f" {last} ".join((", ".join(names[:-1]), names[-1]) if len(names) > 1 else names)


def by_kind(said: Iterable[tuple[str, _T]]) -> list[tuple[str, list[_T]]]:
    """Group texts that differ only in their numbers, and what belongs to each, most frequent first.

    Each group is named by one text with the range of each number: `21 to 39 % is hidden`. Numbers
    that are parts of names are those of the first text.
    """
    kinds: dict[str, list[tuple[str, _T]]] = {}
    for text, one in said:
        kinds.setdefault(_COUNTED.sub("0", text), []).append((text, one))
    groups = sorted(kinds.values(), key=lambda group: -len(group))
    return [(_ranged([text for text, _ in group]), [one for _, one in group]) for group in groups]


def _ranged(texts: Sequence[str]) -> str:
    first = texts[0]
    columns = zip(*(_COUNTED.findall(text) for text in texts), strict=True)
    words, end = "", 0
    for match, numbers in zip(_COUNTED.finditer(first), columns, strict=True):
        low, high = min(numbers, key=float), max(numbers, key=float)
        before, after = first[: match.start()][-1:], first[match.end() :][:1]
        is_free = before in ("", " ", "(") and after in ("", " ", ",", ";", ":", ")")
        range_of = f"{low} to {high}" if is_free and low != high else match[0]
        words += first[end : match.start()] + range_of
        end = match.end()
    return words + first[end:]


def suggestion(given: str, known: Iterable[str]) -> str:
    """Return the end of a message on an unknown name: which known one it may mean, if any."""
    from difflib import get_close_matches  # not above, as few messages need it

    named = {name.lower(): name for name in known}
    close = get_close_matches(given.lower(), named, n=1, cutoff=_ALIKE)
    return f"; did you mean '{named[close[0]]}'?" if close else ""


def alternatives(given: str, known: Iterable[str]) -> str:
    """Return the end of a message on an unknown name: the known ones, and which it may mean."""
    names = list(known)
    return f"; choose one of {', '.join(names)}{suggestion(given, names)}"


def camera_called(name: str) -> str:
    """Name a camera in a sentence: `camera left`, or `the camera` if it has no name of its own."""
    return "the camera" if name == "camera" else f"camera {name}"


def were(count: int) -> str:
    """Return `was` or `were` for a count of things."""
    return "was" if count == 1 else "were"


def are(count: int) -> str:
    """Return `is` or `are` for a count of things."""
    return "is" if count == 1 else "are"
