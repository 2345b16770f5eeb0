"""`servoid export`: writes a body in another program's format."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from servoid.cli.overwriting import check_inputs_kept
from servoid.cli.wrong_options import of_options
from servoid.exchange.export import check_export, check_options, export_body, format_of
from servoid.shape import body_size_note, load_body
from servoid.words import counted, four_digits

_CM3_PER_M3 = 1e6


@dataclass(frozen=True)
class Request:
    """The options of `servoid export`; None keeps the default of a setting."""

    body: Path
    out: Path
    format: str | None
    density_kg_m3: float | None
    frame: str | None
    name: str | None
    detail: int | None


def run_export(request: Request) -> None:
    """Write the body and print its volume, its mass and its files."""
    settings: dict[str, Any] = {
        "density_kg_m3": request.density_kg_m3,
        "frame": request.frame,
        "name": request.name,
        "detail": request.detail,
    }
    given = {name: value for name, value in settings.items() if value is not None}
    with of_options():
        format_ = request.format or format_of(request.out)
        check_options(request.out, format_, **given)
    check_inputs_kept([("--out", request.out)], None, [request.body])
    check_export(request.out, format_)
    file = load_body(request.body)
    done = export_body(file, request.out, format_, **given)
    count = len(file.ellipsoids)
    typer.echo(
        f"Wrote {' '.join(map(str, done.files))} ({format_}): "
        f"{counted(count, 'ellipsoid')}, "
        f"{four_digits(_CM3_PER_M3 * done.volume_m3)} cm³, {four_digits(done.mass_kg)} kg"
    )
    note = body_size_note(file.body())
    if note is not None:
        typer.echo(f"  note  {note}")
