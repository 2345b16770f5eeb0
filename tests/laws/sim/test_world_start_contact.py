"""Laws of an arm that would start in contact: it is refused, unless parts are only drawn so."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from known_arms import UR5E

from servoid.errors import SimError
from servoid.sim.world import ArmSettings, CameraSettings, ObjectSettings, World, WorldSettings

SMALL = CameraSettings(size_px=(64, 48), samples=1, moments=1, rate_hz=1.0)
SENTENCE = re.compile(
    r"the arm would start in contact: (.+) and (.+) intersect by ([\d.]+) mm; (.+)$"
)


def world_with(arm: ArmSettings, ahead: float = 0.545, name: str = "ellipsoid") -> World:
    thing = ObjectSettings(name=name, hand_from_object=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, ahead))
    return World(
        WorldSettings(arm=arm, object=thing, background="plain", cameras=SMALL, ideal=True)
    )


def refused(arm: ArmSettings, ahead: float = 0.545, name: str = "ellipsoid") -> re.Match[str]:
    with pytest.raises(SimError) as caught:
        world_with(arm, ahead, name)
    found = SENTENCE.search(str(caught.value))
    assert found is not None, str(caught.value)
    return found


def of_file(folder: Path, *start: float) -> ArmSettings:
    known = replace(UR5E, start=start)
    path = folder / "arm.urdf"
    path.write_text(known.urdf)
    return known.settings(str(path))


@pytest.mark.parametrize("name", ["mug", "drill", "bottle", "ellipsoid"])
def test_an_object_in_the_hand_is_refused_with_both_and_how_deep_they_intersect(name: str) -> None:
    found = refused(ArmSettings(), -0.05, name)
    assert {found[1], found[2]} == {"the hand", "the object"}
    assert 20.0 < float(found[3]) < 60.0
    assert "object.hand_from_object" in found[4]


def test_an_arm_in_the_floor_is_refused(tmp_path: Path) -> None:
    found = refused(of_file(tmp_path, 0.2, 0.6, 0.6, -0.8, 1.77, 1.57))
    assert "the floor or a wall" in found.groups()
    assert float(found[3]) > 300.0
    assert "arm.start" in found[4]


def test_an_arm_folded_into_itself_is_refused(tmp_path: Path) -> None:
    found = refused(of_file(tmp_path, 0.2, -1.57, -3.0, 2.3, 3.0, 2.8))
    assert {found[1], found[2]} == {"'ur2'", "the hand"}
    assert 50.0 < float(found[3]) < 70.0


def test_a_joint_that_is_drawn_in_its_base_is_no_contact() -> None:
    world = world_with(ArmSettings())
    start = world.arm.state().positions
    for _ in range(60):
        world.arm.command(np.zeros(len(start)))
    assert world.contact_force == 0.0


def test_an_object_that_grazes_the_arm_by_less_than_a_millimetre_is_not_refused() -> None:
    deep, free = -0.05, 0.2
    for _ in range(12):
        middle = 0.5 * (deep + free)
        try:
            world_with(ArmSettings(), middle, "mug")
        except SimError as error:
            found = SENTENCE.search(str(error))
            assert found is not None and float(found[3]) > 0.999
            deep = middle
        else:
            free = middle
    world, force = world_with(ArmSettings(), free, "mug"), 0.0
    for _ in range(60):
        world.arm.command(np.zeros(len(world.arm.joints.names)))
        force = max(force, world.contact_force)
    assert force < 100.0


def test_cameras_that_cannot_turn_to_the_object_start_within_their_limits() -> None:
    world = world_with(ArmSettings(), 0.0, "drill")
    positions, joints = world.arm.state().positions, world.arm.joints
    assert np.all((joints.lower <= positions) & (positions <= joints.upper))
    world.arm.command(np.zeros(len(positions)))
    assert not world.arm.state().stopped
