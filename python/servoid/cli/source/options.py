"""The argument SOURCE and the options that calibrate its cameras, the same for all commands."""

import math
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from servoid.opening import GivenCalibration

from servoid.cli.wrong_options import of_options

SOURCE_HELP = (
    "The images: a capture (a folder with a capture.toml, a COLMAP model, a transforms.json "
    "or a BOP scene), a video, LEFT.mp4+RIGHT.mp4, side-by-side:VIDEO, a folder or 'pattern*' of "
    "images, a bag (.mcap, .bag or a rosbag2 folder)"
)
LIVE_HELP = (
    "; or live: a camera's number or /dev/v4l/..., rtsp:// or http://..., realsense:SERIAL, "
    "genicam:NAME, sim:WORLD, or a rig.toml"
)
LIVE = "For a live SOURCE"
_BAG = "For a bag"
_CAMERAS = "Calibration, where SOURCE has none"


def _check_duration(duration_s: float | None) -> float | None:
    if duration_s is not None and not 0.0 < duration_s < math.inf:
        raise typer.BadParameter(f"{duration_s:g} is not a duration; give seconds above 0")
    return duration_s


Fov = Annotated[
    float | None,
    typer.Option(
        "--fov",
        metavar="DEG",
        help="The horizontal field of view in degrees: about 65 for phones held "
        "horizontally, 60 to 80 for webcams.",
        rich_help_panel=_CAMERAS,
    ),
]
Baseline = Annotated[
    float | None,
    typer.Option(
        "--baseline",
        metavar="M",
        help="Distance in metres between two cameras with parallel axes.",
        rich_help_panel=_CAMERAS,
    ),
]
Calibration = Annotated[
    Path | None,
    typer.Option(
        "--calibration",
        metavar="FILE",
        help="A calibration file instead of these options: TOML with one camera table per "
        "camera, such as a rig.toml or a capture.toml, or one by Kalibr, ROS or OpenCV; of two "
        "files, left.yaml+right.yaml.",
        rich_help_panel=_CAMERAS,
    ),
]
Rate = Annotated[
    float | None,
    typer.Option(
        "--rate",
        metavar="HZ",
        help="Images per second, where the source has no times (default {rates.ASSUMED_HZ}).",
        rich_help_panel=_CAMERAS,
    ),
]
Unit = Annotated[
    float | None,
    typer.Option(
        "--unit",
        metavar="M",
        help="The length in metres of one unit of the source, such as 0.001 for millimetres. "
        "Without, it is 1 of a mesh or a point cloud, and unknown of a COLMAP model or a "
        "transforms.json.",
        rich_help_panel=_CAMERAS,
    ),
]
Topic = Annotated[
    list[str],
    typer.Option(
        "--topic",
        metavar="TOPIC",
        help="Topic of a camera's images, or of depth that is registered to them (default: "
        "the likely ones, which are printed). May be given several times.",
        rich_help_panel=_BAG,
    ),
]
World = Annotated[
    str | None,
    typer.Option(
        "--world",
        metavar="FRAME",
        help="The TF frame in which poses are expressed (default: the root of the tree).",
        rich_help_panel=_BAG,
    ),
]
Duration = Annotated[
    float | None,
    typer.Option(
        "--duration",
        metavar="S",
        callback=_check_duration,
        help="End after this many seconds of recording, or of tracking after the first pose "
        "(default: at Ctrl-C).",
        rich_help_panel=LIVE,
    ),
]


class CameraOptions:
    """The part of a command's options that calibrates its cameras."""

    fov: Fov
    baseline: Baseline
    calibration: Calibration
    rate: Rate = None

    def __post_init__(self) -> None:
        """Check the calibration before anything else.

        Raises:
            OptionError: a value is out of range, or two contradict each other.

        """
        _ = self.known

    @cached_property
    def known(self) -> "GivenCalibration":
        """Return the calibration that the options give."""
        from servoid.opening import GivenCalibration

        with of_options():
            return GivenCalibration(
                fov_deg=self.fov,
                baseline_m=self.baseline,
                calibration=self.calibration,
                rate_hz=self.rate,
            )
