"""Sweeps: one factor is varied at a time, around a case in the centre, over several seeds."""

from servoid_experiments.sweeping.checks import check_names, check_varied
from servoid_experiments.sweeping.factor import Factor, Value, cases_around, varied
from servoid_experiments.sweeping.panels import (
    Curve,
    Panel,
    Scale,
    draw_panels,
    panels_csv,
    written,
)
from servoid_experiments.sweeping.reach import at, beside, highest, holding, known, lowest
from servoid_experiments.sweeping.series import Series, Sweep
from servoid_experiments.sweeping.spread import Spread, confidence, spread_of
from servoid_experiments.sweeping.words import band_words, failure_words, named, percent_sure

__all__ = [
    "Curve",
    "Factor",
    "Panel",
    "Scale",
    "Series",
    "Spread",
    "Sweep",
    "Value",
    "at",
    "band_words",
    "beside",
    "cases_around",
    "check_names",
    "check_varied",
    "confidence",
    "draw_panels",
    "failure_words",
    "highest",
    "holding",
    "known",
    "lowest",
    "named",
    "panels_csv",
    "percent_sure",
    "spread_of",
    "varied",
    "written",
]
