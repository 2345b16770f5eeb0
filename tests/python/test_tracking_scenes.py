"""The toy is followed in other circumstances, mostly with the body that a first track made."""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from conftest import Command
from faults import Moments
from recordings import SNAIL, Alone, Recording, pose_text, run_servoid, wrong
from tracking_errors import TrackingErrors, tracking_errors

from servoid.pose import Pose
from servoid.record import Waypoint, read_trajectory
from servoid.shape import load_body, save_body
from servoid.sim import MovingScene, Scenario
from servoid.sim.convex import Floats

Recorded = Callable[[str], Recording]

BAR_PX, BAR_STEP_PX, BAR_DISPARITY_PX = 16, 6, 69


def tracked(
    recording: Recording, folder: Path, *options: object
) -> tuple[list[Waypoint], TrackingErrors]:
    run_servoid(folder, "track", recording.folder, *options)
    points = read_trajectory(folder / "poses.csv")
    return points, recording.errors(points)


def known(alone: Alone, recording: Recording) -> tuple[object, ...]:
    """Return the options that say which body it is and where it is at first."""
    start = pose_text(alone.start_in(recording))
    return ("--body", alone.folder / "body.json", "--start", start)


def are_tracked(points: Sequence[Waypoint]) -> bool:
    return all(point.status == "tracking" for point in points)


def test_a_body_from_a_file_is_placed_in_the_mask_and_followed(
    alone: Alone, tmp_path: Path
) -> None:
    body = ("--body", alone.folder / "body.json")
    points, errors = tracked(alone.recording, tmp_path, *body, "--observations", ":25")
    assert are_tracked(points)
    assert np.median(errors.add) < 0.003
    start = alone.start_in(alone.recording)
    away = (start.inverse() @ points[0].world_from_object).log()
    assert np.linalg.norm(away[:3]) < 0.01
    assert np.linalg.norm(away[3:]) < np.radians(15.0)


def test_a_modelled_body_is_found_by_its_looks_where_no_mask_is(
    recording: Recorded, tmp_path: Path
) -> None:
    snail = recording("colour")
    options = ("--max-ellipsoids", 4, "--out", "body.json")
    run_servoid(tmp_path, "model", snail.folder, *options)
    file = load_body(tmp_path / "body.json")
    assert file.appearance is not None
    body = ("--body", "body.json", "--observations", "8:14")
    points, _ = tracked(snail, tmp_path, *body)
    assert [point.observation for point in points] == list(range(8, 14))
    assert are_tracked(points)
    toy_from_body = Pose(snail.truth(0)).inverse() @ file.body().world_from_object
    for point in points:
        there = Pose(snail.truth(point.observation or 0)) @ toy_from_body
        away = (there.inverse() @ point.world_from_object).log()
        assert np.linalg.norm(away[:3]) < 0.006
        assert np.linalg.norm(away[3:]) < np.radians(4.0)


def test_a_body_that_remembers_no_look_is_not_sought(
    alone: Alone, tmp_path: Path, servoid_command: Command
) -> None:
    save_body(tmp_path / "body.json", alone.body)
    body = ("--body", tmp_path / "body.json", "--observations", "8:14")
    outcome = servoid_command("track", alone.recording.folder, *body)
    assert outcome.code == 1
    assert "nothing says where 'body' is in observation 8" in outcome.err
    assert "saved with what the object looks like" in " ".join(outcome.err.split())


def test_a_body_from_a_file_evolves_if_it_is_told_to(alone: Alone, tmp_path: Path) -> None:
    options = (*known(alone, alone.recording), "--save-body", "new.json")
    run_servoid(tmp_path, "track", alone.recording.folder, *options)
    kept = (tmp_path / "new.json").read_text()
    said = run_servoid(tmp_path, "track", alone.recording.folder, *options, "--evolve")
    assert "  evolved " in said
    points = read_trajectory(tmp_path / "poses.csv")
    assert are_tracked(points)
    assert alone.recording.errors(points).add.max() < 0.006
    assert (tmp_path / "new.json").read_text() != kept


