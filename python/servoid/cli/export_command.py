"""The options of `servoid export`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from servoid.cli.declared import command


@dataclass(frozen=True, kw_only=True)
class ExportOrder:
    """The options of `servoid export`; None keeps the default of a setting."""

    body: Annotated[
        Path, typer.Argument(metavar="BODY", help="A body, a .json file that model wrote.")
    ]
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="The file to write; others may go beside it.")
    ]
    to: Annotated[
        str | None,
        typer.Option(
            metavar="FORMAT",
            help="obj, ply, glb, mjcf, urdf, sdf or splat (default: what FILE ends in; .xml is "
            "mjcf, .ply a mesh).",
        ),
    ] = None
    density: Annotated[
        float | None,
        typer.Option(
            metavar="D",
            help="Density in kg per cubic metre (default: water's, {export.density_kg_m3}).",
        ),
    ] = None
    frame: Annotated[
        str | None,
        typer.Option(
            metavar="object|world",
            help="The frame of the coordinates: the object's own, or the world's with the object "
            "at its modelled pose (default: {export.frame}).",
        ),
    ] = None
    name: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Name of the body in FILE (default: the name of FILE)."),
    ] = None
    detail: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Make meshes of 20 * 4^N triangles per ellipsoid, N from 0 to 6 (default "
            "{export.detail}).",
        ),
    ] = None


@command
def export(order: ExportOrder) -> None:
    """Write a body for a simulator, a planner or a viewer.

    [bold]servoid export body.json --to mjcf --out body.xml[/bold]

    [bold]servoid export body.json --out body.urdf --density 400[/bold]

    [bold]servoid export body.json --to splat --frame world --out body.ply[/bold]
    """
    from servoid.cli.exporting import run_export

    run_export(order)
