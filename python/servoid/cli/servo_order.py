"""What `servoid servo` was asked for, and the settings that it means."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import typer

from servoid.cli.values import of_options
from servoid.servo import PAPER_LAW
from servoid.sim.trial import TrialSettings, changed, read_trial_settings, trial_toml
from servoid.track import Method

EXTRAS = {"mujoco": "sim", "daqp": "servo", "matplotlib": "view"}


@dataclass(frozen=True, kw_only=True)
class Order:
    """What `servoid servo` was asked for; `values` are settings by their dotted names."""

    out: Path | None
    video: bool
    config: Path | None
    values: dict[str, Any]

    def settings(self) -> TrialSettings:
        """Return the settings of the file, if there is one, with the options on top."""
        settings = TrialSettings() if self.config is None else read_trial_settings(self.config)
        with of_options():
            return changed(settings, self.values, "the options")


def paper_values() -> dict[str, Any]:
    """Return the settings of the paper's servoing, by their dotted names."""
    law = {f"servo.{name}": value for name, value in msgspec.to_builtins(PAPER_LAW).items()}
    return {"track.method": Method.PAPER.value, **law}


def print_settings(order: Order) -> None:
    """Print all settings as commented TOML."""
    typer.echo(trial_toml(order.settings()), nl=False)
