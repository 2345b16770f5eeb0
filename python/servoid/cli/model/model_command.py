"""The options of `servoid model`."""

from pathlib import Path
from typing import Annotated

import typer

from servoid._native import ModelSettings
from servoid.cli.scan.options import Apart, Board, Length
from servoid.cli.source.options import (
    SOURCE_HELP,
    Baseline,
    Calibration,
    Fov,
    Rate,
    Topic,
    World,
    known_cameras,
)
from servoid.cli.values import (
    Method,
    check_seed,
    check_threads,
    checked_by,
    parse_point,
    parse_slice,
)

_BATCH = "A folder of captures"
_defaults = ModelSettings()


def model(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help=f"{SOURCE_HELP}; or a mesh (.ply .obj .stl .off .glb) or a point cloud (.ply). A "
            "video, images or a bag without a calibration are scanned first, unless --fov or "
            "--calibration is given.",
        ),
    ],
    out: Annotated[
        Path,
        typer.Option(
            metavar="FILE", help="The body to write, a .json file; with --each a folder of them."
        ),
    ],
    target: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TARGET",
            help="Marks the object, where the capture has no masks: mask:FILE, "
            "box:U0,V0,U1,V1, click:U,V, hue:LOW..HIGH or background:FILE, each with @VIEW at its "
            "end if not for the first view. May be given several times.",
        ),
    ] = None,
    trust_targets: Annotated[
        bool,
        typer.Option(
            "--trust-targets",
            help="Use a target even if it may mean several objects; the summary then says so.",
        ),
    ] = False,
    max_ellipsoids: Annotated[
        int | None,
        typer.Option(
            callback=checked_by(ModelSettings, "max_ellipsoids"),
            metavar="N",
            help="Stop at this many ellipsoids (default: chosen by held-out views; with "
            f"--delta {_defaults.max_ellipsoids}).",
        ),
    ] = None,
    delta: Annotated[
        float | None,
        typer.Option(
            metavar="D",
            help="Stop when one more ellipsoid raises the fitness F by less than this; with 0, "
            f"continue to the most ellipsoids (default {_defaults.delta:g}).",
        ),
    ] = None,
    method: Annotated[
        Method,
        typer.Option(
            help="How to model: region is servoid's own method; paper is the method of the paper "
            "that it starts from, as a baseline.",
        ),
    ] = Method.region,
    views: Annotated[
        str,
        typer.Option(
            metavar="START:STOP:STEP",
            help="Model from these views, sliced as in Python; the others evaluate the result "
            "(default: all).",
            show_default=False,
        ),
    ] = ":",
    observations: Annotated[
        str | None,
        typer.Option(
            metavar="START:STOP:STEP",
            help="Use only these instants (default: all; of a recording, in which the object "
            "may move, the one with the target).",
            show_default=False,
        ),
    ] = None,
    viewpoint: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="The viewpoint of a point cloud without normals, in metres.",
        ),
    ] = None,
    distance: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="Distance of the object from the camera in metres, needed for a single image.",
        ),
    ] = None,
    fov: Fov = None,
    baseline: Baseline = None,
    calibration: Calibration = None,
    rate: Rate = None,
    bop_object: Annotated[
        int | None, typer.Option(metavar="N", help="Number of the object in a BOP scene, from 0.")
    ] = None,
    images: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The folder of a COLMAP model's images.")
    ] = None,
    topic: Topic = None,
    world: World = None,
    seed: Annotated[
        int | None,
        typer.Option(
            callback=check_seed,
            metavar="S",
            help=f"The same seed gives the same body (default {_defaults.seed}).",
        ),
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(
            callback=check_threads,
            metavar="N",
            help="Work with this many threads; the body stays the same (default: all cores).",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Write a page and pictures that show how good the body is."
        ),
    ] = None,
    length: Length = None,
    board: Board = None,
    apart: Apart = None,
    each: Annotated[
        bool,
        typer.Option(
            "--each",
            help="Model each capture in the folder SOURCE; finished ones are not modelled again.",
            rich_help_panel=_BATCH,
        ),
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(
            callback=check_threads,
            metavar="N",
            help="Use this many processes (default: one per core).",
            rich_help_panel=_BATCH,
        ),
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Work on the Dask cluster at this scheduler address, whose workers see SOURCE at "
            "the same path.",
            rich_help_panel=_BATCH,
        ),
    ] = None,
) -> None:
    """Model an object from images, a mesh or a point cloud.

    [bold]servoid model photos --out body.json[/bold]

    [bold]servoid model photos --out body.json --target box:120,80,420,400[/bold]

    [bold]servoid model photos --out body.json --max-ellipsoids 12 --delta 0 --views ::2[/bold]

    [bold]servoid model film.mp4 --out body.json --target box:240,160,400,320[/bold]

    [bold]servoid model mesh.ply --out body.json --max-ellipsoids 8 --report report[/bold]

    [bold]servoid model captures --each --out bodies --workers 4[/bold]
    """
    chosen = parse_slice(views)
    instants = None if observations is None else parse_slice(observations, "--observations")
    place = None if viewpoint is None else parse_point(viewpoint)
    known = known_cameras(fov, baseline, calibration, rate)
    from servoid.cli.model.modelling import Order, run_model
    from servoid.cli.scan.filming import Scale

    order = Order(
        source=source,
        known=known,
        out=out,
        report=report,
        targets=tuple(target or ()),
        trust_targets=trust_targets,
        method=method,
        views=chosen,
        observations=instants,
        viewpoint=place,
        distance=distance,
        bop_object=bop_object,
        images=images,
        topics=tuple(topic or ()),
        world=world,
        max_ellipsoids=max_ellipsoids,
        delta=delta,
        seed=seed,
        threads=threads,
        scale=Scale(tuple(length or ()), board, tuple(apart or ())),
    )
    if each:
        from servoid.cli.model.each import run_each

        run_each(order, workers, cluster)
        return
    for option, given in (("--workers", workers), ("--cluster", cluster)):
        if given is not None:
            raise typer.BadParameter(
                "this applies to a folder of captures only; add --each, or leave it out",
                param_hint=option,
            )
    run_model(order)
