"""A moving toy is followed with its mask in the first image and nothing else."""

import os
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from recordings import Alone, pose_text, run_apart, run_servoid, track_alone
from scenes_tracking import (
    EVOLVED,
    evolved_figures,
    evolving_outline,
    on_again,
    outline_figures,
    std_figures,
    track_figures,
    track_on_again,
    track_toy,
)

from servoid.record import Waypoint
from servoid.shape import load_body
from servoid.sim import Scenario, write_moving_sample


@pytest.fixture(scope="module")
def as_it_was(alone: Alone, tmp_path_factory: pytest.TempPathFactory) -> Alone:
    """Return the same track with a body that stays as it was modelled."""
    return track_alone(alone.recording, tmp_path_factory.mktemp("still"), "--no-evolve")


def test_it_is_never_lost_and_within_millimetres(alone: Alone) -> None:
    errors = alone.recording.errors(alone.points)
    assert len(alone.points) == len(alone.recording.capture)
    assert track_toy.beyond(track_figures(alone.points, errors)) == []


def test_it_moved_far_enough_that_resting_would_be_wrong(alone: Alone) -> None:
    first = alone.points[0].world_from_object
    resting = [Waypoint(one.time_s, first, observation=one.observation) for one in alone.points]
    errors = alone.recording.errors(resting)
    assert np.median(errors.add) > 0.03
    assert errors.rotation.max() > np.radians(40.0)


def test_its_standard_deviation_is_of_the_size_of_its_errors(alone: Alone) -> None:
    assert all(point.std_m is not None for point in alone.points[1:])
    assert track_toy.beyond(std_figures(alone)) == []


def lines_of(track: Alone) -> list[bytes]:
    return (track.folder / "poses.csv").read_bytes().splitlines(keepends=True)


@pytest.mark.extended
def test_a_track_is_the_same_whether_its_body_evolves_later_or_not(
    alone: Alone, as_it_was: Alone
) -> None:
    last = EVOLVED[0] + 2
    assert lines_of(as_it_was)[:last] == lines_of(alone)[:last]


def test_the_same_command_gives_the_same_bytes_on_any_number_of_threads(
    alone: Alone, tmp_path: Path
) -> None:
    # What comes later in the recording changes nothing of what came before.
    arguments = ("track", alone.recording.folder, "--observations", ":12")
    cores = os.cpu_count() or 1
    run_apart(tmp_path, *arguments, threads=1 if cores > 1 else 2)
    assert (tmp_path / "poses.csv").read_bytes() == b"".join(lines_of(alone)[:13])


@pytest.mark.extended
def test_a_body_that_evolves_stays_in_its_frame(alone: Alone, as_it_was: Alone) -> None:
    assert "evolved" in alone.output and "evolved" not in as_it_was.output
    assert track_toy.beyond(evolved_figures(alone)) == []


@pytest.mark.extended
def test_a_body_that_evolves_fits_true_masks_no_worse_than_as_it_was(
    alone: Alone, as_it_was: Alone
) -> None:
    assert evolving_outline.beyond(outline_figures(alone, as_it_was)) == []


def test_the_saved_body_stands_where_it_was_seen_last(alone: Alone) -> None:
    file = load_body(alone.folder / "body.json")
    last = alone.points[-1].world_from_object
    np.testing.assert_allclose(file.body().world_from_object.matrix(), last.matrix(), atol=1e-8)


def test_a_saved_body_is_tracked_on_from_any_pose_of_the_track(
    alone: Alone, tmp_path: Path
) -> None:
    points, errors = on_again(alone, tmp_path)
    assert [point.observation for point in points] == list(range(20, 40))
    assert track_on_again.beyond(track_figures(points, errors)) == []


def test_a_start_where_the_object_does_not_look_as_it_is_remembered_is_said(
    alone: Alone, tmp_path: Path
) -> None:
    body, words = alone.folder / "body.json", "the appearance in the body's file is recognised"
    begins = pose_text(alone.points[0].world_from_object)
    for start, unlike in (("body", True), (begins, False)):
        options = ("--body", body, "--start", start, "--observations", ":2")
        output = run_servoid(tmp_path, "track", alone.recording.folder, *options)
        assert (words in " ".join(output.split())) == unlike


@pytest.mark.extended
def test_the_body_of_another_object_than_the_one_in_the_mask_is_noticed(
    alone: Alone, tmp_path: Path
) -> None:
    other = tmp_path / "other"
    write_moving_sample(other, Scenario(count=2, size="small", seed=5, plain=True))
    for folder, noticed in ((alone.recording.folder, False), (other, True)):
        options = ("--body", alone.folder / "body.json", "--observations", ":2")
        output = run_servoid(tmp_path, "track", folder, *options)
        assert ("does not match the appearance" in " ".join(output.split())) == noticed


def test_the_video_shows_every_observation(alone: Alone) -> None:
    video = cv2.VideoCapture(str(alone.folder / "o.mp4"))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == len(alone.points)
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(30.0)


def test_the_summary_tells_what_the_files_hold(alone: Alone) -> None:
    rows = dict(re.findall(r"^  (\S.*?)  +(\S.*)$", alone.output, re.MULTILINE))
    assert rows["tracked"] == "100.0 % (40 of 40)"
    assert rows["evolved"].startswith("3 times")
    assert re.fullmatch(r"\d+ .*", rows["rate"])
    paths = (rows["poses"], rows["body"], rows["video"])
    assert paths == ("poses.csv", "body.json", "o.mp4")
