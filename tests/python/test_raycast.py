"""The ray-caster against closed forms, against silhouettes of bodies, and against itself."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from servoid._native import Lens, Lighting, Paint, Stage
from servoid.errors import PoseError, ServoidError, SimError
from servoid.observe import Camera
from servoid.pose import Pose
from servoid.shape import Body

Floats = NDArray[np.float64]
SIZE_PX = (160, 120)
FLAT = {"size_px": SIZE_PX, "focal_px": (150.0, 152.0), "center_px": (81.0, 58.5)}
PINHOLE = Lens(model="pinhole", **FLAT)
BENT = Lens(model="brown_conrady", distortion=(-0.25, 0.06, 2e-3, -1e-3), **FLAT)
FISHEYE = Lens(
    model="kannala_brandt",
    distortion=(0.03, 0.01, -0.002, 0.0003),
    size_px=SIZE_PX,
    focal_px=(60.0, 60.0),
    center_px=(79.0, 60.0),
)
LENSES = (PINHOLE, BENT, FISHEYE)
HERE = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
RADII = (0.09, 0.06, 0.04)
WHITE = Paint(color=(1.0, 1.0, 1.0))
# The tests' lens stands at the origin and looks straight up.
BEHIND_LENS = (0.4, -0.4, -0.8)


def posed(turn_deg: tuple[float, float, float], place: tuple[float, float, float]) -> Floats:
    """Return a pose, (7,), from turns about x, y and z."""
    x, y, z, w = Rotation.from_euler("xyz", turn_deg, degrees=True).as_quat()
    return np.array([w, x, y, z, *place])


SKEW = posed((25.0, -40.0, 70.0), (0.02, -0.03, 0.5))


def image_of(stage: Stage, things: object, lens: Lens = PINHOLE, **changes: object) -> Floats:
    """Draw things at one moment, seen from the world's origin."""
    things = np.array([things], dtype=np.float64).reshape(1, stage.count, 7)
    known = {"world_from_lens": np.array([HERE]), "lighting": Lighting(toward=BEHIND_LENS), "samples": 1}
    drawn = stage.render(lens=lens, world_from_thing=things, **{**known, **changes})
    return drawn.astype(np.float64)


def depth_of(
    stage: Stage, things: object, lens: Lens = PINHOLE
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    things = np.array(things, dtype=np.float64).reshape(stage.count, 7)
    return stage.depth(lens=lens, world_from_lens=np.array(HERE), world_from_thing=things)


def rays_of(lens: Lens) -> Floats:
    """Return the directions of all pixels, (H * W, 3), NaN where the lens sees nothing."""
    u, v = np.meshgrid(np.arange(lens.size_px[0]), np.arange(lens.size_px[1]))
    return lens.rays(np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float64))


