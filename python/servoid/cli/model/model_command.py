"""The options of `servoid model`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from servoid._native import ModelSettings
from servoid.cli.declared import command
from servoid.cli.scan.options import Apart, Board, Length, ScaleOptions
from servoid.cli.source.options import (
    SOURCE_HELP,
    Baseline,
    Calibration,
    CameraOptions,
    Fov,
    Rate,
    Topic,
    Unit,
    World,
)
from servoid.cli.values import (
    Method,
    Triple,
    check_seed,
    check_threads,
    checked_by,
    slice_parser,
    triple_parser,
)

_BATCH = "A folder of captures"
_defaults = ModelSettings()


@dataclass(frozen=True, kw_only=True)
class ModelOrder(CameraOptions, ScaleOptions):
    """The options of `servoid model`; None leaves the choice to servoid."""

    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help=f"{SOURCE_HELP}; or a mesh (.ply .obj .stl .off .glb) or a point cloud (.ply). A "
            "video, images or a bag without a calibration are scanned first, unless --fov or "
            "--calibration is given.",
        ),
    ]
    out: Annotated[
        Path,
        typer.Option(
            metavar="FILE", help="The body to write, a .json file; with --each a folder of them."
        ),
    ]
    targets: Annotated[
        list[str],
        typer.Option(
            "--target",
            metavar="TARGET",
            help="Marks the object, where the capture has no masks: mask:FILE, "
            "box:U0,V0,U1,V1, click:U,V, hue:LOW..HIGH or background:FILE, each with @VIEW at its "
            "end if not for the first view. May be given several times.",
        ),
    ] = field(default_factory=list)
    trust_targets: Annotated[
        bool,
        typer.Option(
            "--trust-targets",
            help="Use a target even if it may mean several objects; the summary then says so.",
        ),
    ] = False
    max_ellipsoids: Annotated[
        int | None,
        typer.Option(
            callback=checked_by(ModelSettings, "max_ellipsoids"),
            metavar="N",
            help="Stop at this many ellipsoids (default: chosen by held-out views; "
            f"{_defaults.max_ellipsoids} if --delta is given).",
        ),
    ] = None
    delta: Annotated[
        float | None,
        typer.Option(
            metavar="D",
            help="Stop when one more ellipsoid raises the fitness F by less than this; with 0, "
            f"continue to the most ellipsoids (default {_defaults.delta:g}).",
        ),
    ] = None
    method: Annotated[
        Method,
        typer.Option(
            help="How to model: region is servoid's own method; paper is the method of the paper "
            "that it starts from, as a baseline.",
        ),
    ] = Method.region
    views: Annotated[
        slice | None,
        typer.Option(
            parser=slice_parser("--views"),
            metavar="START:STOP:STEP",
            help="Model from these views, sliced as in Python; the others evaluate the result "
            "(default: all).",
            show_default=False,
        ),
    ] = None
    observations: Annotated[
        slice | None,
        typer.Option(
            parser=slice_parser("--observations"),
            metavar="START:STOP:STEP",
            help="Use only these instants (default: all; of a recording, in which the object "
            "may move, the one with the target).",
            show_default=False,
        ),
    ] = None
    viewpoint: Annotated[
        Triple | None,
        typer.Option(
            parser=triple_parser("--viewpoint"),
            metavar="X,Y,Z",
            help="The viewpoint of a point cloud without normals, in metres.",
        ),
    ] = None
    distance: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="Distance of the object from the camera in metres, needed for a single image.",
        ),
    ] = None
    fov: Fov = None
    baseline: Baseline = None
    calibration: Calibration = None
    rate: Rate = None
    bop_object: Annotated[
        int | None, typer.Option(metavar="N", help="Number of the object in a BOP scene, from 0.")
    ] = None
    images: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The folder of a COLMAP model's images.")
    ] = None
    unit: Unit = None
    topics: Topic = field(default_factory=list)
    world: World = None
    seed: Annotated[
        int | None,
        typer.Option(
            callback=check_seed,
            metavar="S",
            help=f"The same seed gives the same body (default {_defaults.seed}).",
        ),
    ] = None
    threads: Annotated[
        int | None,
        typer.Option(
            callback=check_threads,
            metavar="N",
            help="Work with this many threads; the body stays the same (default: all cores).",
        ),
    ] = None
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Write a page and pictures that show how good the body is."
        ),
    ] = None
    length: Length = field(default_factory=list)
    board: Board = None
    apart: Apart = field(default_factory=list)
    each: Annotated[
        bool,
        typer.Option(
            "--each",
            help="Model each capture in the folder SOURCE; finished ones are not modelled again.",
            rich_help_panel=_BATCH,
        ),
    ] = False
    workers: Annotated[
        int | None,
        typer.Option(
            callback=check_threads,
            metavar="N",
            help="Use this many processes (default: one per core).",
            rich_help_panel=_BATCH,
        ),
    ] = None
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Work on the Dask cluster at this scheduler address, whose workers see SOURCE at "
            "the same path.",
            rich_help_panel=_BATCH,
        ),
    ] = None

    @property
    def chosen(self) -> slice:
        """Return the views to use."""
        return self.views or slice(None)


@command
def model(order: ModelOrder) -> None:
    """Model an object from images, a mesh or a point cloud.

    [bold]servoid model photos --out body.json[/bold]

    [bold]servoid model photos --out body.json --target box:120,80,420,400[/bold]

    [bold]servoid model photos --out body.json --max-ellipsoids 12 --delta 0 --views ::2[/bold]

    [bold]servoid model film.mp4 --out body.json --target box:240,160,400,320[/bold]

    [bold]servoid model mesh.ply --out body.json --max-ellipsoids 8 --report report[/bold]

    [bold]servoid model captures --each --out bodies --workers 4[/bold]
    """
    from servoid.cli.model.modelling import run_model

    if order.each:
        from servoid.cli.model.each import run_each

        run_each(order)
        return
    for option, given in (("--workers", order.workers), ("--cluster", order.cluster)):
        if given is not None:
            raise typer.BadParameter(
                "this applies to a folder of captures only; add --each, or leave it out",
                param_hint=option,
            )
    run_model(order)
