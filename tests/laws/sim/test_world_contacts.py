"""Laws of contacts: what an arm hits, or what hits it, stops it until it is reset."""

from pathlib import Path

import numpy as np
import pytest
from tiers import tiered

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from known_arms import PANDA, UR5E

from servoid.errors import ServoError
from servoid.sim.world import CameraSettings, ObjectSettings, World, WorldSettings

SMALL = CameraSettings(size_px=(64, 48), samples=1, moments=1, rate_hz=1.0)
MOST_N = 400.0  # an arm of 35 kg at half a metre a second; measured against the floor: 126 N
REST = 3e-3  # rad/s: what is pushed a little creeps in dry friction by 1e-3


AHEAD = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.545)  # of the hand; by default it stands higher
COMING = "line:0.6@3s:-z"


def world_with(*, ideal: bool = True, seed: int = 1, thing: ObjectSettings | None = None) -> World:
    return World(
        WorldSettings(
            object=thing or ObjectSettings(name="mug"),
            background="plain",
            cameras=SMALL,
            ideal=ideal,
            seed=seed,
        )
    )


def driven(world: World, speeds: np.ndarray, seconds: float) -> float:
    """Tell the joints the same speeds for a while; return the greatest force of a contact."""
    force, end_s = 0.0, world.time_s + seconds
    while world.time_s < end_s:
        world.arm.command(speeds)
        force = max(force, world.contact_force)
    return force


def downwards(world: World, speed: float) -> np.ndarray:
    """Return joint speeds that lower the hand, at a speed in m/s."""
    jacobian = world.arm.jacobian(world.arm.state().positions)[:, : world.arm.joints.hand_count]
    down = np.linalg.pinv(jacobian) @ np.array([0.0, 0.0, -speed, 0.0, 0.0, 0.0])
    return np.append(down, np.zeros(len(world.arm.joints.names) - len(down)))


def within_stops(world: World) -> bool:
    joints, positions = world.arm.joints, world._servos.positions
    return bool(np.all((positions >= joints.lower) & (positions <= joints.upper)))


@pytest.mark.parametrize("ideal", [True, False], ids=["ideal", "laboratory"])
@pytest.mark.parametrize("speed", [0.1, 0.5])
def test_an_arm_that_is_driven_into_the_floor_stops_within_its_joints_limits(
    speed: float, ideal: bool
) -> None:
    world = world_with(ideal=ideal)
    velocities = downwards(world, speed)
    force = driven(world, velocities, 0.7 / speed + 2.0)
    assert world.arm.state().stopped
    assert 0.0 < force < MOST_N
    assert within_stops(world)
    # It is still told to go on, and does nothing.
    assert np.abs(world._servos.velocities).max() < REST
    before = world._servos.positions
    driven(world, velocities, 1.0)
    assert np.abs(world._servos.positions - before).max() < REST
    assert world.contact_force < 0.1 * MOST_N  # it has yielded


def test_after_a_stop_an_arm_moves_again_only_when_it_is_reset_at_rest() -> None:
    world = world_with()
    down = downwards(world, 0.3)
    while not world.arm.state().stopped:
        world.arm.command(down)
    with pytest.raises(ServoError, match="still moves"):
        world.arm.reset()
    height = world.world_from_hand_at(world.time_s).translation[2]
    driven(world, -down, 1.0)
    assert abs(world.world_from_hand_at(world.time_s).translation[2] - height) < 0.02
    world.arm.reset()
    driven(world, -down, 1.0)
    assert not world.arm.state().stopped
    assert world.world_from_hand_at(world.time_s).translation[2] > height + 0.1
    # What is in its way is still there.
    driven(world, down, 2.0)
    assert world.arm.state().stopped


@pytest.mark.parametrize("ideal", [True, False], ids=["ideal", "laboratory"])
def test_an_object_that_is_moved_into_the_hand_stops_the_arm_which_yields(ideal: bool) -> None:
    thing = ObjectSettings(name="mug", path=COMING, hand_from_object=AHEAD)
    world = world_with(ideal=ideal, thing=thing)
    world.start_path()
    force = driven(world, np.zeros(len(world.arm.joints.names)), 5.0)
    assert world.arm.state().stopped
    assert 0.0 < force < MOST_N
    assert within_stops(world)
    assert np.abs(world._servos.velocities).max() < REST


def test_an_object_that_passes_over_the_hand_touches_nothing() -> None:
    world = world_with(thing=ObjectSettings(name="mug", path=COMING))
    world.start_path()
    assert driven(world, np.zeros(len(world.arm.joints.names)), 4.0) == 0.0
    assert not world.arm.state().stopped


@pytest.mark.parametrize("seed", tiered(range(6)))
def test_the_errors_of_a_laboratory_stop_no_arm(seed: int) -> None:
    world = world_with(ideal=False, seed=seed)
    random, speed = np.random.default_rng(seed), world.arm.joints.speed
    for _ in range(12):
        velocities = 0.4 * speed * random.uniform(-1.0, 1.0, len(speed))
        if driven(world, velocities, 0.2) > 0.0:
            break  # it hit something
        # Its drives go on to learn what their model misses.
        assert not world._servos.protection.pushed
        assert not world.arm.state().stopped


@pytest.mark.parametrize("arm", tiered([UR5E, PANDA]), ids=["ur", "panda"])
def test_arms_of_files_stop_where_they_hit_themselves_or_the_floor(
    tmp_path: Path, arm: object
) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(arm.urdf)  # type: ignore[attr-defined]
    world = World(
        WorldSettings(
            arm=arm.settings(str(path)),  # type: ignore[attr-defined]
            background="plain",
            cameras=SMALL,
            ideal=True,
        )
    )
    forward = np.zeros(len(world.arm.joints.names))
    forward[1] = 0.4  # rad/s
    force = driven(world, forward, 8.0)
    assert world.arm.state().stopped
    assert 0.0 < force < MOST_N
    assert within_stops(world)
