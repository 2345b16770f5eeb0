"""Draws an object that turns on and on before two eyes, and follows it in memory.

The world is the left eye's frame, as in a course of `trust_scenes`. Images are drawn as they are
asked for, so that ten turns need no more memory than one image.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from trust_scenes import FULL, Course, mesh_of, write_made
from trust_verdicts import Verdicts, verdicts

from servoid.capture import open_capture
from servoid.pose import Pose
from servoid.source import Instant
from servoid.track import Followed, Request, Subject, Tracked, read_instants
from servoid.track.starting import begin
from servoid_experiments.tracking.scene import RATE_HZ, SetUp
from servoid_experiments.tracking.trial import known_of

STEP_DEG = 6.0  # from image to image
PER_TURN = round(360.0 / STEP_DEG)
WAY_MM = 3.0  # that the object's middle goes from image to image
ELLIPSOIDS = 5  # of a body that is known

Place = Callable[[Instant], Pose]  # world_from_old: where the old world stands in a new one


def turned_deg(index: int) -> float:
    """Return how far an object has turned since the first image, in degrees."""
    return STEP_DEG * index


@dataclass(frozen=True, eq=False)
class Turning:
    """A drawn object that turns evenly about an axis that is nearly upright."""

    object: str
    seed: int
    images: int
    size_px: tuple[int, int] = FULL

    @cached_property
    def set_up(self) -> SetUp:
        """Return the scene, ready to be drawn."""
        course = Course((self.object,), self.images, WAY_MM, turned_deg=turned_deg)
        return course.set_up(self.seed, self.size_px)

    @cached_property
    def world_from_cameras(self) -> tuple[Pose, ...]:
        """Return both eyes' poses, the left one first."""
        left = self.set_up.eyes[0].inverse()
        return tuple(left @ eye for eye in self.set_up.eyes)

    @cached_property
    def truth(self) -> list[Pose]:
        """Return world_from_object in each image."""
        left = self.set_up.eyes[0].inverse()
        return [left @ one for one in self.set_up.world_from_objects]

    def instants(self, indices: Iterable[int] | None = None) -> Iterator[Instant]:
        """Draw images, all of them or those of some indices, one after another."""
        for index in range(self.images) if indices is None else indices:
            images = self.set_up.images(index)
            yield Instant(index, index / RATE_HZ, self.world_from_cameras, images)

    def begin(self, index: int = 0, *, known: bool = False, adjust: bool | None = None) -> Followed:
        """Start a tracker in one image: by its mask alone, or with a body of many views."""
        subject = Subject()
        if known:
            body = known_of(self.object, ELLIPSOIDS).body
            subject = Subject(body=body, start=self.truth[index] @ body.world_from_object)
        with TemporaryDirectory() as name:
            folder = write_made(Path(name), self.set_up, mesh_of(self.object), [index])
            capture = open_capture(folder)
            instant = next(read_instants(capture, capture.observations()))
            one = begin(capture, instant, subject, Request(seed=self.seed, adjust=adjust))
        return replace(one, first=replace(one.first, index=index))

    def judge(self, tracked: Sequence[Tracked], *, at_rest: bool = False) -> Verdicts:
        """Compare a track with the truth, or with the object at rest where the eyes go round it."""
        truth = [self.truth[0]] * self.images if at_rest else self.truth
        return verdicts(tracked, truth, mesh_of(self.object)[0])

    def at_rest(self, instant: Instant) -> Pose:
        """Return the old world's pose in one where the object rests, and the eyes go round it."""
        return self.truth[0] @ self.truth[instant.index].inverse()


def followed(
    one: Followed, instants: Iterable[Instant], *, evolves: bool = True
) -> Iterator[Tracked]:
    """Track on through observations; the body evolves as it does when a capture is tracked.

    The times are those of RATE_HZ images a second, in whichever order they come.
    """
    yield one.first
    first_s = one.first.estimate.time_s
    for count, instant in enumerate(instants, 1):
        time_s = first_s + count / RATE_HZ
        estimate = one.tracker.step(time_s, instant.world_from_camera, instant.images)
        tracked = Tracked(instant.index, estimate, 0.0, notices=tuple(estimate.notices))
        if evolves and count % Request.evolve_every == 0 and tracked.is_tracked:
            one.begin_evolving()
        yield tracked


def elsewhere(instants: Iterable[Instant], place: Place) -> list[Instant]:
    """Return the same images in another world; the object's first pose must be the same there."""
    return [
        replace(one, world_from_camera=tuple(place(one) @ pose for pose in one.world_from_camera))
        for one in instants
    ]


def left_from_objects(tracked: Sequence[Tracked], instants: Sequence[Instant]) -> list[Pose]:
    """Return where the left eye sees the object that was tracked."""
    return [
        instant.world_from_camera[0].inverse() @ one.estimate.world_from_object
        for one, instant in zip(tracked, instants, strict=True)
    ]


def apart(some: Sequence[Pose], others: Sequence[Pose]) -> NDArray[np.float64]:
    """Return how far poses are from others, (N, 2): in metres and in radians."""
    offs = [(one.inverse() @ other).log() for one, other in zip(some, others, strict=True)]
    return np.linalg.norm(np.reshape(offs, (-1, 2, 3)), axis=2)


def deviations(tracked: Sequence[Tracked]) -> NDArray[np.float64]:
    """Return the standard deviations that were told, of all directions: (N, 2), metres, radians."""
    squares = [np.diag(one.estimate.covariance).reshape(2, 3).sum(axis=1) for one in tracked]
    return np.sqrt(squares)
