"""Laws of the distances that an arm reports of its own parts: unknown ones hold the hand."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from servo_loop import GOAL_FROM_OBJECT, PERIOD_S, WORLD_FROM_OBJECT, WORLD_FROM_START

from servoid._native import shifted_and_turned
from servoid.errors import ServoError
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.servo import Clearances, Controller, Reason
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm

Reported = Callable[[Clearances], Any]
ROOM_M = 0.05


class WalledArm(SerialArm):
    """An arm in a ball of free space around its start, and what it reports of the distance."""

    report: Reported = staticmethod(lambda found: found)

    @property
    def solid(self) -> "WalledArm":
        return self

    def clearances(self, positions: Floats, _within: float) -> Any:
        start = np.array(WORLD_FROM_START.translation)
        way = np.array(self.world_from_hand(positions).translation) - start
        far = max(float(np.linalg.norm(way)), 1e-9)
        slopes = -(way / far) @ self.jacobian(positions)[:3]
        return self.report(Clearances(np.array([ROOM_M - far]), slopes[None]))


def walled(report: Reported = lambda found: found) -> WalledArm:
    arm = WalledArm(read_arm("pa10"), PERIOD_S)
    arm.report = report  # type: ignore[method-assign]
    return arm


def led_away(arm: WalledArm, seconds: float = 4.0) -> tuple[float, list[frozenset[Reason]]]:
    """Lead a hand out of its room; return how far it came, and why it was held in each period."""
    controller, holding = Controller(arm), []
    away = shifted_and_turned(WORLD_FROM_OBJECT, np.array([0.0, 0.1, 0.05, 0.0, 0.0, 0.0]))
    while arm.time_s < seconds:
        controller.see(None, FakeEstimate(arm.time_s, away))
        command = controller.command(arm.state(), GOAL_FROM_OBJECT)
        holding.append(command.holding)
        arm.command(command.velocities)
    hand = arm.world_from_hand(arm.state().positions)
    return float(
        np.linalg.norm(np.subtract(hand.translation, WORLD_FROM_START.translation))
    ), holding


def test_a_hand_is_held_while_the_distances_of_its_parts_are_unknown() -> None:
    far, holding = led_away(walled())
    assert 0.02 < far < ROOM_M and holding[-1] == frozenset()
    for unknown in (
        lambda found: Clearances(found.distances * np.nan, found.slopes),
        lambda found: Clearances(found.distances, found.slopes * np.nan),
        lambda found: Clearances(-np.inf * np.ones(1), found.slopes),
    ):
        far, holding = led_away(walled(unknown), 2.0)
        assert far < 1e-6
        assert holding[-1] == {Reason.BAD_STATE}


def test_a_hand_brakes_when_distances_become_unknown_and_goes_on_when_they_are_back() -> None:
    arm = walled()

    def report(found: Clearances) -> Clearances:
        lost = 1.3 < arm.time_s < 1.8
        return Clearances(found.distances * (np.nan if lost else 1.0), found.slopes)

    arm.report = report  # type: ignore[method-assign]
    far, holding = led_away(arm)
    assert 0.02 < far < ROOM_M
    assert {Reason.BAD_STATE} in holding and holding[-1] == frozenset()


def test_parts_that_are_infinitely_far_away_do_not_hold_the_hand() -> None:
    def report(found: Clearances) -> Clearances:
        slopes = np.concatenate([found.slopes, found.slopes * np.nan])
        return Clearances(np.append(found.distances, np.inf), slopes)

    far, holding = led_away(walled(report))
    assert 0.02 < far < ROOM_M and holding[-1] == frozenset()


@pytest.mark.parametrize(
    ("report", "words"),
    [
        (lambda _: None, r"must return servoid\.servo\.Clearances, but returned NoneType; if no"),
        (
            lambda found: Clearances(np.ones(2), found.slopes),
            r"distances of shape \(2,\) and slopes of shape \(1, 10\); .* \(K,\) and \(K, 10\)",
        ),
        (
            lambda found: Clearances(found.distances, found.slopes[:, :7]),
            r"slopes of shape \(1, 7\); .* with a slope for each of the 10 joints",
        ),
    ],
    ids=["nothing", "other counts", "fewer joints"],
)
def test_distances_that_cannot_be_used_are_refused_in_words(report: Reported, words: str) -> None:
    with pytest.raises(ServoError, match=words):
        led_away(walled(report))


def test_a_shape_without_distances_is_refused_before_the_arm_moves() -> None:
    class Own(SerialArm):
        solid = 5

    with pytest.raises(ServoError, match=r"Arm\.solid must have a method clearances, .* is int"):
        Controller(Own(read_arm("pa10"), PERIOD_S))


@pytest.mark.parametrize("given", [None, np.eye(4)], ids=["nothing", "a matrix"])
def test_a_hand_whose_pose_is_none_is_refused_in_words(given: Any) -> None:
    class Own(SerialArm):
        def world_from_hand(self, positions: Floats) -> Any:
            return given if self.is_made else super().world_from_hand(positions)

        is_made = False

    arm = Own(read_arm("pa10"), PERIOD_S)
    controller, state = Controller(arm), arm.state()
    arm.is_made = True
    words = r"Arm\.world_from_hand must return a servoid\.pose\.Pose, but returned .*Pose\(matrix\)"
    for ask in (
        lambda: controller.rest(state),
        lambda: controller.go_to(state, Pose.identity(), np.zeros(3)),
    ):
        with pytest.raises(ServoError, match=words):
            ask()
