"""Laws of objects and goals that are absurdly far away: they hold the hand, as NaN does."""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from servo_loop import (
    GOAL_FROM_OBJECT,
    PERIOD_S,
    WORLD_FROM_OBJECT,
    Loop,
    Seen,
    Tick,
    goal_at,
    still,
)

from servoid.errors import ServoError
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.servo import Controller, Eyes, Reason
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid.source.source import Instant

pytestmark = pytest.mark.filterwarnings("error")

FAR = pytest.mark.parametrize("distance", [2e4, 1e50, 1e99])


def away(distance: float) -> Pose:
    return Pose.from_parts([0.0, 0.0, distance], [1.0, 0.0, 0.0, 0.0])


def holds(ticks: list[Tick]) -> bool:
    """Return whether all commands are zero, and finite, for this reason."""
    resting = not any(tick.command.velocities.any() for tick in ticks)
    return resting and all(Reason.NOT_FINITE in tick.command.holding for tick in ticks[-10:])


@FAR
def test_an_object_that_is_absurdly_far_away_is_not_followed(distance: float) -> None:
    assert holds(Loop(still(away(distance))).run(1.0))


@FAR
def test_an_object_that_is_absurdly_far_away_once_does_not_move_the_eyes(distance: float) -> None:
    def spoil(instant: Instant, estimate: FakeEstimate) -> Seen:
        if instant.index == 30:
            estimate.world_from_object = away(distance)
        return instant, estimate

    ticks, true = Loop(still(WORLD_FROM_OBJECT), spoil=spoil).run(2.0), WORLD_FROM_OBJECT
    seen = [tick.command.world_from_object for tick in ticks]
    known = [pose.translation for pose in seen if pose is not None]
    np.testing.assert_allclose(known, [true.translation] * len(known), atol=1e-9)


@FAR
def test_a_goal_that_is_absurdly_far_away_is_not_followed(distance: float) -> None:
    loop = Loop(still(WORLD_FROM_OBJECT), goal=lambda _: away(distance))
    ticks = loop.run(1.0)
    hand = slice(0, loop.arm.joints.hand_count)
    assert not any(tick.command.velocities[hand].any() for tick in ticks)
    assert ticks[-1].command.holding == {Reason.NOT_FINITE}


@FAR
def test_a_viewpoint_that_is_absurdly_far_away_is_not_visited(distance: float) -> None:
    arm = SerialArm(read_arm(), PERIOD_S)
    controller, here = Controller(arm), arm.world_from_hand(arm.state().positions)
    for goal, point in ((away(distance), np.zeros(3)), (here, np.array([distance, 0.0, 0.0]))):
        command = controller.go_to(arm.state(), goal, point)
        assert command.holding == {Reason.NOT_FINITE}
        assert not command.velocities.any()


class NoJacobian(SerialArm):
    """An arm whose Jacobian is undefined after a second."""

    def jacobian(self, positions: Floats) -> Floats:
        return super().jacobian(positions) * (np.nan if self.time_s > 1.0 else 1.0)


class NoBaseline(SerialArm):
    """An arm for whose cameras no angles can be computed after a second."""

    @property
    def eyes(self) -> Eyes:
        eyes = super().eyes
        assert eyes is not None
        return LateEyes(self, eyes)  # type: ignore[return-value]


@dataclass
class LateEyes:
    """The cameras of an arm, whose baseline is undefined after a second."""

    arm: SerialArm
    eyes: Eyes

    def __getattr__(self, name: str) -> object:
        if name == "half_baseline" and self.arm.time_s > 1.0:
            return np.nan
        return getattr(self.eyes, name)


