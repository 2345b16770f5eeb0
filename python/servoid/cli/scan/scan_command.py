"""The options of `servoid scan`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from servoid.cli.declared import command
from servoid.cli.scan.options import Apart, Board, Length, ScaleOptions
from servoid.cli.source.options import Baseline, Calibration, CameraOptions, Fov, Topic
from servoid.cli.values import check_threads

_SCALE = "Scale: give one of these, or lengths have no unit"
_WHAT = "Which parts of the images"


@dataclass(frozen=True, kw_only=True)
class ScanOrder(CameraOptions, ScaleOptions):
    """The options of `servoid scan`."""

    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="A video, a folder of photographs, a pattern in quotes such as 'photos/*.jpg', "
            "LEFT.mp4+RIGHT.mp4 or side-by-side:VIDEO of a stereo pair, a bag, or a recording.",
            show_default=False,
        ),
    ]
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder of the capture to write.")]
    length: Length = field(default_factory=list)
    board: Board = None
    apart: Apart = field(default_factory=list)
    baseline: Baseline = None
    fov: Fov = None
    calibration: Calibration = None
    topics: Topic = field(default_factory=list)
    inside: Annotated[
        str | None,
        typer.Option(
            metavar="FOLDER|TARGET",
            help="Restrict features to this region: a folder of masks, named like the images, or "
            "box:U0,V0,U1,V1, hue:LOW..HIGH or background:FILE in every image.",
            rich_help_panel=_WHAT,
        ),
    ] = None
    turntable: Annotated[
        bool,
        typer.Option(
            "--turntable",
            help="The camera is fixed and the object turns: ignore the static background.",
            rich_help_panel=_WHAT,
        ),
    ] = False
    masks: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Masks of the object, named like the images, to copy into the capture.",
            rich_help_panel=_WHAT,
        ),
    ] = None
    threads: Annotated[
        int | None,
        typer.Option(
            callback=check_threads,
            metavar="N",
            help="Detect and match features with this many threads (default: all cores).",
        ),
    ] = None


@command
def scan(order: ScanOrder) -> None:
    """Find the poses and the calibration of a video, of photographs, or of a recording.

    [bold]servoid scan film.mp4 --out capture[/bold]

    [bold]servoid scan photos --out capture --board 7x5,0.03[/bold]

    [bold]servoid scan photos --out capture --length a:310,205,480,212=0.12
    --length b:290,220,455,240=0.12[/bold]

    [bold]servoid scan left.mp4+right.mp4 --out capture --baseline 0.06[/bold]
    """
    from servoid.cli.scan.scanning import run_scan

    run_scan(order)
