"""Before an arm moves, its Jacobian is compared with its poses, and its hand with its workspace."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from servo_loop import PERIOD_S

from servoid.errors import ServoError
from servoid.pose import Floats, Pose
from servoid.servo import Clearances, Controller, ServoSettings
from servoid.servo.settings import SafetySettings
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm

Change = Callable[[Floats, Floats], Floats]


class Slipped(SerialArm):
    """An arm whose program makes a slip in its Jacobian, or in its pose."""

    change: Change | None = None
    is_inverse = False

    def world_from_hand(self, positions: Floats) -> Pose:
        pose = super().world_from_hand(positions)
        return pose.inverse() if self.is_inverse else pose

    def jacobian(self, positions: Floats) -> Floats:
        found = super().jacobian(positions)
        if self.change is None:
            return found
        turn = super().world_from_hand(positions).matrix()[:3, :3]
        return self.change(found, turn)


def slipped(change: Change | None = None, *, is_inverse: bool = False) -> Slipped:
    arm = Slipped(read_arm(), PERIOD_S)
    arm.change, arm.is_inverse = change, is_inverse
    return arm


def begin(arm: SerialArm, settings: ServoSettings | None = None) -> None:
    """Ask for a first command."""
    controller = Controller(arm, settings)
    controller.go_to(arm.state(), arm.world_from_hand(arm.state().positions), np.zeros(3))
    controller.rest(arm.state())


def in_hand(jacobian: Floats, turn: Floats) -> Floats:
    return np.concatenate([turn.T @ jacobian[:3], turn.T @ jacobian[3:]])


SLIPS: dict[str, tuple[Change, str]] = {
    "rows": (lambda found, _: found[[3, 4, 5, 0, 1, 2]], "rows of jacobian are angular first"),
    "frame": (in_hand, "in the hand's frame, and not in the world's"),
    "both": (lambda j, turn: in_hand(j, turn)[[3, 4, 5, 0, 1, 2]], "hand's frame, and angular"),
    "order": (
        lambda found, _: np.concatenate([found[:, 6::-1], found[:, 7:]], axis=1),
        "the columns of jacobian are in reversed order",
    ),
    "sign": (lambda found, _: -found, "jacobian has the opposite sign"),
    "unit": (
        lambda found, _: np.concatenate([1000.0 * found[:3], found[3:]]),
        "jacobian is in millimetres",
    ),
    "degrees": (lambda found, _: np.radians(found), "jacobian is per degree"),
    "one": (
        lambda found, _: found * np.where(np.arange(10) == 3, -1.0, 1.0),
        r"with e1 the hand moves by .* a radian by world_from_hand, and by .* by jacobian",
    ),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_jacobian_that_contradicts_the_poses_is_refused_and_the_slip_named(slip: str) -> None:
    change, words = SLIPS[slip]
    with pytest.raises(ServoError, match=f"the hand would run away: .*{words}"):
        begin(slipped(change))


def test_an_inverse_pose_of_the_hand_is_refused() -> None:
    with pytest.raises(ServoError, match="world_from_hand returns hand_from_world, the inverse"):
        begin(slipped(is_inverse=True))


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_jacobian_of_a_right_arm_is_never_refused(seed: int) -> None:
    arm = SerialArm(read_arm(), PERIOD_S)
    random = np.random.default_rng(seed)
    within = random.uniform(np.maximum(arm.joints.lower, -3.0), np.minimum(arm.joints.upper, 3.0))
    anywhere = SafetySettings(workspace_lower=(-9.0,) * 3, workspace_upper=(9.0,) * 3)
    begin(SerialArm(read_arm(), PERIOD_S, within.tolist()), ServoSettings(safety=anywhere))
    # A robot's model that is calibrated differs by a little.
    changed = slipped(lambda found, _: found * random.uniform(0.99, 1.01, found.shape))
    begin(changed)


def test_poses_that_do_not_depend_on_the_joints_asked_for_cannot_be_compared(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    arm = SerialArm(read_arm(), PERIOD_S)
    pose = arm.world_from_hand(arm.state().positions)
    monkeypatch.setattr(arm, "world_from_hand", lambda _: pose)
    begin(arm)


@pytest.mark.parametrize(("aside_m", "is_refused"), [(0.02, False), (0.3, True)])
def test_a_hand_far_outside_of_its_workspace_is_refused_before_it_moves(
    aside_m: float, is_refused: bool
) -> None:
    arm = SerialArm(read_arm(), PERIOD_S)
    x = arm.world_from_hand(arm.state().positions).translation[0]
    box = SafetySettings(workspace_lower=(x + aside_m, -5.0, -5.0), workspace_upper=(5.0, 5.0, 5.0))
    if not is_refused:
        begin(arm, ServoSettings(safety=box))
        return
    with pytest.raises(ServoError, match=r"0\.30 m outside of the box .* in the world's frame"):
        begin(arm, ServoSettings(safety=box))


def test_distances_of_an_arms_parts_in_millimetres_are_refused() -> None:
    class Shape:
        def __init__(self, scale: float) -> None:
            self.scale = scale

        def clearances(self, positions: Floats, within: float) -> Clearances:
            near = 0.4 * self.scale < within
            slopes = 0.3 * self.scale * np.ones((1, len(positions)))
            return Clearances(np.array([0.4 * self.scale])[:near], slopes[:near])

    arm = slipped()
    arm.solid = Shape(1.0)  # type: ignore[attr-defined]
    begin(arm)
    arm.solid = Shape(1000.0)  # type: ignore[attr-defined]
    with pytest.raises(ServoError, match=r"slopes of up to 300 m a radian: .* in millimetres"):
        begin(arm)
