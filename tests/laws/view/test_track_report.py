"""The report of a track: what the command writes, what the page holds, and what is kept for it."""

import base64
import gc
import html
import json
import re
import shutil
import weakref
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from drawn import Drawn
from drawn_pairs import Pair
from fake_tracker import FakeTracker, plain_body
from recordings import run_servoid
from test_report_page import Page, looked_at
from tiers import tiered
from track_histories import history_of, track_of, turned

import servoid
from conftest import Command, everything_in, put_fake_core
from servoid import view
from servoid.capture import open_capture
from servoid.errors import TrackError
from servoid.pose import Pose
from servoid.record import read_trajectory
from servoid.shape import save_body
from servoid.sim import WHOLE_TURN, MovingScene, Scenario, write_moving_sample
from servoid.source import Instant
from servoid.track import Historian, LearnedSurface, TrackResult, TrackStep
from servoid.track.history import MOST_CHANGES
from servoid.view.track.growth_picture import surface_colors
from servoid.view.track.turning import Cause

MOVING = Pair(centers=tuple((0.012 + 0.004 * i, -0.008, 0.42) for i in range(5)))
CUP = ("--body", "cup.json", "--start", "body")
RADIUS_M = 0.042  # of two balls that overlap the drawn mask by 0.84, and are as far away
OWN = Pose(MOVING.world_from_left) @ Pose.from_parts((0.002, -0.008, 0.42), (1.0, 0.0, 0.0, 0.0))
PICTURES = ["growth.png", "sides.png", "timeline.png", "turning.png"]
FILES = {"report.html", "summary.json", *PICTURES}
CORRECTED = f"{Cause.KNOWN_SIDE.value}: the rotation is corrected by 2.5 degrees"


@pytest.fixture(scope="module")
def drawn_video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return MOVING.write(tmp_path_factory.mktemp("track") / "video", rate_hz=10.0)


@pytest.fixture
def folder(
    tmp_path: Path, drawn_video: Path, monkeypatch: pytest.MonkeyPatch, fake_core: object
) -> Path:
    """Stand in a folder with a video and a body; the core's tracker is the fake."""
    del fake_core
    (tmp_path / "video").symlink_to(drawn_video)
    save_body(tmp_path / "cup.json", plain_body(OWN, count=2, radius_m=RADIUS_M))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def eventful(time_s: float) -> dict[str, object]:
    """Return an object that turns, is lost for a while, and is corrected."""
    place = round(10 * time_s)
    return {
        "world_from_object": OWN @ Pose.exp([0.0, 0.0, 0.0, 0.0, 0.1 * place, 0.0]),
        "status": "lost" if place == 2 else "tracking",
        "confidence": 0.9 - 0.1 * place,
        "evidence": {"drift_rad": 0.01 * place},
        "notices": [CORRECTED] if place == 3 else [],
    }