def test_images_without_colour_are_enough(recording: Recorded, tmp_path: Path) -> None:
    points, errors = tracked(recording("grey"), tmp_path)
    assert are_tracked(points)
    assert np.median(errors.add) < 0.002


def test_a_known_body_is_followed_by_one_camera(
    alone: Alone, recording: Recorded, tmp_path: Path
) -> None:
    seen = recording("one camera")
    points, errors = tracked(seen, tmp_path, *known(alone, seen))
    assert are_tracked(points)
    assert np.median(errors.add) < 0.005
    assert errors.rotation.max() < np.radians(5.0)


def test_one_camera_and_a_distance_follow_the_object_in_the_image(
    recording: Recorded, tmp_path: Path
) -> None:
    seen = recording("one camera")
    distance = float(np.linalg.norm(seen.truth(0)[:3, 3]))
    points, _ = tracked(seen, tmp_path, "--distance", round(distance, 2))
    assert "lost" not in [point.status for point in points]
    assert are_tracked(points[:5])
    toy_from_body = np.linalg.inv(seen.truth(0)) @ points[0].world_from_object.matrix()
    for point in points:
        true = seen.truth(point.observation or 0) @ toy_from_body
        found = np.array(point.world_from_object.translation)
        apart = seen.scene.camera.focal_px * (found / found[2] - true[:3, 3] / true[2, 3])
        assert np.linalg.norm(apart) < 10.0


def test_an_object_at_rest_rests_in_the_world_while_the_rig_moves(
    alone: Alone, recording: Recorded, tmp_path: Path
) -> None:
    seen = recording("hand")
    points, errors = tracked(seen, tmp_path, *known(alone, seen))
    assert are_tracked(points)
    first, *_, last = seen.capture.world_from_rig
    moved = (first.inverse() @ last).log()
    assert np.linalg.norm(moved[:3]) > 0.015
    assert np.linalg.norm(moved[3:]) > np.radians(2.0)
    places = np.array([point.world_from_object.translation for point in points])
    assert np.ptp(places, axis=0).max() < 0.002
    assert errors.add.max() < 0.002


def test_every_third_observation_is_enough(alone: Alone, tmp_path: Path) -> None:
    options = (*known(alone, alone.recording), "--every", 3)
    points, errors = tracked(alone.recording, tmp_path, *options)
    assert [point.observation for point in points] == list(range(0, 40, 3))
    assert are_tracked(points)
    assert errors.add.max() < 0.01


def test_the_paper_s_method_runs_to_the_end_and_gives_the_same_bytes_again(
    alone: Alone, tmp_path: Path
) -> None:
    options = (*known(alone, alone.recording), "--method", "paper", "--observations", ":12")
    points, errors = tracked(alone.recording, tmp_path, *options)
    first = (tmp_path / "poses.csv").read_bytes()
    tracked(alone.recording, tmp_path, *options)
    assert (tmp_path / "poses.csv").read_bytes() == first
    assert len(points) == 12
    assert np.isfinite(errors.add).all()
    assert errors.translation.max() < 0.15


def veiled(moments: Moments) -> tuple[Moments, list[int]]:
    """Let a striped bar pass before the cameras; return where its left edge is in the left one."""
    random = np.random.default_rng(5)
    stripes = random.integers(60, 190, (1, BAR_PX, 3)).astype(np.uint8)
    found, edges = [], []
    for index, moment in enumerate(moments):
        edges.append(60 + BAR_STEP_PX * index)
        images = [image.copy() for image in moment.images if image is not None]
        for image, edge in zip(images, (edges[-1], edges[-1] - BAR_DISPARITY_PX), strict=True):
            low, high = np.clip((edge, edge + BAR_PX), 0, image.shape[1])
            image[:, low:high] = stripes[:, low - edge : high - edge]
        found.append(replace(moment, images=tuple(images)))
    return found, edges


