"""Converts parsed TOML or JSON to typed structs, and reports each key that does not fit."""

import math
import re
from collections.abc import Iterator, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin

import msgspec

from servoid.config.reading import read_toml_text
from servoid.errors import ServoidError
from servoid.words import digits, suggestion

StructT = TypeVar("StructT", bound=msgspec.Struct)

_MOST_REPORTED = 8  # tables with missing keys to report

_BOUND = re.compile(r"(?P<length>of length )?(?P<sign>[<>]=?) (?P<number>-?\d[.\d]*(?:e[-+]?\d+)?)")
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
    """Read a TOML file as a `struct`; missing keys keep their defaults.

    Raises:
        error: the file cannot be read or is not TOML, or `convert` refuses its content.

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
    """Convert parsed `data` to `struct`; `place` names the file, and `text` is its content.

    Unless `known_only` is set, keys that `struct` does not have are ignored.

    Raises:
        error: a key is unknown or missing, a value has the wrong type or range, a number is NaN.

    """
    complaints = list(_wrong_keys(data, struct, (), text if known_only else None, struct))
    if complaints:
        # Only the first unknown key is reported, as others may follow from it; all missing keys
        # are.
        unknown = [words for words, is_missing in complaints if not is_missing]
        reported = unknown[:1] or [words for words, _ in complaints[:_MOST_REPORTED]]
        raise error(place + "; ".join(reported).replace("; , ", "; "))
    for where in _not_finite(data, ()):
        raise error(f"{place}{_at(where)}: the number is not finite; write a finite number")
    try:
        return msgspec.convert(data, struct)
    except msgspec.ValidationError as reason:
        raise error(explained(reason, data, struct, place)) from reason


def explained(reason: msgspec.ValidationError, data: Any, kind: Any, place: str) -> str:
    """Explain in plain words why `data` at a `place` does not have the type `kind`."""
    what, _, where = str(reason).partition(" - at `$")
    path = where.rstrip("`").lstrip(".")
    at = f"{place}, {path}" if path else place
    what = what.replace(" | null`", "`")  # do not mention that the key is optional
    for word, plain in _PLAIN_WORDS.items():
        what = what.replace(word, plain)
    if what.startswith("Expected"):  # others may quote what was given
        what = _BOUND.sub(_bound_in_words, what)
    what += _choices(kind, path) if what.startswith("Invalid enum value") else ""
    what += "" if "got" in what else _given(data, path)
    return f"{at}: {what[:1].lower()}{what[1:]}"


def _bound_in_words(bound: re.Match[str]) -> str:
    """Return a bound such as `> 0.0` in words: `above 0`."""
    value = float(bound["number"])
    number = str(int(value)) if value.is_integer() else digits(value)
    words = {">": "above {}", "<": "below {}", ">=": "of {} or more", "<=": "of {} or less"}
    said = words[bound["sign"]].format(number)
    return said if bound["length"] is None else f"of length {said.removeprefix('of ')}"


def is_finite(data: Any) -> bool:
    """Return whether no number in `data` is NaN or infinite."""
    return next(_not_finite(data, ()), None) is None


def check_version(data: Any, place: str, error: type[ServoidError], kind: str) -> None:
    """Check that parsed `data` has `version = 1`, before anything else is checked."""
    if not isinstance(data, dict):
        raise error(f"{place}: expected a table of keys and values, got {_kind(data)}")
    version = data.get("version")
    if type(version) is not int or version != 1:
        given = "is missing" if version is None else f"is {version!r}"
        raise error(f"{place}: the key 'version' {given}; this servoid reads {kind} of version 1")


def line_of(text: str, key: str, index: int = 0) -> int | None:
    """Return the line number, from 1, at which TOML text sets `key` for the `index`-th time."""
    matches = list(re.finditer(rf"^[ \t]*{re.escape(key)}[ \t]*=", text, re.MULTILINE))
    return text.count("\n", 0, matches[index].start()) + 1 if index < len(matches) else None


def _wrong_keys(
    data: dict[str, Any],
    struct: type[msgspec.Struct],
    where: tuple[str | int, ...],
    text: str | None,
    root: type[msgspec.Struct],
) -> Iterator[tuple[str, bool]]:
    """Report missing keys and, if the `text` of the file is given, unknown keys.

    A struct's `RENAMED` maps its former keys to their new names; `root` is the struct of the whole
    file. Each message is paired with whether it is about missing keys.
    """
    fields = {field.encode_name: field for field in msgspec.structs.fields(struct)}
    tag = struct.__struct_config__.tag_field
    known = f"known keys: {', '.join([tag, *fields] if tag else fields)}"
    for key in data:
        if key not in fields and key != tag and text is not None:
            # A key that occurs on several lines cannot be located by its name.
            line = line_of(text, key) if line_of(text, key, 1) is None else None
            on = f", line {line}" if line else ""
            new = getattr(struct, "RENAMED", {}).get(key)
            meant = "" if new else _home(key, where, root) or suggestion(key, fields)
            now = f", which is now called '{new}'" if new else ""
            yield f"{on}{_at(where)}: unknown key '{key}'{now}; {known}{meant}", False
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
                yield from _wrong_inside(item, structs, deeper, text, root)


def _wrong_inside(
    data: dict[str, Any],
    structs: list[type[msgspec.Struct]],
    where: tuple[str | int, ...],
    text: str | None,
    root: type[msgspec.Struct],
) -> Iterator[tuple[str, bool]]:
    """Report wrong keys of a table that may be one of several structs, chosen by its tag."""
    tag = structs[0].__struct_config__.tag_field
    if tag is None:
        yield from _wrong_keys(data, structs[0], where, text, root)
        return
    kinds = {struct.__struct_config__.tag: struct for struct in structs}
    given = data.get(tag)
    if isinstance(given, str) and given in kinds:
        yield from _wrong_keys(data, kinds[given], where, text, root)
    else:
        what = f"the key '{tag}' is missing" if tag not in data else f"{tag} is {given!r}"
        yield f"{_at(where)}: {what}; choose one of {', '.join(map(str, kinds))}", False


def _home(key: str, where: tuple[str | int, ...], root: type[msgspec.Struct]) -> str:
    """Return the end of a message on a key in the wrong table: the only one that has it, if any."""
    here = tuple(part for part in where if isinstance(part, str))
    homes = {path: words for path, words in _tables_with(key, root, ()) if path != here}
    return f"; '{key}' belongs {next(iter(homes.values()))}" if len(homes) == 1 else ""


def _tables_with(
    key: str, struct: type[msgspec.Struct], path: tuple[str, ...], *, is_list: bool = False
) -> Iterator[tuple[tuple[str, ...], str]]:
    """List the tables of a file that have a key, each with its place in words."""
    fields = msgspec.structs.fields(struct)
    if any(field.encode_name == key for field in fields):
        table = f"[[{'.'.join(path)}]]" if is_list else f"[{'.'.join(path)}]"
        yield path, f"in {table}" if path else "above the first table"
    for field in fields:
        for inner in _structs_in(field.type):
            if inner is not struct:
                deeper = (*path, field.encode_name)
                yield from _tables_with(key, inner, deeper, is_list=_is_list(field.type))


def _is_list(kind: Any) -> bool:
    """Return whether a field holds a list of structs."""
    return get_origin(kind) in (list, tuple) or any(map(_is_list, get_args(kind)))


def _examples(fields: Sequence[msgspec.structs.FieldInfo]) -> str:
    """Format example values of missing keys as TOML, where their types provide any."""
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
    """List the options of a field at a path such as `joints.law`, or of a type itself."""
    for name in re.sub(r"\[[^]]*\]", "", path).split(".") if path else []:
        inner = next(_structs_in(kind), None)
        fields = {} if inner is None else {f.encode_name: f for f in msgspec.structs.fields(inner)}
        kind = fields[name].type if name in fields else None
    # A field's type may be wrapped, as in `Annotated[Law, ...]` or `Law | None`.
    kinds = [kind, *get_args(kind)]
    values = [one.value for kind in kinds if _is_enum(kind) for one in kind]
    return f"; choose one of {', '.join(map(str, values))}" if values else ""


def _given(data: Any, path: str) -> str:
    """Format the plain value at a path such as `size_px[0]`; empty if there is none."""
    try:
        for part in re.findall(r"[^.\[\]]+", path):
            data = data[int(part) if isinstance(data, (list, tuple)) else part]
    except (LookupError, TypeError, ValueError):
        return ""
    return f", got {repr(data).removesuffix('.0')}" if isinstance(data, (int, float)) else ""


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
    """Format a path inside a file as msgspec does: `, camera[0].size_px[1]`."""
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in where)
    return f", {path.lstrip('.')}" if path else ""


def _kind(data: Any) -> str:
    return {list: "a list", str: "a text", type(None): "nothing"}.get(type(data), "a number")
