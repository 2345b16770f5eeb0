"""Modelling: views of an unknown object become a body of a few ellipsoids."""

from servoid._native import ModelSettings, PaperSettings, Step
from servoid.model.fit import fit
from servoid.model.paper import fit_paper_views
from servoid.model.result import IouByCount, ModelResult
from servoid.model.running import Progress

__all__ = [
    "IouByCount",
    "ModelResult",
    "ModelSettings",
    "PaperSettings",
    "Progress",
    "Step",
    "fit",
    "fit_paper_views",
]
