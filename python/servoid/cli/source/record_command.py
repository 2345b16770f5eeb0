"""The options of `servoid record` and `servoid sources`."""

from pathlib import Path
from typing import Annotated

import typer

from servoid.cli.source.options import (
    LIVE_HELP,
    SOURCE_HELP,
    Baseline,
    Calibration,
    Duration,
    Fov,
    Rate,
    Topic,
    World,
    known_cameras,
)
from servoid.cli.values import check_count


def record(
    source: Annotated[
        str, typer.Argument(metavar="SOURCE", help=f"{SOURCE_HELP}{LIVE_HELP}.", show_default=False)
    ],
    out: Annotated[
        Path,
        typer.Option(
            metavar="PATH", help="The recording to write: a folder, or a file that ends in .mcap."
        ),
    ],
    duration: Duration = None,
    count: Annotated[
        int | None,
        typer.Option(callback=check_count, metavar="N", help="End after this many observations."),
    ] = None,
    fov: Fov = None,
    baseline: Baseline = None,
    calibration: Calibration = None,
    rate: Rate = None,
    topic: Topic = None,
    world: World = None,
) -> None:
    """Record the images of cameras, so that tracking the recording gives the same poses.

    A folder can be recorded without a calibration of the cameras.

    [bold]servoid record 0 --duration 20 --out run[/bold]

    [bold]servoid record rig.toml --out run.mcap[/bold]

    [bold]servoid record film.mp4 --fov 65 --out film.mcap[/bold]
    """
    known = known_cameras(fov, baseline, calibration, rate)
    from servoid.cli.source.recording import Order, run_record

    run_record(Order(source, out, known, duration, count, tuple(topic or ()), world))


def sources() -> None:
    """List the kinds of SOURCE that work here, and the cameras found.

    [bold]servoid sources[/bold]
    """
    from servoid.cli.source.listing import run_sources

    run_sources()
