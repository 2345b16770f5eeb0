"""Sweeps: one factor is varied at a time, around a case in the centre, over several seeds."""

from servoid_experiments.sweeping.factor import (
    Factor,
    Value,
    cases_around,
    check_names,
    check_varied,
    varied,
)
from servoid_experiments.sweeping.panels import (
    BANDS,
    Curve,
    Panel,
    Scale,
    draw_panels,
    panels_csv,
    written,
)
from servoid_experiments.sweeping.series import Series, Sweep

__all__ = [
    "BANDS",
    "Curve",
    "Factor",
    "Panel",
    "Scale",
    "Series",
    "Sweep",
    "Value",
    "cases_around",
    "check_names",
    "check_varied",
    "draw_panels",
    "panels_csv",
    "varied",
    "written",
]
