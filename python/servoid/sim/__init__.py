"""Captures of an object that servoid makes itself, to try everything on."""

from servoid.sim.sample import write_sample

__all__ = ["write_sample"]
