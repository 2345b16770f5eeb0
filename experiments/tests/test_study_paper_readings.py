"""In which frame the paper's tracker lives, and to what time its answers belong."""

from types import SimpleNamespace

import numpy as np
import pytest
from fake_tracker import FakeEstimate

from servoid.pose import Pose
from servoid.servo import JointLaw, ServoSettings, as_the_paper
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid_experiments.bode.margin import PAPER, loop_settings
from servoid_experiments.paper.servoing.method import Method, Reading, servo_settings
from servoid_experiments.paper.servoing.settings import Constants

THERE = Pose.from_parts([-0.9, -0.1, 0.5], [0.5, -0.5, -0.5, 0.5])


class Exact:
    """A tracker that finds the object where it is before the first camera."""

    def __init__(self) -> None:
        self.poses: list[Pose] = []

    def start(self, time_s: float, poses: list[Pose], *_: object) -> FakeEstimate:
        return self.step(time_s, poses)

    def step(self, time_s: float, poses: list[Pose], *_: object) -> FakeEstimate:
        self.poses = poses
        return FakeEstimate(time_s, poses[0] @ self.camera_from_object)

    def sees(self, camera_from_object: Pose) -> None:
        self.camera_from_object = camera_from_object


def seen(*, in_hand: bool, stamped: bool) -> tuple[Pose, Pose, Exact, SimpleNamespace]:
    """Return what was recognised and what is believed when the hand has gone on meanwhile."""
    arm, tracker = SerialArm(read_arm()), Exact()
    then = arm.state().positions
    world = SimpleNamespace(arm=arm, source=SimpleNamespace(handed_out=None))
    world.source.handed_out = SimpleNamespace(positions_at_time=then)
    cameras = arm.world_from_cameras(then)
    for _ in range(5):
        arm.command(np.full(10, 0.3))
    world.then, world.now = (arm.world_from_hand(q) for q in (then, arm.state().positions))
    tracker.sees(cameras[0].inverse() @ THERE)
    reading = Reading(world, tracker, in_hand=in_hand, stamped=stamped)  # type: ignore[arg-type]
    estimate = reading.step(0.1, cameras, [])
    return reading.world_from_seen, estimate.world_from_object, tracker, world


@pytest.mark.parametrize("in_hand", [True, False])
@pytest.mark.parametrize("stamped", [True, False])
def test_recognition_is_measured_alike_in_every_reading(in_hand: bool, stamped: bool) -> None:
    recognised, believed, tracker, world = seen(in_hand=in_hand, stamped=stamped)
    np.testing.assert_allclose(recognised.matrix(), THERE.matrix(), atol=1e-12)
    expected = THERE if stamped else world.now @ world.then.inverse() @ THERE
    np.testing.assert_allclose(believed.matrix(), expected.matrix(), atol=1e-12)
    away = np.linalg.norm(np.subtract(believed.translation, THERE.translation))
    assert (away < 1e-9) == stamped
    # In the hand, the cameras are where they are on it, wherever it is.
    beside_m = np.linalg.norm(tracker.poses[0].translation)
    assert (beside_m < 0.3) == in_hand


def test_the_papers_law_is_the_same_wherever_it_is_named() -> None:
    law = as_the_paper(ServoSettings())
    assert law.joints.law is JointLaw.PAPER
    study, bode = servo_settings(Method(), Constants()), loop_settings(PAPER, 1.0, 0.1)
    for settings in (study, bode):
        assert settings.target == law.target
        assert settings.joints == law.joints
        assert settings.hand == law.hand
        assert settings.gaze.feed_forward == law.gaze.feed_forward
    assert Method().stamped == PAPER.stamped == False  # noqa: E712
    assert (Method().feed_forward, Method().filtered) == (PAPER.feed_forward, PAPER.predicts)
