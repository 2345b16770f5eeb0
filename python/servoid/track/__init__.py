"""Tracking: where an object is, in six degrees of freedom, in one observation after another."""

from servoid._native import Estimate, Tracker, TrackSettings, place_body
from servoid.observe import cameras_of, read_instants, tidy_image
from servoid.track.follower import Evolver, Follower, Rememberer
from servoid.track.following import Collector, TrackStep, follow, track_capture
from servoid.track.history import Historian, History, Stage, Surface
from servoid.track.learning import learn_appearance
from servoid.track.request import Method, Request, Subject
from servoid.track.result import Gap, Tracked, TrackResult
from servoid.track.sides import SEEN_WITHIN, Sides, sides_of
from servoid.track.starting import Followed, placed
from servoid.track.turning import Cause, Correction, Turning, turning_of

__all__ = [
    "SEEN_WITHIN",
    "Cause",
    "Collector",
    "Correction",
    "Estimate",
    "Evolver",
    "Followed",
    "Follower",
    "Gap",
    "Historian",
    "History",
    "Method",
    "Rememberer",
    "Request",
    "Sides",
    "Stage",
    "Subject",
    "Surface",
    "TrackResult",
    "TrackSettings",
    "TrackStep",
    "Tracked",
    "Tracker",
    "Turning",
    "cameras_of",
    "follow",
    "learn_appearance",
    "place_body",
    "placed",
    "read_instants",
    "sides_of",
    "tidy_image",
    "track_capture",
    "turning_of",
]
