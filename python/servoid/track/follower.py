"""Declares the interface of a tracker, and makes the trackers of the core."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from servoid import _native
from servoid._native import Body, Camera, Estimate, Pose
from servoid.errors import TrackError
from servoid.source import Instant

_ONE_STEP_OPTIONS = ("seed", "population")

Images = Sequence[NDArray[np.uint8] | None]


class Follower(Protocol):
    """Tracks one body: starts at a known pose, then takes one observation after another.

    Images are (H, W) or (H, W, 3) uint8, RGB, of the cameras that the tracker was made with; None
    where a camera delivered nothing.
    """

    def start(
        self,
        time_s: float,
        world_from_camera: Sequence[Pose],
        images: Images,
        world_from_object: Pose,
        masks: Images | None = None,
    ) -> Estimate:
        """Learn the object's appearance at a known pose."""
        ...

    def step(self, time_s: float, world_from_camera: Sequence[Pose], images: Images) -> Estimate:
        """Estimate the object's pose in the next observation."""
        ...


@runtime_checkable
class Evolver(Protocol):
    """Evolves its body while tracking; the `evolved` flag of an estimate reports a change."""

    def begin_evolving(self) -> bool:
        """Start to refine the body from the observations; return whether there is new data."""
        ...


@runtime_checkable
class Avoider(Protocol):
    """Searches for its object only where no other tracked object is."""

    def avoid(self, others: Sequence[Body]) -> None:
        """Set where the other objects are now, as bodies at their poses."""
        ...


@runtime_checkable
class Adjuster(Protocol):
    """Corrects earlier poses of the object later."""

    def keyframe_pose(self, number: int) -> Pose | None:
        """Return the current estimate of the object's pose at a keyframe."""
        ...


@runtime_checkable
class Rememberer(Protocol):
    """Recognises an object by its appearance."""

    def appearance(self) -> bytes:
        """Return the appearance of the object learned so far."""
        ...

    def recall(self, appearance: bytes) -> None:
        """Set the appearance of the object."""
        ...

    def find(
        self,
        time_s: float,
        world_from_camera: Sequence[Pose],
        images: Images,
        near: Pose | None = None,
    ) -> Estimate:
        """Search for the object in the whole images, or near a pose."""
        ...


@runtime_checkable
class Surfaced(Protocol):
    """Knows points on the surface of its object."""

    @property
    def surface(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.uint8]]:
        """The points, (N, 3) in the object's frame, with their normals and colours."""
        ...


def recall(tracker: Rememberer, appearance: bytes) -> None:
    """Set the appearance of the object that is in its body's file.

    Raises:
        TrackError: it cannot be read, or it is that of another body.

    """
    try:
        tracker.recall(appearance)
    except TrackError as error:
        raise error.at("the appearance in the body's file") from error


def avoid(tracker: Follower, others: Sequence[Body]) -> None:
    """Let a tracker not find its object where others are, if it can; they are at their poses."""
    if isinstance(tracker, Avoider):
        tracker.avoid(others)


def depths_for(tracker: object, instant: Instant) -> dict[str, Any]:
    """Return the depth images of an observation as keyword arguments, if the tracker uses them."""
    takes = bool(instant.depths) and getattr(tracker, "TAKES_DEPTHS", False)
    return {"depths": instant.depths} if takes else {}


Maker = Callable[[Sequence[Camera], Body, dict[str, Any]], Follower]


def make_tracker(cameras: Sequence[Camera], body: Body, options: dict[str, Any]) -> Follower:
    """Make servoid's own tracker of a body; `options` are those of `TrackSettings`.

    Raises:
        TrackError: a setting is out of range.

    """
    return _native.Tracker(cameras, body, _native.TrackSettings(**options))


def make_one_step_tracker(
    cameras: Sequence[Camera], body: Body, options: dict[str, Any]
) -> Follower:
    """Make the paper's tracker, a genetic algorithm of one generation per image.

    Raises:
        TrackError: a setting is out of range, or is one that this tracker does not have.

    """
    return _native.OneStepTracker(cameras, body, one_step_settings(options))


def one_step_settings(options: dict[str, Any]) -> _native.OneStepSettings:
    """Return the settings of the paper's tracker; `None` keeps the core's default.

    Raises:
        TrackError: one is out of range, or is one that this tracker does not have.

    """
    for name, value in options.items():
        if value is not None and name not in _ONE_STEP_OPTIONS:
            raise TrackError(
                f"{name} was given, which the paper's method does not have; leave it out (it has "
                f"{' and '.join(_ONE_STEP_OPTIONS)})"
            )
    known = {name: options.get(name) for name in _ONE_STEP_OPTIONS}
    return _native.OneStepSettings(**known)
