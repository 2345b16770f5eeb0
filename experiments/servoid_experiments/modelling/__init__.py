"""The study of modelling: the quality of a body by its inputs."""

from servoid_experiments.design import Study
from servoid_experiments.modelling.around import around
from servoid_experiments.modelling.designs import design_of
from servoid_experiments.modelling.plan import plan_modelling
from servoid_experiments.modelling.reporting import report_modelling
from servoid_experiments.modelling.settings import QUICK, ModelStudySettings

MODEL = Study(
    name="model",
    title="How good a body is, by what it was made of",
    question=(
        "How many views and ellipsoids a body needs, what masks and camera poses that are not "
        "exact do to it, and how long modelling takes; on objects whose shape is known"
    ),
    settings=ModelStudySettings,
    quick=QUICK,
    plan=plan_modelling,
    report=report_modelling,
)

__all__ = ["MODEL", "ModelStudySettings", "around", "design_of"]
