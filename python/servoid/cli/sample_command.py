"""The options of `servoid sample`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from servoid.cli.declared import command
from servoid.cli.values import Size, check_count, check_seed


@dataclass(frozen=True, kw_only=True)
class SampleOrder:
    """The options of `servoid sample`; None leaves the choice to servoid."""

    directory: Annotated[Path, typer.Argument(metavar="DIR", help="The folder to write.")]
    moving: Annotated[
        bool,
        typer.Option(
            "--moving",
            help="Write a stereo recording of a moving toy to track, with the true poses.",
        ),
    ] = False
    count: Annotated[
        int | None,
        typer.Option(
            callback=check_count,
            metavar="N",
            help="Write this many observations, at 30 per second (default: {sample.count}, or the "
            "whole turn).",
            show_default=False,
        ),
    ] = None
    size: Annotated[
        Size | None,
        typer.Option(
            help="Write images of 320 x 240 pixels, small, or of 640 x 480, full (default "
            "{sample.size})."
        ),
    ] = None
    turn: Annotated[
        bool, typer.Option("--turn", help="Turn the toy all the way around and back.")
    ] = False
    occluder: Annotated[
        bool,
        typer.Option("--occluder", help="Let something cover a third of the toy as it passes."),
    ] = False
    hand: Annotated[
        bool, typer.Option("--hand", help="Move the cameras, and let the toy rest.")
    ] = False
    grey: Annotated[bool, typer.Option("--grey", help="Write images without colour.")] = False
    plain: Annotated[bool, typer.Option("--plain", help="Use a toy without any pattern.")] = False
    one_camera: Annotated[bool, typer.Option("--one-camera", help="Write no right images.")] = False
    seed: Annotated[
        int | None,
        typer.Option(
            callback=check_seed,
            metavar="S",
            help="Another seed gives another motion in another room.",
        ),
    ] = None


@command
def sample(order: SampleOrder) -> None:
    """Write a capture of a synthetic object, to try servoid with.

    [bold]servoid sample out/sample[/bold]

    [bold]servoid sample out/moving --moving --size small --count 60[/bold]
    """
    from servoid.cli.sampling import run_sample

    run_sample(order)