@pytest.mark.parametrize(
    ("made", "reason"),
    [(NoJacobian, Reason.BAD_STATE), (NoBaseline, Reason.NOT_FINITE)],
)
def test_commands_are_finite_when_what_is_computed_is_not(
    made: type[SerialArm], reason: Reason
) -> None:
    arm = made(read_arm(), PERIOD_S)
    controller, commands = Controller(arm), []
    pose = goal_at(np.array([0.06, 0.17, 0.08, 0.0, 0.35, 0.0]))
    for tick in range(120):
        state = arm.state()
        if tick % 2 == 0:
            controller.see(None, FakeEstimate(state.time_s, pose, confidence=1.0))
        commands.append(controller.command(state, GOAL_FROM_OBJECT))
        arm.command(commands[-1].velocities)
    assert commands[60].velocities.any() and not commands[-1].velocities.any()
    assert all(np.isfinite([*one.velocities, *one.twist]).all() for one in commands)
    assert commands[-1].holding == {reason}


class InMillimetres(SerialArm):
    """An arm whose program returns the hand and its velocity in millimetres, or begins to."""

    unit = 1000.0

    def world_from_hand(self, positions: Floats) -> Pose:
        pose = super().world_from_hand(positions)
        return Pose.from_parts([self.unit * one for one in pose.translation], pose.quaternion)

    def jacobian(self, positions: Floats) -> Floats:
        return super().jacobian(positions) * np.array([self.unit] * 3 + [1.0] * 3)[:, None]


def test_an_arm_in_millimetres_is_refused() -> None:
    with pytest.raises(ServoError, match=r"moves the hand by \d+ m a radian: .* in metres"):
        arm = InMillimetres(read_arm(), PERIOD_S, [0.3] * 10)
        Controller(arm).command(arm.state(), GOAL_FROM_OBJECT)


def test_an_arm_in_millimetres_is_held() -> None:
    right = SerialArm(read_arm(), PERIOD_S)
    arm = InMillimetres(read_arm(), PERIOD_S, right.state().positions.tolist())
    arm.unit = 1.0
    controller = Controller(arm)
    controller.command(arm.state(), GOAL_FROM_OBJECT)
    arm.unit = 1000.0
    for _ in range(30):
        controller.see(None, FakeEstimate(arm.time_s, WORLD_FROM_OBJECT, confidence=1.0))
        command = controller.command(arm.state(), GOAL_FROM_OBJECT)
        assert command.holding == {Reason.BAD_STATE}
        arm.command(command.velocities)
        assert not command.velocities.any()


def test_a_goal_in_millimetres_is_not_followed() -> None:
    goal = Pose.from_parts([1000.0 * one for one in GOAL_FROM_OBJECT.translation], [1.0, 0, 0, 0])
    loop = Loop(still(WORLD_FROM_OBJECT), goal=lambda _: goal)
    ticks = loop.run(1.0)
    hand = slice(0, loop.arm.joints.hand_count)
    assert not any(tick.command.velocities[hand].any() for tick in ticks)
    assert ticks[-1].command.holding == {Reason.NOT_FINITE}


def test_an_object_in_millimetres_is_not_followed() -> None:
    place = [1000.0 * one for one in WORLD_FROM_OBJECT.translation]
    far = Pose.from_parts(place, WORLD_FROM_OBJECT.quaternion)
    for loop in (Loop(still(far)), Loop(still(far), goal=lambda _: None)):
        ticks = loop.run(2.0)
        assert not any(tick.command.velocities.any() for tick in ticks)
        assert ticks[-1].command.holding == {Reason.NOT_FINITE}


def test_eyes_in_millimetres_are_refused() -> None:
    class Wide(SerialArm):
        @property
        def eyes(self) -> Eyes:
            return replace(self.true_eyes, **self.wrong)

        @property
        def true_eyes(self) -> Eyes:
            eyes = super().eyes
            assert eyes is not None
            return eyes

        wrong: ClassVar[dict[str, Any]] = {}

    for wrong, words in (
        ({"half_baseline": 60.0}, "half_baseline is 60 m, .* write 0.06"),
        ({"hand_from_head": away(80.0)}, "hand_from_head is 80 m, and more than 10 m"),
    ):
        Wide.wrong = wrong
        with pytest.raises(ServoError, match=words):
            Controller(Wide(read_arm(), PERIOD_S))
