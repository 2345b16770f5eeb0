"""The options that set the scale of images without poses, the same for all commands."""

from typing import Annotated

import typer

_SCALE = "Scale of images without poses: give one of these, or lengths have no unit"

Length = Annotated[
    list[str],
    typer.Option(
        "--length",
        metavar="IMAGE:U0,V0,U1,V1=M",
        help="The two ends of a known length in an image, in pixels, and the length in metres; "
        "give it for two or more images from different sides.",
        rich_help_panel=_SCALE,
    ),
]
Board = Annotated[
    str | None,
    typer.Option(
        "--board",
        metavar="NxM,SQUARE,MARKER,DICTIONARY",
        help="A printed ChArUco board in the scene: number of squares, sides of a square and of a "
        "marker in metres, and the dictionary; the last two may be left out.",
        rich_help_panel=_SCALE,
    ),
]
Apart = Annotated[
    list[str],
    typer.Option(
        "--apart",
        metavar="IMAGE,IMAGE=M",
        help="Distance in metres between the camera positions of two images.",
        rich_help_panel=_SCALE,
    ),
]


class ScaleOptions:
    """The part of a command's options that sets the scale of images without poses."""

    length: Length
    board: Board
    apart: Apart

    @property
    def scale_options(self) -> list[str]:
        """Name the options that were given."""
        known = {"--length": self.length, "--board": self.board, "--apart": self.apart}
        return [option for option, value in known.items() if value]
