"""Modelling: fits a body of a few ellipsoids to views of an unknown object."""

from typing import TYPE_CHECKING

from servoid._native import ModelSettings, PaperSettings, Step
from servoid.model.cloud import fit_range_samples
from servoid.model.depth_agreement import with_twins
from servoid.model.depth_registration import misregistered
from servoid.model.finding import find_in_view
from servoid.model.fit import Request, fit, fit_mesh
from servoid.model.look import (
    NO_METRES,
    find_everywhere,
    fit_capture,
    fit_capture_by_paper,
    mark_everywhere,
)
from servoid.model.marking import mark, views_meant
from servoid.model.misfit import center_notes, swapped_note
from servoid.model.paper import fit_paper_views
from servoid.model.range_samples import RangeSamples, depth_of_pair, range_samples_of_cloud
from servoid.model.result import Coverage, IouByCount, ModelResult
from servoid.model.running import Progress, ProgressCallback
from servoid.model.verdict import GOOD_IOU, ModelVerdict
from servoid.renamed import refuse_old_names

__all__ = [
    "Coverage",
    "IouByCount",
    "ModelResult",
    "ModelSettings",
    "ModelVerdict",
    "PaperSettings",
    "Progress",
    "RangeSamples",
    "Request",
    "Step",
    "fit",
    "fit_capture",
    "fit_capture_by_paper",
    "fit_mesh",
    "fit_paper_views",
    "fit_range_samples",
    "mark_everywhere",
    "range_samples_of_cloud",
]

if not TYPE_CHECKING:
    __getattr__ = refuse_old_names(
        __name__,
        {
            "Sights": "RangeSamples",
            "Surface": "Coverage",
            "fit_sights": "fit_range_samples",
            "sights_of_cloud": "range_samples_of_cloud",
        },
    )