def linear(levels: Floats) -> Floats:
    share = levels / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def sphere_mesh(rings: int) -> tuple[Floats, NDArray[np.int64]]:
    """Return corners of a ball of radius 1 and triangles between them."""
    down, turn = np.meshgrid(
        np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2.0 * np.pi, 2 * rings, endpoint=False)
    )
    corners = np.stack([np.sin(down) * np.cos(turn), np.sin(down) * np.sin(turn), np.cos(down)], 2)
    index = np.arange(corners[..., 0].size).reshape(2 * rings, rings + 1)
    a, b = index[:, :-1].ravel(), index[:, 1:].ravel()
    beside = np.roll(index, -1, axis=0)
    c, d = beside[:, :-1].ravel(), beside[:, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    return corners.reshape(-1, 3), faces


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


SOLIDS: dict[str, tuple[Callable[[Stage], int], Callable[[Floats], Floats]]] = {
    "ellipsoid": (lambda stage: stage.add_ellipsoid(RADII, WHITE), inside_ellipsoid),
    "capsule": (lambda stage: stage.add_capsule(0.05, 0.07, WHITE), inside_capsule),
    "cylinder": (lambda stage: stage.add_cylinder(0.05, 0.07, WHITE), inside_cylinder),
    "box": (lambda stage: stage.add_box((0.07, 0.04, 0.05), WHITE), inside_box),
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


@pytest.mark.parametrize("lens", LENSES, ids=("pinhole", "bent", "fisheye"))
@pytest.mark.parametrize("name", SOLIDS)
def test_depth_is_where_a_walk_along_the_ray_comes_inside(name: str, lens: Lens) -> None:
    add, inside = SOLIDS[name]
    stage = Stage()
    add(stage)
    depth, numbers = depth_of(stage, SKEW, lens)
    rays = rays_of(lens)
    expected = (walked(inside, SKEW, rays) * rays[:, 2]).reshape(depth.shape)
    both = ~np.isnan(expected) & ~np.isnan(depth)
    assert both.sum() > 100
    # Steps may jump over a corner that is thinner than they are.
    assert (np.isnan(expected) != np.isnan(depth)).sum() <= 8
    assert np.abs(expected - depth)[both].max() < 1e-5
    np.testing.assert_array_equal(numbers == 0, ~np.isnan(depth))


def test_depth_of_a_rectangle_is_that_of_its_plane_inside_its_edges() -> None:
    stage = Stage()
    stage.add_plane((0.12, 0.05), WHITE)
    depth, _ = depth_of(stage, SKEW)
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
    stage = Stage()
    stage.add_mesh(corners, faces, WHITE)
    depth, _ = depth_of(stage, SKEW)
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
    ball, mesh = Stage(), Stage()
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
    stage = Stage()
    stage.add_ellipsoid(radii, WHITE)
    body = Body(
        world_from_object=Pose.from_parts(list(pose[4:]), list(pose[:4])),
        centers=np.zeros((1, 3)),
        radii=np.array([radii]),
        rotations=np.array([[1.0, 0.0, 0.0, 0.0]]),
    )
    silhouette = body.silhouette(Camera(**FLAT), Pose.identity()) > 0
    _, numbers = depth_of(stage, pose)
    assert (silhouette != (numbers == 0)).sum() <= 1


@pytest.mark.parametrize("lens", LENSES, ids=("pinhole", "bent", "fisheye"))
def test_what_a_pixel_shows_projects_to_it(lens: Lens) -> None:
    stage = Stage()
    stage.add_ellipsoid((0.3, 0.2, 0.1), WHITE)
    depth, _ = depth_of(stage, posed((20.0, 30.0, 0.0), (0.0, 0.0, 0.5)), lens)
    v, u = np.nonzero(np.isfinite(depth))
    rays = rays_of(lens).reshape(*depth.shape, 3)[v, u]
    points = rays * (depth[v, u] / rays[:, 2])[:, None]
    assert len(v) > 2000
    np.testing.assert_allclose(lens.project(points), np.stack([u, v], 1), atol=1e-5)


def test_what_stands_in_front_hides() -> None:
    stage = Stage()
    stage.add_box((0.05, 0.05, 0.05), WHITE)
    stage.add_ellipsoid((0.05, 0.05, 0.05), WHITE)
    near, far = (*HERE[:4], 0.0, 0.0, 0.4), (*HERE[:4], 0.0, 0.0, 0.8)
    middle = SIZE_PX[1] // 2, SIZE_PX[0] // 2
    assert depth_of(stage, [near, far])[1][middle] == 0
    assert depth_of(stage, [far, near])[1][middle] == 1
    assert depth_of(stage, [(*HERE[:4], 0.3, 0.0, 0.4), far])[1][middle] == 1
    assert depth_of(stage, [near, far])[1][0, 0] == -1


def test_the_world_can_move_with_everything_in_it() -> None:
    stage, things = cluttered()
    world = Pose.from_parts([0.3, -0.2, 0.1], list(posed((0.0, 0.0, 50.0), (0, 0, 0))[:4]))

    def moved(pose: Floats) -> Floats:
        pose_in = world @ Pose.from_parts(list(pose[4:]), list(pose[:4]))
        return np.array([*pose_in.quaternion, *pose_in.translation])

    toward = np.array(BEHIND_LENS)
    turned = Rotation.from_euler("z", 50.0, degrees=True).apply(toward)
    here = image_of(stage, things, lighting=Lighting(toward=toward))
    there = image_of(
        stage,
        np.array([moved(pose) for pose in things]),
        world_from_lens=np.array([moved(np.array(HERE))]),
        lighting=Lighting(toward=turned),
    )
    assert np.percentile(np.abs(here - there), 99) <= 1.0


# Determinism, noise, moments.


def cluttered() -> tuple[Stage, Floats]:
    """Return one thing of each kind, and their poses before a lens at the origin."""
    rng = np.random.default_rng(9)
    texture = rng.integers(0, 256, (32, 48, 3), dtype=np.uint8)
    painted = Paint(texture=texture, repeat=(2.0, 1.5), gloss=0.5)
    stage = Stage()
    stage.add_plane((0.8, 0.8), Paint(texture=texture, repeat=(5.0, 5.0)))
    stage.add_ellipsoid(RADII, painted)
    stage.add_capsule(0.03, 0.05, Paint(color=(0.8, 0.2, 0.1), gloss=0.2))
    stage.add_cylinder(0.04, 0.05, painted)
    stage.add_box((0.04, 0.05, 0.03), painted)
    corners, faces = sphere_mesh(12)
    colors = rng.integers(0, 256, (len(corners), 3), dtype=np.uint8)
    stage.add_mesh(corners * 0.05, faces, WHITE, colors=colors)
    poses = [
        posed((60.0, 10.0, 0.0), (0.0, 0.0, 0.9)),
        posed((10.0, 40.0, 0.0), (-0.12, -0.1, 0.55)),
        posed((70.0, 0.0, 20.0), (0.1, -0.1, 0.5)),
        posed((50.0, 30.0, 0.0), (0.12, 0.08, 0.5)),
        posed((20.0, 30.0, 40.0), (-0.1, 0.08, 0.5)),
        posed((0.0, 0.0, 0.0), (0.0, 0.0, 0.45)),
    ]
    return stage, np.array(poses)


@pytest.mark.parametrize("lens", LENSES, ids=("pinhole", "bent", "fisheye"))
def test_the_same_image_comes_from_any_number_of_threads(lens: Lens) -> None:
    stage, things = cluttered()
    images = [
        image_of(stage, things, lens, samples=2, noise=3.0, seed=4, threads=threads)
        for threads in (1, 2, 3, 0)
    ]
    for image in images[1:]:
        np.testing.assert_array_equal(images[0], image)


def grey_wall() -> tuple[Stage, Floats]:
    stage = Stage()
    stage.add_plane((9.0, 9.0), Paint(color=(0.5, 0.5, 0.5)))
    return stage, np.array([[*HERE[:4], 0.0, 0.0, 1.0]])


def test_noise_has_the_deviation_that_was_asked_for_and_no_mean() -> None:
    stage, things = grey_wall()
    still = image_of(stage, things)
    assert still.std(axis=(0, 1)).max() == 0.0
    for sigma in (1.0, 6.0):
        noise = image_of(stage, things, noise=sigma, seed=1) - still
        offset = noise.mean(axis=(0, 1))
        # The still image is rounded too.
        assert np.abs(offset).max() < 0.5 + 4.0 * sigma / np.sqrt(noise[..., 0].size)
        noise -= offset
        # Rounding to bytes adds a twelfth to the variance.
        assert abs(noise.std() / np.sqrt(sigma**2 + 1.0 / 12.0) - 1.0) < 0.02
        assert abs(np.mean((noise / noise.std()) ** 4) - 3.0) < 0.15
        channels = noise.reshape(-1, 3)
        assert np.abs(np.corrcoef(channels.T) - np.eye(3)).max() < 0.03
        beside = np.corrcoef(noise[:, :-1].ravel(), noise[:, 1:].ravel())[0, 1]
        assert abs(beside) < 0.02


def test_noise_is_another_with_another_seed_and_the_same_with_the_same() -> None:
    stage, things = grey_wall()
    one, two, other = (image_of(stage, things, noise=4.0, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, two)
    still = image_of(stage, things)
    shared = np.corrcoef((one - still).ravel(), (other - still).ravel())[0, 1]
    assert abs(shared) < 0.02


def test_two_moments_give_the_mean_of_two_still_images() -> None:
    stage, _ = grey_wall()
    stage.add_box((0.1, 0.1, 0.1), Paint(color=(0.1, 0.6, 0.2)))
    wall = [*HERE[:4], 0.0, 0.0, 1.0]
    before, after = ([wall, [*HERE[:4], x, 0.0, 0.6]] for x in (-0.04, 0.04))
    stills = [linear(image_of(stage, things, samples=2)) for things in (before, after)]
    both = stage.render(
        lens=PINHOLE,
        world_from_lens=np.array([HERE, HERE]),
        world_from_thing=np.array([before, after]),
        lighting=Lighting(toward=BEHIND_LENS),
        samples=2,
    )

    def even(image: Floats) -> NDArray[np.bool_]:
        """Say where a pixel and its neighbours are alike."""
        shifted = [np.roll(image, shift, axis) for shift in (-1, 1) for axis in (0, 1)]
        return np.max([np.abs(image - other).max(axis=2) for other in shifted], axis=0) == 0.0

    calm = even(stills[0]) & even(stills[1])
    mean = 0.5 * (stills[0] + stills[1])
    blurred = calm & (np.abs(stills[0] - stills[1]).max(axis=2) > 0.05)
    assert blurred.sum() > 200
    # One grey level is at most 0.009 of linear light.
    assert np.abs(linear(both.astype(np.float64)) - mean)[calm].max() < 0.01


def test_a_moving_lens_blurs_what_stands_still() -> None:
    stage, things = cluttered()
    moving = np.tile(HERE, (4, 1))
    moving[:, 4] = [0.0, 0.004, 0.008, 0.012]
    sharp = image_of(stage, things, samples=2)
    blurred = stage.render(
        lens=PINHOLE,
        world_from_lens=moving,
        world_from_thing=np.tile(things, (4, 1, 1)),
        lighting=Lighting(toward=BEHIND_LENS),
        samples=2,
    ).astype(np.float64)
    assert np.abs(np.diff(blurred, axis=1)).mean() < 0.8 * np.abs(np.diff(sharp, axis=1)).mean()


# Light.


def test_a_brighter_lamp_makes_a_brighter_image() -> None:
    stage, things = cluttered()
    dim, bright = (
        image_of(stage, things, lighting=Lighting(toward=BEHIND_LENS, key=(x, x, x)))
        for x in (0.2, 0.5)
    )
    assert (bright >= dim).all()
    assert bright.mean() > dim.mean() + 3.0
    exposed = image_of(stage, things, lighting=Lighting(toward=BEHIND_LENS, exposure=2.0))
    assert exposed.mean() > image_of(stage, things).mean() + 10.0
    np.testing.assert_array_equal(image_of(stage, things, lighting=Lighting(exposure=0.0)), 0.0)


def test_a_facing_surface_has_the_colour_of_lamp_times_paint() -> None:
    """Lambert's law: the cosine of the angle between normal and lamp."""
    stage = Stage()
    stage.add_plane((9.0, 9.0), Paint(color=(0.9, 0.5, 0.2)))
    dark = {"sky": (0.0, 0.0, 0.0), "bounce": (0.0, 0.0, 0.0), "key": (0.8, 0.7, 1.0)}
    for angle in (0.0, 30.0, 60.0):
        toward = (np.sin(np.radians(angle)), 0.0, -np.cos(np.radians(angle)))
        image = image_of(
            stage, [*HERE[:4], 0.0, 0.0, 1.0], lighting=Lighting(toward=toward, **dark)
        )
        expected = np.array([0.72, 0.35, 0.2]) * np.cos(np.radians(angle))
        np.testing.assert_allclose(linear(image), np.broadcast_to(expected, image.shape), atol=5e-3)


def looking_down(height: float) -> Floats:
    """Return the pose of a lens over the world's origin: u along x, v against y."""
    return np.array([[0.0, 1.0, 0.0, 0.0, 0.0, 0.0, height]])


def test_shade_falls_where_the_lamp_is_hidden() -> None:
    stage = Stage()
    stage.add_plane((1.0, 1.0), WHITE)
    stage.add_box((0.05, 0.05, 0.05), WHITE)
    poses = np.array([[HERE, (*HERE[:4], 0.0, 0.0, 0.2)]])
    # The lamp stands at 45 degrees over +x, so that the shade falls by the height towards -x.
    image = stage.render(
        lens=PINHOLE,
        world_from_lens=looking_down(1.0),
        world_from_thing=poses,
        lighting=Lighting(toward=(1.0, 0.0, 1.0)),
        samples=1,
    )[..., 1].astype(float)
    depth, numbers = stage.depth(
        lens=PINHOLE, world_from_lens=looking_down(1.0)[0], world_from_thing=poses[0]
    )
    u, v = np.meshgrid(np.arange(SIZE_PX[0]), np.arange(SIZE_PX[1]))
    x, y = (u - 81.0) / 150.0 * depth, -(v - 58.5) / 152.0 * depth
    floor = numbers == 0
    # A point is in shade if its line to the lamp crosses the box, 0.15 to 0.25 m up.
    shade = floor & (x < -0.105) & (x > -0.295) & (np.abs(y) < 0.045)
    lit = floor & ((x > -0.095) | (x < -0.305) | (np.abs(y) > 0.055))
    assert shade.sum() > 150
    assert image[lit].min() == image[lit].max()
    assert image[shade].max() < image[lit].min() - 40.0


def test_a_thing_does_not_shade_its_own_lit_side() -> None:
    for add, _ in SOLIDS.values():
        stage = Stage()
        add(stage)
        bare = Lighting(toward=(0.0, 0.0, -1.0), sky=(0, 0, 0), bounce=(0, 0, 0), key=(1, 1, 1))
        image = image_of(stage, SKEW, lighting=bare)
        _, numbers = depth_of(stage, SKEW)
        inner = (numbers == 0) & (np.roll(numbers, 1, 0) == 0) & (np.roll(numbers, -1, 0) == 0)
        inner &= (np.roll(numbers, 1, 1) == 0) & (np.roll(numbers, -1, 1) == 0)
        assert image[inner].min() > 20.0


def test_a_glossy_ball_has_a_highlight_half_way_to_the_lamp() -> None:
    lamp = np.array([0.6, -0.5, -1.0]) / np.linalg.norm([0.6, -0.5, -1.0])
    bare = Lighting(toward=lamp, sky=(0, 0, 0), bounce=(0, 0, 0), key=(0.5, 0.5, 0.5))
    balls = []
    for gloss in (0.0, 0.8):
        stage = Stage()
        stage.add_ellipsoid((0.1, 0.1, 0.1), Paint(color=(0.2, 0.2, 0.2), gloss=gloss))
        balls.append(image_of(stage, [*HERE[:4], 0.0, 0.0, 0.6], lighting=bare)[..., 0])
    v, u = np.unravel_index(np.argmax(linear(balls[1]) - linear(balls[0])), balls[0].shape)
    ray = PINHOLE.rays(np.array([[u, v]], dtype=np.float64))[0]
    t = ray[2] * 0.6 - np.sqrt((ray[2] * 0.6) ** 2 - (0.36 - 0.01))
    normal = (ray * t - [0.0, 0.0, 0.6]) / 0.1
    middle = (lamp - ray) / np.linalg.norm(lamp - ray)
    assert normal @ middle > 0.998


def test_the_background_is_lighter_above() -> None:
    stage = Stage()
    level = posed((-90.0, 0.0, 0.0), (0.0, 0.0, 0.0))[None]
    image = image_of(stage, np.zeros((0, 7)), world_from_lens=level).mean(axis=(1, 2))
    assert (np.diff(image) <= 0.0).all()
    assert image[0] > image[-1] + 5.0


# Textures.


def quarters() -> NDArray[np.uint8]:
    """Return a texture of four colours, one in each quarter."""
    colors = np.array([[[250, 20, 20], [20, 250, 20]], [[20, 20, 250], [240, 240, 20]]], np.uint8)
    return np.repeat(np.repeat(colors, 16, axis=0), 16, axis=1)


FULL = Lighting(key=(0, 0, 0), sky=(1, 1, 1), bounce=(1, 1, 1))


def color_at(image: Floats, point: Floats) -> Floats:
    """Return the colour at which a point before the lens is seen."""
    u, v = PINHOLE.project(np.array([point], dtype=np.float64))[0].round().astype(int)
    return image[v, u]


def test_a_texture_lies_upright_on_a_plane_and_repeats() -> None:
    # The plane's x points to the right and its y up in the image.
    pose = posed((180.0, 0.0, 0.0), (0.0, 0.0, 0.5))
    for repeat, parts in (((1.0, 1.0), 1), ((2.0, 2.0), 2)):
        stage = Stage()
        stage.add_plane((0.1, 0.1), Paint(color=(1, 1, 1), texture=quarters(), repeat=repeat))
        image = image_of(stage, pose, lighting=FULL)
        texture = np.tile(quarters(), (parts, parts, 1))
        for x in (-0.08, -0.03, 0.03, 0.08):
            for y in (-0.08, -0.03, 0.03, 0.08):
                row, column = ((np.array([y, x]) / 0.2 + 0.5) * 32 * parts).astype(int)
                seen = color_at(image, np.array([x, y, 0.5]))
                np.testing.assert_allclose(seen, texture[row, column], atol=1.0)


def test_a_texture_goes_round_an_ellipsoid_and_from_its_top_down() -> None:
    stage = Stage()
    stage.add_ellipsoid((0.1, 0.1, 0.1), Paint(color=(1, 1, 1), texture=quarters()))
    # The ball's z points up, its x away from the lens, its y to the left.
    pose = np.array([0.5, 0.5, -0.5, 0.5, 0.0, 0.0, 0.6])
    turn = Rotation.from_quat(pose[[1, 2, 3, 0]])
    image = image_of(stage, pose, lighting=FULL)
    for y in (-1, 1):
        for z in (-1, 1):
            local = np.array([-0.7, 0.5 * y, 0.5 * z]) / np.linalg.norm([0.7, 0.5, 0.5])
            u = np.arctan2(local[1], local[0]) / (2.0 * np.pi) + 0.5
            v = np.arccos(local[2]) / np.pi
            seen = color_at(image, turn.apply(0.1 * local) + pose[4:])
            expected = quarters()[int(v * 32), int(u * 32)]
            np.testing.assert_allclose(seen, expected, atol=1.0)


def test_a_mesh_shows_its_texture_and_its_colours() -> None:
    corners = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    places = np.array([[0.0, 0.0], [1, 0], [1, 1], [0, 1]])
    pose = [*HERE[:4], 0.0, 0.0, 0.5]
    stage = Stage()
    stage.add_mesh(corners, faces, Paint(color=(1, 1, 1), texture=quarters()), places)
    image = image_of(stage, pose, lighting=FULL)
    for x in (-0.05, 0.05):
        for y in (-0.05, 0.05):
            row, column = ((np.array([y, x]) / 0.2 + 0.5) * 32).astype(int)
            np.testing.assert_allclose(
                color_at(image, np.array([x, y, 0.5])), quarters()[row, column], atol=1.0
            )
    stage = Stage()
    colors = np.array([[10, 200, 90]] * 4, dtype=np.uint8)
    stage.add_mesh(corners, faces, WHITE, colors=colors)
    seen = color_at(image_of(stage, pose, lighting=FULL), np.array([0.01, 0.02, 0.5]))
    np.testing.assert_allclose(seen, [10, 200, 90], atol=1.0)


def test_more_samples_make_edges_smooth_and_leave_the_rest() -> None:
    stage = Stage()
    stage.add_ellipsoid((0.08, 0.08, 0.08), WHITE)
    pose = [*HERE[:4], 0.0, 0.0, 0.5]
    lamp = Lighting(toward=BEHIND_LENS, sky=(0.0, 0.0, 0.0))
    one, four, exact = (image_of(stage, pose, lighting=lamp, samples=n)[..., 0] for n in (1, 4, 8))
    assert np.abs(four - exact).mean() < 0.4 * np.abs(one - exact).mean()


# What is refused.


def one_thing() -> Stage:
    stage = Stage()
    stage.add_ellipsoid(RADII, WHITE)
    return stage


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf"), 1e9])
def test_a_size_that_is_no_length_is_refused(bad: float) -> None:
    stage = Stage()
    for call in (
        lambda: stage.add_ellipsoid((0.1, bad, 0.1), WHITE),
        lambda: stage.add_capsule(bad, 0.1, WHITE),
        lambda: stage.add_cylinder(0.1, bad, WHITE),
        lambda: stage.add_box((0.1, 0.1, bad), WHITE),
        lambda: stage.add_plane((bad, 0.1), WHITE),
    ):
        with pytest.raises(SimError, match="must be a number of metres from"):
            call()
    assert stage.count == 0


CORNERS = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]])
FACE = np.array([[0, 1, 2]])


