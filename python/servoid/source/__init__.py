"""Sources of observations: cameras that run, and captures that are played."""

from servoid.source.instants import ASSUMED_HZ, cameras_of, read_instants, tidy_image
from servoid.source.live import Live, LiveCamera, LiveSettings
from servoid.source.looks import write_looks
from servoid.source.recording import Recording
from servoid.source.rig_file import read_rig
from servoid.source.source import Instant, Source

__all__ = [
    "ASSUMED_HZ",
    "Instant",
    "Live",
    "LiveCamera",
    "LiveSettings",
    "Recording",
    "Source",
    "cameras_of",
    "read_instants",
    "read_rig",
    "tidy_image",
    "write_looks",
]
