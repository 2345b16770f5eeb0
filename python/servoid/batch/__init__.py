"""Batches of trials: on one core, on all cores, or on a cluster, with the same numbers."""

from servoid.batch.experiment import Experiment
from servoid.batch.running import Headway, run_batch
from servoid.batch.work import Done, Results, Work
from servoid.batch.workers import InProcess, Processes, Workers, workers_for

__all__ = [
    "Done",
    "Experiment",
    "Headway",
    "InProcess",
    "Processes",
    "Results",
    "Work",
    "Workers",
    "run_batch",
    "workers_for",
]
