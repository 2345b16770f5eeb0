"""A given body is compared with the masks of the first observation before it is believed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recordings import Alone, pose_text, run_servoid

from servoid.errors import TrackError
from servoid.pose import Pose
from servoid.segment import parse_target
from servoid.shape import Body, load_body, save_body
from servoid.sim import write_sample
from servoid.track import (
    Request,
    Subject,
    TrackResult,
    masked,
    starting,
    track_capture,
    unobservable_axes,
)
from servoid.track.doubts import Recognition, body_doubts, is_contradicted

FIRST = Request(seed=0, observations=slice(12))


def words_of(folder: Path, alone: Alone, *options: object) -> str:
    """Return what a track of the first two images prints, in one line."""
    arguments = ("track", alone.recording.folder, "--observations", ":2", *options)
    return " ".join(run_servoid(folder, *arguments).split())


def without_its_look(folder: Path, alone: Alone, stretch: float = 1.0) -> Path:
    """Save the toy's body alone, stretched along one axis."""
    known = load_body(alone.folder / "body.json").body()
    centers, radii = known.centers.copy(), known.radii.copy()
    centers[:, 0] *= stretch
    body = Body(
        world_from_object=known.world_from_object,
        centers=centers,
        rotations=known.rotations,
        radii=radii,
    )
    save_body(folder / "body.json", body)
    return folder / "body.json"


def test_the_summary_says_how_well_a_body_fits_its_mask(alone: Alone, tmp_path: Path) -> None:
    given = words_of(tmp_path, alone, "--body", without_its_look(tmp_path, alone))
    for words in (" ".join(alone.output.split()), given):
        assert 0.85 < float(words.split("silhouette IoU ")[1][:4]) <= 1.0
        assert "overlaps the mask by" not in words


def test_a_body_of_another_shape_than_its_mask_is_doubted(alone: Alone, tmp_path: Path) -> None:
    body = without_its_look(tmp_path, alone, stretch=3.0)
    assert "overlaps the mask by 0." in words_of(tmp_path, alone, "--body", body)


@pytest.mark.parametrize(("overlap", "is_doubted"), [(None, False), (0.86, False), (0.84, True)])
def test_a_body_that_was_modelled_and_leaves_its_mask_is_doubted(
    overlap: float | None, is_doubted: bool
) -> None:
    doubts = body_doubts(Subject(), overlap, None)
    assert [f"overlaps its mask by {overlap} only" in one for one in doubts] == [True] * is_doubted


def test_a_body_beside_its_mask_is_doubted(alone: Alone, tmp_path: Path) -> None:
    first = alone.points[0].world_from_object
    for aside_m, is_doubted in ((0.0, False), (0.02, True)):
        start = pose_text(Pose.exp([aside_m, 0.0, 0.0, 0.0, 0.0, 0.0]) @ first)
        words = words_of(tmp_path, alone, "--body", alone.folder / "body.json", "--start", start)
        assert ("at the given start overlaps the mask by 0." in words) == is_doubted


@pytest.mark.extended
def test_an_object_that_neither_looks_nor_fits_like_the_body_is_refused(
    alone: Alone, tmp_path: Path
) -> None:
    write_sample(tmp_path / "bird", views=8, size_px=(320, 240))
    options = ("--max-ellipsoids", 6, "--out", "bird.json")
    run_servoid(tmp_path, "model", "bird", *options)
    file = load_body(tmp_path / "bird.json")
    bird = Subject(body=file.body(), appearance=file.look(), fitness=file.fitness)
    with pytest.raises(TrackError, match=r"is not the one in the body's file.* 0\.[67]\d only"):
        track_capture(alone.recording.capture, [bird], FIRST)


@pytest.mark.extended
def test_a_coarse_body_of_the_object_itself_is_not_refused(alone: Alone, tmp_path: Path) -> None:
    options = ("--max-ellipsoids", 1, "--observations", ":2", "--out", "coarse.json")
    run_servoid(tmp_path, "model", alone.recording.folder, *options)
    words = words_of(tmp_path, alone, "--body", "coarse.json")
    assert float(words.split("silhouette IoU ")[1][:4]) < 0.85
    assert "overlaps the mask by" not in words


def followed(alone: Alone, move: list[float], *, knows_look: bool) -> TrackResult:
    """Track the toy with its body, from a start that is moved from the right one."""
    file = load_body(alone.folder / "body.json")
    first = alone.points[0].world_from_object
    start = Pose.exp(move[:3] + [0.0] * 3) @ first @ Pose.exp([0.0] * 3 + move[3:])
    subject = Subject(
        body=file.body(),
        start=start,
        fitness=file.fitness,
        appearance=file.look() if knows_look else None,
    )
    return track_capture(alone.recording.capture, [subject], FIRST)[0]


@pytest.mark.parametrize("aside_m", [0.0, 0.04, 0.15])
def test_no_pose_is_tracking_that_follows_from_a_start_that_its_mask_contradicts(
    aside_m: float, alone: Alone
) -> None:
    tracked = followed(alone, [aside_m, 0.0, 0.0, 0.0, 0.0, 0.0], knows_look=False).tracked
    if not aside_m:
        assert all(one.is_tracked and not one.notices for one in tracked)
        return
    for one in tracked:
        assert (one.estimate.status, one.estimate.confidence) == ("searching", 0.0)
        assert "the pose of the start is in doubt, and no image confirms it" in one.notices


