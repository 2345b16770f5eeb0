"""Batches of trials: on one core, on all cores, or on a cluster, with the same results."""

from typing import TYPE_CHECKING

from servoid.batch.experiment import Done, Experiment, Results, Work
from servoid.batch.running import BatchProgress, ProgressCallback, run_batch
from servoid.batch.workers import InProcess, Processes, Workers, workers_for
from servoid.renamed import refuse_old_names

if not TYPE_CHECKING:
    __getattr__ = refuse_old_names(__name__, {"Headway": "BatchProgress"})

__all__ = [
    "BatchProgress",
    "Done",
    "Experiment",
    "InProcess",
    "Processes",
    "Results",
    "Work",
    "Workers",
    "run_batch",
    "workers_for",
]