@pytest.fixture(scope="module")
def reported(drawn_video: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a report of an eventful track."""
    folder = tmp_path_factory.mktemp("reported")
    save_body(folder / "cup.json", plain_body(OWN, count=2, radius_m=RADIUS_M))
    with pytest.MonkeyPatch.context() as patch:
        put_fake_core(patch).answers = staticmethod(eventful)
        output = run_servoid(folder, "track", drawn_video, *CUP, "--evolve", "--report", "report")
    assert "report/report.html" in output
    return folder / "report"


def test_a_report_is_a_page_pictures_and_figures_and_the_page_holds_all(reported: Path) -> None:
    assert set(everything_in(reported)) == FILES
    text = (reported / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    assert page.open == []
    shown = [str(image["src"]).split(",")[1] for image in page.attributes("img")]
    written = [(reported / name).read_bytes() for name in PICTURES]
    assert sorted(base64.b64decode(one) for one in shown) == sorted(written)
    assert all(cv2.imread(str(reported / name)) is not None for name in PICTURES)


def test_the_page_has_the_notes_on_the_images_that_the_terminal_prints(folder: Path) -> None:
    toml = MOVING.write(folder / "timeless") / "capture.toml"
    toml.write_text(toml.read_text().replace('[rig]\nposes = "poses.csv"\n', ""))
    output = run_servoid(folder, "track", "timeless", *CUP, "--report", "report")
    assert "the capture has no times: " in output
    assert "<li>the capture has no times: " in (folder / "report" / "report.html").read_text()


def test_the_page_needs_nothing_from_elsewhere(reported: Path) -> None:
    text = (reported / "report.html").read_text(encoding="utf-8")
    for tag, attributes in Page(text).elements:
        for name in ("src", "href", "srcset", "action", "data"):
            value = attributes.get(name)
            assert value is None or value.startswith("data:"), (tag, value)
    assert re.findall(r"https?://|url\(|@import|\bimport\b|fetch\(|XMLHttp", text) == []
    assert "default-src 'none'" in text


def test_the_figures_agree_with_the_poses_that_are_written(reported: Path) -> None:
    summary = json.loads((reported / "summary.json").read_text(encoding="utf-8"))
    points = read_trajectory(reported.parent / "poses.csv")
    steps = summary["steps"]
    assert [one["observation"] for one in steps] == [point.observation for point in points]
    assert [one["time_s"] for one in steps] == [point.time_s for point in points]
    assert [one["state"] for one in steps] == [point.status for point in points]
    assert [one["confidence"] for one in steps] == pytest.approx([p.confidence for p in points])
    assert [one["std_rad"] for one in steps] == pytest.approx(
        [point.std_rad for point in points], rel=1e-2
    )
    assert summary["tracked"] == sum(point.status == "tracking" for point in points) == 4
    assert summary["tracked_share"] == pytest.approx(0.8)
    assert summary["verdict"] == "rough"
    assert summary["reasons"][-1] == "not tracked in 1 of 5 observations"
    page = html.unescape((reported / "report.html").read_text(encoding="utf-8"))
    assert f"Tracking: {summary['verdict']}; it was tracked in 4 of 5" in page
    assert len(summary["doubts"]) == 1 and f"start: {summary['doubts'][0]}." in page
    assert [gap["count"] for gap in summary["gaps"]] == [1]
    [correction] = summary["corrections"]
    [noticed] = [point for point in points if CORRECTED in point.notices]
    assert correction["observation"] == noticed.observation
    assert correction["angle_rad"] == pytest.approx(np.radians(2.5))
    assert summary["turned_rad"] == pytest.approx(0.4, abs=1e-6)
    assert 0.1 < summary["sides_seen_share"] < 0.3


def test_the_page_says_what_became_of_the_track(reported: Path) -> None:
    text = "".join(Page((reported / "report.html").read_text(encoding="utf-8")).content["p"])
    assert (
        "Tracking: rough; it was tracked in 4 of 5 observations (80.0 %), and not at 0.20 s."
        in text
    )
    assert re.search(
        r"The cameras saw \d+ % of its sides. The depth of the others is a guess, unless", text
    )
    assert "It rotated by 23 degrees" in text
    assert f"/video · servoid {servoid.__version__}" in text
    assert "corrected once by 2.5 degrees: a known side is seen again" in text
    assert "drift was 2.3 degrees at most, and 2.3 degrees at the end" in text


@pytest.mark.parametrize(
    "stop", tiered([KeyboardInterrupt(), TrackError("the cameras are on <fire>")])
)
def test_what_was_tracked_before_a_stop_is_reported(
    stop: BaseException, folder: Path, servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    def answer(time_s: float) -> dict[str, object]:
        if time_s > 0.25:
            raise stop
        return {}

    fake_core.answers = staticmethod(answer)
    outcome = servoid_command("track", "video", *CUP, "--report", "report")
    assert outcome.code == (130 if isinstance(stop, KeyboardInterrupt) else 1)
    assert set(everything_in(folder / "report")) == FILES
    page = Page((folder / "report" / "report.html").read_text(encoding="utf-8"))
    words = "interrupted" if isinstance(stop, KeyboardInterrupt) else "ended"
    assert f"not finished: {words} after 3 observations" in "".join(page.content["p"])
    summary = json.loads((folder / "report" / "summary.json").read_text(encoding="utf-8"))
    assert summary["observations"] == len(read_trajectory("poses.csv")) == 3


@pytest.mark.parametrize(
    ("report", "message"),
    [("cup.json", "it is a file; name a folder"), ("none/report", "there is no folder")],
)
def test_a_report_that_cannot_be_written_is_refused_before_tracking(
    report: str,
    message: str,
    folder: Path,
    servoid_command: Command,
    fake_core: type[FakeTracker],
) -> None:
    before = everything_in(folder)
    outcome = servoid_command("track", "video", *CUP, "--report", report)
    assert (outcome.code, outcome.out) == (1, "")
    assert outcome.err.startswith("error: cannot write") and message in outcome.err
    assert everything_in(folder) == before
    assert fake_core.made == []


@pytest.mark.extended
def test_several_objects_have_a_folder_each(folder: Path, servoid_command: Command) -> None:
    save_body(folder / "jug.json", plain_body(OWN, radius_m=RADIUS_M))
    outcome = servoid_command(
        "track", "video", *CUP[:2], "--body", "jug.json", "--start", "cup=body",
        "--start", "jug=body", "--report", "turn",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    for name in ("cup", "jug"):
        assert set(everything_in(folder / f"turn_{name}")) == FILES
        summary = json.loads((folder / f"turn_{name}" / "summary.json").read_text("utf-8"))
        assert summary["object"] == name
    assert not (folder / "turn").exists()


@pytest.mark.extended
def test_poses_and_body_may_go_into_the_folder_that_the_report_makes(
    folder: Path, servoid_command: Command
) -> None:
    outcome = servoid_command(
        "track", "video", *CUP, "--report", "a", "--out", "a/p.csv", "--save-body", "a/b.json"
    )
    assert outcome.code == 0, outcome.err
    assert set(everything_in(folder / "a")) == {*FILES, "p.csv", "b.json"}


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("option", "expected"), [((), None), (("--adjust",), True), (("--no-adjust",), False)]
)
def test_the_choice_to_adjust_reaches_the_tracker(
    option: tuple[str, ...],
    expected: bool | None,
    servoid_command: Command,
    fake_core: type[FakeTracker],
) -> None:
    assert servoid_command("track", "video", *CUP, *option).code == 0
    assert fake_core.made[0].settings.options["adjust"] is expected


# What is gathered while tracking.


@pytest.fixture(scope="module")
def step_of(drawn_video: Path) -> Callable[[int], TrackStep]:
    """Make steps in each of which the body changes, with images of their own."""
    capture = open_capture(drawn_video)
    size = capture.cameras[0].ideal.camera.size_px

    def make(index: int) -> TrackStep:
        body = plain_body(OWN, count=1 + index, radius_m=RADIUS_M)
        [tracked] = track_of([OWN])
        estimate = replace(tracked.estimate, evolved=index > 0)
        tracked = replace(tracked, index=index, estimate=estimate)
        images = tuple(np.full((size[1], size[0], 3), index, np.uint8) for _ in range(2))
        instant = Instant(index, 0.1 * index, (Pose.identity(), Pose.identity()), images)
        one = SimpleNamespace(
            body=body,
            body_at=lambda _: body,
            tracker=None,
            surface=(np.empty((0, 3)), np.empty((0, 3))),
        )
        return TrackStep(instant, (one,), (tracked,), 0.0)  # type: ignore[arg-type]

    return make


def test_no_image_is_kept_and_few_thumbnails(
    drawn_video: Path, step_of: Callable[[int], TrackStep]
) -> None:
    historian = Historian(open_capture(drawn_video))
    images = []
    for index in range(3 * MOST_CHANGES):
        step = step_of(index)
        images += [weakref.ref(image) for image in step.instant.images if image is not None]
        historian.add(step)
        del step
    gc.collect()
    assert [image for image in images if image() is not None] == []
    [history] = historian.histories()
    assert MOST_CHANGES / 2 <= len(history.changes) <= MOST_CHANGES
    assert history.delivered.shape == (3 * MOST_CHANGES, 2)


def test_each_change_knows_the_body_before_and_after_and_they_are_evenly_spread(
    drawn_video: Path, step_of: Callable[[int], TrackStep]
) -> None:
    historian = Historian(open_capture(drawn_video))
    history = history_of(0)
    for index in range(3 * MOST_CHANGES):
        historian.add(step_of(index))
        [history] = historian.histories()
        counts = [(len(change.before), len(change.after)) for change in history.changes]
        assert counts == [(change.index, change.index + 1) for change in history.changes]
        assert len(set(np.diff([change.index for change in history.changes]))) <= 1
    assert len(history.initial) == 1
    seen = [change.thumbnail for change in history.changes]
    assert all(one is not None and (one.max() > 0) for one in seen)


def test_an_ellipsoid_has_the_colour_of_the_points_that_lie_on_it() -> None:
    body = plain_body(count=2)  # balls of 40 mm about x = 0 and x = 20 mm
    points = np.array([[-0.04, 0.0, 0.0], [-0.03, 0.02, 0.0], [0.06, 0.0, 0.0]])
    colors = np.array([[200, 0, 0], [100, 0, 0], [0, 0, 250]], np.uint8)
    found = surface_colors(body, LearnedSurface(points, colors))
    assert found.tolist() == [[150, 0, 0], [0, 0, 250]]
    bare = surface_colors(body, LearnedSurface(points[:0], colors[:0]))
    assert len({tuple(one) for one in bare.tolist()}) == 2


def test_a_track_that_was_never_confirmed_and_has_no_drift_has_a_report(tmp_path: Path) -> None:
    lost = track_of([turned((0.0, 0.0, 0.0))], lambda _: {"status": "lost"})
    result = TrackResult("a <b>", lost, plain_body(OWN, count=2, radius_m=RADIUS_M))
    files = view.write_track_report(result, history_of(1), tmp_path / "r", notes=["<i>{{script}}"])
    assert {path.name for path in files} == FILES
    summary = json.loads((tmp_path / "r" / "summary.json").read_text(encoding="utf-8"))
    assert summary["sides_seen_share"] == 0.0
    assert summary["step_s"]["median"] is None
    page = Page((tmp_path / "r" / "report.html").read_text(encoding="utf-8"))
    assert page.content["h1"] == ["The track of a <b>"]
    assert page.content["li"] == ["<i>{{script}}"]


@pytest.fixture(scope="module")
def turned_toy(tmp_path_factory: pytest.TempPathFactory, drawn: Drawn) -> Path:
    """Track a toy that is turned all the way around and back; return its folder."""
    folder = tmp_path_factory.mktemp("turned")
    scenario = Scenario(count=WHOLE_TURN, size="small", turn=True)
    drawn(folder / "toy", "moving", scenario, lambda new: write_moving_sample(new, scenario))
    run_servoid(folder, "track", "toy", "--report", "report", "--save-body", "body.json")
    return folder


@pytest.mark.extended
def test_the_report_of_a_whole_turn_knows_how_far_it_was(turned_toy: Path) -> None:
    summary = json.loads((turned_toy / "report" / "summary.json").read_text(encoding="utf-8"))
    scene = MovingScene(Scenario(count=WHOLE_TURN, size="small", turn=True))
    poses = [Pose(scene.left_from_object(index)) for index in range(WHOLE_TURN)]
    steps = [(before.inverse() @ after).log()[3:] for before, after in pairwise(poses)]
    turned_rad = float(np.linalg.norm(steps, axis=1).sum())
    assert turned_rad > 4.0 * np.pi
    assert summary["turned_rad"] == pytest.approx(turned_rad, rel=0.03)
    away = [np.linalg.norm((poses[0].inverse() @ pose).log()[3:]) for pose in poses]
    measured = [one["away_rad"] for one in summary["steps"] if one["state"] == "tracking"]
    true = [away[one["observation"]] for one in summary["steps"] if one["state"] == "tracking"]
    assert np.degrees(np.abs(np.subtract(measured, true)).max()) < 10.0


@pytest.mark.extended
def test_a_whole_turn_shows_all_sides_but_top_and_bottom_and_its_drift_falls_again(
    turned_toy: Path,
) -> None:
    summary = json.loads((turned_toy / "report" / "summary.json").read_text(encoding="utf-8"))
    assert summary["tracked_share"] > 0.6
    assert 0.6 < summary["sides_seen_share"] < 0.95
    seen = summary["sides_first_seen_s"]
    assert None not in [seen[name] for name in ("front", "right", "back", "left")]
    drift = np.array([one["drift_rad"] for one in summary["steps"]])
    assert drift.shape == (WHOLE_TURN,)
    assert drift[-1] < 0.5 * drift.max()
    points, words = read_trajectory(turned_toy / "poses.csv"), "the rotation is corrected by"
    noticed = [point.observation for point in points if words in point.notices]
    assert [one["observation"] for one in summary["corrections"]] == noticed
    assert summary["evolutions"] > 0


@pytest.mark.extended
def test_one_camera_tracks_more_of_a_turn_with_the_body_that_a_pair_saw(turned_toy: Path) -> None:
    (turned_toy / "eye").mkdir()
    for name in ("left", "masks"):
        shutil.copytree(turned_toy / "toy" / name, turned_toy / "eye" / name)
    parts = (turned_toy / "toy" / "capture.toml").read_text(encoding="utf-8").split("[[camera]]")
    (turned_toy / "eye" / "capture.toml").write_text("[[camera]]".join(parts[:2]))
    shares, around = {}, ("--observations", f":{WHOLE_TURN // 2}")  # once, and not back again
    for given in (("--body", "body.json"), ("--distance", 0.58)):
        run_servoid(turned_toy, "track", "eye", *given, *around, "--out", "eye.csv", "--seed", 0)
        points = read_trajectory(turned_toy / "eye.csv")
        shares[given[0]] = np.mean([point.status == "tracking" for point in points])
    # With a guessed body alone, a single camera trusts no turn beyond some 35 degrees, and with
    # either none where an image determines it three times worse than usual.
    assert shares["--body"] > 0.2
    assert shares["--body"] > 1.3 * shares["--distance"] > 0.02


@pytest.mark.extended
def test_in_a_browser_the_body_at_the_end_is_drawn(reported: Path, tmp_path: Path) -> None:
    if shutil.which("chromium") is None:
        pytest.skip("there is no chromium to look at the page with")
    seen = looked_at((reported / "report.html").read_text(encoding="utf-8"), tmp_path)
    assert 'data-drawn="yes"' in seen
