"""`servoid export`: writes a body in another program's format."""

from typing import Any

import typer

from servoid.cli.export_command import ExportOrder
from servoid.cli.overwriting import check_inputs_kept
from servoid.cli.wrong_options import of_options
from servoid.exchange.export import (
    check_export,
    check_options,
    density_note,
    export_body,
    format_of,
)
from servoid.shape import NO_UNIT, body_size_note, load_body
from servoid.words import counted, four_digits

_CM3_PER_M3 = 1e6


def run_export(order: ExportOrder) -> None:
    """Write the body and print its volume, its mass and its files."""
    settings: dict[str, Any] = {
        "density_kg_m3": order.density,
        "frame": order.frame,
        "name": order.name,
        "detail": order.detail,
    }
    given = {name: value for name, value in settings.items() if value is not None}
    with of_options():
        format_ = order.to or format_of(order.out)
        check_options(order.out, format_, **given)
    check_inputs_kept([("--out", order.out)], None, [order.body])
    check_export(order.out, format_)
    file = load_body(order.body)
    done = export_body(file, order.out, format_, **given)
    count = len(file.ellipsoids)
    typer.echo(
        f"Wrote {' '.join(map(str, done.files))} ({format_}): "
        f"{counted(count, 'ellipsoid')}, "
        f"{four_digits(_CM3_PER_M3 * done.volume_m3)} cm³, {four_digits(done.mass_kg)} kg"
    )
    notes = (
        body_size_note(file.body()) if file.is_metric else NO_UNIT,
        None if order.density is None else density_note(order.density),
    )
    for note in notes:
        if note is not None:
            typer.echo(f"  note  {note}")
