"""`servoid sample`: writes a capture to try servoid with."""

import shlex
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import typer

from servoid.cli.progress import progress_bar
from servoid.cli.sample_command import SampleOrder
from servoid.cli.values import Size
from servoid.sim import WHOLE_TURN, MovingScene, Scenario, write_moving_sample, write_sample
from servoid.words import counted


def run_sample(order: SampleOrder) -> None:
    """Write a capture of an object at rest, or a recording of a moving one.

    Raises:
        BadParameter: an option applies to a moving object only, or two contradict each other.

    """
    chosen = asdict(order)
    given = {
        name: value.value if isinstance(value, Size) else value
        for name, value in chosen.items()
        if name not in ("directory", "moving") and value is not None and value is not False
    }
    if order.moving:
        _write_moving(order.directory, given)
        return
    for name in given:
        option = "--" + name.replace("_", "-")
        raise typer.BadParameter(
            f"{option} does not apply without --moving; add --moving, or leave {option} out"
        )
    _write_still(order.directory)


def _write_still(directory: Path) -> None:
    """Write the sample capture and print how to model it."""
    with progress_bar("drawing") as update:
        write_sample(directory, progress=lambda done, of: update(done / of, f"{done} of {of}"))
    typer.echo(f"Wrote a capture into {directory}; model it with")
    typer.echo(f"  servoid model {shlex.quote(str(directory))} --out body.json")


def _write_moving(directory: Path, chosen: Mapping[str, Any]) -> None:
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
    place = shlex.quote(str(directory))
    typer.echo(f"  servoid track {place}{distance} --out poses.csv --video track.mp4")
    if scenario.one_camera:
        typer.echo("One camera measures no depth, so only the first poses will be confirmed.")


def _first_distance_m(scenario: Scenario) -> float:
    return float(np.linalg.norm(MovingScene(scenario).left_from_object(0)[:3, 3]))