def test_what_passes_before_the_object_lowers_the_confidence_and_does_not_lose_it(
    alone: Alone, recording: Recorded
) -> None:
    seen = recording("colour")
    moments, edges = veiled(seen.moments())
    tracker = alone.tracker_in(seen, moments[0])
    estimates = [tracker.step(one.time_s, one.world_from_camera, one.images) for one in moments[1:]]
    truth = [seen.truth(index) for index in range(len(moments))]
    start = alone.start_in(seen).matrix()
    poses = [one.world_from_object.matrix() for one in estimates]
    errors = tracking_errors([start, *poses], truth, SNAIL)
    assert "lost" not in [one.status for one in estimates]
    assert [one.status for one in estimates[-5:]] == ["tracking"] * 5
    assert np.median(errors.add) < 0.003
    seen_well = np.array([one.status == "tracking" for one in estimates])
    assert seen_well.mean() > 0.85
    assert not (wrong(errors) & seen_well).any()
    confidence = np.array([one.confidence for one in estimates])
    middle = [
        seen.scene.camera.focal_px * pose[0, 3] / pose[2, 3] + seen.scene.camera.center_px[0]
        for pose in truth[1:]
    ]
    before = np.abs(np.array(edges[1:]) + BAR_PX / 2 - middle) < 12.0
    aside = np.array(edges[1:]) < np.array(middle) - 75.0
    assert before.any() and aside.any()
    assert confidence[before].mean() < confidence[aside].mean() - 0.05


class Aside(MovingScene):
    """The scene with its toy moved to the right, in metres, and `ahead` by so many images."""

    def __init__(self, scenario: Scenario, right: float, ahead: int) -> None:
        super().__init__(scenario)
        self.right, self.ahead = right, ahead

    def room_from_object(self, index: int) -> Floats:
        pose = super().room_from_object(index + self.ahead)
        pose[0, 3] += self.right
        return pose


@pytest.fixture(scope="module")
def pair(
    recording: Recorded, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, tuple[Aside, Aside]]:
    """Write a recording of two toys of which neither hides the other."""
    folder, scenario = tmp_path_factory.mktemp("pair") / "video", Scenario(count=8, size="small")
    for name in ("left", "right", "masks"):
        (folder / name).mkdir(parents=True)
    shutil.copy(recording("colour").folder / "capture.toml", folder)
    scenes = (Aside(scenario, -0.14, 0), Aside(scenario, 0.16, 62))
    empty = Aside(scenario, 90.0, 0)
    assert cv2.imwrite(str(folder / "masks" / "000000.png"), scenes[0].look(0).mask)
    for index in range(len(empty)):
        looks = [scene.look(index).images for scene in (*scenes, empty)]
        for name, first, second, room in zip(("left", "right"), *looks, strict=True):
            # All three have the same noise, so that they differ where a toy or its edge is.
            both = np.where((second != room).any(axis=2, keepdims=True), second, first)
            assert cv2.imwrite(str(folder / name / f"{index:06d}.png"), both[..., ::-1])
    toml = (folder / "capture.toml").read_text()
    (folder / "capture.toml").write_text(toml.replace("*.jpg", "*.png"))
    return folder, scenes


def test_two_objects_in_one_capture_are_both_followed(
    alone: Alone, pair: tuple[Path, tuple[Aside, Aside]], tmp_path: Path
) -> None:
    folder, scenes = pair
    options: list[object] = []
    for name, scene in zip("ab", scenes, strict=True):
        start = Pose(scene.left_from_object(0) @ alone.toy_from_body)
        options += ["--body", f"{name}={alone.folder / 'body.json'}"]
        options += ["--start", f"{name}={pose_text(start)}"]
    said = run_servoid(tmp_path, "track", folder, *options, "--video", "both.mp4")
    assert [line for line in said.splitlines() if line in (" a", " b")] == [" a", " b"]
    for name, scene in zip("ab", scenes, strict=True):
        points = read_trajectory(tmp_path / f"poses_{name}.csv")
        assert are_tracked(points) and len(points) == len(scene)
        assert Recording(folder, scene).errors(points).add.max() < 0.006
