from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from drawn_pairs import BASELINE, Pair
from fake_tracker import FakeTracker, plain_body

from servoid.capture import open_capture
from servoid.errors import TargetError, TrackError
from servoid.model import Request as ModelRequest
from servoid.model import fit, fit_capture
from servoid.pose import Pose
from servoid.segment import parse_target
from servoid.shape import Body
from servoid.source import ASSUMED_HZ
from servoid.track import Collector, Method, Request, Subject, follow, track_capture

MOVING = Pair(centers=tuple((0.012 + 0.004 * i, -0.008, 0.42) for i in range(6)))
# A ball there overlaps the mask of what is drawn by 0.83, and is as far away.
RADIUS_M = 0.0494
START = Pose(MOVING.world_from_left) @ Pose.from_parts((0.012, -0.008, 0.42), (1.0, 0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return MOVING.write(tmp_path_factory.mktemp("track") / "video", rate_hz=10.0)


@pytest.fixture
def own_video(tmp_path: Path) -> Path:
    """Return a video that a test may spoil."""
    return MOVING.write(tmp_path / "video", rate_hz=10.0)


def known(**options: object) -> Subject:
    return Subject(**({"body": plain_body(START, radius_m=RADIUS_M), "start": START} | options))  # type: ignore


def test_each_observation_is_given_once_in_order_with_its_time(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    [result] = track_capture(open_capture(video), [known()])
    [tracker] = fake_core.made
    given = [call["time_s"] for kind, call in tracker.calls if kind != "evolve"]
    assert given == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    assert [one.index for one in result.tracked] == list(range(6))
    assert tracker.kinds()[:2] == ["start", "step"]


@pytest.mark.usefixtures("fake_core")
def test_a_result_is_there_before_the_next_images_are_read(own_video: Path) -> None:
    steps = follow(open_capture(own_video), [known()])
    next(steps)
    for path in (own_video / "left").glob("*.png"):
        path.unlink()
    step = next(steps)
    assert step.instant.images[0] is None
    assert step.instant.images[1] is not None


def test_the_cameras_stand_where_the_capture_says(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    track_capture(open_capture(video), [known()])
    _, call = fake_core.made[0].calls[0]
    left, right = (pose.matrix() for pose in call["poses"])
    assert np.allclose(left, MOVING.world_from_left, atol=1e-9)
    left_from_right = np.eye(4)
    left_from_right[0, 3] = BASELINE
    assert np.allclose(left @ left_from_right, right, atol=1e-9)


@pytest.mark.usefixtures("fake_core")
def test_every_and_the_slice_choose_observations(video: Path) -> None:
    request = Request(observations=slice(1, 6), every=2)
    [result] = track_capture(open_capture(video), [known()], request)
    assert [one.index for one in result.tracked] == [1, 3, 5]
    with pytest.raises(TrackError, match="selects none of the 6; choose among 0 to 5"):
        track_capture(open_capture(video), [known()], Request(observations=slice(6, 9)))


def spoil_missing(path: Path) -> None:
    path.unlink()


def spoil_cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:200])


def spoil_size(path: Path) -> None:
    cv2.imwrite(str(path), np.zeros((40, 30, 3), np.uint8))


def spoil_text(path: Path) -> None:
    path.write_text("no image")


@pytest.mark.parametrize("spoil", [spoil_missing, spoil_cut, spoil_size, spoil_text])
@pytest.mark.parametrize("index", [0, 3])
def test_an_image_that_cannot_be_used_is_none_with_a_notice_and_the_rest_goes_on(
    own_video: Path, fake_core: type[FakeTracker], spoil: Callable[[Path], None], index: int
) -> None:
    capture = open_capture(own_video)
    spoil(own_video / "right" / f"{index:04}.png")
    [result] = track_capture(capture, [known()])
    given = [call["images"] for kind, call in fake_core.made[0].calls if kind != "evolve"]
    assert [images[1] is None for images in given] == [one == index for one in range(6)]
    assert all(images[0] is not None for images in given)
    noticed = [one.index for one in result.tracked if one.notices]
    assert noticed == [index]
    assert "camera right: " in result.tracked[index].notices[0]


@pytest.mark.usefixtures("fake_core")
def test_observations_without_any_image_before_the_start_are_passed_over(own_video: Path) -> None:
    capture = open_capture(own_video)
    for name in ("left", "right"):
        for index in range(2):
            spoil_text(own_video / name / f"{index:04}.png")
    [result] = track_capture(capture, [known()])
    assert [one.index for one in result.tracked] == [2, 3, 4, 5]
    assert result.notes == ("the first 2 observations have no image that can be read",)
    for path in own_video.glob("*/*.png"):
        path.write_text("no image")
    unread = "no image of the 6 observations can be read: .*0000.png cannot be decoded"
    with pytest.raises(TrackError, match=unread):
        track_capture(capture, [known()])


@pytest.mark.usefixtures("fake_core")
def test_a_capture_without_times_is_taken_for_one_of_a_usual_rate(drawn_capture: Path) -> None:
    (drawn_capture / "poses.csv").unlink()
    toml = drawn_capture / "capture.toml"
    toml.write_text(toml.read_text().replace('[rig]\nposes = "poses.csv"', ""))
    [result] = track_capture(open_capture(drawn_capture), [known()])
    assert [one.estimate.time_s for one in result.tracked] == [i / ASSUMED_HZ for i in range(8)]


def test_a_body_with_a_start_begins_there_with_the_masks_that_are_there(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    start = Pose(MOVING.world_from_left) @ Pose.from_parts(MOVING.centers[0], (1.0, 0.0, 0.0, 0.0))
    track_capture(open_capture(video), [known(start=start)])
    kind, call = fake_core.made[0].calls[0]
    assert kind == "start"
    assert fake_core.made[0].pose.translation == start.translation
    left, right = call["masks"]
    assert np.array_equal(left > 0, MOVING.draw(0, 0.0)[2])
    assert right is None


def test_a_mask_that_is_not_where_the_start_says_is_not_used_and_that_is_said(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    start = Pose.from_parts((0.1, 0.2, 0.3), (1.0, 0.0, 0.0, 0.0))
    [result] = track_capture(open_capture(video), [known(start=start)])
    assert fake_core.made[0].calls[0][1]["masks"] is None
    assert any("is not where the mask of the first" in note for note in result.notes)
    assert not any(one.is_tracked for one in result.tracked)


def test_a_body_without_a_start_is_placed_in_the_mask_or_the_target(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    capture = open_capture(video)
    body = fit_capture(capture, ModelRequest(max_ellipsoids=1)).body
    target = parse_target("box:60,40,220,170@right/0000")
    away = Pose.from_parts((5.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0))
    moved = Body(
        world_from_object=away, centers=body.centers, radii=body.radii, rotations=body.rotations
    )
    for targets in ((), (target,)):
        track_capture(capture, [Subject(body=moved, targets=targets)], Request(seed=2))
        kind, _ = fake_core.made[-1].calls[0]
        found = fake_core.made[-1].pose
        assert kind == "start"
        off = np.array(found.translation) - (MOVING.world_from_left @ [*MOVING.centers[0], 1.0])[:3]
        assert np.linalg.norm(off) < 0.03


@pytest.mark.usefixtures("fake_core")
def test_a_body_that_nothing_places_or_that_fits_no_mask_is_refused(video: Path) -> None:
    capture = open_capture(video)
    with pytest.raises(TrackError, match="nothing says where 'object' is in observation 1; mark"):
        track_capture(capture, [known(start=None)], Request(observations=slice(1, None)))
    rod = Body(
        world_from_object=START,
        centers=np.zeros((1, 3)),
        radii=np.array([[0.3, 0.002, 0.002]]),
        rotations=np.array([[1.0, 0.0, 0.0, 0.0]]),
    )
    with pytest.raises(TrackError, match=r"the body does not fit the mask: .* 0\.[0-4]"):
        track_capture(capture, [known(body=rod, start=None)])


@pytest.mark.extended
def test_without_a_body_the_first_observation_is_modelled_and_tracked_from_there(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    [result] = track_capture(open_capture(video), request=Request(seed=3))
    kind, call = fake_core.made[0].calls[0]
    assert kind == "start"
    assert call["masks"][0] is not None
    seen = np.linalg.norm(
        np.array(result.body.world_from_object.translation)
        - (MOVING.world_from_left @ [*MOVING.centers[0], 1.0])[:3]
    )
    assert seen < 0.02
    assert result.colors is not None and len(result.colors) == len(result.body)
    with pytest.raises(TargetError, match="nothing marks the object"):
        track_capture(open_capture(video), request=Request(observations=slice(1, None)))


def test_a_start_needs_a_body_and_names_must_differ(video: Path) -> None:
    with pytest.raises(TrackError, match="no body was given"):
        Subject(start=START)
    with pytest.raises(TrackError, match="two objects are named 'object'"):
        track_capture(open_capture(video), [known(), known()])
    for subjects, said in (([], "nothing to track"), (["toy"], r"write Subject\(body=...\)")):
        with pytest.raises(TrackError, match=said):
            track_capture(open_capture(video), subjects)  # pyright: ignore[reportArgumentType]


def test_several_objects_have_a_tracker_each_and_share_the_images(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    results = track_capture(open_capture(video), [known(name="a"), known(name="b")])
    assert [result.name for result in results] == ["a", "b"]
    first, second = fake_core.made
    assert first.calls[2][1]["images"][0] is second.calls[2][1]["images"][0]


def test_the_body_evolves_every_few_trusted_observations_unless_told_not_to(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    capture = open_capture(video)
    fake_core.answers = staticmethod(
        lambda time_s: {"status": "lost" if time_s == pytest.approx(0.4) else "tracking"}
    )
    [result] = track_capture(capture, [known()], Request(evolve=True, evolve_every=2))
    track_capture(capture, [known()], Request(evolve_every=2, evolve=False))
    evolving, still = (made.kinds() for made in fake_core.made)
    assert evolving == ["start", "step", "step", "evolve", "step", "step", "step"]
    assert "evolve" not in still
    assert result.evolutions == 1


@pytest.mark.extended
def test_a_body_made_on_the_spot_evolves_and_one_that_was_given_does_not_unless_asked(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    capture, given = open_capture(video), known(name="given")
    track_capture(capture, [Subject(), given], Request(evolve_every=2))
    track_capture(capture, [Subject(), given], Request(evolve_every=2, evolve=True))
    track_capture(capture, [Subject(), given], Request(evolve_every=2, evolve=False))
    evolved = ["evolve" in made.kinds() for made in fake_core.made]
    assert evolved == [True, False, True, True, False, False]


def test_the_settings_reach_the_core_and_none_stays_none(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    track_capture(open_capture(video), [known()], Request(seed=5, budget_s=0.02, surface=False))
    options = fake_core.made[0].settings.options
    assert (options["seed"], options["budget_s"], options["surface"]) == (5, 0.02, False)
    assert options["population"] is None


def test_another_tracker_can_take_the_core_s_place(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    given = []

    def make(cameras: object, body: object, options: object) -> FakeTracker:
        given.append(options)
        return fake_core(cameras, body)  # type: ignore

    track_capture(open_capture(video), [known()], Request(maker=make))  # type: ignore
    assert fake_core.made[0].settings is None
    assert given[0]["seed"] is None


def test_figures_of_speed_count_the_steps_and_not_the_start(
    video: Path, fake_core: type[FakeTracker]
) -> None:
    fake_core.answers = staticmethod(
        lambda time_s: {
            "seconds": {"prepare": 1.0 if time_s == 0.0 else 0.002, "search": 0.001},
            "evaluations": 9999 if time_s == 0.0 else 200,
            "status": "tracking" if time_s < 0.25 or time_s > 0.45 else "searching",
        }
    )
    [result] = track_capture(open_capture(video), [known()])
    assert result.stage_seconds == pytest.approx({"prepare": 0.002, "search": 0.001})
    assert list(result.stage_seconds) == ["prepare", "search"]
    assert result.evaluations == 200
    assert result.tracked_share == pytest.approx(4 / 6)
    assert [(round(gap.first_s, 3), gap.count) for gap in result.gaps] == [(0.3, 2)]
    assert result.rate_hz == pytest.approx(1.0 / result.step_seconds.mean())
    assert result.step_percentile(50.0) == pytest.approx(np.median(result.step_seconds))


@pytest.mark.usefixtures("fake_core")
def test_notices_that_differ_by_numbers_are_counted_together(video: Path) -> None:
    [result] = track_capture(open_capture(video), [known()])
    words = ["22 % is hidden", "23.5 % is hidden", "camera 0 is dark", "31 % is hidden"]
    tracked = [
        replace(one, notices=(notice,)) for one, notice in zip(result.tracked, words, strict=False)
    ]
    counted = replace(result, tracked=tracked).notices
    assert counted == [("22 to 31 % is hidden", 3), ("camera 0 is dark", 1)]


@pytest.mark.usefixtures("fake_core")
def test_the_time_to_read_images_is_not_the_tracker_s(
    video: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from servoid.camera import Picture

    clock = [0.0]
    read = Picture.read

    def slowly(picture: Picture, *given: Any) -> object:
        clock[0] += 10.0
        return read(picture, *given)

    monkeypatch.setattr(Picture, "read", slowly)
    monkeypatch.setattr("time.perf_counter", lambda: clock[0])
    [result] = track_capture(open_capture(video), [known()])
    assert result.step_seconds.tolist() == [0.0] * 5


@pytest.mark.usefixtures("fake_core")
def test_what_was_collected_before_a_stop_is_a_track(video: Path) -> None:
    collector = Collector()
    for step in follow(open_capture(video), [known()]):
        collector.add(step)
        if len(collector) == 3:
            break
    [result] = collector.results()
    assert len(result) == 3
    assert Collector().results() == []


def test_the_paper_s_tracker_scores_one_generation_an_image_and_takes_its_own_settings_only(
    video: Path,
) -> None:
    capture = open_capture(video)
    body = fit_capture(capture, ModelRequest(max_ellipsoids=1)).body
    subject = Subject(body=body, start=body.world_from_object)
    request = Request(method=Method.PAPER, seed=1, population=60)
    [result] = track_capture(capture, [subject], request)
    assert [one.estimate.evaluations for one in result.tracked[1:]] == [60] * 5
    with pytest.raises(TrackError, match="generations was given, which the paper's method"):
        track_capture(capture, [subject], Request(method=Method.PAPER, generations=3))


@pytest.mark.extended
def test_a_moving_object_is_followed_from_its_mask_alone(video: Path) -> None:
    [result] = track_capture(open_capture(video), request=Request(seed=1))
    first, last = (result.estimates[at].world_from_object.translation for at in (0, -1))
    true = MOVING.world_from_left[:3, 0] * (MOVING.centers[-1][0] - MOVING.centers[0][0])
    assert result.tracked_share == 1.0
    assert np.linalg.norm(np.array(last) - first - true) < 0.002
    assert list(result.stage_seconds) == ["prepare", "search", "refine", "verify", "update"]


@pytest.mark.extended
def test_a_camera_that_dies_on_the_way_does_not_end_the_track(own_video: Path) -> None:
    capture = open_capture(own_video)
    for index in range(3, 6):
        (own_video / "right" / f"{index:04}.png").unlink()
    [result] = track_capture(capture, request=Request(seed=1))
    first, last = (result.estimates[at].world_from_object.translation for at in (0, -1))
    true = MOVING.world_from_left[:3, 0] * (MOVING.centers[-1][0] - MOVING.centers[0][0])
    assert len(result) == 6
    assert np.linalg.norm(np.array(last) - first - true) < 0.01
    assert [bool(one.notices) for one in result.tracked] == [False] * 3 + [True] * 3


@pytest.mark.usefixtures("fake_core")
def test_the_drawn_capture_leads_back_to_the_body_it_was_modelled_from(drawn_capture: Path) -> None:
    capture = open_capture(drawn_capture)
    body = fit(capture.views(), max_ellipsoids=1).body
    [result] = track_capture(capture, [Subject(body=body, start=body.world_from_object)])
    assert np.allclose(
        result.body.world_from_object.matrix(), body.world_from_object.matrix(), atol=1e-12
    )
