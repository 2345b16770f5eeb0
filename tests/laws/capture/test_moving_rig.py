"""Poses of a rig that moves are contradicted by what is at rest around it."""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import Recording, run_servoid

from servoid.capture import Capture, doubt_rig_poses, examine_rig_poses, open_capture
from servoid.capture.rig_sightings import Sighting
from servoid.pose import Pose
from servoid.record import read_trajectory

DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
CV_FROM_GL = Pose.from_parts((0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0))
COUNT = 25


def late(lines: int) -> Callable[[Sequence[Pose]], list[Pose]]:
    return lambda poses: [poses[max(index - lines, 0)] for index in range(len(poses))]


def transposed(pose: Pose) -> Pose:
    turn = pose.matrix()[:3, :3].T
    return Pose(np.block([[turn, np.array(pose.translation)[:, None]], [np.zeros(3), 1.0]]))


FAULTS: dict[str, tuple[Callable[[Sequence[Pose]], list[Pose]], str]] = {
    "inverted": (
        lambda poses: [pose.inverse() for pose in poses],
        "invert them: they look like rig_from_world, with which 100 % would be",
    ),
    "y up": (
        lambda poses: [pose @ CV_FROM_GL for pose in poses],
        "those of cameras with y up and z backwards, with which 100 % would be",
    ),
    "millimetres": (
        lambda poses: [
            Pose.from_parts(1000.0 * np.array(pose.translation), pose.quaternion) for pose in poses
        ],
        "they look like millimetres, with which 100 % would be",
    ),
    "qw last": (
        lambda poses: [
            Pose.from_parts(pose.translation, np.roll(pose.quaternion, -1)) for pose in poses
        ],
        "it looks like qx, qy, qz, qw, with which 100 % would be",
    ),
    "late": (late(7), "compare their times with those of the images: with the poses of 7 lines"),
    "reversed": (
        lambda poses: list(poses)[::-1],
        "check that they are world_from_rig, in metres, and of the same times as the images",
    ),
}


@pytest.fixture(scope="module")
def moving(recording: Callable[[str], Recording]) -> Capture:
    """Return what a hand's cameras recorded while the hand moved around an object at rest."""
    return recording("long hand").capture


def with_fault(capture: Capture, fault: str) -> Capture:
    return replace(capture, world_from_rig=tuple(FAULTS[fault][0](capture.world_from_rig)))


@pytest.mark.parametrize("count", [1, 2])
def test_right_poses_of_a_moving_rig_are_not_doubted(count: int, moving: Capture) -> None:
    assert doubt_rig_poses(replace(moving, cameras=moving.cameras[:count])) is None


def test_a_camera_that_only_turns_sees_the_directions_turn() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform([-1.0, -1.0, 2.0], [1.0, 1.0, 4.0], (40, 3))
    far = points / np.linalg.norm(points, axis=1)[:, None]
    moved = Pose.exp([0.0, 0.0, 0.0, 0.1, -0.2, 0.05])
    rays = far @ moved.matrix()[:3, :3].T
    seen = Sighting((0, 1), far, rays, located=False)
    assert np.abs(seen.off_rad(Pose.identity(), moved.inverse())).max() < 1e-9
    assert seen.off_rad(Pose.identity(), Pose.identity()).min() > 0.02


def test_one_camera_sees_what_it_passes_on_an_arc_from_near_to_far() -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform([-1.0, -1.0, 2.0], [1.0, 1.0, 4.0], (40, 3))
    far = points / np.linalg.norm(points, axis=1)[:, None]
    moved = Pose.exp([0.3, -0.1, 0.2, 0.1, -0.2, 0.05])  # second camera from the first
    later = points @ moved.matrix()[:3, :3].T + moved.translation
    rays = later / np.linalg.norm(later, axis=1)[:, None]
    seen = Sighting((0, 1), far, rays, located=False)
    assert seen.off_rad(Pose.identity(), moved.inverse()).max() < 1e-9
    # As if it had moved the other way, features would be behind it.
    back = Pose.from_parts(-np.array(moved.translation), moved.quaternion)
    assert np.median(seen.off_rad(Pose.identity(), back.inverse())) > 0.03


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("fault", FAULTS)
def test_wrong_poses_of_a_moving_rig_are_doubted_and_what_is_wrong_is_named(
    fault: str, count: int, moving: Capture
) -> None:
    wrong = with_fault(moving, fault)
    doubt = examine_rig_poses(replace(wrong, cameras=wrong.cameras[:count]))
    if count == 1 and fault == "millimetres":
        assert doubt is None  # one camera sees directions only
        return
    if count == 1 and fault == "late":
        return  # along the motion of the image, so that it may be noticed or not
    assert doubt is not None
    assert doubt.words.startswith("the images contradict the poses of the rig: of ")
    assert FAULTS[fault][1] in doubt.words
    # Other poses explain what is seen, or hardly any feature fits these; but one camera's often do.
    assert doubt.is_sure == (fault != "reversed" or count == 2)


