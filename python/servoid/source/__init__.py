"""Sources of observations: live cameras, and captures that are played back."""

from servoid.rates import ASSUMED_HZ
from servoid.source.controls import Controls
from servoid.source.delivery import Delivery, EndedError, LostDeviceError
from servoid.source.device import Device, opened, shown
from servoid.source.feed import Feed
from servoid.source.grabbing import Video
from servoid.source.instants import cameras_of, read_instants, tidy_image, time_of
from servoid.source.live import Live, LiveCamera, LiveSettings
from servoid.source.looks import write_looks
from servoid.source.raw import (
    MountedCamera,
    RawImage,
    RawInstant,
    RawSource,
    capture_of_raw,
    instant_of,
)
from servoid.source.recording import Recording
from servoid.source.rig_file import read_rig
from servoid.source.source import Instant, Source
from servoid.source.streams.halves import HalvesVideo

__all__ = [
    "ASSUMED_HZ",
    "Controls",
    "Delivery",
    "Device",
    "EndedError",
    "Feed",
    "Instant",
    "Live",
    "LiveCamera",
    "LiveSettings",
    "LostDeviceError",
    "MountedCamera",
    "RawImage",
    "RawInstant",
    "RawSource",
    "Recording",
    "Source",
    "Video",
    "cameras_of",
    "capture_of_raw",
    "instant_of",
    "opened",
    "read_instants",
    "read_rig",
    "tidy_image",
    "write_looks",
]
