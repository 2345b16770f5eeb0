"""The options of `servoid record` and `servoid sources`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from servoid.cli.declared import command
from servoid.cli.source.options import (
    LIVE,
    LIVE_HELP,
    SOURCE_HELP,
    Baseline,
    Calibration,
    CameraOptions,
    Duration,
    Fov,
    Rate,
    Topic,
    World,
)
from servoid.cli.values import check_count


@dataclass(frozen=True, kw_only=True)
class RecordOrder(CameraOptions):
    """The options of `servoid record`; None leaves the choice to servoid."""

    source: Annotated[
        str, typer.Argument(metavar="SOURCE", help=f"{SOURCE_HELP}{LIVE_HELP}.", show_default=False)
    ]
    out: Annotated[
        Path,
        typer.Option(
            metavar="PATH", help="The recording to write: a folder, or a file that ends in .mcap."
        ),
    ]
    duration: Duration = None
    count: Annotated[
        int | None,
        typer.Option(
            callback=check_count,
            metavar="N",
            help="End after this many observations.",
            rich_help_panel=LIVE,
        ),
    ] = None
    fov: Fov = None
    baseline: Baseline = None
    calibration: Calibration = None
    rate: Rate = None
    topics: Topic = field(default_factory=list)
    world: World = None


@command
def record(order: RecordOrder) -> None:
    """Record the images of cameras, so that tracking the recording gives the same poses.

    A folder can be recorded without a calibration of the cameras.

    [bold]servoid record 0 --duration 20 --out run[/bold]

    [bold]servoid record rig.toml --out run.mcap[/bold]

    [bold]servoid record film.mp4 --fov 65 --out film.mcap[/bold]
    """
    from servoid.cli.source.recording import run_record

    run_record(order)


def sources() -> None:
    """List the kinds of SOURCE that work here, and the cameras found.

    [bold]servoid sources[/bold]
    """
    from servoid.cli.source.listing import run_sources

    run_sources()
