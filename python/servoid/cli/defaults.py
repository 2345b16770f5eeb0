"""Fills the declared defaults into help texts, and keeps the names of options whole there."""

from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from types import SimpleNamespace
from typing import Any

from servoid.cli.flags import CommandWithFlags


class CommandWithDefaults(CommandWithFlags):
    """A command whose help may name a default by its dotted name, such as `{servo.run.seconds}`.

    The name is looked up when the help is printed, so that a command need not import the module
    that declares its settings.
    """

    help: str | None

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help with all defaults filled in."""
        if self.help is not None:
            self.help = _in_whole_lines(self.help)
        for option in self.params:
            text = getattr(option, "help", None)
            if text is not None:
                option.help = with_defaults(text)  # type: ignore[attr-defined]
        with _switches_in_one_word(self.params):
            super().format_help(ctx, formatter)


def _in_whole_lines(text: str) -> str:
    """Join the lines of each paragraph: the library keeps its ends of lines, and adds its own."""
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n"))


@contextmanager
def _switches_in_one_word(options: list[Any]) -> Iterator[None]:
    """Name the two options of a switch in one word, such as `--[no-]video`, inside the block.

    In two columns the longest would not fit a terminal of 80 columns, and would be cut.
    """
    before = [(option, option.opts, option.secondary_opts) for option in options]
    try:
        for option, names, opposites in before:
            if [name.replace("--", "--no-", 1) for name in names] == opposites:
                option.opts = [name.replace("--", "--[no-]", 1) for name in names]
                option.secondary_opts = []
        yield
    finally:
        for option, names, opposites in before:
            option.opts, option.secondary_opts = names, opposites


def with_defaults(text: str) -> str:
    """Return a help text with the value of each `{dotted.name}`.

    A boolean is written as one of two words: `{servo.world.ideal:ideal|a laboratory}`.
    """
    return text.format_map(_Declared())


class _Declared(dict[str, "_Shown | _About"]):
    """The objects that declare defaults, by the first part of a dotted name."""

    def __missing__(self, key: str) -> "_Shown | _About":
        if key == "about":
            from servoid.sim.trial import TrialSettings

            return _About(TrialSettings())
        if key == "servo":
            from servoid.sim.trial import TrialSettings

            return _Shown(TrialSettings())
        if key == "sample":
            from servoid.sim import Scenario

            return _Shown(Scenario())
        if key == "export":
            from servoid.exchange.export import export_body

            return _Shown(SimpleNamespace(**(export_body.__kwdefaults__ or {})))
        if key == "rates":
            from servoid import rates

            return _Shown(rates)
        raise KeyError(key)


class _About:
    """A setting of `servoid servo`: its description, and its default unless it is a switch."""

    def __init__(self, value: Any, description: str = "") -> None:
        self._value, self._description = value, description

    def __getattr__(self, name: str) -> "_About":
        from servoid.servo import described

        return _About(getattr(self._value, name), described(type(self._value), name))

    def __format__(self, _: str) -> str:
        default = "" if isinstance(self._value, bool) else f" (default {_Shown(self._value)})"
        return f"{self._description[:1].upper()}{self._description[1:]}{default}."


class _Shown:
    """A default, or a group of defaults, formatted for a help text."""

    def __init__(self, value: Any) -> None:
        self._value = value

    def __getattr__(self, name: str) -> "_Shown":
        return _Shown(getattr(self._value, name))

    def __format__(self, words: str) -> str:
        value = self._value
        if isinstance(value, bool):
            return words.split("|")[0 if value else 1]
        if isinstance(value, Enum):
            return str(value.value)
        if isinstance(value, tuple):
            return ",".join(f"{number:g}" for number in value)
        return f"{value:g}" if isinstance(value, float) else str(value)
