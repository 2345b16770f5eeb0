"""Exports bodies to the formats of simulators, planners and viewers."""

from typing import TYPE_CHECKING

from servoid.exchange.export.exporting import (
    Exported,
    Frame,
    check_export,
    check_options,
    density_note,
    export_body,
    format_of,
)
from servoid.exchange.export.formats import FORMATS
from servoid.renamed import refuse_old_names

__all__ = [
    "FORMATS",
    "Exported",
    "Frame",
    "check_export",
    "check_options",
    "density_note",
    "export_body",
    "format_of",
]

if not TYPE_CHECKING:
    __getattr__ = refuse_old_names(__name__, {"check_wish": "check_options"})
