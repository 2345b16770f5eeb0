"""Reads JSON files of other programs: unknown keys are ignored."""

from pathlib import Path
from typing import Any, TypeVar

import msgspec

from servoid.config import SCENE_FILE, convert, read_json
from servoid.errors import CaptureError

StructT = TypeVar("StructT", bound=msgspec.Struct)


def read_table(path: Path) -> dict[str, Any]:
    """Read a JSON file that contains a table.

    Raises:
        CaptureError: the file is missing or not JSON, or contains something else.

    """
    data = read_json(path, CaptureError, SCENE_FILE)
    if not isinstance(data, dict):
        raise CaptureError(f"{path}: expected a table of keys and values")
    return data


def read_struct(data: Any, struct: type[StructT], place: str) -> StructT:
    """Convert a parsed table to `struct`; keys that it does not have are ignored.

    Raises:
        CaptureError: it is not a table, a key is missing, or a value has the wrong type.

    """
    if not isinstance(data, dict):
        raise CaptureError(f"{place}: expected a table of keys and values")
    return convert(data, struct, place, CaptureError, known_only=False)
