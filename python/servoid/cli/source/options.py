"""The argument SOURCE and the options that say how its cameras see, the same for all commands."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from servoid.opening import Known

from servoid.cli.wrong_options import of_options

SOURCE_HELP = (
    "What to look at: a capture (a folder with a capture.toml, a COLMAP model, a transforms.json "
    "or a BOP scene), a video, LEFT.mp4+RIGHT.mp4, side-by-side:VIDEO, a folder or 'pattern*' of "
    "images, a bag (.mcap, .bag or a rosbag2 folder)"
)
LIVE_HELP = (
    "; or live: a camera's number or /dev/v4l/..., rtsp:// or http://..., realsense:SERIAL, "
    "genicam:NAME, sim:WORLD, or a rig.toml"
)
LIVE = "Of a live SOURCE"
_BAG = "Of a bag"
_CAMERAS = "How the cameras see, where SOURCE does not say it"


def _check_duration(duration_s: float | None) -> float | None:
    if duration_s is not None and not 0.0 < duration_s < math.inf:
        raise typer.BadParameter(f"{duration_s} is no time; give seconds above 0")
    return duration_s


Fov = Annotated[
    float | None,
    typer.Option(
        "--fov",
        metavar="DEG",
        help="The angle of view from the left to the right border of the image, in degrees: of "
        "phones about 65 where the image is wide, of webcams 60 to 80.",
        rich_help_panel=_CAMERAS,
    ),
]
Baseline = Annotated[
    float | None,
    typer.Option(
        "--baseline",
        metavar="M",
        help="How far apart two cameras are that look in parallel, in metres.",
        rich_help_panel=_CAMERAS,
    ),
]
Calibration = Annotated[
    Path | None,
    typer.Option(
        "--calibration",
        metavar="FILE",
        help="A calibration in place of these: a TOML file with [[camera]] tables, such as a "
        "rig.toml or a capture.toml.",
        rich_help_panel=_CAMERAS,
    ),
]
Rate = Annotated[
    float | None,
    typer.Option(
        "--rate",
        metavar="HZ",
        help="How many images there are a second, where nothing says their times (default "
        "{rates.ASSUMED_HZ}).",
        rich_help_panel=_CAMERAS,
    ),
]
Topic = Annotated[
    list[str] | None,
    typer.Option(
        "--topic",
        metavar="TOPIC",
        help="Of a bag: the images of a camera, or depth that is registered to them (default: "
        "the likely ones, which are said). May be given several times.",
        rich_help_panel=_BAG,
    ),
]
World = Annotated[
    str | None,
    typer.Option(
        "--world",
        metavar="FRAME",
        help="Of a bag: the frame of TF in which poses are told (default: the top one).",
        rich_help_panel=_BAG,
    ),
]
Duration = Annotated[
    float | None,
    typer.Option(
        "--duration",
        metavar="S",
        callback=_check_duration,
        help="End after so many seconds (default: at Ctrl-C).",
        rich_help_panel=LIVE,
    ),
]


def known_cameras(
    fov: float | None, baseline: float | None, calibration: Path | None, rate: float | None
) -> "Known":
    """Return what the options say of the cameras.

    Raises:
        OptionError: a value is out of range, or two contradict each other.

    """
    from servoid.opening import Known

    with of_options():
        return Known(fov_deg=fov, baseline_m=baseline, calibration=calibration, rate_hz=rate)
