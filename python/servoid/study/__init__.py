"""Studies: whole runs of what servoid does, with their settings and their figures."""

from servoid.study.meeting import Meeting, meet
from servoid.study.servo_trial import ServoTrial, TrialStep, run_servo_trial
from servoid.study.trial_settings import (
    RunSettings,
    TrackingSettings,
    TrialSettings,
    changed,
    read_trial_settings,
    trial_toml,
)

__all__ = [
    "Meeting",
    "RunSettings",
    "ServoTrial",
    "TrackingSettings",
    "TrialSettings",
    "TrialStep",
    "changed",
    "meet",
    "read_trial_settings",
    "run_servo_trial",
    "trial_toml",
]
