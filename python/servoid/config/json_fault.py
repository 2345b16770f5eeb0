"""Describes what is wrong in the text of a JSON file, with its place."""

import json
import re
from collections import Counter

_CUT_OFF = "Input data was truncated"  # of the fast parser
_AT_BYTE = re.compile(r"\(byte (\d+)\)")
_NO_NUMBER = re.compile(rb"NaN|Infinity")
_SHOWN = 40  # characters of a line in a message


def json_fault(content: bytes, reason: Exception) -> str:
    """Describe a fault and its place, which the fast parser's `reason` seldom tells."""
    try:
        text = content.decode()
    except UnicodeDecodeError:
        return "the file is not UTF-8 text"
    if not text.strip():
        return "the file is empty"
    if text.startswith("\ufeff"):
        return "it begins with a byte order mark; save it as UTF-8 without one"
    if not text.lstrip().startswith(("{", "[")):
        return _first_line(text)
    if str(reason) == _CUT_OFF:
        end = text.rstrip().count("\n") + 1
        return f"it ends in the middle, at line {end}, as if it were cut off"
    try:
        json.loads(content)
    except json.JSONDecodeError as fault:
        return f"{fault.msg} (at line {fault.lineno}, column {fault.colno})"
    except (ValueError, RecursionError):  # a number or a depth that only this parser refuses
        pass
    return _fault_at(content, str(reason).removeprefix("JSON is malformed: "))


def repeated_key(content: bytes) -> str | None:
    """Return a key that a table of valid JSON holds twice, of which the fast parser keeps one."""
    found: list[str] = []

    def look(pairs: list[tuple[str, object]]) -> None:
        counts = Counter(name for name, _ in pairs)
        found.extend(name for name, count in counts.items() if count > 1)

    try:
        json.loads(content, object_pairs_hook=look)
    except ValueError:  # a number of so many digits that only this parser refuses it
        return None
    return found[0] if found else None


def _first_line(text: str) -> str:
    """Describe a text that cannot be a table or a list."""
    blank = len(text) - len(text.lstrip())
    line = text[blank:].splitlines()[0].rstrip()
    shown = line if len(line) <= _SHOWN else f"{line[:_SHOWN]}..."
    shown = "".join(letter if letter.isprintable() else "?" for letter in shown)
    number = text.count("\n", 0, blank) + 1
    return f"line {number} begins with '{shown}', not with a brace"


def _fault_at(content: bytes, reason: str) -> str:
    """Describe a fault whose place is given in bytes, by line and column."""
    found = _AT_BYTE.search(reason)
    if found is None:
        return reason
    before = content[: int(found[1])].decode(errors="replace")
    place = f"line {before.count(chr(10)) + 1}, column {len(before) - before.rfind(chr(10))}"
    number = _NO_NUMBER.match(content, int(found[1]))
    if number is None:
        return _AT_BYTE.sub(f"(at {place})", reason)
    return f"{number[0].decode()} at {place} is no number of JSON; write a finite number"
