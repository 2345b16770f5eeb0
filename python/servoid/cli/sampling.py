"""`servoid sample`: a capture to try servoid with."""

from pathlib import Path

import typer

from servoid.sim import write_sample


def run_sample(directory: Path) -> None:
    """Write the sample capture and say what to do with it."""
    write_sample(directory)
    typer.echo(f"Wrote a capture into {directory}; model it with")
    typer.echo(f"  servoid model {directory} --out body.json")
