"""Makes a command of the dataclass that declares its options, and settings of those given."""

import inspect
from collections.abc import Callable
from dataclasses import MISSING, Field, dataclass, fields
from enum import Enum
from typing import Any, TypeVar, get_args, get_type_hints

from typer.models import OptionInfo

OrderT = TypeVar("OrderT")


@dataclass(frozen=True)
class Sets:
    """Names the settings that an option sets, dotted, such as `run.seconds`."""

    keys: tuple[str, ...]

    def __init__(self, *keys: str) -> None:
        object.__setattr__(self, "keys", keys)


def command(run: Callable[[OrderT], None]) -> Callable[..., None]:
    """Return `run` as a command that has an option for each field of the dataclass it takes."""
    (order,) = (hint for name, hint in get_type_hints(run).items() if name != "return")
    hints = get_type_hints(order, include_extras=True)

    def command_of_options(**options: Any) -> None:
        run(order(**options))

    command_of_options.__name__ = run.__name__
    command_of_options.__doc__ = run.__doc__
    command_of_options.__annotations__ = {one.name: hints[one.name] for one in fields(order)}
    command_of_options.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            inspect.Parameter(
                one.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=_default(one),
                annotation=hints[one.name],
            )
            for one in fields(order)
        ]
    )
    return command_of_options


def _default(one: Field[Any]) -> Any:
    if one.default_factory is not MISSING:
        return one.default_factory()
    return inspect.Parameter.empty if one.default is MISSING else one.default


def given_settings(options: object) -> dict[str, Any]:
    """Return the settings that options set, by their dotted names."""
    values = {
        key: getattr(options, name)
        for name, annotations in _annotations(type(options)).items()
        for key in _keys(annotations)
    }
    return {
        key: value.value if isinstance(value, Enum) else value
        for key, value in values.items()
        if value is not None
    }


def setting_options(order: type) -> dict[str, str]:
    """Return the option that sets each setting, such as `--seconds`, by its dotted name."""
    return {
        key: next(
            (one.param_decls[0].split("/")[0] for one in annotations if _is_named(one)),
            f"--{name.replace('_', '-')}",
        )
        for name, annotations in _annotations(order).items()
        for key in _keys(annotations)
    }


def _annotations(order: type) -> dict[str, tuple[Any, ...]]:
    return {
        name: get_args(hint)[1:]
        for name, hint in get_type_hints(order, include_extras=True).items()
    }


def _keys(annotations: tuple[Any, ...]) -> list[str]:
    return [key for one in annotations if isinstance(one, Sets) for key in one.keys]


def _is_named(annotation: object) -> bool:
    return isinstance(annotation, OptionInfo) and bool(annotation.param_decls)
