"""Turns parsed TOML or JSON into typed structs, and says of each key that does not fit why."""

import math
import re
from collections.abc import Iterator, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin

import msgspec

from servoid.config.reading import read_toml_text
from servoid.errors import ServoidError

StructT = TypeVar("StructT", bound=msgspec.Struct)

_MOST_TOLD = 8  # tables that lack keys

_PLAIN_WORDS = {
    "`array`": "a list",
    "`object`": "a table",
    "`int`": "a whole number",
    "`float`": "a number",
    "`str`": "a text",
    "`bool`": "true or false",
    "`null`": "nothing",
}


def read_toml(path: Path, struct: type[StructT], error: type[ServoidError]) -> StructT:
    """Read a TOML file as a `struct`; what it leaves out keeps its default.

    Raises:
        error: the file cannot be read or is no TOML, or says what `convert` refuses.

    """
    data, text = read_toml_text(path, error)
    return convert(data, struct, str(path), error, text)


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
    complaints = list(_wrong_keys(data, struct, (), text if known_only else None))
    if complaints:
        # Of unknown keys the first is told, as others may follow from it; of missing ones all are.
        unknown = [words for words, is_missing in complaints if not is_missing]
        told = unknown[:1] or [words for words, _ in complaints[:_MOST_TOLD]]
        raise error(place + "; ".join(told).replace("; , ", "; "))
    for where in _not_finite(data, ()):
        raise error(f"{place}{_at(where)}: the number is not finite; write a finite number")
    try:
        return msgspec.convert(data, struct)
    except msgspec.ValidationError as reason:
        raise error(explained(reason, data, struct, place)) from reason


def explained(reason: msgspec.ValidationError, data: Any, kind: Any, place: str) -> str:
    """Say in plain words why `data` at a `place` is not of a `kind`, a struct or another type."""
    what, _, where = str(reason).partition(" - at `$")
    path = where.rstrip("`").lstrip(".")
    at = f"{place}, {path}" if path else place
    what = what.replace(" | null`", "`")  # that a key may also be left out
    for word, plain in _PLAIN_WORDS.items():
        what = what.replace(word, plain)
    what += _choices(kind, path) if what.startswith("Invalid enum value") else ""
    what += "" if "got" in what else _given(data, path)
    return f"{at}: {what[:1].lower()}{what[1:]}"


def is_finite(data: Any) -> bool:
    """Say if no number in `data` is NaN or infinite."""
    return next(_not_finite(data, ()), None) is None


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
) -> Iterator[tuple[str, bool]]:
    """Say which keys are missing and, if there is the `text` of the file, which are unknown.

    A struct's `RENAMED` holds the new names of keys that it had. Each answer comes with whether it
    is of missing keys.
    """
    fields = {field.encode_name: field for field in msgspec.structs.fields(struct)}
    tag = struct.__struct_config__.tag_field
    known = f"known keys: {', '.join([tag, *fields] if tag else fields)}"
    for key in data:
        if key not in fields and key != tag and text is not None:
            # A key that stands on several lines cannot be told apart by its name.
            line = line_of(text, key) if line_of(text, key, 1) is None else None
            on = f", line {line}" if line else ""
            new = getattr(struct, "RENAMED", {}).get(key)
            now = f", which is called '{new}' now" if new else ""
            yield f"{on}{_at(where)}: unknown key '{key}'{now}; {known}", False
    missing = [field for name, field in fields.items() if field.required and name not in data]
    if missing:
        names = ", ".join(f"'{field.encode_name}'" for field in missing)
        are = "key {} is" if len(missing) == 1 else "keys {} are"
        yield f"{_at(where)}: the {are.format(names)} missing; {known}{_examples(missing)}", True
    for name, field in fields.items():
        structs = list(_structs_in(field.type))
        if not structs or name not in data:
            continue
        value = data[name]
        items = enumerate(value) if isinstance(value, (list, tuple)) else [(None, value)]
        for index, item in items:
            if isinstance(item, dict):
                deeper = (*where, name) if index is None else (*where, name, index)
                yield from _wrong_inside(item, structs, deeper, text)


def _wrong_inside(
    data: dict[str, Any],
    structs: list[type[msgspec.Struct]],
    where: tuple[str | int, ...],
    text: str | None,
) -> Iterator[tuple[str, bool]]:
    """Say what is wrong with the keys of a table that may be one of several structs, by its tag."""
    tag = structs[0].__struct_config__.tag_field
    if tag is None:
        yield from _wrong_keys(data, structs[0], where, text)
        return
    kinds = {struct.__struct_config__.tag: struct for struct in structs}
    given = data.get(tag)
    if isinstance(given, str) and given in kinds:
        yield from _wrong_keys(data, kinds[given], where, text)
    else:
        what = f"the key '{tag}' is missing" if tag not in data else f"{tag} is {given!r}"
        yield f"{_at(where)}: {what}; choose one of {', '.join(map(str, kinds))}", False


def _examples(fields: Sequence[msgspec.structs.FieldInfo]) -> str:
    """Write values that keys may have as TOML has them, as far as their types give any."""
    values = {
        field.encode_name: meta.examples[0]
        for field in fields
        for meta in get_args(field.type)
        if isinstance(meta, msgspec.Meta) and meta.examples
    }
    lines = [f"{name} = {msgspec.json.encode(value).decode()}" for name, value in values.items()]
    return f"; write such as {', '.join(lines)}" if lines else ""


def _structs_in(kind: Any) -> Iterator[type[msgspec.Struct]]:
    """List the structs that a field holds, alone, in a list or optionally."""
    if get_origin(kind) is None and not get_args(kind):
        if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
            yield kind
        return
    for argument in get_args(kind):
        yield from _structs_in(argument)


def _choices(kind: Any, path: str) -> str:
    """Name what can be chosen in a struct at a path such as `joints.law`, or of a kind itself."""
    for name in re.sub(r"\[[^]]*\]", "", path).split(".") if path else []:
        inner = next(_structs_in(kind), None)
        fields = {} if inner is None else {f.encode_name: f for f in msgspec.structs.fields(inner)}
        kind = fields[name].type if name in fields else None
    # A field's type may be wrapped, as in `Annotated[Law, ...]` or `Law | None`.
    kinds = [kind, *get_args(kind)]
    values = [one.value for kind in kinds if _is_enum(kind) for one in kind]
    return f"; choose one of {', '.join(map(str, values))}" if values else ""


def _given(data: Any, path: str) -> str:
    """Say which plain value stands at a path such as `size_px[0]`, if one does."""
    try:
        for part in re.findall(r"[^.\[\]]+", path):
            data = data[int(part) if isinstance(data, (list, tuple)) else part]
    except (LookupError, TypeError, ValueError):
        return ""
    return f", got {data!r}" if isinstance(data, (int, float)) else ""


def _is_enum(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Enum)


def _not_finite(data: Any, where: tuple[str | int, ...]) -> Iterator[tuple[str | int, ...]]:
    if isinstance(data, float) and not math.isfinite(data):
        yield where
    elif isinstance(data, dict):
        for key, value in data.items():
            yield from _not_finite(value, (*where, key))
    elif isinstance(data, (list, tuple)):
        for index, value in enumerate(data):
            yield from _not_finite(value, (*where, index))


def _at(where: tuple[str | int, ...]) -> str:
    """Write a place inside a file like msgspec does: `, camera[0].size_px[1]`."""
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in where)
    return f", {path.lstrip('.')}" if path else ""


def _kind(data: Any) -> str:
    return {list: "a list", str: "a text", type(None): "nothing"}.get(type(data), "a number")
