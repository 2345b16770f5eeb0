"""The commands of `servoid` and their options."""

from pathlib import Path
from typing import Annotated

import typer

from servoid._native import ModelSettings, __version__
from servoid.cli.values import check_count, check_seed, parse_slice

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
    """Look at an unknown object and model it as a few ellipsoids.

    Start with a sample: [bold]servoid sample out/sample[/bold], then
    [bold]servoid model out/sample --out out/body.json --report out/report[/bold].
    """
    del version


@app.command()
def model(
    capture: Annotated[
        Path, typer.Argument(metavar="CAPTURE", help="A folder with a capture.toml, or that file.")
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The body to write, a .json file.")],
    max_ellipsoids: Annotated[
        int | None,
        typer.Option(
            callback=check_count,
            metavar="N",
            help=f"Stop at this many ellipsoids (default {_defaults.max_ellipsoids}).",
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
    views: Annotated[
        str,
        typer.Option(
            metavar="START:STOP:STEP",
            help="Model from these views, chosen as in Python; the others judge the result "
            "(default: all).",
            show_default=False,
        ),
    ] = ":",
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
        typer.Option(metavar="DIR", help="Draw pictures that show how good the body is."),
    ] = None,
) -> None:
    """Model an object from calibrated images with masks.

    [bold]servoid model photos --out body.json[/bold]

    [bold]servoid model photos --out body.json --max-ellipsoids 12 --delta 0[/bold]

    [bold]servoid model photos --out body.json --views ::2 --report report[/bold]
    """
    chosen = parse_slice(views)
    from servoid.cli.modelling import Request, run_model

    run_model(
        Request(
            capture=capture,
            out=out,
            max_ellipsoids=max_ellipsoids,
            delta=delta,
            views=chosen,
            seed=seed,
            threads=threads,
            report=report,
        )
    )


@app.command()
def sample(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="The folder to write.")],
) -> None:
    """Write a capture of a designed object, to try servoid with.

    [bold]servoid sample out/sample[/bold]
    """
    from servoid.cli.sampling import run_sample

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
