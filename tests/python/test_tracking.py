"""A moving toy is followed with its mask in the first image and nothing else."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from recordings import Alone, pose_text, run_servoid, track_alone

from servoid.pose import Pose
from servoid.record import Waypoint, read_trajectory
from servoid.shape import load_body

EVOLVED = (10, 20, 30)


@pytest.fixture(scope="module")
def as_it_was(alone: Alone, tmp_path_factory: pytest.TempPathFactory) -> Alone:
    """Return the same track with a body that stays as it was modelled."""
    return track_alone(alone.recording, tmp_path_factory.mktemp("still"), "--no-evolve")


def test_it_is_never_lost_and_within_millimetres(alone: Alone) -> None:
    errors = alone.recording.errors(alone.points)
    assert len(alone.points) == len(alone.recording.capture)
    assert {point.status for point in alone.points} == {"tracking"}
    assert np.median(errors.add) < 0.002
    assert errors.add.max() < 0.006
    assert errors.rotation.max() < np.radians(4.0)


def test_it_moved_far_enough_that_resting_would_be_wrong(alone: Alone) -> None:
    first = alone.points[0].world_from_object
    resting = [Waypoint(one.time_s, first, observation=one.observation) for one in alone.points]
    errors = alone.recording.errors(resting)
    assert np.median(errors.add) > 0.03
    assert errors.rotation.max() > np.radians(40.0)


def test_its_standard_deviation_is_of_the_size_of_its_errors(alone: Alone) -> None:
    errors = alone.recording.errors(alone.points)
    told = np.array([point.std_m for point in alone.points[1:]], dtype=float)
    assert np.isfinite(told).all()
    assert np.median(errors.translation) / 10.0 < np.median(told) < 10.0 * np.median(errors.add)


def test_the_same_command_gives_the_same_bytes_on_any_number_of_threads(
    alone: Alone, as_it_was: Alone, tmp_path: Path
) -> None:
    whole, again = (
        (one.folder / "poses.csv").read_bytes().splitlines(keepends=True)
        for one in (alone, as_it_was)
    )
    assert again[: EVOLVED[0] + 2] == whole[: EVOLVED[0] + 2]
    # What comes later in the recording changes nothing of what came before.
    arguments = ("track", alone.recording.folder, "--observations", ":22")
    run_servoid(tmp_path, *arguments, threads=1)
    assert (tmp_path / "poses.csv").read_bytes() == b"".join(whole[:23])


def test_a_body_that_evolves_stays_in_its_frame(alone: Alone, as_it_was: Alone) -> None:
    assert "evolved" in alone.said and "evolved" not in as_it_was.said
    for at in EVOLVED:
        before, after = (
            Pose(alone.recording.truth(index)).inverse() @ alone.points[index].world_from_object
            for index in (at, at + 1)
        )
        jump = (before.inverse() @ after).log()
        assert np.linalg.norm(jump[:3]) < 0.003
        assert np.linalg.norm(jump[3:]) < np.radians(2.0)


def test_a_body_that_evolves_fits_true_masks_no_worse_than_as_it_was(
    alone: Alone, as_it_was: Alone
) -> None:
    at = (0, 13, 26, 39)
    evolved = alone.recording.overlaps(alone.body, [alone.points[index] for index in at])
    still = alone.recording.overlaps(as_it_was.body, [as_it_was.points[index] for index in at])
    assert evolved.mean() > still.mean() - 0.015
    assert evolved.min() > 0.8


def test_the_saved_body_stands_where_it_was_seen_last(alone: Alone) -> None:
    file = load_body(alone.folder / "body.json")
    last = alone.points[-1].world_from_object
    np.testing.assert_allclose(file.body().world_from_object.matrix(), last.matrix(), atol=1e-8)


def test_a_saved_body_is_tracked_on_from_any_pose_of_the_track(
    alone: Alone, tmp_path: Path
) -> None:
    start = pose_text(alone.points[20].world_from_object)
    body = ("--body", alone.folder / "body.json", "--start", start)
    run_servoid(tmp_path, "track", alone.recording.folder, *body, "--observations", "20:")
    again = read_trajectory(tmp_path / "poses.csv")
    assert [point.observation for point in again] == list(range(20, 40))
    assert {point.status for point in again} == {"tracking"}
    assert alone.recording.errors(again).add.max() < 0.006


def test_a_start_where_the_object_does_not_look_as_it_is_remembered_is_said(
    alone: Alone, tmp_path: Path
) -> None:
    body, words = alone.folder / "body.json", "does not look like the object"
    begins = pose_text(alone.points[0].world_from_object)
    for start, unlike in (("body", True), (begins, False)):
        options = ("--body", body, "--start", start, "--observations", ":2")
        said = run_servoid(tmp_path, "track", alone.recording.folder, *options)
        assert (words in " ".join(said.split())) == unlike


def test_the_video_shows_every_observation(alone: Alone) -> None:
    video = cv2.VideoCapture(str(alone.folder / "o.mp4"))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == len(alone.points)
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(30.0)


def test_the_summary_tells_what_the_files_hold(alone: Alone) -> None:
    said = dict(re.findall(r"^  (\S.*?)  +(\S.*)$", alone.said, re.MULTILINE))
    assert said["tracked"] == "100.0 % (40 of 40)"
    assert said["evolved"].startswith("3 times")
    assert float(said["rate"].split()[0]) > 30.0
    paths = (said["poses"], said["body"], said["video"])
    assert paths == ("poses.csv", "body.json", "o.mp4")