@pytest.mark.parametrize(
    ("vertices", "faces", "more", "words"),
    [
        (CORNERS, np.array([[0, 1, 3]]), {}, "names the vertices 0, 1, 3, but there are 3"),
        (CORNERS, np.array([[0, 1, -1]]), {}, "a negative one"),
        (CORNERS, np.zeros((0, 3), np.int64), {}, "0 were given"),
        (CORNERS * np.nan, FACE, {}, "vertex 0"),
        (CORNERS[:, :2], FACE, {}, r"vertices must have shape \(N, 3\)"),
        (CORNERS, FACE[0], {}, r"faces must have shape \(N, 3\)"),
        (CORNERS, FACE, {"colors": np.zeros((2, 3), np.uint8)}, "colors has 2 rows"),
        (CORNERS, FACE, {"texture_coordinates": np.zeros((4, 2))}, "has 4 rows"),
        (CORNERS, FACE, {"texture_coordinates": np.full((3, 2), np.nan)}, "has NaN"),
    ],
)
def test_a_mesh_that_cannot_be_is_refused(
    vertices: Floats, faces: NDArray[np.int64], more: dict[str, NDArray[np.uint8]], words: str
) -> None:
    with pytest.raises(ServoidError, match=words):
        Stage().add_mesh(vertices, faces, WHITE, **more)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"color": (0.5, 0.5, 1.5)}, "color is"),
        ({"color": (0.5, float("nan"), 0.5)}, "color is"),
        ({"gloss": -0.1}, "gloss is -0.1"),
        ({"repeat": (0.0, 1.0)}, "repeat is 0"),
        ({"texture": np.zeros((4, 4), np.uint8)}, r"texture must have shape \(H, W, 3\)"),
        ({"texture": np.zeros((4, 4, 4), np.uint8)}, r"texture must have shape \(H, W, 3\)"),
        ({"texture": np.zeros((0, 4, 3), np.uint8)}, "from 1 to"),
    ],
)
def test_a_paint_that_cannot_be_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(SimError, match=words):
        Paint(**changes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"toward": (0.0, 0.0, 0.0)}, "toward is"),
        ({"toward": (float("nan"), 0.0, 1.0)}, "toward is"),
        ({"key": (-0.1, 0.0, 0.0)}, "key is"),
        ({"sky": (0.1, float("inf"), 0.0)}, "sky is"),
        ({"exposure": -1.0}, "exposure is -1"),
    ],
)
def test_a_light_that_cannot_be_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(SimError, match=words):
        Lighting(**changes)


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"samples": 0}, SimError, "samples is 0"),
        ({"samples": 9}, SimError, "samples is 9"),
        ({"samples": -2}, SimError, "samples is 0"),
        ({"noise": -1.0}, SimError, "noise is -1"),
        ({"noise": float("nan")}, SimError, "noise is NaN"),
        ({"world_from_lens": np.array(HERE)}, SimError, r"must have shape \(N, 7\)"),
        ({"world_from_lens": np.tile(HERE, (2, 1))}, SimError, "2 poses and the things have 1"),
        ({"world_from_lens": np.full((1, 7), np.nan)}, PoseError, "NaN"),
        ({"world_from_thing": np.array([HERE])}, SimError, r"shape \(M, T, 7\)"),
        ({"world_from_thing": np.array([[HERE, HERE]])}, SimError, "2 poses of things, but the st"),
        ({"world_from_thing": np.full((1, 1, 7), np.nan)}, PoseError, "NaN"),
        ({"world_from_thing": np.zeros((1, 1, 7))}, PoseError, "length 1"),
        ({"world_from_thing": np.array([[[*HERE[:4], 0, 0, 1e6]]])}, SimError, "thing 0 stands"),
    ],
)
def test_an_image_that_cannot_be_is_refused(
    changes: dict[str, object], error: type[Exception], words: str
) -> None:
    known = {
        "lens": PINHOLE,
        "world_from_lens": np.array([HERE]),
        "world_from_thing": np.array([[HERE]]),
        "lighting": Lighting(),
    }
    with pytest.raises(error, match=words):
        one_thing().render(**{**known, **changes})


def test_more_moments_than_rays_are_refused() -> None:
    with pytest.raises(SimError, match="5 moments were given, but a pixel has only 4 rays"):
        one_thing().render(
            lens=PINHOLE,
            world_from_lens=np.tile(HERE, (5, 1)),
            world_from_thing=np.tile(HERE, (5, 1, 1)),
            lighting=Lighting(),
            samples=2,
        )


def test_depth_refuses_poses_of_the_wrong_shape() -> None:
    with pytest.raises(SimError, match=r"world_from_lens must have shape \(7,\)"):
        one_thing().depth(
            lens=PINHOLE, world_from_lens=np.array([HERE]), world_from_thing=np.array([HERE])
        )
    with pytest.raises(SimError, match="0 poses of things"):
        one_thing().depth(
            lens=PINHOLE, world_from_lens=np.array(HERE), world_from_thing=np.zeros((0, 7))
        )
