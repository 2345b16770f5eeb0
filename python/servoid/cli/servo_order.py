"""What `servoid servo` was asked for, and the settings that it means."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from servoid.study import TrialSettings, changed, read_trial_settings, trial_toml

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
        return changed(settings, self.values, "the options")


def print_settings(order: Order) -> None:
    """Print all settings as commented TOML."""
    typer.echo(trial_toml(order.settings()), nl=False)
