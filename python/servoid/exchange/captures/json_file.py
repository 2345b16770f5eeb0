"""Reads JSON files that other programs wrote: what servoid does not know is passed over."""

from pathlib import Path
from typing import Any, TypeVar

import msgspec

from servoid.config.limits import SCENE_FILE
from servoid.config.reading import read_json
from servoid.config.strict import convert
from servoid.errors import CaptureError

StructT = TypeVar("StructT", bound=msgspec.Struct)


def read_table(path: Path) -> dict[str, Any]:
    """Read a JSON file that holds a table.

    Raises:
        CaptureError: the file is missing or no JSON, or holds something else.

    """
    data = read_json(path, CaptureError, SCENE_FILE)
    if not isinstance(data, dict):
        raise CaptureError(f"{path}: expected a table of keys and values")
    return data


def read_struct(data: Any, struct: type[StructT], place: str) -> StructT:
    """Convert a parsed table to `struct`; keys that it does not have are passed over.

    Raises:
        CaptureError: it is no table, a key is missing, a value has the wrong type.

    """
    if not isinstance(data, dict):
        raise CaptureError(f"{place}: expected a table of keys and values")
    return convert(data, struct, place, CaptureError, known_only=False)
