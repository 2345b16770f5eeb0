"""`servoid sample`: writes a capture to try servoid with."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import typer

from servoid.cli.progress import progress_bar
from servoid.sim import WHOLE_TURN, MovingScene, Scenario, write_moving_sample, write_sample
from servoid.words import counted


def check_still(chosen: Mapping[str, Any]) -> None:
    """Refuse options that apply to a moving sample only."""
    for name in chosen:
        option = "--" + name.replace("_", "-")
        raise typer.BadParameter(
            f"{option} does not apply without --moving; add --moving, or leave {option} out"
        )


def run_sample(directory: Path) -> None:
    """Write the sample capture and print how to model it."""
    with progress_bar("drawing") as update:
        write_sample(directory, progress=lambda done, of: update(done / of, f"{done} of {of}"))
    typer.echo(f"Wrote a capture into {directory}; model it with")
    typer.echo(f"  servoid model {directory} --out body.json")


def run_moving_sample(directory: Path, chosen: Mapping[str, Any]) -> None:
    """Write the recording that the options describe; their names are those of `Scenario`."""
    if chosen.get("turn") and chosen.get("hand"):
        raise typer.BadParameter(
            "--turn moves the toy, and --hand keeps it at rest; leave one of them out"
        )
    whole: dict[str, Any] = {"count": WHOLE_TURN} if chosen.get("turn") else {}
    scenario = Scenario(**(whole | dict(chosen)))
    with progress_bar("drawing") as update:
        write_moving_sample(
            directory,
            scenario,
            progress=lambda done, of: update(done / of, f"{done} of {of}"),
        )
    typer.echo(f"Wrote a recording of {counted(scenario.count, 'observation')} into {directory},")
    typer.echo(f"  with the true poses in {directory / 'truth'}; track it with")
    distance = f" --distance {_first_distance_m(scenario):.2f}" if scenario.one_camera else ""
    typer.echo(f"  servoid track {directory}{distance} --out poses.csv --video track.mp4")


def _first_distance_m(scenario: Scenario) -> float:
    return float(np.linalg.norm(MovingScene(scenario).left_from_object(0)[:3, 3]))
