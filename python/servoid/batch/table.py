"""Writes results of an experiment to a Parquet table, with a schema derived from its structs."""

import types
from collections.abc import Sequence
from enum import Enum
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

import msgspec
from msgspec import Meta

from servoid._native import __version__
from servoid.batch.experiment import Done, Experiment
from servoid.errors import MissingExtraError, StudyError
from servoid.output import written_beside

if TYPE_CHECKING:
    import pyarrow

_CASE = "case"
_FAILURE = "failure"
_PLAIN = {bool: "bool_", int: "int64", float: "float64", str: "string"}


def check_tables() -> None:
    """Check that tables can be written.

    Raises:
        MissingExtraError: the library is not installed.

    """
    if find_spec("pyarrow") is None:
        raise MissingExtraError.of("tables of trials", "pyarrow", "batch")


def write_table(experiment: Experiment[Any, Any], trials: Sequence[Done], path: Path) -> None:
    """Write one row per trial, in order.

    The case's fields become columns `case.FIELD`, those of structs in it `case.STRUCT.FIELD`. The
    row's fields keep their names and are null where the trial failed; `failure` gives the reason.

    Raises:
        OutputError: the file cannot be written.

    """
    import pyarrow
    import pyarrow.parquet

    columns = {
        **{f"{_CASE}.{name}": (one, _CASE, at) for name, at, one in _leaves(experiment.case)},
        **{name: (one, "row", at) for name, at, one in _leaves(experiment.row)},
    }
    about = {"experiment": experiment.name, "version": str(experiment.version)}
    fields = [_field(name, one) for name, (one, _, _) in columns.items()]
    schema = pyarrow.schema(
        [*fields, pyarrow.field(_FAILURE, pyarrow.string())],
        metadata={**about, "servoid": __version__},
    )
    lines = [
        {"case": msgspec.to_builtins(done.case), "row": msgspec.to_builtins(done.row)}
        for done in trials
    ]
    data = {
        name: [_value(line[part], at) for line in lines] for name, (_, part, at) in columns.items()
    }
    data[_FAILURE] = [done.failure or None for done in trials]
    with written_beside(path) as partial:
        pyarrow.parquet.write_table(pyarrow.table(data, schema=schema), partial)


def _leaves(struct: Any, at: tuple[str, ...] = ()) -> list[tuple[str, tuple[str, ...], Any]]:
    """List the columns of a struct: a name, the path to the value, and its type."""
    found = []
    for field in msgspec.structs.fields(struct):
        place = (*at, field.encode_name)
        if isinstance(field.type, type) and issubclass(field.type, msgspec.Struct):
            found += _leaves(field.type, place)
        else:
            found.append((".".join(place), place, field.type))
    return found


def _value(content: Any, at: tuple[str, ...]) -> Any:
    for name in at:
        if content is None:
            return None
        content = content[name]
    return content


def _field(name: str, kind: Any) -> "pyarrow.Field":
    """Return the column of a field, with the metadata of the field's type."""
    import pyarrow

    descriptions = [part.description for part in get_args(kind)[1:] if isinstance(part, Meta)]
    words = " ".join(text for text in descriptions if text) if get_origin(kind) is Annotated else ""
    metadata = {"description": words} if words else None
    return pyarrow.field(name, _kind(name, kind), metadata=metadata)


def _kind(name: str, kind: Any) -> "pyarrow.DataType":
    """Return the Parquet type of a field's type."""
    import pyarrow

    origin, inner = get_origin(kind), get_args(kind)
    if kind in _PLAIN:
        return getattr(pyarrow, _PLAIN[kind])()
    if origin is Annotated:
        return _kind(name, inner[0])
    if origin is Literal or (isinstance(kind, type) and issubclass(kind, Enum)):
        values = inner if origin is Literal else [one.value for one in kind]
        return _kind(name, type(values[0]))
    if origin in (Union, types.UnionType):
        known = [one for one in inner if one is not type(None)]
        if len(known) == 1:
            return _kind(name, known[0])
    if origin in (list, tuple):
        kinds = {_kind(name, one) for one in inner if one is not Ellipsis}
        if len(kinds) == 1:
            return pyarrow.list_(kinds.pop())
    if origin is dict:
        return pyarrow.map_(_kind(name, inner[0]), _kind(name, inner[1]))
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        inside = msgspec.structs.fields(kind)
        return pyarrow.struct([_field(one.encode_name, one.type) for one in inside])
    raise StudyError(f"the column {name} has the type {kind}, which a table cannot store")
