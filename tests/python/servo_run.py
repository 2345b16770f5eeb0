"""A short run of servoing in a simulated world, with estimates that are the truth."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from fake_tracker import FakeTracker

from servoid.pose import Pose
from servoid.servo import Controller, Seen, ServoLog, ServoRow, Tick, off_center, servo
from servoid.shape import Body
from servoid.sim.world import (
    ArmSettings,
    CameraSettings,
    Fault,
    ObjectSettings,
    World,
    WorldSettings,
)
from servoid.source import Instant

SMALL = CameraSettings(size_px=(160, 120), samples=1, moments=1)
GOAL_FROM_OBJECT = Pose.from_parts([0.0, -0.09, 0.545], [1.0, 0.0, 0.0, 0.0])  # Eq. (20)
Watch = Callable[[Tick, Body], None]


def bottle_body() -> Body:
    """Make a body of about a bottle's size."""
    return Body(
        world_from_object=Pose.identity(),
        centers=np.array([[0.0, 0.02, 0.0], [0.0, -0.06, 0.0]]),
        radii=np.array([[0.035, 0.085, 0.035], [0.016, 0.06, 0.016]]),
        rotations=np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)),
    )


@dataclass
class Run:
    """A world in which a hand follows a bottle that it lost from sight between two times."""

    cameras: CameraSettings = SMALL
    path: str = "sine:0.15@10s"
    background: str = "plain"
    lost_s: tuple[float, float] = (0.3, 0.8)
    arm: ArmSettings = field(default_factory=ArmSettings)
    faults: tuple[Fault, ...] = ()
    world: World = field(init=False)
    log: ServoLog = field(init=False)

    def __post_init__(self) -> None:
        self.world = World(
            WorldSettings(
                arm=self.arm,
                faults=self.faults,
                ideal=True,
                cameras=self.cameras,
                background=self.background,
                object=ObjectSettings(path=self.path),
            )
        )
        self.world.start_path()

    def run(self, seconds: float, watch: Watch = lambda _tick, _body: None) -> ServoLog:
        """Servo for some time, and return the log; `watch` is called with each tick."""
        arm = self.world.arm

        class Truth(FakeTracker):
            made: list[FakeTracker] = []  # noqa: RUF012
            answers = staticmethod(self._answer)

        tracker = Truth(self.world.cameras, bottle_body())
        self.log = ServoLog.of(arm)
        controller, goal = Controller(arm), lambda _time_s: GOAL_FROM_OBJECT
        for tick in servo(arm, self.world.source, tracker, controller, goal):  # type: ignore
            watch(tick, tracker.body)
            self.log.add(self._row(tick))
            if tick.state.time_s >= self.log.start_s + seconds:
                return self.log
        raise AssertionError

    def _answer(self, time_s: float) -> dict[str, Any]:
        pose = {"world_from_object": self.world.world_from_object_at(time_s)}
        if self.lost_s[0] <= time_s < self.lost_s[1]:
            return pose | {"status": "lost", "confidence": 0.1}
        return pose | {"confidence": 1.0}

    def _row(self, tick: Tick) -> ServoRow:
        truth = self.world.world_from_object_at(tick.state.time_s)
        hand = self.world.arm.world_from_hand(tick.state.positions)
        goal = truth @ GOAL_FROM_OBJECT.inverse()
        seen = None if tick.instant is None else self._seen(tick, tick.instant)
        return ServoRow(tick, hand, goal, truth, seen)

    def _seen(self, tick: Tick, instant: Instant) -> Seen:
        then = self.world.world_from_object_at(instant.time_s)
        place = np.array(then.translation)
        off = off_center(self.world.cameras, instant.world_from_camera, place)
        return Seen(instant, tick.estimate, then, off)