@pytest.mark.parametrize(
    ("move", "words"),
    [
        ([0.0, 0.0, 0.03, 0.0, 0.0, 0.0], "30 mm and 0 degrees"),
        ([0.0, 0.0, 0.0, 0.0, 0.35, 0.0], "0 mm and 20 degrees"),
    ],
)
def test_no_pose_is_tracking_whose_start_is_not_where_the_look_is_recognised(
    move: list[float], words: str, alone: Alone
) -> None:
    right = followed(alone, [0.0] * 6, knows_look=True)
    assert right.verdict == "good" and right.tracked_share == 1.0
    wrong = followed(alone, move, knows_look=True)
    assert wrong.verdict == "poor" and wrong.tracked_count == 0
    assert any(f"recognised {words} from the given start" in doubt for doubt in wrong.doubts)


@pytest.mark.parametrize("turn", [[3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]])
def test_a_start_that_neither_outline_nor_look_confirms_is_wrong_for_all_poses(
    turn: list[float], alone: Alone
) -> None:
    result = followed(alone, [0.0] * 3 + turn, knows_look=True)
    assert result.overlap is not None and 0.6 < result.overlap < 0.7  # by itself a doubt only
    for one in result.tracked:
        assert (one.estimate.status, one.estimate.confidence) == ("searching", 0.0)


def test_a_look_that_is_not_recognised_dooms_no_start_that_fits_its_mask(
    alone: Alone, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_other_light = Recognition(Pose.identity(), is_unlike=True, is_sure=False, off=(0.3, 1.0))
    monkeypatch.setattr(starting, "recognised", lambda *_: in_other_light)
    first, *others = followed(alone, [0.0] * 6, knows_look=True).tracked
    assert (first.estimate.status, first.estimate.confidence) == ("searching", 0.0)
    assert all(one.is_tracked for one in others)


@pytest.mark.extended
def test_a_look_that_is_not_recognised_where_a_mask_alone_was_given_confirms_no_pose(
    alone: Alone, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A mug on its head and a bottle that showed its back were tracking at 0.99, 100 and 180 degrees
    # off, and so was the body of a bottle on a box.
    unlike = Recognition(Pose.identity(), is_unlike=True, is_sure=False, off=(0.0, 0.0))
    file = load_body(alone.folder / "body.json")
    subject = Subject(body=file.body(), appearance=file.look(), fitness=file.fitness)
    for recognition in (replace(unlike, is_unlike=False), unlike):
        monkeypatch.setattr(starting, "recognised", lambda *_, said=recognition: said)
        result = track_capture(alone.recording.capture, [subject], FIRST)[0]
        statuses = {one.estimate.status for one in result.tracked}
        assert statuses == {"searching" if recognition.is_unlike else "tracking"}


@pytest.mark.parametrize(
    ("overlap", "fitness", "is_unlike", "is_wrong"),
    [
        (0.62, 0.9, False, False),
        (0.62, 0.9, True, True),
        (0.81, 0.9, True, True),  # the right starts of recordings fit by 0.86 and more
        (0.83, 0.9, True, False),
        (0.62, 0.65, True, False),  # of a coarse body
        (0.69, None, True, True),
        (0.71, None, True, False),
        (0.59, 0.9, False, True),
        (0.48, 0.57, False, False),  # of a drill as one ellipsoid, at its right pose
        (0.41, 0.57, False, True),
        (None, 0.9, True, False),
    ],
)
def test_an_outline_that_misfits_contradicts_a_start_whose_look_is_not_recognised(
    overlap: float | None, fitness: float | None, is_unlike: bool, is_wrong: bool
) -> None:
    assert is_contradicted(overlap, fitness, is_unlike=is_unlike) == is_wrong


def test_what_is_recognised_gives_the_pose_where_a_mask_alone_was_given(alone: Alone) -> None:
    file = load_body(alone.folder / "body.json")
    body, capture = file.body(), alone.recording.capture
    turned = alone.points[0].world_from_object @ Pose.exp([0.0, 0.0, 0.0, 0.0, 0.4, 0.0])
    views = [[(turned, 1.0)]]
    subject = Subject(body=body, appearance=file.look(), fitness=file.fitness)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(masked, "poses_from_masks", lambda *_: views[0])
        [result] = track_capture(capture, [subject], FIRST)
    off = (
        alone.points[0].world_from_object.inverse() @ result.estimates[0].world_from_object
    ).log()
    assert np.linalg.norm(off[3:]) < np.radians(3.0) and np.linalg.norm(off[:3]) < 5e-3
    assert result.verdict == "good" and result.tracked_share == 1.0


def test_a_mask_elsewhere_does_not_outweigh_what_is_recognised(alone: Alone) -> None:
    file = load_body(alone.folder / "body.json")
    subject = Subject(
        body=file.body(),
        start=alone.points[0].world_from_object,
        appearance=file.look(),
        fitness=file.fitness,
        targets=(parse_target("box:0,0,40,40"),),
    )
    trusting = replace(FIRST, trust_targets=True)
    [result] = track_capture(alone.recording.capture, [subject], trusting)
    assert any("is not where the mask of the first" in doubt for doubt in result.doubts)
    assert result.tracked_share == 1.0


def test_directions_that_motions_span_are_no_axes_of_observed_turns() -> None:
    moves = np.zeros((3, 6))
    moves[0, 3], moves[1, 3:5], moves[2, 0] = 1.0, (0.6, 0.8), 1.0
    axes, observable = unobservable_axes(moves, np.eye(3))
    assert axes.shape == (3, 2) and observable.shape == (3, 1)
    np.testing.assert_allclose(np.abs(observable[:, 0]), [0.0, 0.0, 1.0], atol=1e-12)
    np.testing.assert_array_equal(unobservable_axes(np.empty((0, 6)), np.eye(3))[1], np.eye(3))
