"""Batches of trials: on one core, on all cores, or on a cluster, with the same numbers."""

from servoid.study.batch.experiment import Experiment
from servoid.study.batch.running import Headway, run_batch
from servoid.study.batch.work import Done, Results, Work
from servoid.study.batch.workers import InProcess, Processes, Workers, workers_for

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
