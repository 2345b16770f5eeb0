"""Reads JSON files that other programs wrote: what servoid does not know is passed over."""

from pathlib import Path
from typing import Any, TypeVar

import msgspec

from servoid.errors import CaptureError
from servoid.observe.strict import convert, read_bytes

StructT = TypeVar("StructT", bound=msgspec.Struct)


def read_table(path: Path) -> dict[str, Any]:
    """Read a JSON file that holds a table.

    Raises:
        CaptureError: the file is missing or no JSON, or holds something else.

    """
    try:
        data = msgspec.json.decode(read_bytes(path, CaptureError))
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise CaptureError(f"{path} is not valid JSON: {error}") from error
    except RecursionError as error:
        raise CaptureError(f"{path} is nested too deeply; export it again") from error
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
