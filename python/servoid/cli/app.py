"""The commands of `servoid` and their options."""

from pathlib import Path
from typing import Annotated

import typer

from servoid._native import __version__
from servoid.cli.defaults import CommandWithDefaults
from servoid.cli.interrupting import Commands
from servoid.cli.model.model_command import model
from servoid.cli.pick.pick_command import pick
from servoid.cli.plugins import add_commands
from servoid.cli.scan.scan_command import scan
from servoid.cli.servo.servo_command import servo
from servoid.cli.source.record_command import record, sources
from servoid.cli.track.track_command import track
from servoid.cli.values import Size, check_count, check_seed

app: typer.Typer = typer.Typer(
    name="servoid",
    cls=Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


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

    See it work: [bold]servoid demo[/bold]. Try it yourself: [bold]servoid sample
    out/sample[/bold], then [bold]servoid model out/sample --out out/body.json[/bold].
    """
    del version


app.command(cls=CommandWithDefaults)(model)
app.command(cls=CommandWithDefaults)(track)
app.command(cls=CommandWithDefaults)(record)
app.command(cls=CommandWithDefaults)(sources)
app.command(cls=CommandWithDefaults)(servo)
app.command(cls=CommandWithDefaults)(pick)
app.command(cls=CommandWithDefaults)(scan)


@app.command(cls=CommandWithDefaults)
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
            help="Write so many observations, 30 of them a second (default: {sample.count}, or the "
            "whole turn).",
            show_default=False,
        ),
    ] = None,
    size: Annotated[
        Size | None,
        typer.Option(
            help="Write images of 320 x 240 pixels, small, or of 640 x 480, full (default "
            "{sample.size})."
        ),
    ] = None,
    turn: Annotated[
        bool, typer.Option("--turn", help="The toy is turned all the way around, and back.")
    ] = False,
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
        "turn": turn or None,
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


@app.command(cls=CommandWithDefaults)
def demo(
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="The folder for all that is made.")
    ] = Path("servoid-demo"),
) -> None:
    """See it work: model, track and servo to drawn objects, without any file of your own.

    Each command is shown before it runs. What needs a library that is not installed is left out,
    and the demo says so. It takes one or two minutes.
    """
    from servoid.cli.demo import run_demo

    run_demo(out)


@app.command(cls=CommandWithDefaults)
def doctor(
    json: Annotated[
        bool, typer.Option("--json", help="Say it as JSON, for programs and reports of faults.")
    ] = False,
    test: Annotated[
        bool,
        typer.Option(
            "--test/--no-test",
            help="Model and track a drawn object for about five seconds, and compare the result "
            "with what is expected.",
        ),
    ] = True,
) -> None:
    """Say what servoid runs on here, test it, and exit with 1 if something is wrong.

    Versions, vector instructions, libraries, renderers, cameras; then a drawn object is modelled
    and tracked, with its figures beside those expected.
    """
    from servoid.cli.doctor.doctor import run_doctor

    run_doctor(json=json, tests=test)


@app.command(cls=CommandWithDefaults)
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
        typer.Option(
            metavar="D",
            help="Mass of a cubic metre in kg (default: water's, {export.density_kg_m3}).",
        ),
    ] = None,
    frame: Annotated[
        str | None,
        typer.Option(
            metavar="object|world",
            help="Whose coordinates to use: the object's own, or the world's, in which it stood "
            "(default: {export.frame}).",
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
            help="Make meshes of 20 * 4^N triangles an ellipsoid, N from 0 to 6 (default "
            "{export.detail}).",
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


add_commands(app)
