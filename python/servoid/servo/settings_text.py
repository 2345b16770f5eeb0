"""Writes settings as TOML with a comment that describes each key."""

import json
from collections.abc import Iterator
from enum import Enum
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import msgspec
from msgspec import Meta


def settings_toml(settings: msgspec.Struct, table: str = "") -> str:
    """Return settings as commented TOML that reads back equal; `table` prefixes their tables."""
    return "\n".join(_lines(settings, table)).lstrip("\n") + "\n"


def _lines(settings: msgspec.Struct, table: str) -> Iterator[str]:
    kinds = get_type_hints(type(settings), include_extras=True)
    values = {
        field.encode_name: (getattr(settings, field.name), kinds[field.name])
        for field in msgspec.structs.fields(settings)
    }
    inner = {
        name: value for name, (value, _) in values.items() if isinstance(value, msgspec.Struct)
    }
    plain = {name: pair for name, pair in values.items() if name not in inner}
    if plain:
        if table:
            yield from ("", f"[{table}]")
        for name, (value, kind) in plain.items():
            unset = value is None  # which TOML cannot express
            line = f"# {name} =" if unset else f"{name} = {_written(value)}"
            yield f"{line}{_described(kind)}{' (not set)' if unset else ''}"
    for name, value in inner.items():
        yield from _lines(value, f"{table}.{name}" if table else name)


def _described(kind: Any) -> str:
    """Return the description in a field's type as a comment."""
    if get_origin(kind) is not Annotated:
        return ""
    descriptions = [part.description for part in get_args(kind)[1:] if isinstance(part, Meta)]
    return "".join(f"  # {description}" for description in descriptions if description)


def _written(value: Any) -> str:
    if isinstance(value, Enum):
        return _written(value.value)
    if isinstance(value, msgspec.Struct):
        return _written(msgspec.to_builtins(value))
    if isinstance(value, dict):
        inside = (f"{key} = {_written(kept)}" for key, kept in value.items() if kept is not None)
        return f"{{ {', '.join(inside)} }}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_written(item) for item in value)}]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value, ensure_ascii=False)
