"""A delayed sensor that measures poses, not images: a loop whose tracker makes no errors."""

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from servoid.camera import Camera
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.sim.serial_arm import SerialArm
from servoid.source import Instant

Course = Callable[[float], Pose]
Images = Sequence[NDArray[np.uint8] | None]

_EMPTY = np.zeros((16, 16), np.uint8)
_CLOSE_S = 1e-9
_REMEMBERED_S = 2.0


@dataclass(frozen=True)
class Sight:
    """The latency and the rate of the poses.

    A pose arrives `latency_s` and `unknown_s` after it was taken. Its timestamp does not include
    `unknown_s`: it is later than the truth by this, and so are the cameras' poses that belong to
    it.
    """

    rate_hz: float
    latency_s: float
    unknown_s: float = 0.0

    @property
    def delay_s(self) -> float:
        """Return the age of a pose when it arrives."""
        return self.latency_s + self.unknown_s


@dataclass(frozen=True, eq=False)
class MadeEstimate:
    """The fields of a tracker's estimate that servoing uses; only the core makes its own type.

    Without others, they are those of an object that was found without any error.
    """

    time_s: float
    world_from_object: Pose
    covariance: Floats
    status: str = "tracking"
    located: bool = True
    confidence: float = 1.0
    notices: list[str] = field(default_factory=list)
    evaluations: int = 0
    unobservable: Floats = field(default_factory=lambda: np.empty((0, 6)))
    seconds: dict[str, float] = field(default_factory=dict)


class LateSensor:
    """Measures the object's pose in the first camera's frame, and delivers it late.

    It is a `servoid.source.Source` whose images are empty, and a `servoid.track.Follower` except
    for the type of its estimates. Request the newest in each control period, since the joints' path
    is recorded there.
    """

    def __init__(
        self, arm: SerialArm, course: Course, sight: Sight, sigmas: tuple[float, float]
    ) -> None:
        """Take an arm at its start time; `course` returns `world_from_object`.

        `sigmas` are the standard deviations that it reports, in m and in rad.
        """
        self._arm, self._course, self._sight = arm, course, sight
        self._covariance = np.diag(np.repeat(sigmas, 3) ** 2)
        self._went: deque[tuple[float, Floats]] = deque(
            maxlen=math.ceil((_REMEMBERED_S + sight.delay_s) / arm.period_s)
        )
        self._next = 0
        self._camera_from_object = Pose.identity()

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """Return cameras of the least size: nothing is rendered."""
        camera = Camera(size_px=(16, 16), focal_px=(16.0, 16.0), center_px=(7.5, 7.5))
        return camera, camera

    def newest(self) -> Instant | None:
        """Return the newest observation that has arrived and was not yet returned, else None."""
        state = self._arm.state()
        self._went.append((state.time_s, state.positions))
        found = None
        while (
            taken_s := self._next / self._sight.rate_hz
        ) + self._sight.delay_s <= state.time_s + _CLOSE_S:
            found = self._next, taken_s
            self._next += 1
        return None if found is None else self._seen(*found)

    def _seen(self, index: int, taken_s: float) -> Instant:
        first_camera = self._cameras_at(taken_s)[0]
        self._camera_from_object = first_camera.inverse() @ self._course(taken_s)
        stamp_s = taken_s + self._sight.unknown_s
        return Instant(index, stamp_s, self._cameras_at(stamp_s), (_EMPTY, _EMPTY))

    def _cameras_at(self, time_s: float) -> tuple[Pose, ...]:
        """Return the cameras' poses, interpolated between two control periods."""
        end_s, end = self._went[-1]
        for start_s, start in reversed(self._went):
            if start_s <= time_s:
                share = (time_s - start_s) / (end_s - start_s) if end_s > start_s else 0.0
                return self._arm.world_from_cameras((1.0 - share) * start + share * end)
            end_s, end = start_s, start
        return self._arm.world_from_cameras(end)

    def start(
        self,
        time_s: float,
        world_from_camera: Sequence[Pose],  # noqa: ARG002 (nothing is learned)
        images: Images,  # noqa: ARG002
        world_from_object: Pose,
        masks: Images | None = None,  # noqa: ARG002
    ) -> MadeEstimate:
        """Return the pose that was given."""
        return MadeEstimate(time_s, world_from_object, self._covariance)

    def step(
        self,
        time_s: float,
        world_from_camera: Sequence[Pose],
        images: Images,  # noqa: ARG002
    ) -> MadeEstimate:
        """Return the object's pose, assuming that the camera is at its reported pose."""
        pose = world_from_camera[0] @ self._camera_from_object
        return MadeEstimate(time_s, pose, self._covariance)
