"""Tracking: estimates the 6-DoF pose of an object in a sequence of observations."""

from typing import TYPE_CHECKING

from servoid._native import Estimate, Tracker, TrackSettings, pose_from_masks, poses_from_masks
from servoid.renamed import refuse_old_names
from servoid.shape import placed
from servoid.source import cameras_of, read_instants, tidy_image
from servoid.track.follower import Adjuster, Avoider, Evolver, Follower, Rememberer, depths_for
from servoid.track.following import (
    Collector,
    TrackStep,
    doubt_capture,
    follow,
    follow_live,
    track_capture,
)
from servoid.track.history import BodyChange, Historian, History, LearnedSurface
from servoid.track.learning import learn_appearance
from servoid.track.request import Method, Request, Subject
from servoid.track.result import Gap, Tracked, TrackResult
from servoid.track.starting import Followed, begin
from servoid.track.unobservable import unobservable_axes

__all__ = [
    "Adjuster",
    "Avoider",
    "BodyChange",
    "Collector",
    "Estimate",
    "Evolver",
    "Followed",
    "Follower",
    "Gap",
    "Historian",
    "History",
    "LearnedSurface",
    "Method",
    "Rememberer",
    "Request",
    "Subject",
    "TrackResult",
    "TrackSettings",
    "TrackStep",
    "Tracked",
    "Tracker",
    "begin",
    "cameras_of",
    "depths_for",
    "doubt_capture",
    "follow",
    "follow_live",
    "learn_appearance",
    "placed",
    "pose_from_masks",
    "poses_from_masks",
    "read_instants",
    "tidy_image",
    "track_capture",
]

if not TYPE_CHECKING:
    __getattr__ = refuse_old_names(__name__, {"place_body": "pose_from_masks"})
