"""Reads whole files and the text of TOML and JSON; never opens pipes, devices or huge files."""

import codecs
import re
import stat
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import msgspec.toml

from servoid.config.json_fault import json_fault, repeated_key
from servoid.config.limits import MOST_NESTED, SETTINGS_FILE, FileLimit
from servoid.config.places import beside
from servoid.errors import ServoidError
from servoid.words import reason_of

ErrorT = TypeVar("ErrorT", bound=ServoidError)

_MOST_WHOLE = 1 << 63
_KINDS = (
    (stat.S_ISDIR, "is a directory"),
    (stat.S_ISFIFO, "is a named pipe"),
    (stat.S_ISSOCK, "is a socket"),
    (stat.S_ISCHR, "is a device"),
    (stat.S_ISBLK, "is a device"),
)
# A key of many parts: TOML parsers take time quadratic in their number.
_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*\.[ \t]*{_PART}){{{MOST_NESTED}}}")


def read_bytes(path: Path, error: type[ServoidError], limit: FileLimit) -> bytes:
    """Return the content of a file of a kind, or raise `error` with the reason.

    Pipes, devices and files beyond the limit are refused before they are opened: they may never
    end, or not fit into memory.
    """
    check_regular(path, error, limit)
    try:
        with path.open("rb") as file:
            data = file.read(limit.most_bytes + 1)
    except OSError as reason:
        raise unreadable(path, reason, error) from reason
    if len(data) > limit.most_bytes:
        raise _too_large(path, error, limit)
    return data


def check_regular(path: Path, error: type[ServoidError], limit: FileLimit | None = None) -> None:
    """Check that a path is a file, not a pipe or a device, and that its size is within the limit.

    Raises:
        error: it is not, or it is missing.

    """
    try:
        status = path.stat()
    except FileNotFoundError as reason:
        if limit is None or not limit.suffixes:
            raise unreadable(path, reason, error) from reason
        raise missing(path, error, limit.wanted, limit.suffixes) from reason
    except OSError as reason:
        raise unreadable(path, reason, error) from reason
    except ValueError as reason:  # a name that contains a null character
        raise error(f"cannot read {str(path)!r}: no file can have this name") from reason
    for is_kind, words in _KINDS:
        if is_kind(status.st_mode):
            raise error(f"cannot read {path}: it {words}, not a file; give a file")
    if limit is not None and status.st_size > limit.most_bytes:
        raise _too_large(path, error, limit)


def missing(path: Path, error: type[ErrorT], wanted: str, suffixes: Sequence[str]) -> ErrorT:
    """Make the `error` that reports that a file is missing, what is wanted, and what is there."""
    return error(
        f"cannot read {path}: no such file or directory; give {wanted}; {beside(path, suffixes)}"
    )


def unreadable(path: Path, reason: OSError, error: type[ErrorT]) -> ErrorT:
    """Make the `error` that reports why a file cannot be read."""
    return error(f"cannot read {path}: {reason_of(reason)}")


def read_text(path: Path, error: type[ServoidError], limit: FileLimit) -> str:
    """Return the text of a file of a kind, without a byte order mark, as some editors write.

    Raises:
        error: the file cannot be read, is too large, is no text, or is not UTF-8.

    """
    data = read_bytes(path, error, limit)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as reason:
        is_wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        if b"\0" in data and not is_wide:
            words = "it is an image, a video or another file that is no text; give the right one"
            raise error(f"{path}: {words}") from reason
        raise error(f"{path}: the file is not UTF-8 text; save it as UTF-8") from reason


def read_toml_text(path: Path, error: type[ServoidError]) -> tuple[dict[str, Any], str]:
    """Return the content of a TOML file as a dict, and its text.

    Raises:
        error: the file cannot be read, is not TOML, or is nested too deeply.

    """
    text = read_text(path, error, SETTINGS_FILE)
    deep = _LONG_KEY.search(text)
    if deep is not None:
        line = text.count("\n", 0, deep.start()) + 1
        raise error(
            f"{path}, line {line}: a key has more than {MOST_NESTED} parts, the most that servoid "
            "accepts; shorten it"
        )
    try:
        data = msgspec.toml.decode(text)
    except (msgspec.DecodeError, ValueError) as reason:
        raise error(f"{path} is not valid TOML: {reason}") from reason
    except RecursionError as reason:
        raise too_deep(path, error) from reason
    _check_depth(path, data, error)
    _check_numbers(path, data, error)
    return data, text


def read_json(path: Path, error: type[ServoidError], limit: FileLimit) -> Any:
    """Return the content of a JSON file.

    Raises:
        error: the file cannot be read, is too large, is not JSON, is nested too deeply, or has a
            key twice in one table.

    """
    content = read_bytes(path, error, limit)
    try:
        data = msgspec.json.decode(content)
    except (msgspec.DecodeError, UnicodeDecodeError) as reason:
        fault = json_fault(content, reason)
        raise error(f"{path} is not valid JSON: {fault}; give {limit.wanted}") from reason
    except RecursionError as reason:
        raise too_deep(path, error) from reason
    _check_depth(path, data, error)
    repeated = repeated_key(content)
    if repeated is not None:
        raise error(
            f"{path}: the key '{repeated}' is given twice in one table; leave one of them out"
        )
    return data


def _check_depth(path: Path, data: Any, error: type[ServoidError]) -> None:
    """Check that tables and lists are not nested too deeply, level by level."""
    level = [data]
    for _ in range(MOST_NESTED):
        level = [inner for outer in level for inner in _inside(outer)]
        if not level:
            return
    raise too_deep(path, error)


def _check_numbers(path: Path, data: Any, error: type[ServoidError]) -> None:
    """Check that integers fit 64 bits, as in TOML; larger ones fit no other number type."""
    if isinstance(data, int) and not -_MOST_WHOLE <= data < _MOST_WHOLE:
        raise error(f"{path}: {str(data)[:20]}... does not fit a 64-bit integer; correct it")
    if isinstance(data, (dict, list)):
        for value in data.values() if isinstance(data, dict) else data:
            _check_numbers(path, value, error)


def _inside(data: Any) -> list[Any]:
    """List the tables and lists directly inside a table or list."""
    if not isinstance(data, (dict, list)):
        return []
    values = data.values() if isinstance(data, dict) else data
    return [value for value in values if isinstance(value, (dict, list))]


def too_deep(path: Path, error: type[ErrorT]) -> ErrorT:
    """Make the `error` that reports that a file is nested too deeply."""
    return error(
        f"{path} is nested too deeply: more than {MOST_NESTED} nested tables or lists; flatten it"
    )


def _too_large(path: Path, error: type[ErrorT], limit: FileLimit) -> ErrorT:
    return error(
        f"cannot read {path}: it has more than {limit.text}, the most for {limit.what}; give a "
        "smaller file"
    )
