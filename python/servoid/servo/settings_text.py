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


def described(settings: type[msgspec.Struct], name: str) -> str:
    """Return the description in the type of a setting; empty without one."""
    kind = get_type_hints(settings, include_extras=True)[name]
    parts = get_args(kind)[1:] if get_origin(kind) is Annotated else ()
    return "".join(part.description or "" for part in parts if isinstance(part, Meta))


def _lines(settings: msgspec.Struct, table: str) -> Iterator[str]:
    values = [
        (field.name, field.encode_name, getattr(settings, field.name))
        for field in msgspec.structs.fields(settings)
    ]
    plain = [one for one in values if not isinstance(one[2], msgspec.Struct)]
    if plain and table:
        yield from ("", f"[{table}]")
    for field, name, value in plain:
        unset = value is None  # which TOML cannot express
        line = f"# {name} =" if unset else f"{name} = {_written(value)}"
        description = described(type(settings), field)
        yield f"{line}{description and f'  # {description}'}{' (not set)' if unset else ''}"
    for _, name, value in values:
        if isinstance(value, msgspec.Struct):
            yield from _lines(value, f"{table}.{name}" if table else name)


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
