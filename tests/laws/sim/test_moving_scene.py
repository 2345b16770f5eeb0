"""The moving scene: what its images show is computed again here, from its poses and its mesh."""

from collections.abc import Iterator
from itertools import pairwise

import cv2
import numpy as np
import pytest
from body_measures import overlap
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from servoid.sim import MovingScene, Scenario
from servoid.sim.samples import motion, room, scene, snail
from servoid.sim.samples.surface import outer_mesh

Array = NDArray[np.float64]
VERTICES, FACES = outer_mesh(snail.PARTS)
LAMP, ABOVE, BELOW = 2.05, 1.04, 0.33  # light of a world, its three colours together


@pytest.fixture(scope="module")
def toy() -> MovingScene:
    return MovingScene(Scenario(size="small"))


def project(made: MovingScene, index: int, offset: float = 0.0) -> tuple[Array, Array]:
    """Return the pixels (N, 2) of the mesh's vertices, and their places (N, 3), in a camera."""
    pose = made.left_from_object(index)
    places = VERTICES @ pose[:3, :3].T + pose[:3, 3] - np.array([offset, 0.0, 0.0])
    width, height = made.camera.size_px
    center = np.array([(width - 1) / 2, (height - 1) / 2])
    return 580.0 / 640.0 * width * places[:, :2] / places[:, 2:] + center, places


def silhouette(made: MovingScene, index: int) -> NDArray[np.bool_]:
    """Fill the mesh's triangles, four times finer; where parts meet, a gap may stay open."""
    fine = 4
    pixels, _ = project(made, index)
    width, height = made.camera.size_px
    drawn = np.zeros((fine * height, fine * width), np.uint8)
    for triangle in np.rint(fine * (pixels[FACES] + 0.5) - 0.5).astype(np.int32):
        cv2.fillConvexPoly(drawn, triangle, 255)
    drawn = cv2.morphologyEx(drawn, cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8))
    return cv2.resize(drawn, (width, height), interpolation=cv2.INTER_AREA) > 127


def normals() -> Array:
    """Return the vertices' unit normals (N, 3), from the triangles around each."""
    corners = VERTICES[FACES]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros_like(VERTICES)
    for corner in range(3):
        np.add.at(total, FACES[:, corner], faces)
    return total / np.linalg.norm(total, axis=1, keepdims=True)


def seen_well(made: MovingScene, index: int, offset: float = 0.0) -> NDArray[np.bool_]:
    """Say which vertices a camera sees: turned to it, and nothing of the toy before them."""
    pixels, places = project(made, index, offset)
    turned = normals() @ made.left_from_object(index)[:3, :3].T
    slant = -(turned * places).sum(axis=1) / np.linalg.norm(places, axis=1)
    cells = np.rint(pixels / 4.0).astype(int)
    nearest: dict[tuple[int, int], float] = {}
    keys = [(int(u), int(v)) for u, v in cells]
    for key, depth in zip(keys, places[:, 2], strict=True):
        nearest[key] = min(depth, nearest.get(key, np.inf))
    front = np.array(
        [
            depth
            < 0.012 + min(nearest.get((u + i, v + j), 9.0) for i in (-1, 0, 1) for j in (-1, 0, 1))
            for (u, v), depth in zip(keys, places[:, 2], strict=True)
        ]
    )
    return front & (slant > 0.6)


def sample(image: NDArray[np.uint8], pixels: Array) -> Array:
    """Read an image between its pixels, (N, channels)."""
    u, v = pixels.T.astype(np.float32)
    return cv2.remap(image, u, v, cv2.INTER_LINEAR)[:, 0].astype(float)


def best_shifts(first: Array, image: NDArray[np.uint8], pixels: Array) -> Array:
    """Return by how much pixels (2,) must move for an image to agree best with known colours."""
    steps = np.arange(-1.0, 1.01, 0.1)
    found = []
    for axis in np.eye(2):
        apart = [np.abs(sample(image, pixels + step * axis) - first).mean() for step in steps]
        fitted = np.polyfit(steps, apart, 2)
        found.append(-fitted[1] / (2.0 * fitted[0]))
    return np.array(found)


def rows(moved: Iterator[Array]) -> tuple[Array, Array]:
    """Return steps in metres and turns in degrees from pose to pose."""
    poses = list(moved)
    pairs = list(pairwise(poses))
    steps = [np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in pairs]
    turns = [Rotation.from_matrix(a[:3, :3].T @ b[:3, :3]).magnitude() for a, b in pairs]
    return np.array(steps), np.degrees(turns)


