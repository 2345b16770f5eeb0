"""`servoid sources`: lists the kinds of SOURCE in this installation, and the cameras found."""

from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import typer

from servoid.cli.rows import Row, wrapped
from servoid.errors import ServoidError

_LABEL_WIDTH = 22
_WIDTH = 80
_BY_ID = Path("/dev/v4l/by-id")
_DEVICES = Path("/dev")
_NAMES = Path("/sys/class/video4linux")
_DRIVERS = "servoid.source.devices"


def run_sources() -> None:
    """Print a line for each kind of SOURCE, with the devices found."""
    typer.echo("Recorded")
    _print(_recorded())
    typer.echo("Live")
    _print(_live())


def _recorded() -> Iterator[Row]:
    yield "FOLDER", "a capture.toml, a COLMAP model, a transforms.json or a BOP scene"
    yield "FILM.mp4", "a video: .mp4, .mov, .avi, .mkv, .webm or .m4v"
    yield "LEFT.mp4+RIGHT.mp4", "two videos of a stereo pair"
    yield "side-by-side:FILM.mp4", "one video of a stereo pair, whose images hold both halves"
    yield "FOLDER, 'left/*.png'", "images in the order of their names"
    yield "RUN.mcap, RUN.bag", f"bags of ROS 1 and ROS 2; {_has('rosbags', 'bags')}"


def _live() -> Iterator[Row]:
    yield "0, 1, ...", _cameras()
    for path in sorted(_BY_ID.glob("*")) if _BY_ID.is_dir() else ():
        yield "", str(path)
    yield "http://, rtsp://", "a phone, an IP camera"
    yield "realsense:SERIAL", _found("realsense", "list_realsense")
    yield "genicam:NAME", _found("genicam", "list_genicam")
    yield (
        "sim:OBJECT[:PATH]",
        (f"a simulated object before two cameras, such as sim:bottle; {_has('mujoco', 'sim')}"),
    )
    yield "RIG.toml", "several of these, with their calibration"


def _has(library: str, extra: str) -> str:
    if find_spec(library) is not None:
        return "ready"
    return f"needs {library}: pip install 'servoid[{extra}]'"


def _cameras() -> str:
    numbers = sorted(
        int(path.name.removeprefix("video"))
        for path in _DEVICES.glob("video*")
        if path.name.removeprefix("video").isdigit()
    )
    named = [f"{number}{_name(number)}" for number in numbers]
    return f"a camera's number; {', '.join(named) if named else 'none found'}"


def _name(number: int) -> str:
    try:
        return f" ({(_NAMES / f'video{number}' / 'name').read_text('utf-8').strip()})"
    except OSError:
        return ""


def _found(module: str, function: str) -> str:
    """Return the devices that a driver finds, or why it finds none."""
    try:
        seek: Callable[[], Iterable[object]] = getattr(
            import_module(f"{_DRIVERS}.{module}"), function
        )
        found = [f"{one.name} ({one.description})" for one in seek()]  # type: ignore
    except ModuleNotFoundError:
        return "this version of servoid has no such driver"
    except ServoidError as error:
        return str(error)
    return f"ready; {', '.join(found) if found else 'none found'}"


def _print(rows: Iterable[Row]) -> None:
    for label, value in rows:
        room = _WIDTH - _LABEL_WIDTH - 3
        for name, line in wrapped(label, value, room):
            typer.echo(f"  {name:<{_LABEL_WIDTH}} {line}")