def test_a_rig_without_poses_and_photographs_are_not_examined(
    moving: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("servoid.capture.rig_sightings.match_features", None)  # none is called
    wrong = with_fault(moving, "inverted")
    assert doubt_rig_poses(replace(moving, world_from_rig=(Pose.identity(),) * COUNT)) is None
    assert doubt_rig_poses(replace(wrong, rate_hz=None)) is None


def test_only_observations_among_the_given_ones_are_compared(moving: Capture) -> None:
    poses = list(moving.world_from_rig)
    wrong = replace(moving, world_from_rig=(*poses[:9], *(pose.inverse() for pose in poses[9:])))
    asked: set[int] = set()

    def noted(index: int) -> list[tuple[np.ndarray, float]]:
        asked.add(index)
        return []

    assert doubt_rig_poses(wrong, noted, among=range(9)) is None
    assert asked <= set(range(9)) and len(asked) >= 4
    assert doubt_rig_poses(wrong, among=range(9, COUNT)) is not None
    assert doubt_rig_poses(wrong, among=[3]) is None


def test_what_is_seen_on_what_may_move_says_nothing(moving: Capture) -> None:
    wrong = with_fault(moving, "inverted")
    asked: list[int] = []

    def all_of_it(index: int) -> list[tuple[np.ndarray, float]]:
        asked.append(index)
        ahead = wrong.world_from_rig[index] @ wrong.cameras[0].rig_from_camera
        return [(ahead.matrix()[:3, :3] @ [0.0, 0.0, 1.0] + ahead.translation, 0.9)]

    assert doubt_rig_poses(wrong, all_of_it) is None
    assert set(asked) <= set(range(COUNT)) and len(asked) >= 4
    behind = [(np.array([0.0, 0.0, 50.0]), 0.1)]
    assert doubt_rig_poses(wrong, lambda _: behind) is not None


def test_a_track_with_wrong_poses_of_its_rig_is_not_good(moving: Capture, tmp_path: Path) -> None:
    folder = tmp_path / "hand"
    shutil.copytree(Path(moving.path).parent, folder)
    table = folder / "poses.csv"
    right = table.read_text()
    for fault, word in ((None, "good"), ("inverted", "poor")):
        if fault is not None:
            header, *lines = right.splitlines()
            poses = with_fault(moving, fault).world_from_rig
            rows = [
                ",".join([line.split(",")[0], *map(str, (*pose.translation, *pose.quaternion))])
                for line, pose in zip(lines, poses, strict=True)
            ]
            table.write_text("\n".join([header, *rows, ""]))
        told = run_servoid(tmp_path, "track", folder, "--observations", ":9")
        trusting = run_servoid(
            tmp_path, "track", folder, "--observations", ":9", "--trust-poses", "--out", "t.csv"
        )
        words = " ".join(told.split())
        table.write_text(right)
        assert f"verdict {word}" in words
        assert ("the poses of the rig are in doubt" in words) == (fault is not None)
        assert ("the images contradict the poses of the rig" in words) == (fault is not None)
        points = read_trajectory(tmp_path / "poses.csv")
        said = ["the poses of the rig are in doubt" in point.notices for point in points]
        assert said == [fault is not None] * 9, "with each pose, for who reads only these"
        told = {(point.status, point.confidence > 0.0) for point in points}
        assert told == {("tracking", True) if fault is None else ("searching", False)}
        assert "--start" not in words
        told = {point.status for point in read_trajectory(tmp_path / "t.csv")}
        assert told == {"tracking"}, "for those who know that what they see moves"
        assert ("the poses of the rig are in doubt" in " ".join(trusting.split())) == (
            fault is not None
        )


HAND_FROM_RIG = Pose.exp([0.05, -0.03, 0.09, 0.2, -0.4, 1.3])
MOUNTS = {
    "right": (HAND_FROM_RIG, None),
    "inverted": (HAND_FROM_RIG.inverse(), "invert rig_from_camera"),
    "transposed": (transposed(HAND_FROM_RIG), "transpose the rotation of rig_from_camera"),
    "forgotten": (Pose.identity(), "(hand-eye calibration): with left at"),
}


def on_hand(capture: Capture, mount: Pose) -> Capture:
    """Return a capture with poses of a hand, and what is said of how the rig is mounted on it."""
    cameras = tuple(
        replace(camera, rig_from_camera=mount @ camera.rig_from_camera)
        for camera in capture.cameras
    )
    poses = tuple(pose @ HAND_FROM_RIG.inverse() for pose in capture.world_from_rig)
    return replace(capture, cameras=cameras, world_from_rig=poses)


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("mistake", MOUNTS)
def test_a_wrong_hand_eye_calibration_is_told_and_what_the_images_say_of_it(
    mistake: str, count: int, moving: Capture
) -> None:
    mount, words = MOUNTS[mistake]
    wrong = on_hand(replace(moving, cameras=moving.cameras[:count]), mount)
    doubt = examine_rig_poses(wrong)
    if words is None:
        assert doubt is None
        return
    assert doubt is not None
    is_told = words in doubt.words and " % would be" in doubt.words
    # One camera sees no distances, so that of its mistakes only those with a name are recognised.
    has_name = "rig_from_camera" in words
    assert is_told == (count == 2 or has_name)
    assert doubt.is_sure or not is_told
    near_hand = pytest.approx(np.array(HAND_FROM_RIG.translation), abs=0.01)
    if count == 2 and not has_name:
        assert named_place(doubt.words) == near_hand


def named_place(words: str) -> NDArray[np.float64]:
    """Return where a sentence says that the left camera is on the rig."""
    return np.array(words.split("with left at (")[1].split(")")[0].split(", "), float)


@pytest.mark.parametrize("off", [[0, 0, 0, 0.2, 0, 0], [0, 0, 0, 0, 0.15, 0], [0.2, 0, 0, 0, 0, 0]])
def test_a_hand_eye_calibration_that_is_a_little_off_is_told_where_another_fits_much_better(
    off: list[float], moving: Capture
) -> None:
    doubt = examine_rig_poses(on_hand(moving, HAND_FROM_RIG @ Pose.exp(off)))
    assert doubt is not None and not doubt.is_sure
    assert doubt.words.startswith("the images fit other poses of the cameras better")
    near_hand = pytest.approx(np.array(HAND_FROM_RIG.translation), abs=0.01)
    assert named_place(doubt.words) == near_hand


@pytest.mark.parametrize("seed", [0, 1])
def test_joints_that_are_not_exact_are_no_wrong_hand_eye_calibration(
    seed: int, moving: Capture
) -> None:
    rng = np.random.default_rng(seed)
    exact = on_hand(moving, HAND_FROM_RIG)
    poses = [
        pose @ Pose.exp(rng.normal(0.0, [5e-4] * 3 + [1e-3] * 3)) for pose in exact.world_from_rig
    ]
    assert examine_rig_poses(replace(exact, world_from_rig=tuple(poses))) is None


@pytest.mark.parametrize("scale", [0.6, 0.95, 1.3])
def test_lengths_in_no_usual_unit_are_told(scale: float, moving: Capture) -> None:
    poses = [
        Pose.from_parts(scale * np.array(pose.translation), pose.quaternion)
        for pose in moving.world_from_rig
    ]
    doubt = examine_rig_poses(replace(moving, world_from_rig=tuple(poses)))
    assert doubt is not None and doubt.is_sure == (scale != 0.95)
    named = doubt.words.split("distance of the cameras: with ")[1].split(" times")[0]
    assert float(named) == pytest.approx(1.0 / scale, rel=0.02)


@pytest.mark.extended
@pytest.mark.parametrize("fault", [None, *FAULTS])
def test_a_recorded_rig_that_moves_is_doubted_only_if_its_poses_are_wrong(
    fault: str | None,
) -> None:
    if not (DATA / "stereo" / "mustard_hand").is_dir():
        pytest.skip("mustard_hand is not beside the repository")
    capture = open_capture(DATA / "stereo" / "mustard_hand")
    doubt = doubt_rig_poses(capture if fault is None else with_fault(capture, fault))
    assert (doubt is None) == (fault is None)
    if fault not in (None, "reversed"):
        assert FAULTS[fault][1].split(", with")[0] in str(doubt)


def resting(capture: Capture) -> Capture:
    pose = Pose.from_parts((0.3, 0.1, 0.5), (0.5, 0.5, 0.5, 0.5))
    return replace(capture, world_from_rig=(pose,) * len(capture.world_from_rig))


@pytest.mark.parametrize("count", [1, 2])
def test_poses_that_never_change_are_doubted_if_the_cameras_move(
    count: int, moving: Capture
) -> None:
    doubt = examine_rig_poses(resting(replace(moving, cameras=moving.cameras[:count])))
    assert doubt is not None and not doubt.is_sure, "what they see may be on a conveyor"
    assert doubt.words.startswith("the poses of the rig are the same at all times")
    poses = (Pose.identity(),) * COUNT
    assert doubt_rig_poses(replace(moving, world_from_rig=poses)) is None  # none are given


@pytest.mark.extended
@pytest.mark.parametrize(
    "name",
    ["stereo/mustard", "stereo/drill", "hard/bleach_turn", "hard/mug_sway", "real/cube_hand"],
)
def test_cameras_at_rest_before_what_moves_are_not_doubted(name: str) -> None:
    if not (DATA / name).is_dir():
        pytest.skip(f"{name} is not beside the repository")
    assert doubt_rig_poses(resting(open_capture(DATA / name))) is None
