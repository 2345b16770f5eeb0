"""The ray-caster's noise, moments, light and textures."""

import numpy as np
import pytest
from numpy.typing import NDArray
from ray_scenes import (
    BEHIND_LENS,
    HERE,
    LENSES,
    PINHOLE,
    RADII,
    SIZE_PX,
    SKEW,
    WHITE,
    cluttered,
    depth_of,
    grey_wall,
    image_of,
    linear,
    posed,
)
from scipy.spatial.transform import Rotation

from servoid._native import Lens, Lighting, Paint, Scene
from servoid.pose.exact import Floats


@pytest.mark.parametrize("lens", LENSES, ids=("pinhole", "bent", "fisheye"))
def test_the_same_image_comes_from_any_number_of_threads(lens: Lens) -> None:
    scene, visuals = cluttered()
    images = [
        image_of(scene, visuals, lens, samples=2, noise=3.0, seed=4, threads=threads)
        for threads in (1, 2, 3, 0)
    ]
    for image in images[1:]:
        np.testing.assert_array_equal(images[0], image)


def test_noise_has_the_deviation_that_was_asked_for_and_no_mean() -> None:
    scene, visuals = grey_wall()
    still = image_of(scene, visuals)
    assert still.std(axis=(0, 1)).max() == 0.0
    for sigma in (1.0, 6.0):
        noise = image_of(scene, visuals, noise=sigma, seed=1) - still
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
    scene, visuals = grey_wall()
    one, two, other = (image_of(scene, visuals, noise=4.0, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, two)
    still = image_of(scene, visuals)
    shared = np.corrcoef((one - still).ravel(), (other - still).ravel())[0, 1]
    assert abs(shared) < 0.02


def test_two_moments_give_the_mean_of_two_still_images() -> None:
    scene, _ = grey_wall()
    scene.add_box((0.1, 0.1, 0.1), Paint(color=(0.1, 0.6, 0.2)))
    wall = [*HERE[:4], 0.0, 0.0, 1.0]
    before, after = ([wall, [*HERE[:4], x, 0.0, 0.6]] for x in (-0.04, 0.04))
    stills = [linear(image_of(scene, visuals, samples=2)) for visuals in (before, after)]
    both = scene.render(
        lens=PINHOLE,
        world_from_lens=np.array([HERE, HERE]),
        world_from_visual=np.array([before, after]),
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
    scene, visuals = cluttered()
    moving = np.tile(HERE, (4, 1))
    moving[:, 4] = [0.0, 0.004, 0.008, 0.012]
    sharp = image_of(scene, visuals, samples=2)
    blurred = scene.render(
        lens=PINHOLE,
        world_from_lens=moving,
        world_from_visual=np.tile(visuals, (4, 1, 1)),
        lighting=Lighting(toward=BEHIND_LENS),
        samples=2,
    ).astype(np.float64)
    assert np.abs(np.diff(blurred, axis=1)).mean() < 0.8 * np.abs(np.diff(sharp, axis=1)).mean()


# Light.


def test_a_brighter_lamp_makes_a_brighter_image() -> None:
    scene, visuals = cluttered()
    dim, bright = (
        image_of(scene, visuals, lighting=Lighting(toward=BEHIND_LENS, key=(x, x, x)))
        for x in (0.2, 0.5)
    )
    assert (bright >= dim).all()
    assert bright.mean() > dim.mean() + 3.0
    exposed = image_of(scene, visuals, lighting=Lighting(toward=BEHIND_LENS, exposure=2.0))
    assert exposed.mean() > image_of(scene, visuals).mean() + 10.0
    np.testing.assert_array_equal(image_of(scene, visuals, lighting=Lighting(exposure=0.0)), 0.0)


def test_a_facing_surface_has_the_colour_of_lamp_times_paint() -> None:
    """Lambert's law: the cosine of the angle between normal and lamp."""
    scene = Scene()
    scene.add_plane((9.0, 9.0), Paint(color=(0.9, 0.5, 0.2)))
    dark = {"sky": (0.0, 0.0, 0.0), "bounce": (0.0, 0.0, 0.0), "key": (0.8, 0.7, 1.0)}
    for angle in (0.0, 30.0, 60.0):
        toward = (np.sin(np.radians(angle)), 0.0, -np.cos(np.radians(angle)))
        image = image_of(
            scene, [*HERE[:4], 0.0, 0.0, 1.0], lighting=Lighting(toward=toward, **dark)
        )
        expected = np.array([0.72, 0.35, 0.2]) * np.cos(np.radians(angle))
        np.testing.assert_allclose(linear(image), np.broadcast_to(expected, image.shape), atol=5e-3)


def looking_down(height: float) -> Floats:
    """Return the pose of a lens over the world's origin: u along x, v against y."""
    return np.array([[0.0, 1.0, 0.0, 0.0, 0.0, 0.0, height]])


def test_shade_falls_where_the_lamp_is_hidden() -> None:
    scene = Scene()
    scene.add_plane((1.0, 1.0), WHITE)
    scene.add_box((0.05, 0.05, 0.05), WHITE)
    poses = np.array([[HERE, (*HERE[:4], 0.0, 0.0, 0.2)]])
    # The lamp stands at 45 degrees over +x, so that the shade falls by the height towards -x.
    image = scene.render(
        lens=PINHOLE,
        world_from_lens=looking_down(1.0),
        world_from_visual=poses,
        lighting=Lighting(toward=(1.0, 0.0, 1.0)),
        samples=1,
    )[..., 1].astype(float)
    depth, numbers = scene.depth(
        lens=PINHOLE, world_from_lens=looking_down(1.0)[0], world_from_visual=poses[0]
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


def test_a_visual_does_not_shade_its_own_lit_side() -> None:
    for add in (
        lambda scene: scene.add_ellipsoid(RADII, WHITE),
        lambda scene: scene.add_capsule(0.05, 0.07, WHITE),
        lambda scene: scene.add_cylinder(0.05, 0.07, WHITE),
        lambda scene: scene.add_box((0.07, 0.04, 0.05), WHITE),
    ):
        scene = Scene()
        add(scene)
        bare = Lighting(toward=(0.0, 0.0, -1.0), sky=(0, 0, 0), bounce=(0, 0, 0), key=(1, 1, 1))
        image = image_of(scene, SKEW, lighting=bare)
        _, numbers = depth_of(scene, SKEW)
        inner = (numbers == 0) & (np.roll(numbers, 1, 0) == 0) & (np.roll(numbers, -1, 0) == 0)
        inner &= (np.roll(numbers, 1, 1) == 0) & (np.roll(numbers, -1, 1) == 0)
        assert image[inner].min() > 20.0


def test_a_glossy_ball_has_a_highlight_half_way_to_the_lamp() -> None:
    lamp = np.array([0.6, -0.5, -1.0]) / np.linalg.norm([0.6, -0.5, -1.0])
    bare = Lighting(toward=lamp, sky=(0, 0, 0), bounce=(0, 0, 0), key=(0.5, 0.5, 0.5))
    balls = []
    for gloss in (0.0, 0.8):
        scene = Scene()
        scene.add_ellipsoid((0.1, 0.1, 0.1), Paint(color=(0.2, 0.2, 0.2), gloss=gloss))
        balls.append(image_of(scene, [*HERE[:4], 0.0, 0.0, 0.6], lighting=bare)[..., 0])
    v, u = np.unravel_index(np.argmax(linear(balls[1]) - linear(balls[0])), balls[0].shape)
    ray = PINHOLE.rays(np.array([[u, v]], dtype=np.float64))[0]
    t = ray[2] * 0.6 - np.sqrt((ray[2] * 0.6) ** 2 - (0.36 - 0.01))
    normal = (ray * t - [0.0, 0.0, 0.6]) / 0.1
    middle = (lamp - ray) / np.linalg.norm(lamp - ray)
    assert normal @ middle > 0.998


def test_the_background_is_lighter_above() -> None:
    scene = Scene()
    level = posed((-90.0, 0.0, 0.0), (0.0, 0.0, 0.0))[None]
    image = image_of(scene, np.zeros((0, 7)), world_from_lens=level).mean(axis=(1, 2))
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
        scene = Scene()
        scene.add_plane((0.1, 0.1), Paint(color=(1, 1, 1), texture=quarters(), repeat=repeat))
        image = image_of(scene, pose, lighting=FULL)
        texture = np.tile(quarters(), (parts, parts, 1))
        for x in (-0.08, -0.03, 0.03, 0.08):
            for y in (-0.08, -0.03, 0.03, 0.08):
                row, column = ((np.array([y, x]) / 0.2 + 0.5) * 32 * parts).astype(int)
                seen = color_at(image, np.array([x, y, 0.5]))
                np.testing.assert_allclose(seen, texture[row, column], atol=1.0)


def test_a_texture_goes_round_an_ellipsoid_and_from_its_top_down() -> None:
    scene = Scene()
    scene.add_ellipsoid((0.1, 0.1, 0.1), Paint(color=(1, 1, 1), texture=quarters()))
    # The ball's z points up, its x away from the lens, its y to the left.
    pose = np.array([0.5, 0.5, -0.5, 0.5, 0.0, 0.0, 0.6])
    turn = Rotation.from_quat(pose[[1, 2, 3, 0]])
    image = image_of(scene, pose, lighting=FULL)
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
    scene = Scene()
    scene.add_mesh(corners, faces, Paint(color=(1, 1, 1), texture=quarters()), places)
    image = image_of(scene, pose, lighting=FULL)
    for x in (-0.05, 0.05):
        for y in (-0.05, 0.05):
            row, column = ((np.array([y, x]) / 0.2 + 0.5) * 32).astype(int)
            np.testing.assert_allclose(
                color_at(image, np.array([x, y, 0.5])), quarters()[row, column], atol=1.0
            )
    scene = Scene()
    colors = np.array([[10, 200, 90]] * 4, dtype=np.uint8)
    scene.add_mesh(corners, faces, WHITE, colors=colors)
    seen = color_at(image_of(scene, pose, lighting=FULL), np.array([0.01, 0.02, 0.5]))
    np.testing.assert_allclose(seen, [10, 200, 90], atol=1.0)


def test_more_samples_make_edges_smooth_and_leave_the_rest() -> None:
    scene = Scene()
    scene.add_ellipsoid((0.08, 0.08, 0.08), WHITE)
    pose = [*HERE[:4], 0.0, 0.0, 0.5]
    lamp = Lighting(toward=BEHIND_LENS, sky=(0.0, 0.0, 0.0))
    one, four, exact = (image_of(scene, pose, lighting=lamp, samples=n)[..., 0] for n in (1, 4, 8))
    assert np.abs(four - exact).mean() < 0.4 * np.abs(one - exact).mean()
