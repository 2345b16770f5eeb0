"""The options of `servoid pick`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from servoid.cli.declared import command

_LAST_PORT = 65535
_WAIT_S = 600.0


def _check_timeout(timeout_s: float) -> float:
    if not 0.0 < timeout_s < float("inf"):
        raise typer.BadParameter(f"{timeout_s:g} is not a duration; give seconds above 0")
    return timeout_s


@dataclass(frozen=True, kw_only=True)
class PickOrder:
    """The options of `servoid pick`."""

    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="Any recording: a capture, a video, images or a bag; its cameras need no "
            "calibration.",
        ),
    ]
    image: Annotated[
        int,
        typer.Option(metavar="N", min=0, help="Show the image of this observation, from 0."),
    ] = 0
    camera: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Show an image of this camera (default: the first)."),
    ] = None
    mask: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Also write the mask that was found: a .png file, white on the object.",
        ),
    ] = None
    browser: Annotated[
        bool,
        typer.Option(
            "--browser/--no-browser",
            help="Open the page in the browser, if there is a desktop; its address is always "
            "printed.",
        ),
    ] = True
    port: Annotated[
        int,
        typer.Option(
            metavar="PORT",
            min=0,
            max=_LAST_PORT,
            help="Listen on this port of 127.0.0.1, such as one that ssh forwards (default: a "
            "free one).",
            show_default=False,
        ),
    ] = 0
    timeout: Annotated[
        float,
        typer.Option(metavar="S", callback=_check_timeout, help="Give up after this many seconds."),
    ] = _WAIT_S


@command
def pick(order: PickOrder) -> None:
    """Mark the object in the browser, see the mask that is found, and print the --target option.

    [bold]servoid pick photos[/bold]

    [bold]servoid pick film.mp4 --image 30[/bold]

    [bold]servoid model photos --out body.json $(servoid pick photos --image 3)[/bold]

    The page is served to this machine alone, at an address with a secret.
    """
    from servoid.cli.pick.picking import run_pick

    run_pick(order)
