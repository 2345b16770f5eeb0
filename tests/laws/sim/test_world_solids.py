"""Laws of an arm that knows its shape: its parts keep off each other, and off the room."""

from pathlib import Path

import numpy as np
import pytest
from tiers import tiered

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from known_arms import PANDA, UR5E, KnownArm

from servoid._native import shifted_and_turned
from servoid.servo import Controller, Reason, RememberingArm, ServoSettings
from servoid.servo.arm import Shaped
from servoid.servo.settings import SafetySettings
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid.sim.world import ArmSettings, CameraSettings, World, WorldSettings

SMALL = CameraSettings(size_px=(160, 120), samples=1, moments=1)
LEAST = SafetySettings().least_clearance
TOO_NEAR = LEAST - 0.005
FAR = 0.4


def world_with(arm: ArmSettings | None = None) -> World:
    return World(WorldSettings(arm=arm or ArmSettings(), background="plain", cameras=SMALL))


def known(folder: Path, arm: KnownArm) -> ArmSettings:
    path = folder / "arm.urdf"
    path.write_text(arm.urdf)
    return arm.settings(str(path))


@pytest.mark.parametrize("arm", [None, UR5E, PANDA], ids=["pa10", "ur", "panda"])
def test_slopes_of_clearances_are_how_they_change(tmp_path: Path, arm: KnownArm | None) -> None:
    world = world_with(None if arm is None else known(tmp_path, arm))
    solid, positions = world.arm.solid, world.arm.state().positions
    random = np.random.default_rng(1)
    for _ in range(5):
        at = positions + random.uniform(-0.2, 0.2, len(positions))
        found = solid.clearances(at, FAR)
        assert len(found.distances) > 2
        step = 1e-6 * random.normal(size=len(at))
        after, before = (solid.clearances(at + sign * step, FAR) for sign in (1.0, -1.0))
        change = 0.5 * (after.distances - before.distances)
        # Flat ends may change the point that is nearest.
        off = np.abs(change - found.slopes @ step)
        assert np.median(off) < 1e-9 and np.mean(off < 1e-8) > 0.8


def brought_near(world: World, way: tuple[float, ...], *, watch: bool) -> tuple[float, set[Reason]]:
    """Lead the hand by a way (6,) in the world; return the least clearance, and what limited it."""
    arm = world.arm
    settings = ServoSettings(
        safety=SafetySettings(
            least_clearance=LEAST if watch else 0.0, workspace_lower=(-1.5, -1.5, -0.5)
        )
    )
    led = arm if watch else Shapeless(arm)
    controller = Controller(led, settings)
    start = arm.world_from_hand(arm.state().positions)
    goal = shifted_and_turned(start, np.array(way))
    least, reasons = np.inf, set()
    for _ in range(500):
        command = controller.go_to(arm.state(), goal, np.array([-2.0, 0.0, 0.5]))
        arm.command(command.velocities)
        distances = arm.solid.clearances(arm.state().positions, FAR).distances
        least = min(least, float(distances.min(initial=FAR)))
        reasons |= command.limiting
        if least < TOO_NEAR:
            break
    return least, reasons


class Shapeless:
    """An arm that does not know its shape."""

    def __init__(self, arm: object) -> None:
        self._arm = arm

    def __getattr__(self, name: str) -> object:
        if name == "solid":
            raise AttributeError(name)
        return getattr(self._arm, name)


FLOOR = (0.39, 0.0, -0.6, 0.0, 0.0, 0.0)
FOREARM = (0.0, 0.0, 0.0, 0.0, -2.2, 0.0)


@pytest.mark.parametrize("way", tiered([(FLOOR,), (FOREARM,)]), ids=["floor", "forearm"])
def test_parts_keep_their_clearance_from_each_other_and_the_floor(way: tuple[float, ...]) -> None:
    least, reasons = brought_near(world_with(), way, watch=True)
    assert least > LEAST - 0.002
    assert Reason.COLLISION in reasons
    # Without it the same goal brings them together.
    assert brought_near(world_with(), way, watch=False)[0] < TOO_NEAR


def test_an_arm_that_remembers_knows_the_shape_of_the_one_that_it_drives() -> None:
    world = world_with()
    assert RememberingArm(world.arm).solid is world.arm.solid
    plain = SerialArm(read_arm())
    assert not isinstance(plain, Shaped) and RememberingArm(plain).solid is None


def test_where_it_starts_an_arm_is_near_nothing() -> None:
    for background in ("plain", "cluttered"):
        arm = World(WorldSettings(background=background, cameras=SMALL)).arm
        found = arm.solid.clearances(arm.state().positions, FAR)
        assert len(found.distances) and found.distances.min() > 0.03
