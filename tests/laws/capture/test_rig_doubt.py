"""Rigs of three and more cameras: each one is compared, and what is wrong is named."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from servoid.capture import Capture, PosedImage, capture_of, doubt_calibration
from servoid.pose import Pose
from servoid.sim import MovingScene, Scenario

COUNT = 6
NAMES = ("left", "right", "third", "fourth")


def rig(offsets: Sequence[float]) -> Capture:
    """Record a moving toy with parallel cameras beside each other."""
    scene = MovingScene(Scenario(count=COUNT, size="small"))
    scene.offsets = tuple(offsets)
    observations = []
    for index in range(COUNT):
        look = scene.look(index)
        images = zip(look.images, scene.room_from_cameras(index), strict=True)
        observations.append(
            [
                PosedImage(camera=scene.camera, world_from_camera=Pose(pose), image=image)
                for image, pose in images
            ]
        )
    made = capture_of(observations, rate_hz=30.0)
    cameras = [
        replace(camera, name=name) for name, camera in zip(NAMES, made.cameras, strict=False)
    ]
    return replace(made, cameras=tuple(cameras))


@pytest.fixture(scope="module")
def three() -> Capture:
    return rig((0.0, 0.1, -0.1))


@pytest.fixture(scope="module")
def four() -> Capture:
    return rig((0.0, 0.1, -0.1, 0.2))


def moved(capture: Capture, place: int, twist: Sequence[float]) -> Capture:
    """Move one camera of a rig away from where it was."""
    cameras = list(capture.cameras)
    one = cameras[place]
    cameras[place] = replace(one, rig_from_camera=one.rig_from_camera @ Pose.exp(list(twist)))
    return replace(capture, cameras=tuple(cameras))


def with_images_of(capture: Capture, places: Sequence[int]) -> Capture:
    """Give each camera the images of another."""
    pictures = [camera.pictures for camera in capture.cameras]
    cameras = [
        replace(camera, pictures=pictures[place])
        for camera, place in zip(capture.cameras, places, strict=True)
    ]
    return replace(capture, cameras=tuple(cameras))


def test_right_rigs_are_not_doubted_in_bounded_time(three: Capture, four: Capture) -> None:
    for capture in (three, four):
        start = time.process_time()
        assert doubt_calibration(capture) is None
        assert time.process_time() - start < 10.0


def test_many_cameras_are_compared_with_their_nearest_only(
    four: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    from servoid.capture import neighbours

    asked = []
    whole = neighbours.match_features

    def noted(*given: object) -> object:
        asked.append(given)
        return whole(*given)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(neighbours, "match_features", noted)
    more = [
        replace(camera, name=f"{camera.name}{times}")
        for times in range(3)
        for camera in four.cameras
    ]
    # The first of each is at the place of the others, and has the same images.
    shifted = [replace(one, pictures=one.pictures[at:] + one.pictures[:at])
               for one, at in zip(more, np.repeat([0, 1, 2], 4).tolist(), strict=True)]  # fmt: skip
    doubt_calibration(replace(four, cameras=tuple(shifted)))
    assert 0 < len(asked) <= 3 * 2 * len(more)


@pytest.mark.parametrize("place", [1, 2])
@pytest.mark.parametrize("degrees", [-6.0, 6.0])
def test_a_turned_camera_of_three_is_named(place: int, degrees: float, three: Capture) -> None:
    turn = [0.0, 0.0, 0.0, np.radians(degrees), 0.0, 0.0]
    doubt = doubt_calibration(moved(three, place, turn))
    assert doubt is not None
    assert doubt.startswith(f"camera {NAMES[place]} does not fit the others: the images contradict")


@pytest.mark.parametrize("place", [1, 2])
def test_a_camera_on_the_wrong_side_is_named(place: int, three: Capture) -> None:
    x_m = three.cameras[place].rig_from_camera.translation[0]
    doubt = doubt_calibration(moved(three, place, [-2.0 * x_m, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert doubt is not None
    assert doubt.startswith(f"camera {NAMES[place]} does not fit the others: the images contradict")


def test_no_pair_of_parallel_cameras_shows_how_far_they_are_apart(three: Capture) -> None:
    two = replace(three, cameras=three.cameras[:2])
    assert doubt_calibration(moved(two, 1, [0.03, 0.0, 0.0, 0.0, 0.0, 0.0])) is None


@pytest.mark.parametrize("twist", [[-0.03, 0, 0, 0, 0, 0], [0, 0, 0, 0, np.radians(1.0), 0]])
def test_what_no_pair_shows_is_found_by_what_two_cameras_locate_for_a_third(
    twist: list[float], three: Capture
) -> None:
    for place in (1, 2):
        doubt = doubt_calibration(moved(three, place, twist))
        assert doubt is not None
        assert "the images contradict the calibration of left, right and third" in doubt


@pytest.mark.parametrize("place", [0, 1, 2, 3])
def test_which_of_four_cameras_is_off_is_named_though_no_pair_shows_it(
    place: int, four: Capture
) -> None:
    doubt = doubt_calibration(moved(four, place, [0.0, 0.0, 0.0, 0.0, np.radians(1.5), 0.0]))
    assert doubt is not None
    assert doubt.startswith(f"camera {NAMES[place]} does not fit the others: ")


@pytest.mark.parametrize(
    ("places", "names"),
    [((1, 0, 2), "left and right"), ((0, 2, 1), "right and third"), ((2, 1, 0), "left and third")],
)
def test_the_two_of_three_cameras_that_are_exchanged_are_named(
    places: tuple[int, ...], names: str, three: Capture
) -> None:
    doubt = doubt_calibration(with_images_of(three, places))
    assert doubt is not None and doubt.startswith(f"the images of {names} are exchanged: of ")


def test_two_of_three_cameras_with_the_same_images_are_named(three: Capture) -> None:
    for places, names in (((0, 1, 1), "right and third"), ((0, 1, 0), "left and third")):
        doubt = doubt_calibration(with_images_of(three, places))
        assert doubt is not None
        assert doubt.startswith(f"the images of {names} are the same to the last pixel")


def test_a_third_camera_that_is_moved_meanwhile_is_told(three: Capture) -> None:
    one, two, third = three.cameras
    late = with_images_of(three, (0, 1, 0)).cameras[2].pictures
    mixed = (*third.pictures[:-1], late[-2])
    doubt = doubt_calibration(replace(three, cameras=(one, two, replace(third, pictures=mixed))))
    assert doubt is not None and doubt.startswith("a camera was moved meanwhile")
