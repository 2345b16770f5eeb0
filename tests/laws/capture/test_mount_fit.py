"""How a camera is mounted follows from motions of the rig and what the camera saw of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from servoid.capture.mount_fit import (
    Predicted,
    fitted_mount,
    fitted_scale,
    refined_mount,
    refined_scale,
    seen_motion,
)
from servoid.pose import Pose

NUMBERS = st.lists(st.floats(-0.5, 0.5), min_size=6, max_size=6)


def motions_of(rig_from_camera: Pose, twists: list[list[float]]) -> list[tuple[Pose, Pose]]:
    """Return motions of a rig, and what its camera sees of them."""
    rig = [Pose.exp(twist) for twist in twists]
    return [(one, rig_from_camera.inverse() @ one @ rig_from_camera) for one in rig]


@given(st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6), st.integers(0, 1000))
def test_a_mount_is_found_from_motions_about_several_axes(numbers: list[float], seed: int) -> None:
    mount = Pose.exp(numbers)
    twists = np.random.default_rng(seed).uniform(-0.5, 0.5, (4, 6)).tolist()
    found = fitted_mount(motions_of(mount, twists))
    assert found is not None
    assert np.abs((mount.inverse() @ found).log()).max() < 1e-6


@given(NUMBERS, st.floats(0.1, 10.0))
def test_the_scale_of_translations_is_found(numbers: list[float], scale: float) -> None:
    mount = Pose.exp(numbers)
    twists = [[0.1, 0.2, -0.3, 0.0, 0.1, 0.0], [0.2, 0.0, 0.1, 0.3, 0.0, 0.0]]
    wrong = [
        (Pose.from_parts(np.array(rig.translation) / scale, rig.quaternion), seen)
        for rig, seen in motions_of(mount, twists)
    ]
    assert fitted_scale(wrong, mount) == pytest.approx(scale)


def test_motions_about_one_axis_and_too_few_of_them_determine_no_mount() -> None:
    about_one = [[0.1 * k, 0.2, 0.0, 0.0, 0.2 * k, 0.0] for k in range(1, 6)]
    assert fitted_mount(motions_of(Pose.identity(), about_one)) is None
    assert fitted_mount(motions_of(Pose.identity(), [[0.1] * 6, [0.0, 0, 0, 0.2, 0, 0.1]])) is None
    assert fitted_scale([], Pose.identity()) is None


def test_how_a_camera_moved_is_seen_beside_what_moves_otherwise() -> None:
    rng = np.random.default_rng(0)
    motion = Pose.exp([0.05, -0.02, 0.1, 0.1, -0.2, 0.05])
    points = rng.uniform((-0.5, -0.5, 1.0), (0.5, 0.5, 2.0), (60, 3))
    rays = motion.inverse().transform(points)
    rays[:20] += rng.uniform(-0.2, 0.2, (20, 3))
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    found = seen_motion(points, rays, 1e-3)
    assert found is not None and np.abs((motion.inverse() @ found).log()).max() < 1e-4
    assert seen_motion(points, rng.permutation(rays), 1e-3) is None


def predicted(mount: Pose, scale: float, seed: int) -> list[Predicted]:
    """Return what a camera sees of motions whose translations are told too short by a scale.

    A fifth of it moves by itself.
    """
    rng = np.random.default_rng(seed)
    seen = []
    for _ in range(4):
        rig = Pose.exp(rng.uniform(-0.3, 0.3, 6))
        points = rng.uniform((-0.5, -0.5, 1.0), (0.5, 0.5, 2.0), (50, 3))
        rays = (mount.inverse() @ rig.inverse() @ mount).transform(points)
        rays[:10] += rng.uniform(-0.3, 0.3, (10, 3))
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        told = Pose.from_parts(np.array(rig.translation) / scale, rig.quaternion)
        seen.append(Predicted(told, points, rays))
    return seen


@given(st.integers(0, 100))
def test_a_mount_and_a_scale_that_are_nearly_right_are_refined_beside_what_moves(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mount = Pose.exp(rng.uniform(-1.0, 1.0, 6))
    start = mount @ Pose.exp(rng.uniform(-0.03, 0.03, 6))
    found = refined_mount(predicted(mount, 1.0, seed), start, 0.003)
    assert np.abs((mount.inverse() @ found).log()).max() < 1e-3
    assert refined_scale(predicted(mount, 1.2, seed), mount, 1.15, 0.003) == pytest.approx(
        1.2, rel=1e-3
    )


@given(st.integers(0, 100), st.lists(st.floats(-4.0, 4.0), min_size=6, max_size=6))
def test_from_far_away_some_mount_is_found(seed: int, far: list[float]) -> None:
    seen = predicted(Pose.identity(), 1.0, seed)
    for start in (Pose.exp(far), Pose.from_parts((1e3, -1e3, 1e3), (0.5, 0.5, -0.5, 0.5))):
        found = refined_mount(seen, start, 0.003)
        assert np.isfinite(found.matrix()).all()
        assert np.isfinite(refined_scale(seen, start, 1e-3, 0.003))
