"""Laws of physics that become unstable: an error says so, and from then on the arm rests."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from test_world_other_arms import MJCF

from servoid.errors import SimError
from servoid.servo import Controller, brought_to_rest
from servoid.sim.world import (
    ArmSettings,
    CameraSettings,
    ObjectSettings,
    PhysicsSettings,
    World,
    WorldSettings,
)

LIGHT = '<default><geom density="1"/>'
STEP_S = 0.05


@pytest.fixture
def struck(tmp_path: Path) -> World:
    """Return a world in which the object strikes an arm of almost no mass, in long steps."""
    path = tmp_path / "light.xml"
    path.write_text(MJCF.replace('armature="0.01"', 'armature="1e-9"').replace("<default>", LIGHT))
    ahead = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1)
    world = World(
        WorldSettings(
            arm=ArmSettings(name=str(path), mount="flange", mount_from_hand=ahead),
            object=ObjectSettings(name="bottle", path="line:0.6@0.05s:-z"),
            background="plain",
            cameras=CameraSettings(size_px=(64, 48), samples=1, moments=1, rate_hz=1.0),
            ideal=True,
            physics=PhysicsSettings(step_s=STEP_S, period_s=STEP_S),
        )
    )
    world.start_path()
    return world


def rest(world: World, seconds: float) -> None:
    end_s = world.time_s + seconds
    while world.time_s < end_s:
        world.arm.command(np.zeros(len(world.arm.joints.names)))


def test_physics_that_become_unstable_are_told_once_and_the_arm_stays_where_it_was(
    struck: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    told = r"unstable at \d\.\d+ s: joint 'j\d' .* lower world.physics.step_s, which is 0.05,"
    with pytest.raises(SimError, match=told):
        rest(struck, 4.0)
    ended_s = struck.time_s
    before = struck.arm.state()
    assert np.all(np.isfinite(before.positions)) and not before.velocities.any()
    rest(struck, 0.5)
    after = struck.arm.state()
    assert struck.time_s >= ended_s + 0.5
    np.testing.assert_array_equal(after.positions, before.positions)
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_the_error_is_what_ends_a_block_that_brings_the_arm_to_rest(struck: World) -> None:
    controller = Controller(struck.arm)
    with (
        pytest.raises(SimError, match="became unstable"),
        brought_to_rest(struck.arm, controller),
    ):
        rest(struck, 4.0)
