"""The toy is followed in other circumstances, mostly with the body that a first track made."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from recordings import Alone, Recording, run_servoid
from scenes_tracking import (
    by_its_looks,
    by_its_looks_figures,
    found_by_looks,
    in_the_mask,
    in_the_mask_figures,
    known,
    placed_in_mask,
    track_figures,
    tracked,
)
from scenes_tracking_more import (
    Toys,
    at_a_distance,
    at_a_distance_figures,
    at_rest,
    at_rest_figures,
    behind_a_bar,
    by_the_paper,
    distant,
    every_second,
    evolving,
    grey,
    one_camera,
    pair_figures,
    paper_figures,
    track_pair,
    two_toys,
    veiled_figures,
    write_pair,
)

from conftest import Command
from servoid.record import read_trajectory
from servoid.shape import load_body, save_body

Recorded = Callable[[str], Recording]


def test_a_body_from_a_file_is_placed_in_the_mask_and_followed(
    alone: Alone, tmp_path: Path
) -> None:
    track = in_the_mask(alone, tmp_path)
    assert placed_in_mask.beyond(in_the_mask_figures(alone, track)) == []


@pytest.mark.extended
def test_a_modelled_body_is_found_by_its_looks_where_no_mask_is(
    recording: Recorded, tmp_path: Path
) -> None:
    snail = recording("colour")
    points = by_its_looks(snail, tmp_path)
    assert load_body(tmp_path / "body.json").appearance is not None
    assert [point.observation for point in points] == list(range(8, 14))
    assert found_by_looks.beyond(by_its_looks_figures(snail, tmp_path, points)) == []


def test_a_body_that_remembers_no_look_is_not_sought(
    alone: Alone, tmp_path: Path, servoid_command: Command
) -> None:
    save_body(tmp_path / "body.json", alone.body)
    body = ("--body", tmp_path / "body.json", "--observations", "8:14")
    outcome = servoid_command("track", alone.recording.folder, *body)
    assert outcome.code == 1
    assert "nothing says where 'body' is in observation 8" in outcome.err
    assert "a body that was saved with its appearance" in " ".join(outcome.err.split())


@pytest.mark.extended
def test_a_body_from_a_file_evolves_if_it_is_told_to(alone: Alone, tmp_path: Path) -> None:
    options = (*known(alone, alone.recording), "--save-body", "new.json")
    run_servoid(tmp_path, "track", alone.recording.folder, *options)
    kept = (tmp_path / "new.json").read_text()
    output = run_servoid(tmp_path, "track", alone.recording.folder, *options, "--evolve")
    assert "  evolved " in output
    points = read_trajectory(tmp_path / "poses.csv")
    errors = alone.recording.errors(points)
    assert evolving.beyond(track_figures(points, errors)) == []
    assert (tmp_path / "new.json").read_text() != kept


@pytest.mark.extended
def test_images_without_colour_are_enough(recording: Recorded, tmp_path: Path) -> None:
    track = tracked(recording("grey"), tmp_path)
    assert grey.beyond(track_figures(*track)) == []


@pytest.mark.extended
def test_a_known_body_is_followed_by_one_camera(
    alone: Alone, recording: Recorded, tmp_path: Path
) -> None:
    seen = recording("one camera")
    track = tracked(seen, tmp_path, *known(alone, seen))
    assert one_camera.beyond(track_figures(*track)) == []


@pytest.mark.extended
def test_one_camera_and_a_distance_follow_the_object_in_the_image(
    recording: Recorded, tmp_path: Path
) -> None:
    seen = recording("one camera")
    points = at_a_distance(seen, tmp_path)
    assert distant.beyond(at_a_distance_figures(seen, points)) == []


@pytest.mark.extended
def test_an_object_at_rest_rests_in_the_world_while_the_rig_moves(
    alone: Alone, recording: Recorded, tmp_path: Path
) -> None:
    seen = recording("hand")
    track = tracked(seen, tmp_path, *known(alone, seen))
    first, *_, last = seen.capture.world_from_rig
    moved = (first.inverse() @ last).log()
    assert np.linalg.norm(moved[:3]) > 0.015
    assert np.linalg.norm(moved[3:]) > np.radians(2.0)
    assert at_rest.beyond(at_rest_figures(track)) == []


@pytest.mark.extended
def test_every_second_observation_is_enough(alone: Alone, tmp_path: Path) -> None:
    options = (*known(alone, alone.recording), "--every", 2)
    points, errors = tracked(alone.recording, tmp_path, *options)
    assert [point.observation for point in points] == list(range(0, 40, 2))
    assert every_second.beyond(track_figures(points, errors)) == []


@pytest.mark.extended
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
    assert by_the_paper.beyond(paper_figures((points, errors))) == []


def test_what_passes_before_the_object_hides_a_share_of_it_and_does_not_lose_it(
    alone: Alone, recording: Recorded
) -> None:
    assert behind_a_bar.beyond(veiled_figures(alone, recording("colour"))) == []


@pytest.fixture(scope="module")
def pair(recording: Recorded, tmp_path_factory: pytest.TempPathFactory) -> Toys:
    """Write a recording of two toys of which neither hides the other."""
    return write_pair(recording("colour"), tmp_path_factory.mktemp("pair") / "video")


@pytest.mark.extended
def test_two_objects_in_one_capture_are_both_followed(
    alone: Alone, pair: Toys, tmp_path: Path
) -> None:
    output = track_pair(alone, pair, tmp_path, "--video", "both.mp4")
    assert [line for line in output.splitlines() if line in (" a", " b")] == [" a", " b"]
    assert two_toys.beyond(pair_figures(pair, tmp_path)) == []
