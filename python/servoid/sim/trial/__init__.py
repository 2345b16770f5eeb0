"""Whole servo runs in a simulated world: settings, the run, and its ground truth."""

from servoid.sim.trial.figures import trial_notes, trial_numbers, trial_rows
from servoid.sim.trial.servoing import LOOKS, ServoTrial, TrialStep, run_servo_trial
from servoid.sim.trial.settings import (
    PEOPLE,
    RunSettings,
    TrackingSettings,
    TrialSettings,
    changed,
    read_trial_settings,
    trial_toml,
)

__all__ = [
    "LOOKS",
    "PEOPLE",
    "RunSettings",
    "ServoTrial",
    "TrackingSettings",
    "TrialSettings",
    "TrialStep",
    "changed",
    "read_trial_settings",
    "run_servo_trial",
    "trial_notes",
    "trial_numbers",
    "trial_rows",
    "trial_toml",
]