@pytest.mark.parametrize("index", [0, 25, 60, 97])
def test_the_toy_is_where_the_truth_says(toy: MovingScene, index: int) -> None:
    assert overlap(silhouette(toy, index), toy.look(index).mask > 0) > 0.97


@pytest.mark.parametrize("index", [0, 40])
def test_both_images_show_a_point_of_the_toy_in_the_same_colour(
    toy: MovingScene, index: int
) -> None:
    left, right = toy.look(index).images
    seen = seen_well(toy, index) & seen_well(toy, index, scene.BASELINE)
    colors = sample(left, project(toy, index)[0][seen])
    pixels = project(toy, index, scene.BASELINE)[0][seen]
    apart = np.abs(sample(right, pixels) - colors).mean(axis=1)
    assert seen.sum() > 300
    assert np.median(apart) < 8.0
    assert np.abs(best_shifts(colors, right, pixels)).max() < 0.12


def test_the_pattern_sticks_to_the_toy_from_image_to_image(toy: MovingScene) -> None:
    seen = seen_well(toy, 10) & seen_well(toy, 14)
    colors = sample(toy.look(10).images[0], project(toy, 10)[0][seen])
    later = toy.look(14).images[0]
    assert np.abs(best_shifts(colors, later, project(toy, 14)[0][seen])).max() < 0.12


def test_brightness_follows_how_a_point_faces_the_light() -> None:
    made = MovingScene(Scenario(size="small", plain=True, one_camera=True))
    expected, measured = [], []
    for index in (0, 40):
        turn = made.room_from_object(index)[:3, :3]
        turned = turn @ normals().T
        facing = np.maximum(np.array(room.TOWARD_LAMP) @ turned, 0.0)
        upward = 0.5 + 0.5 * turned[2]
        expected.append(LAMP * facing + ABOVE * upward + BELOW * (1.0 - upward))
        levels = sample(made.look(index).images[0], project(made, index)[0])
        measured.append(((levels / 255.0) ** 2.2).sum(axis=1))
    # The flank of the shell, on which nothing else throws its shade.
    flank = np.linalg.norm((VERTICES - snail.PARTS[1].center)[:, [0, 2]], axis=1) < 0.04
    seen = seen_well(made, 0) & seen_well(made, 40) & flank
    assert seen.sum() > 100
    change = np.abs(np.log(expected[1] / expected[0]))[seen]
    assert np.median(change) > 0.15
    share = np.array(measured)[:, seen] / np.array(expected)[:, seen]
    away = np.abs(share / np.median(share) - 1.0)
    assert np.median(away) < 0.03
    assert np.quantile(away, 0.9) < 0.15  # of those, some shine


@pytest.mark.extended
@pytest.mark.parametrize("seed", [0, 1])
def test_the_occluder_hides_a_third_of_the_toy_and_is_gone_at_both_ends(seed: int) -> None:
    made = MovingScene(Scenario(size="small", seed=seed, occluder=True, one_camera=True))
    hidden = [made.look(index).hidden for index in (0, *range(44, 78, 4), len(made) - 1)]
    assert hidden[0] == hidden[-1] == 0.0
    assert 0.25 < max(hidden) < 0.45


def test_what_the_occluder_hides_is_not_in_the_mask() -> None:
    made = MovingScene(Scenario(size="small", occluder=True, one_camera=True))
    free = MovingScene(Scenario(size="small", one_camera=True))
    look = made.look(60)
    left = np.count_nonzero(look.mask) / np.count_nonzero(free.look(60).mask)
    assert left == pytest.approx(1.0 - look.hidden, abs=0.02)


