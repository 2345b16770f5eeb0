"""Turns parsed TOML or JSON into typed structs, and says of each key that does not fit why."""

import math
import re
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin

import msgspec

from servoid.errors import ServoidError

StructT = TypeVar("StructT", bound=msgspec.Struct)
ErrorT = TypeVar("ErrorT", bound=ServoidError)

_PLAIN_WORDS = {
    "`array`": "a list",
    "`object`": "a table",
    "`int`": "a whole number",
    "`float`": "a number",
    "`str`": "a text",
    "`bool`": "true or false",
    "`null`": "nothing",
}


def read_bytes(path: Path, error: type[ServoidError]) -> bytes:
    """Return the content of a file, or raise `error` and say why that is impossible."""
    try:
        return path.read_bytes()
    except OSError as reason:
        raise unreadable(path, reason, error) from reason


def unreadable(path: Path, reason: OSError, error: type[ErrorT]) -> ErrorT:
    """Make the `error` that says why a file cannot be read."""
    return error(f"cannot read {path}: {(reason.strerror or str(reason)).lower()}")


def convert(
    data: dict[str, Any],
    struct: type[StructT],
    place: str,
    error: type[ServoidError],
    text: str = "",
    *,
    known_only: bool = True,
) -> StructT:
    """Convert parsed `data` to `struct`; `place` names the file, `text` is what it holds.

    Without `known_only`, keys that `struct` does not have are passed over.

    Raises:
        error: a key is unknown or missing, a value has the wrong type or range, a number is NaN.

    """
    for complaint in _wrong_keys(data, struct, (), text if known_only else None):
        raise error(f"{place}{complaint}")
    for where in _not_finite(data, ()):
        raise error(f"{place}{_at(where)}: the number is not finite; write a finite number")
    try:
        return msgspec.convert(data, struct)
    except msgspec.ValidationError as reason:
        what, _, where = str(reason).partition(" - at `$")
        path = where.rstrip("`").lstrip(".")
        at = f"{place}, {path}" if path else place
        what = what.replace(" | null`", "`")  # that a key may also be left out
        for word, plain in _PLAIN_WORDS.items():
            what = what.replace(word, plain)
        what += _choices(struct, path) if what.startswith("Invalid enum value") else ""
        raise error(f"{at}: {what[:1].lower()}{what[1:]}") from reason


def check_version(data: Any, place: str, error: type[ServoidError], kind: str) -> None:
    """Check that parsed `data` says `version = 1`, before anything else is expected of it."""
    if not isinstance(data, dict):
        raise error(f"{place}: expected a table of keys and values, got {_kind(data)}")
    version = data.get("version")
    if type(version) is not int or version != 1:
        given = "is missing" if version is None else f"is {version!r}"
        raise error(f"{place}: the key 'version' {given}; this servoid reads {kind} of version 1")


def line_of(text: str, key: str, index: int = 0) -> int | None:
    """Return the line, from 1, on which `key` is set for the time `index`, from 0, in TOML."""
    matches = list(re.finditer(rf"^[ \t]*{re.escape(key)}[ \t]*=", text, re.MULTILINE))
    return text.count("\n", 0, matches[index].start()) + 1 if index < len(matches) else None


def _wrong_keys(
    data: dict[str, Any],
    struct: type[msgspec.Struct],
    where: tuple[str | int, ...],
    text: str | None,
) -> Iterator[str]:
    """Say which keys are missing and, if there is the `text` of the file, which are unknown."""
    fields = {field.encode_name: field for field in msgspec.structs.fields(struct)}
    tag = struct.__struct_config__.tag_field
    names = [*([tag] if tag else []), *fields]
    known = f"known keys: {', '.join(names)}"
    for key in data:
        if key not in names and text is not None:
            # A key that stands on several lines cannot be told apart by its name.
            line = line_of(text, key) if line_of(text, key, 1) is None else None
            on = f", line {line}" if line else ""
            yield f"{on}{_at(where)}: unknown key '{key}'; {known}"
    for name, field in fields.items():
        if field.required and name not in data:
            yield f"{_at(where)}: the key '{name}' is missing; {known}"
        kinds = _structs_in(field.type)
        if not kinds or name not in data:
            continue
        value = data[name]
        items = list(enumerate(value)) if isinstance(value, list) else [(None, value)]
        for index, item in items:
            if isinstance(item, dict):
                deeper = (*where, name) if index is None else (*where, name, index)
                inner = _meant(item, kinds)
                if inner is None:
                    yield f"{_at(deeper)}: {_unmeant(item, kinds)}"
                else:
                    yield from _wrong_keys(item, inner, deeper, text)


def _structs_in(kind: Any) -> list[type[msgspec.Struct]]:
    """Return the structs that a field may hold, alone, in a list or optionally."""
    if get_origin(kind) is None:
        return [kind] if isinstance(kind, type) and issubclass(kind, msgspec.Struct) else []
    return [struct for argument in get_args(kind) for struct in _structs_in(argument)]


def _meant(item: dict[str, Any], kinds: list[type[msgspec.Struct]]) -> type[msgspec.Struct] | None:
    """Return which of several structs an item says that it is; None if it says none of them."""
    if len(kinds) == 1:
        return kinds[0]
    said = item.get(_tag_field(kinds))
    return next((kind for kind in kinds if kind.__struct_config__.tag == said), None)


def _unmeant(item: dict[str, Any], kinds: list[type[msgspec.Struct]]) -> str:
    """Say that an item is none of several structs."""
    field = _tag_field(kinds)
    tags = ", ".join(str(kind.__struct_config__.tag) for kind in kinds)
    given = f"unknown {field} {item[field]!r}" if field in item else f"the key '{field}' is missing"
    return f"{given}; choose one of {tags}"


def _tag_field(kinds: list[type[msgspec.Struct]]) -> str:
    return kinds[0].__struct_config__.tag_field or ""


def _choices(struct: type[msgspec.Struct], path: str) -> str:
    """Name what can be chosen at a path such as `joints.law`."""
    kind: Any = struct
    for name in re.sub(r"\[[^]]*\]", "", path).split("."):
        inner = _structs_in(kind)
        fields = {f.encode_name: f for f in msgspec.structs.fields(inner[0])} if inner else {}
        kind = fields[name].type if name in fields else None
    # A field's type may be wrapped, as in `Annotated[Law, ...]` or `Law | None`.
    kinds = [kind, *get_args(kind)]
    values = [one.value for kind in kinds if _is_enum(kind) for one in kind]
    return f"; choose one of {', '.join(map(str, values))}" if values else ""


def _is_enum(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Enum)


def _not_finite(data: Any, where: tuple[str | int, ...]) -> Iterator[tuple[str | int, ...]]:
    if isinstance(data, float) and not math.isfinite(data):
        yield where
    elif isinstance(data, dict):
        for key, value in data.items():
            yield from _not_finite(value, (*where, key))
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from _not_finite(value, (*where, index))


def _at(where: tuple[str | int, ...]) -> str:
    """Write a place inside a file like msgspec does: `, camera[0].size_px[1]`."""
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in where)
    return f", {path.lstrip('.')}" if path else ""


def _kind(data: Any) -> str:
    return {list: "a list", str: "a text", type(None): "nothing"}.get(type(data), "a number")
