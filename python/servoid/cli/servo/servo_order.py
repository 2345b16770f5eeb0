"""The options of `servoid servo`, and the settings that follow from them."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import typer

from servoid.cli.wrong_options import of_options
from servoid.errors import ServoError
from servoid.servo import PAPER_LAW
from servoid.sim import read_arm
from servoid.sim.trial import TrialSettings, changed, read_trial_settings, trial_toml
from servoid.sim.world import is_file_name, make_object, make_room, parse_path
from servoid.track import Method

RECORDED = "recorded:"
"""The prefix of a path that is stored in a file."""

_PLACE = "the options"  # of settings, in messages
EXTRAS = {"mujoco": "sim", "daqp": "servo", "matplotlib": "view"}


@dataclass(frozen=True, kw_only=True)
class Order:
    """The options of `servoid servo`.

    `values` are settings by their dotted names, and `names` those of the options that set them.
    """

    out: Path | None
    video: bool
    mcap: bool
    config: Path | None
    values: dict[str, Any]
    names: dict[str, str] = field(default_factory=dict)

    def settings(self) -> TrialSettings:
        """Return the settings of the file, if there is one, overridden by the options."""
        settings = TrialSettings() if self.config is None else read_trial_settings(self.config)
        with of_options():
            try:
                wanted = changed(settings, self.values, _PLACE)
            except ServoError as error:
                raise ServoError(self._in_options(str(error))) from error
            self._check_names(wanted)
        return wanted

    def _in_options(self, message: str) -> str:
        """Return a message about settings with the options that set them in place of their keys."""
        for key, option in self.names.items():
            table, _, name = key.rpartition(".")
            for written, named in (
                (f"{key}: ", f"{option}: "),
                (f"{table}: {key}: ", f"{option}: "),
                (f"{table}: {name} ", f"{option} "),
            ):
                if message.startswith(f"{_PLACE}, {written}"):
                    return named + message.removeprefix(f"{_PLACE}, {written}")
        return message

    def _check_names(self, settings: TrialSettings) -> None:
        """Check that the things that options name exist, as far as no file must be read.

        Raises:
            SimError: there is no such object, path, background or arm.

        """
        world = settings.world
        if "world.object.name" in self.values:
            make_object(world.object.name, world.object.radii)
        if "world.object.path" in self.values and not world.object.path.startswith(RECORDED):
            parse_path(world.object.path)
        if "world.background" in self.values:
            make_room(world.background, world.seed)
        if "world.arm.name" in self.values and not is_file_name(world.arm.name):
            read_arm(world.arm.name)


def paper_values() -> dict[str, Any]:
    """Return the settings of the paper's servoing, by their dotted names."""
    law = {f"servo.{name}": value for name, value in msgspec.to_builtins(PAPER_LAW).items()}
    return {"track.method": Method.PAPER.value, **law}


def print_settings(order: Order) -> None:
    """Print all settings as commented TOML."""
    typer.echo(trial_toml(order.settings()), nl=False)
