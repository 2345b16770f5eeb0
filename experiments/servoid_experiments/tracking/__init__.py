"""The study of tracking: its limits and its precision."""

from servoid_experiments.design import Study
from servoid_experiments.tracking.plan import plan_tracking
from servoid_experiments.tracking.reporting import report_tracking
from servoid_experiments.tracking.settings import QUICK, TrackStudySettings

TRACK = Study(
    name="track",
    title="Until when an object is tracked, and how well",
    question=(
        "What tracking bears, one factor at a time around a common case: fast motion, few "
        "hypotheses, coarse bodies, noise, light, something before the object, and how the eyes "
        "stand; for servoid's tracker and for the paper's 1-step GA"
    ),
    settings=TrackStudySettings,
    quick=QUICK,
    plan=plan_tracking,
    report=report_tracking,
)

__all__ = ["TRACK", "TrackStudySettings"]
