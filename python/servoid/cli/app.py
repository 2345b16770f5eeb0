"""The commands of `servoid` and their options."""

from pathlib import Path
from typing import Annotated

import typer

from servoid._native import __version__
from servoid.cli.commands import Commands
from servoid.cli.defaults import CommandWithDefaults
from servoid.cli.export_command import export
from servoid.cli.model.model_command import model
from servoid.cli.pick.pick_command import pick
from servoid.cli.plugins import add_commands
from servoid.cli.sample_command import sample
from servoid.cli.scan.scan_command import scan
from servoid.cli.servo.servo_command import servo
from servoid.cli.source.record_command import record, sources
from servoid.cli.track.track_command import track

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
app.command(cls=CommandWithDefaults)(sample)


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


app.command(cls=CommandWithDefaults)(export)
add_commands(app)
