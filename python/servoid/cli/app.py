"""The commands of `servoid` and their options."""

from pathlib import Path
from typing import Annotated

import typer

from servoid._native import ModelSettings, __version__
from servoid.cli.servo_command import servo
from servoid.cli.study_command import study
from servoid.cli.track_command import track
from servoid.cli.values import Method, Size, check_count, check_seed, parse_point, parse_slice

app = typer.Typer(
    name="servoid",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)

_defaults = ModelSettings()


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"servoid {__version__}")
        raise typer.Exit


@app.callback()
def servoid(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Look at an unknown object, model it as a few ellipsoids, track it, and servo an arm to it.

    Start with a sample: [bold]servoid sample out/sample[/bold], then
    [bold]servoid model out/sample --out out/body.json --report out/report[/bold].
    """
    del version


@app.command()
def model(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SOURCE",
            help="A capture (a folder with a capture.toml, a COLMAP model, a transforms.json or a "
            "BOP scene), a mesh (.ply .obj .stl .off .glb) or a point cloud (.ply).",
        ),
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The body to write, a .json file.")],
    target: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TARGET",
            help="What the object is, where the capture has no masks: mask:FILE, "
            "box:U0,V0,U1,V1, click:U,V, hue:LOW..HIGH or background:FILE, each with @VIEW at its "
            "end if not for the first view. May be given several times.",
        ),
    ] = None,
    max_ellipsoids: Annotated[
        int | None,
        typer.Option(
            callback=check_count,
            metavar="N",
            help="Stop at this many ellipsoids (default: chosen by views that are held out; with "
            f"--delta {_defaults.max_ellipsoids}).",
        ),
    ] = None,
    delta: Annotated[
        float | None,
        typer.Option(
            metavar="D",
            help="Stop when one more ellipsoid raises the fitness F by less than this; with 0, "
            f"go on to the most ellipsoids (default {_defaults.delta:g}).",
        ),
    ] = None,
    method: Annotated[
        Method,
        typer.Option(
            help="How to model: region is servoid's own; paper is the method of the paper that it "
            "starts from, as a baseline.",
        ),
    ] = Method.region,
    views: Annotated[
        str,
        typer.Option(
            metavar="START:STOP:STEP",
            help="Model from these views, chosen as in Python; the others judge the result "
            "(default: all).",
            show_default=False,
        ),
    ] = ":",
    observations: Annotated[
        str | None,
        typer.Option(
            metavar="START:STOP:STEP",
            help="Look at these instants only (default: all; of a recording, in which the object "
            "may move, the one with the target).",
            show_default=False,
        ),
    ] = None,
    viewpoint: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Where a point cloud without normals was seen from, in metres.",
        ),
    ] = None,
    distance: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="How many metres the object is from the camera, needed for one image alone.",
        ),
    ] = None,
    bop_object: Annotated[
        int | None, typer.Option(metavar="N", help="Which object of a BOP scene, from 0.")
    ] = None,
    images: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Where a COLMAP model's images are.")
    ] = None,
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
            callback=check_count,
            metavar="N",
            help="Work with this many threads; the body stays the same (default: all cores).",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write a page and pictures that show how good it is."),
    ] = None,
) -> None:
    """Model an object from images, a mesh or a point cloud.

    [bold]servoid model photos --out body.json[/bold]

    [bold]servoid model photos --out body.json --target box:120,80,420,400[/bold]

    [bold]servoid model photos --out body.json --max-ellipsoids 12 --delta 0 --views ::2[/bold]

    [bold]servoid model mesh.ply --out body.json --max-ellipsoids 8 --report report[/bold]
    """
    chosen = parse_slice(views)
    instants = None if observations is None else parse_slice(observations, "--observations")
    place = None if viewpoint is None else parse_point(viewpoint)
    from servoid.cli.modelling import Order, run_model

    run_model(
        Order(
            source=source,
            out=out,
            report=report,
            targets=tuple(target or ()),
            method=method,
            views=chosen,
            observations=instants,
            viewpoint=place,
            distance=distance,
            bop_object=bop_object,
            images=images,
            max_ellipsoids=max_ellipsoids,
            delta=delta,
            seed=seed,
            threads=threads,
        )
    )


app.command()(track)
app.command()(servo)
app.command()(study)


@app.command()
def sample(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="The folder to write.")],
    moving: Annotated[
        bool,
        typer.Option(
            "--moving",
            help="Write a stereo recording of a toy that moves, to track; with its truth.",
        ),
    ] = False,
    count: Annotated[
        int | None,
        typer.Option(
            callback=check_count,
            metavar="N",
            help="Write so many observations, 30 of them a second.",
        ),
    ] = None,
    size: Annotated[
        Size | None,
        typer.Option(
            help="Write images of 320 x 240 pixels, or of 640 x 480 (default: the larger)."
        ),
    ] = None,
    occluder: Annotated[
        bool, typer.Option("--occluder", help="Something passes over a third of the toy.")
    ] = False,
    hand: Annotated[
        bool, typer.Option("--hand", help="The cameras move, and the toy rests.")
    ] = False,
    grey: Annotated[bool, typer.Option("--grey", help="Images without colour.")] = False,
    plain: Annotated[bool, typer.Option("--plain", help="A toy without any pattern.")] = False,
    one_camera: Annotated[bool, typer.Option("--one-camera", help="No right images.")] = False,
    seed: Annotated[
        int | None,
        typer.Option(
            callback=check_seed, metavar="S", help="Another seed: another way, in another room."
        ),
    ] = None,
) -> None:
    """Write a capture of a designed object, to try servoid with.

    [bold]servoid sample out/sample[/bold]

    [bold]servoid sample out/moving --moving --size small --count 60[/bold]
    """
    from servoid.cli.sampling import check_still, run_moving_sample, run_sample

    asked = {
        "count": count,
        "size": None if size is None else size.value,
        "occluder": occluder or None,
        "hand": hand or None,
        "grey": grey or None,
        "plain": plain or None,
        "one_camera": one_camera or None,
        "seed": seed,
    }
    given = {name: value for name, value in asked.items() if value is not None}
    if moving:
        run_moving_sample(directory, given)
    else:
        check_still(given)
        run_sample(directory)


@app.command()
def export(
    body: Annotated[
        Path, typer.Argument(metavar="BODY", help="A body, a .json file that model wrote.")
    ],
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="The file to write; others may go beside it.")
    ],
    to: Annotated[
        str | None,
        typer.Option(
            metavar="FORMAT",
            help="obj, ply, glb, mjcf, urdf, sdf or splat (default: what FILE ends in; .xml is "
            "mjcf, .ply a mesh).",
        ),
    ] = None,
    density: Annotated[
        float | None,
        typer.Option(metavar="D", help="Mass of a cubic metre in kg (default: water's, 1000)."),
    ] = None,
    frame: Annotated[
        str | None,
        typer.Option(
            metavar="object|world",
            help="Whose coordinates to use: the object's own, or the world's, in which it stood "
            "(default: object).",
        ),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="What the body is called in FILE (default: as FILE)."),
    ] = None,
    detail: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Make meshes of 20 * 4^N triangles an ellipsoid, N from 0 to 6 (default 4).",
        ),
    ] = None,
) -> None:
    """Write a body for a simulator, a planner or a viewer.

    [bold]servoid export body.json --to mjcf --out body.xml[/bold]

    [bold]servoid export body.json --out body.urdf --density 400[/bold]

    [bold]servoid export body.json --to splat --frame world --out body.ply[/bold]
    """
    from servoid.cli.exporting import Request, run_export

    run_export(Request(body, out, to, density, frame, name, detail))