def test_the_same_scenario_gives_the_same_bits_in_any_order() -> None:
    scenario = Scenario(size="small", seed=4, occluder=True)
    first, again = MovingScene(scenario), MovingScene(scenario)
    again.look(7)
    for one, other in zip(first.look(3).images, again.look(3).images, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.extended
def test_another_seed_gives_another_way_and_another_room() -> None:
    one, other = (MovingScene(Scenario(size="small", seed=seed)) for seed in (0, 1))
    assert np.abs(one.left_from_object(9) - other.left_from_object(9)).max() > 0.01
    apart = np.abs(one.look(9).images[0].astype(int) - other.look(9).images[0])
    assert apart[:60].mean() > 5.0  # above the toy


@pytest.mark.parametrize("seed", range(6))
def test_the_toy_moves_five_millimetres_and_two_degrees_an_image(seed: int) -> None:
    steps, turns = rows(motion.toy_pose(index, seed) for index in range(120))
    assert 0.004 < np.median(steps) < 0.006
    assert steps.max() < 0.01
    assert 1.5 < np.median(turns) < 3.0
    assert turns.max() < 5.0
    first = motion.toy_pose(0, seed)[:3, :3]
    away = [
        Rotation.from_matrix(first.T @ motion.toy_pose(index, seed)[:3, :3]).magnitude()
        for index in range(120)
    ]
    assert 50.0 < np.degrees(max(away)) < 60.0


@pytest.mark.extended
def test_a_hand_moves_the_rig_and_the_toy_rests() -> None:
    made = MovingScene(Scenario(size="small", hand=True, one_camera=True))
    objects = [
        made.room_from_rig(index) @ made.left_from_object(index) for index in range(0, 120, 9)
    ]
    np.testing.assert_allclose(objects, np.broadcast_to(objects[0], np.shape(objects)), atol=1e-9)
    steps, turns = rows(made.room_from_rig(index) for index in range(120))
    assert 0.005 < np.median(steps) < 0.02
    assert 0.5 < np.median(turns) < 2.0
    for index in (0, 45, 110):
        assert overlap(silhouette(made, index), made.look(index).mask > 0) > 0.97


@pytest.mark.parametrize("seed", range(6))
def test_a_toy_that_is_turned_shows_all_its_sides_and_comes_back(seed: int) -> None:
    poses = [motion.turning_pose(index, seed) for index in range(motion.WHOLE_TURN + 1)]
    steps, turns = rows(iter(poses))
    assert steps.max() < 0.005
    assert 2.0 < np.median(turns) < 3.0
    assert turns.max() < 3.5
    up = np.array([one[:3, 2] for one in poses])
    lean = np.degrees(np.arccos(up[:, 2]))
    assert 5.0 < lean.max() < 30.0
    heads = np.unwrap([np.arctan2(one[1, 0], one[0, 0]) for one in poses])
    middle = motion.WHOLE_TURN // 2
    assert np.degrees(heads[middle] - heads[0]) == pytest.approx(360.0, abs=12.0)
    assert np.degrees(heads[-1] - heads[0]) == pytest.approx(0.0, abs=12.0)


def test_a_rig_in_a_hand_and_a_toy_that_turns_are_not_both_drawn() -> None:
    with pytest.raises(ValueError, match="leave turn or hand out"):
        Scenario(turn=True, hand=True)


@pytest.mark.parametrize("moved", [{}, {"hand": True}, {"turn": True}])
def test_the_toy_stays_whole_in_both_images(moved: dict[str, bool]) -> None:
    made = MovingScene(Scenario(size="small", **moved, one_camera=True))  # type: ignore
    for index in range(0, motion.WHOLE_TURN if made.scenario.turn else 120, 5):
        for offset in (0.0, scene.BASELINE):
            pixels, places = project(made, index, offset)
            assert pixels.min() > 4.0
            assert (pixels < np.array(made.camera.size_px) - 5.0).all()
            assert 0.4 < places[:, 2].min() < places[:, 2].max() < 0.85


def test_the_room_wears_the_colours_of_the_toy(toy: MovingScene) -> None:
    look = toy.look(0)
    cells = (look.images[0] // 32).astype(int) @ np.array([64, 8, 1])
    inside = np.bincount(cells[look.mask > 0], minlength=512) / (look.mask > 0).sum()
    outside = np.bincount(cells[look.mask == 0], minlength=512) / (look.mask == 0).sum()
    assert np.minimum(inside, outside).sum() > 0.2


def test_a_plain_toy_has_one_hue_and_a_painted_one_many(toy: MovingScene) -> None:
    plain = MovingScene(Scenario(size="small", plain=True, one_camera=True)).look(0)
    spread = []
    for look in (plain, toy.look(0)):
        inner = cv2.erode(look.mask, np.ones((5, 5), np.uint8)) > 0
        hue = cv2.cvtColor(look.images[0], cv2.COLOR_RGB2HSV)[:, :, 0][inner].astype(float)
        spread.append(hue.std())
    assert spread[0] < 4.0 < 20.0 < spread[1]


def test_grey_images_have_no_colour() -> None:
    made = MovingScene(Scenario(size="small", grey=True, one_camera=True))
    assert made.look(0).images[0].shape == (240, 320)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"count": 0}, "needs 1 observation"), ({"size": "huge"}, "choose one of small, full")],
)
def test_a_scenario_that_cannot_be_is_refused(wrong: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Scenario(**wrong)  # pyright: ignore[reportArgumentType]
