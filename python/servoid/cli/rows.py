"""Wraps the rows of summaries: a label, and words beside it."""

import textwrap
from collections.abc import Iterator

Row = tuple[str, str]


def wrapped(label: str, words: str, width: int) -> Iterator[Row]:
    """Yield rows whose words are at most so wide; only the first one has the label."""
    # Names of options stay whole.
    for index, line in enumerate(textwrap.wrap(words, width, break_on_hyphens=False)):
        yield "" if index else label, line
