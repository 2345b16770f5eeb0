"""`servoid pick`: asks in the browser where the object is, and prints the --target option."""

import os
import shlex
import sys
import webbrowser
from pathlib import Path

import cv2
import typer

from servoid.capture import CaptureView
from servoid.cli.overwriting import check_inputs_kept
from servoid.cli.pick.pick_command import PickOrder
from servoid.cli.wrong_options import OptionError
from servoid.errors import OutputError, TargetError
from servoid.model import find_in_view
from servoid.opening import (
    GivenCalibration,
    any_cameras,
    count_uncalibrated_cameras,
    open_recorded,
    parse_source,
)
from servoid.output import check_file, write_whole
from servoid.pick import Choice, Mark, PickServer, Question
from servoid.segment import Found
from servoid.words import counted, digits


def run_pick(order: PickOrder) -> None:
    """Ask in the browser, print the option for the command line, and write the mask on request.

    Raises:
        TargetError: nobody chose in time.

    """
    if order.mask is not None:
        if order.mask.suffix.lower() != ".png":
            raise OptionError(f"cannot write {order.mask}: the file of a mask ends in .png")
        check_file(order.mask)
        check_inputs_kept([("--mask", order.mask)], parse_source(order.source))
    with PickServer(_question(order), order.port) as server:
        typer.echo(f"Mark the object at {server.address}", err=True)
        if order.browser and _has_desktop():
            webbrowser.open(server.address)
        choice = server.wait(order.timeout)
    if choice is None:
        raise TargetError(
            f"nobody chose within {digits(order.timeout)} s; open the printed address, or "
            "give --timeout more seconds"
        )
    _print_choice(choice, order.mask)


def _print_choice(choice: Choice, mask: Path | None) -> None:
    """Print nothing but the option to standard output, so that a command can take it."""
    if choice.found.doubt is not None:
        typer.echo(
            f"doubtful: {choice.found.doubt}; model and track refuse it unless --trust-targets is "
            "given",
            err=True,
        )
    if mask is not None:
        done, data = cv2.imencode(".png", choice.found.mask)
        if not done:
            raise OutputError(f"cannot write {mask}: the mask cannot be stored as PNG")
        write_whole(mask, data.tobytes())
        typer.echo(
            f"the mask is in {mask}; --target {shlex.quote(f'mask:{mask}@{choice.target.view}')} "
            "uses it unchanged",
            err=True,
        )
    typer.echo(f"--target {shlex.quote(str(choice.target))}")


def _question(order: PickOrder) -> Question:
    """Return the image to mark; everything that depends on the kind of source is here."""
    word = parse_source(order.source)
    # Any lens will do, because the page shows the image as it was recorded.
    is_uncalibrated = not word.is_live and count_uncalibrated_cameras(word) > 0
    known = any_cameras(GivenCalibration()) if is_uncalibrated else GivenCalibration()
    views = open_recorded(word, known).capture.all_views()
    view = _view(views, order)
    image = view.recorded_image()
    seen = [] if is_uncalibrated else views  # stereo needs the cameras' true poses

    def seek(mark: Mark) -> Found:
        return find_in_view(mark, view, image, seen)

    return Question(view.name, image, seek)


def _view(views: list[CaptureView], order: PickOrder) -> CaptureView:
    names = list(dict.fromkeys(view.camera_name for view in views))
    if order.camera is not None and order.camera not in names:
        raise OptionError(
            f"{order.source} has no camera '{order.camera}'; its cameras are {', '.join(names)}"
        )
    own = [view for view in views if view.camera_name == (order.camera or names[0])]
    for view in own:
        if view.index == order.image:
            return view
    raise OptionError(
        f"{order.source} has no image {order.image} of camera '{own[0].camera_name}', which has "
        f"{counted(len(own), 'image')}, {own[0].index} to {own[-1].index}"
    )


def _has_desktop() -> bool:
    """Return whether a browser opens in a window; one in the terminal would occupy it."""
    if sys.platform in ("darwin", "win32"):
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
