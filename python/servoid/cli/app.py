"""The commands of `servoid` and their options."""

from pathlib import Path
from typing import Annotated

import typer

from servoid._native import __version__
from servoid.cli.commands import Commands
from servoid.cli.defaults import CommandWithDefaults
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
            help="Write a stereo recording of a moving toy to track, with the true poses.",
        ),
    ] = False,
    count: Annotated[
        int | None,
        typer.Option(
            callback=check_count,
            metavar="N",
            help="Write this many observations, at 30 per second (default: {sample.count}, or the "
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
        bool, typer.Option("--turn", help="Turn the toy all the way around and back.")
    ] = False,
    occluder: Annotated[
        bool,
        typer.Option("--occluder", help="Let something cover a third of the toy as it passes."),
    ] = False,
    hand: Annotated[
        bool, typer.Option("--hand", help="Move the cameras, and let the toy rest.")
    ] = False,
    grey: Annotated[bool, typer.Option("--grey", help="Write images without colour.")] = False,
    plain: Annotated[bool, typer.Option("--plain", help="Use a toy without any pattern.")] = False,
    one_camera: Annotated[
        bool, typer.Option("--one-camera", help="Write no right images.")
    ] = False,
    seed: Annotated[
        int | None,
        typer.Option(
            callback=check_seed,
            metavar="S",
            help="Another seed gives another motion in another room.",
        ),
    ] = None,
) -> None:
    """Write a capture of a synthetic object, to try servoid with.

    [bold]servoid sample out/sample[/bold]

    [bold]servoid sample out/moving --moving --size small --count 60[/bold]
    """
    from servoid.cli.sampling import check_still, run_moving_sample, run_sample

    options = {
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
    given = {name: value for name, value in options.items() if value is not None}
    if moving:
        run_moving_sample(directory, given)
    else:
        check_still(given)
        run_sample(directory)


@app.command(cls=CommandWithDefaults)
def demo(
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="The folder for all files of the demo.")
    ] = Path("servoid-demo"),
) -> None:
    """See it work: model, track and servo to rendered objects, without any file of your own.

    The demo prints each command before it runs it, and names the parts that it leaves out because
    a library is not installed. It takes one or two minutes.
    """
    from servoid.cli.demo import run_demo

    run_demo(out)


@app.command(cls=CommandWithDefaults)
def doctor(
    json: Annotated[
        bool, typer.Option("--json", help="Print JSON, for programs and bug reports.")
    ] = False,
    test: Annotated[
        bool,
        typer.Option(
            "--test/--no-test",
            help="Model and track a rendered object for about five seconds, and compare the result "
            "with the expected one.",
        ),
    ] = True,
) -> None:
    """Report what servoid runs on here, test it, and exit with 1 if something is wrong.

    Lists versions, vector instructions, libraries, renderers and cameras. Then models and tracks a
    rendered object, and prints the measured figures beside the expected ones.
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
            help="Density in kg per cubic metre (default: water's, {export.density_kg_m3}).",
        ),
    ] = None,
    frame: Annotated[
        str | None,
        typer.Option(
            metavar="object|world",
            help="The frame of the coordinates: the object's own, or the world's with the object "
            "at its modelled pose (default: {export.frame}).",
        ),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Name of the body in FILE (default: the name of FILE)."),
    ] = None,
    detail: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Make meshes of 20 * 4^N triangles per ellipsoid, N from 0 to 6 (default "
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
