"""Represents values in one short line: sizes and counts in place of arrays and lists."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import PurePath
from typing import Any

_MOST = 60  # characters of one field
_MOST_NUMBERS = 7  # of a pose
_NOTHING: tuple[object, ...] = (None, (), [], "", {})


def brief(self: object) -> str:
    """Return the type of a dataclass or a msgspec struct, and its fields that are not empty.

    It is what `repr` returns for classes that hold arrays, bytes or lists, which nobody wants to
    see in a terminal: `StereoDepth(depth=480x640 float32, sigma_m=480x640 float32)`.
    """
    names = [field.name for field in fields(self)] if is_dataclass(self) else _struct_names(self)
    values = [(name, getattr(self, name)) for name in names]
    parts = [f"{name}={_said(value)}" for name, value in values if not _is_nothing(value)]
    return f"{type(self).__name__}({', '.join(parts)})"


def said(kind: type, *words: str | None) -> str:
    """Return the type and a few words on a value, as its `repr`; None is left out."""
    return f"{kind.__name__}({', '.join(word for word in words if word is not None)})"


def _struct_names(one: object) -> tuple[str, ...]:
    names: tuple[str, ...] = getattr(one, "__struct_fields__", ())
    return names


def _is_nothing(value: object) -> bool:
    return any(type(value) is type(nothing) and value == nothing for nothing in _NOTHING)


def _said(value: Any) -> str:
    """Return the words for one field."""
    if hasattr(value, "dtype") and hasattr(value, "shape"):
        return f"{'x'.join(map(str, value.shape)) or 'one'} {value.dtype}"
    if isinstance(value, bytes | bytearray):
        return f"{len(value)} bytes"
    if isinstance(value, str):
        return _cut(repr(value))
    if isinstance(value, PurePath):
        return repr(str(value))
    if isinstance(value, Mapping):
        return f"{len(value)} entries"
    if isinstance(value, Sequence):
        return _listed(value)
    return _cut(repr(value), f"<{type(value).__name__}>")


def _listed(values: Sequence[Any]) -> str:
    """Return a few numbers or names themselves, otherwise how many values there are of a type."""
    if len(values) <= _MOST_NUMBERS and all(isinstance(one, str | int | float) for one in values):
        words = ", ".join(f"{one:.4g}" if isinstance(one, float) else repr(one) for one in values)
        if len(words) <= _MOST:
            return f"({words})"
    kinds = {type(one).__name__ for one in values if one is not None}
    return f"{len(values)} {kinds.pop() if len(kinds) == 1 else 'values'}"


def _cut(text: str, otherwise: str | None = None) -> str:
    if len(text) <= _MOST and "\n" not in text:
        return text
    return otherwise or f"{text[: _MOST - 1]}…"
