"""Exports bodies to the formats of simulators, planners and viewers."""

from servoid.exchange.export.exporting import (
    Exported,
    Frame,
    check_export,
    check_wish,
    export_body,
    format_of,
)
from servoid.exchange.export.formats import FORMATS

__all__ = ["FORMATS", "Exported", "Frame", "check_export", "check_wish", "export_body", "format_of"]
