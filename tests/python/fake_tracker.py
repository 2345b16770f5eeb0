"""A tracker that answers with what a test prepared, in place of the core's."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Pose
from servoid.shape import Body

STAGES = ("look", "search", "polish", "judge", "learn")


@dataclass
class FakeEstimate:
    """What the core's estimate has."""

    time_s: float
    world_from_object: Pose
    status: str = "tracking"
    confidence: float = 0.9
    notices: list[str] = field(default_factory=list)
    evaluations: int = 100
    covariance: NDArray[np.float64] = field(
        default_factory=lambda: np.diag([4e-6] * 3 + [9e-4] * 3)
    )
    unobservable: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 6)))
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.001))
    evidence: dict[str, float] | None = None
    evolved: bool = False

    @property
    def located(self) -> bool:
        """Return whether the images confirm where the object is."""
        return self.status == "tracking"


Answer = Callable[[float], dict[str, Any]]


class FakeTracker:
    """Says that the object rests where it started, unless `answers` says something else."""

    answers: Answer = staticmethod(lambda _: {})
    made: list["FakeTracker"]

    def __init__(self, cameras: Sequence[Any], body: Body, settings: Any = None) -> None:
        self.cameras, self.body, self.settings = cameras, body, settings
        self.surface = (body.centers, np.tile([0.0, 0.0, -1.0], (len(body), 1)), None)
        self.pose = body.world_from_object
        self.calls: list[tuple[str, dict[str, Any]]] = []
        self.evolving = False
        self.made.append(self)

    def start(
        self, time_s: float, poses: Any, images: Any, world_from_object: Pose, masks: Any = None
    ) -> FakeEstimate:
        self.pose = world_from_object
        return self._answer("start", time_s, poses=poses, images=images, masks=masks)

    def step(self, time_s: float, poses: Any, images: Any) -> FakeEstimate:
        evolved, self.evolving = self.evolving, False
        return replace(self._answer("step", time_s, poses=poses, images=images), evolved=evolved)

    def begin_evolving(self) -> bool:
        self.calls.append(("evolve", {}))
        self.evolving = True
        return True

    def _answer(self, kind: str, time_s: float, **given: Any) -> FakeEstimate:
        self.calls.append((kind, {"time_s": time_s} | given))
        return FakeEstimate(time_s, **({"world_from_object": self.pose} | self.answers(time_s)))

    def kinds(self) -> list[str]:
        return [kind for kind, _ in self.calls]


class FakeSettings:
    """Keeps what it was given."""

    def __init__(self, **options: Any) -> None:
        self.options = options


def plain_body(pose: Pose | None = None, count: int = 1) -> Body:
    """Make a body of `count` equal balls in a row."""
    centers = np.zeros((count, 3))
    centers[:, 0] = 0.02 * np.arange(count)
    return Body(
        world_from_object=pose or Pose.identity(),
        centers=centers,
        radii=np.full((count, 3), 0.04),
        rotations=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
    )
