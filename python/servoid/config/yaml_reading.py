"""Reads YAML files of other programs, as PyYAML parses them, into tables, lists and numbers."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from servoid.config.limits import MOST_NESTED, FileLimit
from servoid.config.reading import read_text, too_deep
from servoid.errors import ServoidError
from servoid.words import number_of

if TYPE_CHECKING:
    import yaml

_OPENCV_HEADER = "%YAML:1.0"  # which is no directive of YAML
_NO_NUMBER = re.compile(r"[+-]?\.(?:inf|nan)", re.IGNORECASE)
_DIGIT = re.compile(r"[0-9]")
_MOST_EXACT = 1 << 53  # whole numbers that a float holds


def read_yaml(path: Path, error: type[ServoidError], limit: FileLimit) -> Any:
    """Return the content of a YAML file, or of a JSON file, of a kind.

    Tags are ignored. Plain numbers are converted as in YAML 1.2, so that `1e-5` is one; all else is
    text. Aliases are refused, as a few of them may stand for any amount of data.

    Raises:
        error: the file cannot be read, is too large, is not YAML, is nested too deeply, has a key
            twice in one table, or has an alias.

    """
    import yaml  # not above, as few commands read YAML

    text = read_text(path, error, limit)
    if text.startswith(_OPENCV_HEADER):
        text = text[len(_OPENCV_HEADER) :].lstrip(" \r\t")
    loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader)  # the fast one, where it is built
    try:
        return _Content(path, error, yaml.parse(text, Loader=loader)).read()
    except yaml.YAMLError as reason:
        raise error(f"{path} is not valid YAML: {_fault(reason)}; give {limit.wanted}") from reason


class _Content:
    """The content of a file, built from the events of its parser."""

    def __init__(
        self, path: Path, error: type[ServoidError], events: "Iterator[yaml.Event]"
    ) -> None:
        self._path, self._error, self._events = path, error, events

    def read(self) -> Any:
        """Return the content of the only document; None if there is none."""
        import yaml

        content, documents = None, 0
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise self._error(
                        f"{self._path} holds several documents; leave one, without further lines "
                        "'---'"
                    )
                content = self._node(next(self._events), 0)
        return content

    def _node(self, event: "yaml.Event", depth: int) -> Any:
        import yaml

        if isinstance(event, yaml.ScalarEvent):
            return _plain(event.value) if event.implicit[0] else event.value
        if isinstance(event, yaml.AliasEvent):
            raise self._error(
                f"{self._path}{_line(event.start_mark)}: *{event.anchor} stands for another part "
                "of the file; write that out in its place"
            )
        if depth == MOST_NESTED:
            raise too_deep(self._path, self._error)
        if isinstance(event, yaml.SequenceStartEvent):
            return [self._node(one, depth + 1) for one in self._until(yaml.SequenceEndEvent)]
        table: dict[str, Any] = {}
        for key in self._until(yaml.MappingEndEvent):
            if not isinstance(key, yaml.ScalarEvent):
                raise self._error(
                    f"{self._path}{_line(key.start_mark)}: a key is a table or a list; give text"
                )
            if key.value in table:
                raise self._error(
                    f"{self._path}{_line(key.start_mark)}: the key '{key.value}' is given twice in "
                    "one table; leave one of them out"
                )
            table[key.value] = self._node(next(self._events), depth + 1)
        return table

    def _until(self, end: "type[yaml.Event]") -> "Iterator[yaml.Event]":
        """Yield the first events of the parts of a table or list, to its end."""
        for event in self._events:
            if isinstance(event, end):
                return
            yield event


def _plain(text: str) -> int | float | str:
    """Convert what is written like a number."""
    if _NO_NUMBER.fullmatch(text) is not None:
        return number_of(text.replace(".", "", 1))
    if _DIGIT.search(text) is None:  # `nan` and `inf` are words
        return text
    try:
        number = number_of(text)
    except ValueError:
        return text
    is_whole = text.lstrip("+-").isdigit() and abs(number) < _MOST_EXACT
    return int(number) if is_whole else number


def _fault(reason: "yaml.YAMLError") -> str:
    """Describe what the parser met, and where."""
    mark = getattr(reason, "problem_mark", None)
    return f"{getattr(reason, 'problem', None) or 'it has characters that cannot be'}{_line(mark)}"


def _line(mark: "yaml.Mark | None") -> str:
    return "" if mark is None else f", line {mark.line + 1}"
