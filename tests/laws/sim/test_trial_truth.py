import numpy as np
import pytest

from servoid.pose import Pose
from servoid.servo import spun_like
from servoid.sim.trial.truth import Truth
from servoid.sim.world import ObjectSettings, World, WorldSettings

OBJECT_FROM_BODY = Pose.exp([0.003, 0.001, -0.002, 0.1, -0.2, 0.3])
SLIPPED = Pose.exp([0.0, 0.0, 0.0, 0.0, 0.7, 0.0])
TILTED = Pose.exp([0.0, 0.0, 0.0, 0.02, 0.0, -0.03])


def world_with(name: str) -> World:
    pytest.importorskip("mujoco")
    return World(WorldSettings(object=ObjectSettings(name=name), background="plain", ideal=True))


def turn_between(one: Pose, other: Pose) -> float:
    return float(np.linalg.norm((one.inverse() @ other).log()[3:]))


@pytest.mark.parametrize("name", ["ellipsoid", "plain_bottle"])
def test_a_slipped_spin_that_nobody_could_see_is_no_error(name: str) -> None:
    world = world_with(name)
    truth = Truth(world, OBJECT_FROM_BODY)
    believed = world.world_from_object_at(0.0) @ SLIPPED @ OBJECT_FROM_BODY
    np.testing.assert_allclose(
        truth.at(0.0, believed).matrix(), believed.matrix(), rtol=0.0, atol=1e-12
    )


@pytest.mark.parametrize("name", ["ellipsoid", "plain_bottle"])
def test_a_tilt_beside_the_spin_remains_an_error(name: str) -> None:
    world = world_with(name)
    truth = Truth(world, OBJECT_FROM_BODY)
    believed = world.world_from_object_at(0.0) @ TILTED @ SLIPPED @ OBJECT_FROM_BODY
    assert turn_between(truth.at(0.0, believed), believed) == pytest.approx(
        turn_between(Pose.identity(), TILTED), rel=1e-3
    )


def test_a_spin_that_can_be_seen_is_an_error() -> None:
    world = world_with("bottle")
    truth = Truth(world, OBJECT_FROM_BODY)
    believed = world.world_from_object_at(0.0) @ SLIPPED @ OBJECT_FROM_BODY
    assert turn_between(truth.at(0.0, believed), believed) == pytest.approx(0.7)


def test_without_a_belief_the_truth_is_that_of_the_simulation() -> None:
    world = world_with("ellipsoid")
    expected = world.world_from_object_at(0.0) @ OBJECT_FROM_BODY
    assert np.array_equal(Truth(world, OBJECT_FROM_BODY).at(0.0, None).matrix(), expected.matrix())


@pytest.mark.parametrize("seed", range(5))
def test_of_all_spins_the_nearest_one_is_taken(seed: int) -> None:
    random = np.random.default_rng(seed)
    pose, other = (Pose.exp(random.normal(size=6).tolist()) for _ in range(2))
    axis = random.normal(size=3)
    axis /= np.linalg.norm(axis)
    nearest = turn_between(spun_like(pose, other, axis), other)
    for angle in np.linspace(-np.pi, np.pi, 100):
        spun = pose @ Pose.exp([0.0, 0.0, 0.0, *(angle * axis)])
        assert turn_between(spun, other) >= nearest - 1e-9
