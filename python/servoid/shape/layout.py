"""Formats JSON for readability: one line for each list of plain values, one for each key."""

import json
from typing import Any


def lay_out(data: Any) -> str:
    """Return JSON text that ends in a line break; numbers keep their full precision."""
    return _lines(data, "") + "\n"


def _lines(data: Any, indent: str) -> str:
    deeper = indent + "  "
    if isinstance(data, dict) and data:
        items = [f"{json.dumps(key)}: {_lines(value, deeper)}" for key, value in data.items()]
    elif isinstance(data, (list, tuple)) and any(_nests(item) for item in data):
        items = [_lines(item, deeper) for item in data]
    else:
        return json.dumps(data, allow_nan=False, ensure_ascii=False)
    opening, closing = "{}" if isinstance(data, dict) else "[]"
    body = ",\n".join(deeper + item for item in items)
    return f"{opening}\n{body}\n{indent}{closing}"


def _nests(item: Any) -> bool:
    return isinstance(item, (dict, list, tuple))
