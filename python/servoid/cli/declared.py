"""Makes a command of the dataclass that declares its options, and settings of those given."""

import inspect
from collections.abc import Callable
from dataclasses import MISSING, Field, fields
from enum import Enum
from typing import Any, TypeVar, get_args, get_type_hints

from typer.models import OptionInfo

OrderT = TypeVar("OrderT")


class Setting(OptionInfo):
    """An option that sets settings of `servoid servo`, by their dotted names.

    `name` is the option's, if not that of its field; another spelling of an option is a `hidden`
    one above it, for the same keys. Unless `help` is given, the option is described as its setting
    is, with its default.
    """

    def __init__(
        self,
        *keys: str,
        panel: str,
        metavar: str | None = None,
        name: str | None = None,
        hidden: bool = False,
        help: str = "",  # noqa: A002
        parser: Callable[[str], Any] | None = None,
        callback: Callable[[Any], Any] | None = None,
    ) -> None:
        super().__init__(
            default=...,  # that of the field
            param_decls=[] if name is None else [name],
            metavar=metavar,
            help=help or f"{{about.{keys[0]}}}",
            parser=parser,
            callback=callback,
            hidden=hidden,
            show_default=False,
            rich_help_panel=panel,
        )
        self.keys = keys


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
    return {
        key: value.value if isinstance(value, Enum) else value
        for name, setting in _settings(type(options)).items()
        if (value := getattr(options, name)) is not None
        for key in setting.keys
    }


def setting_options(order: type) -> dict[str, str]:
    """Return the option that sets each setting, such as `--seconds`, by its dotted name."""
    return {
        key: (setting.param_decls or [f"--{name.replace('_', '-')}"])[0].split("/")[0]
        for name, setting in _settings(order).items()
        for key in setting.keys
    }


def _settings(order: type) -> dict[str, Setting]:
    return {
        name: part
        for name, hint in get_type_hints(order, include_extras=True).items()
        for part in get_args(hint)[1:]
        if isinstance(part, Setting)
    }
