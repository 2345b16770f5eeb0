"""Modelling: views of an unknown object become a body of a few ellipsoids."""

from servoid._native import ModelSettings, PaperSettings, Step
from servoid.model.fit import Request, fit, fit_mesh, fit_sights
from servoid.model.look import fit_capture, fit_capture_by_paper, mark_everywhere
from servoid.model.paper import fit_paper_views
from servoid.model.result import IouByCount, ModelResult, Surface
from servoid.model.running import Progress
from servoid.model.sights import Sights, sights_of_cloud

__all__ = [
    "IouByCount",
    "ModelResult",
    "ModelSettings",
    "PaperSettings",
    "Progress",
    "Request",
    "Sights",
    "Step",
    "Surface",
    "fit",
    "fit_capture",
    "fit_capture_by_paper",
    "fit_mesh",
    "fit_paper_views",
    "fit_sights",
    "mark_everywhere",
    "sights_of_cloud",
]
