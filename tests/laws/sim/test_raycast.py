"""The ray-caster's depth against closed forms, silhouettes of bodies, and itself."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from ray_scenes import (
    BEHIND_LENS,
    FLAT,
    HERE,
    LENSES,
    PINHOLE,
    RADII,
    SIZE_PX,
    SKEW,
    WHITE,
    cluttered,
    depth_of,
    image_of,
    posed,
    rays_of,
    sphere_mesh,
)
from scipy.spatial.transform import Rotation
from tiers import tiered

from servoid._native import Lens, Lighting, Scene
from servoid.camera import Camera
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.shape import Body

# Depth, by another way: how far inside a shape a point is, walked along each ray.


def inside_ellipsoid(p: Floats) -> Floats:
    return 1.0 - np.linalg.norm(p / RADII, axis=-1)


def inside_capsule(p: Floats) -> Floats:
    axis = np.clip(p[..., 2], -0.07, 0.07)
    return 0.05 - np.linalg.norm(p - axis[..., None] * [0.0, 0.0, 1.0], axis=-1)


def inside_cylinder(p: Floats) -> Floats:
    return np.minimum(0.05 - np.hypot(p[..., 0], p[..., 1]), 0.07 - np.abs(p[..., 2]))


def inside_box(p: Floats) -> Floats:
    return (np.array([0.07, 0.04, 0.05]) - np.abs(p)).min(axis=-1)


SOLIDS: dict[str, tuple[Callable[[Scene], int], Callable[[Floats], Floats]]] = {
    "ellipsoid": (lambda scene: scene.add_ellipsoid(RADII, WHITE), inside_ellipsoid),
    "capsule": (lambda scene: scene.add_capsule(0.05, 0.07, WHITE), inside_capsule),
    "cylinder": (lambda scene: scene.add_cylinder(0.05, 0.07, WHITE), inside_cylinder),
    "box": (lambda scene: scene.add_box((0.07, 0.04, 0.05), WHITE), inside_box),
}


def walked(inside: Callable[[Floats], Floats], pose: Floats, rays: Floats) -> Floats:
    """Return where rays first come inside, by small steps and halving; NaN where never."""
    turn = Rotation.from_quat(pose[[1, 2, 3, 0]])
    start, along = turn.inv().apply(-pose[4:]), turn.inv().apply(rays)

    def is_in(t: Floats) -> NDArray[np.bool_]:
        return inside(start + along * t[:, None]) > 0.0

    steps = np.arange(0.3, 0.75, 0.0005)
    first = np.full(len(rays), np.nan)
    for t in steps:
        entered = np.isnan(first) & is_in(np.full(len(rays), t))
        first[entered] = t
    low, high = first - 0.0005, first.copy()
    for _ in range(30):
        middle = 0.5 * (low + high)
        entered = is_in(middle)
        high = np.where(entered, middle, high)
        low = np.where(entered, low, middle)
    return high


@pytest.mark.parametrize("lens", tiered(LENSES[::-1]), ids=("fisheye", "bent", "pinhole"))
@pytest.mark.parametrize("name", SOLIDS)
def test_depth_is_where_a_walk_along_the_ray_comes_inside(name: str, lens: Lens) -> None:
    add, inside = SOLIDS[name]
    scene = Scene()
    add(scene)
    depth, numbers = depth_of(scene, SKEW, lens)
    rays = rays_of(lens)
    expected = (walked(inside, SKEW, rays) * rays[:, 2]).reshape(depth.shape)
    both = ~np.isnan(expected) & ~np.isnan(depth)
    assert both.sum() > 100
    # Steps may jump over a corner that is thinner than they are.
    assert (np.isnan(expected) != np.isnan(depth)).sum() <= 8
    assert np.abs(expected - depth)[both].max() < 1e-5
    np.testing.assert_array_equal(numbers == 0, ~np.isnan(depth))


def test_depth_of_a_rectangle_is_that_of_its_plane_inside_its_edges() -> None:
    scene = Scene()
    scene.add_plane((0.12, 0.05), WHITE)
    depth, _ = depth_of(scene, SKEW)
    rays = rays_of(PINHOLE)
    turn = Rotation.from_quat(SKEW[[1, 2, 3, 0]])
    normal = turn.apply([0.0, 0.0, 1.0])
    t = (normal @ SKEW[4:]) / (rays @ normal)
    at = turn.inv().apply(rays * t[:, None] - SKEW[4:])
    is_in = (np.abs(at[:, 0]) < 0.12) & (np.abs(at[:, 1]) < 0.05)
    expected = np.where(is_in, t * rays[:, 2], np.nan).reshape(depth.shape)
    np.testing.assert_allclose(depth, expected, atol=1e-5)


def test_depth_of_a_mesh_is_that_of_all_its_triangles() -> None:
    rng = np.random.default_rng(5)
    corners = rng.uniform(-0.12, 0.12, (60, 3))
    faces = np.array([rng.choice(60, 3, replace=False) for _ in range(80)])
    scene = Scene()
    scene.add_mesh(corners, faces, WHITE)
    depth, _ = depth_of(scene, SKEW)
    rays = rays_of(PINHOLE)
    placed = Rotation.from_quat(SKEW[[1, 2, 3, 0]]).apply(corners) + SKEW[4:]
    best = np.full(len(rays), np.inf)
    for a, b, c in placed[faces]:
        # Cramer's rule on a + u (b - a) + v (c - a) = t ray.
        matrix = np.stack(np.broadcast_arrays(b - a, c - a, -rays), axis=-1)
        u, v, t = np.linalg.solve(matrix, np.broadcast_to(-a, rays.shape)[..., None])[..., 0].T
        best = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), np.minimum(best, t), best)
    expected = np.where(np.isfinite(best), best * rays[:, 2], np.nan).reshape(depth.shape)
    differ = ~np.isclose(depth, expected, rtol=0.0, atol=1e-5, equal_nan=True)
    # On an edge, rounding decides.
    assert differ.sum() <= 3
    assert np.isfinite(depth).sum() > 2000


def test_a_mesh_of_a_ball_looks_like_the_ball() -> None:
    corners, faces = sphere_mesh(60)
    ball, mesh = Scene(), Scene()
    ball.add_ellipsoid(RADII, WHITE)
    mesh.add_mesh(corners * RADII, faces, WHITE)
    (one, _), (two, _) = depth_of(ball, SKEW), depth_of(mesh, SKEW)
    both = np.isfinite(one) & np.isfinite(two)
    assert (np.isfinite(one) != np.isfinite(two)).sum() < 20
    assert np.abs(one - two)[both].max() < 3e-3
    assert np.median(np.abs(one - two)[both]) < 1e-4
    drawn = np.abs(image_of(ball, SKEW) - image_of(mesh, SKEW))
    assert np.median(drawn[both]) <= 1.0
    assert np.percentile(drawn[both], 98) <= 6.0


@settings(max_examples=25, deadline=None)
@given(
    turn=st.tuples(*[st.floats(-180.0, 180.0)] * 3),
    place=st.tuples(st.floats(-0.15, 0.15), st.floats(-0.1, 0.1), st.floats(0.35, 0.9)),
    radii=st.tuples(*[st.floats(0.02, 0.1)] * 3),
)
def test_an_ellipsoid_covers_the_pixels_of_its_silhouette(
    turn: tuple[float, float, float],
    place: tuple[float, float, float],
    radii: tuple[float, float, float],
) -> None:
    pose = posed(turn, place)
    scene = Scene()
    scene.add_ellipsoid(radii, WHITE)
    body = Body(
        world_from_object=Pose.from_parts(list(pose[4:]), list(pose[:4])),
        centers=np.zeros((1, 3)),
        radii=np.array([radii]),
        rotations=np.array([[1.0, 0.0, 0.0, 0.0]]),
    )
    silhouette = body.silhouette(Camera(**FLAT), Pose.identity()) > 0
    _, numbers = depth_of(scene, pose)
    assert (silhouette != (numbers == 0)).sum() <= 1


@pytest.mark.parametrize("lens", LENSES, ids=("pinhole", "bent", "fisheye"))
def test_what_a_pixel_shows_projects_to_it(lens: Lens) -> None:
    scene = Scene()
    scene.add_ellipsoid((0.3, 0.2, 0.1), WHITE)
    depth, _ = depth_of(scene, posed((20.0, 30.0, 0.0), (0.0, 0.0, 0.5)), lens)
    v, u = np.nonzero(np.isfinite(depth))
    rays = rays_of(lens).reshape(*depth.shape, 3)[v, u]
    points = rays * (depth[v, u] / rays[:, 2])[:, None]
    assert len(v) > 2000
    np.testing.assert_allclose(lens.project(points), np.stack([u, v], 1), atol=1e-5)


def test_what_stands_in_front_hides() -> None:
    scene = Scene()
    scene.add_box((0.05, 0.05, 0.05), WHITE)
    scene.add_ellipsoid((0.05, 0.05, 0.05), WHITE)
    near, far = (*HERE[:4], 0.0, 0.0, 0.4), (*HERE[:4], 0.0, 0.0, 0.8)
    middle = SIZE_PX[1] // 2, SIZE_PX[0] // 2
    assert depth_of(scene, [near, far])[1][middle] == 0
    assert depth_of(scene, [far, near])[1][middle] == 1
    assert depth_of(scene, [(*HERE[:4], 0.3, 0.0, 0.4), far])[1][middle] == 1
    assert depth_of(scene, [near, far])[1][0, 0] == -1


def test_the_world_can_move_with_everything_in_it() -> None:
    scene, visuals = cluttered()
    world = Pose.from_parts([0.3, -0.2, 0.1], list(posed((0.0, 0.0, 50.0), (0, 0, 0))[:4]))

    def moved(pose: Floats) -> Floats:
        pose_in = world @ Pose.from_parts(list(pose[4:]), list(pose[:4]))
        return np.array([*pose_in.quaternion, *pose_in.translation])

    toward = np.array(BEHIND_LENS)
    turned = Rotation.from_euler("z", 50.0, degrees=True).apply(toward)
    here = image_of(scene, visuals, lighting=Lighting(toward=toward))
    there = image_of(
        scene,
        np.array([moved(pose) for pose in visuals]),
        world_from_lens=np.array([moved(np.array(HERE))]),
        lighting=Lighting(toward=turned),
    )
    assert np.percentile(np.abs(here - there), 99) <= 1.0
