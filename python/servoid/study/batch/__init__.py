"""Batches of trials: on one core, on all cores, or on a cluster, with the same numbers."""

from servoid.study.batch.experiment import Experiment

__all__ = ["Experiment"]
