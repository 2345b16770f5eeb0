import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from drawn_pairs import SIZE_PX, Pair
from fake_tracker import FakeTracker, plain_body

from conftest import Command, Outcome, everything_in
from servoid.errors import TrackError
from servoid.pose import Pose
from servoid.record import read_trajectory
from servoid.shape import load_body, save_body

MOVING = Pair(centers=tuple((0.012 + 0.004 * i, -0.008, 0.42) for i in range(5)))
BARE = ("--body", "cup.json")
BOTH = (*BARE, "--body", "jug.json")
CUP = (*BARE, "--start", "body")
# A ball there overlaps the mask of what is drawn by 0.83, and is as far away.
RADIUS_M = 0.0494
OWN = Pose(MOVING.world_from_left) @ Pose.from_parts((0.012, -0.008, 0.42), (1.0, 0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def drawn_video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return MOVING.write(tmp_path_factory.mktemp("track") / "video", rate_hz=10.0)


@pytest.fixture
def folder(
    tmp_path: Path, drawn_video: Path, monkeypatch: pytest.MonkeyPatch, fake_core: object
) -> Path:
    """Stand in a folder with a video and two bodies; the core's tracker is the fake."""
    del fake_core
    (tmp_path / "video").symlink_to(drawn_video)
    save_body(tmp_path / "cup.json", plain_body(OWN, radius_m=RADIUS_M))
    jug = plain_body(OWN, count=2, radius_m=RADIUS_M)
    save_body(tmp_path / "jug.json", jug, np.zeros((2, 3), np.uint8))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def rows(outcome: Outcome) -> dict[str, str]:
    return dict(re.findall(r"^  (\S.*?)  +(\S.*)$", outcome.out, re.MULTILINE))


@pytest.mark.usefixtures("folder")
def test_a_body_is_tracked_into_a_file_and_a_summary(
    servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    fake_core.answers = staticmethod(
        lambda time_s: {"status": "lost" if 0.15 < time_s < 0.35 else "tracking"}
    )
    outcome = servoid_command("track", "video", *CUP)
    assert (outcome.code, outcome.err) == (0, "")
    points = read_trajectory("poses.csv")
    assert [point.status == "lost" for point in points] == [False, False, True, True, False]
    assert [point.time_s for point in points] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    assert points[0].world_from_object.translation == pytest.approx(OWN.translation)
    summary = rows(outcome)
    assert outcome.out.startswith("Tracked video: 5 observations, 2 cameras\n  verdict ")
    assert summary["verdict"].startswith("poor: ")
    assert "not tracked in 2 of 5" in summary["verdict"]
    assert summary["tracked"] == "60.0 % (3 of 5)"
    assert summary["not tracked"] == "0.20 to 0.30 s (2 observations)"
    assert summary["on average"].startswith("mean 5.00: prepare 1.00, search 1.00")
    assert summary["poses"] == "poses.csv"


@pytest.mark.usefixtures("folder")
def test_a_single_observation_that_is_not_tracked_is_told_by_its_time_not_as_a_duration(
    servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    fake_core.answers = staticmethod(
        lambda time_s: {"status": "lost" if 0.15 < time_s < 0.25 else "tracking"}
    )
    summary = rows(servoid_command("track", "video", *CUP))
    assert summary["not tracked"] == "at 0.20 s (1 observation)"
    assert " s to the first pose, " in summary["start"]


@pytest.mark.usefixtures("folder")
def test_the_summary_fits_a_screen_of_eighty_columns(
    servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    fake_core.answers = staticmethod(
        lambda time_s: {
            "status": "lost" if round(time_s * 10) % 2 else "tracking",
            "notices": [f"camera left, at {time_s}: {'much is wrong with this image ' * 4}"],
        }
    )
    outcome = servoid_command("track", "video", *CUP, "--video", "out.mp4")
    assert outcome.code == 0, outcome.err
    lines = outcome.out.splitlines()
    assert max(map(len, lines)) <= 80
    assert len(lines) <= 24


@pytest.mark.usefixtures("folder")
def test_the_suffix_chooses_the_format(servoid_command: Command) -> None:
    outcome = servoid_command("track", "video", *CUP, "--out", "a.tum")
    assert outcome.code == 0, outcome.err
    assert np.loadtxt("a.tum").shape == (5, 8)


@pytest.mark.usefixtures("folder")
def test_several_bodies_have_a_file_each_named_after_them(
    folder: Path, servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    before = everything_in(folder)
    outcome = servoid_command(
        "track", "video", "--body", "cup.json", "--body", "b=jug.json", "--save-body", "new.json",
        "--start", "cup=body", "--start", "b=1,2,3,1,0,0,0",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    made = set(everything_in(folder)) - set(before)
    assert made == {"poses_cup.csv", "poses_b.csv", "new_cup.json", "new_b.json"}
    assert read_trajectory("poses_b.csv")[0].world_from_object.translation == (1.0, 2.0, 3.0)
    assert len(fake_core.made) == 2
    assert re.search(r"^ cup$", outcome.out, re.MULTILINE)


@pytest.mark.usefixtures("folder", "fake_core")
def test_what_nothing_corrected_is_the_same_in_the_smoothed_file(servoid_command: Command) -> None:
    outcome = servoid_command("track", "video", *CUP, "--smooth", "smooth.csv")
    assert outcome.code == 0, outcome.err
    assert re.search(r"smoothed +smooth\.csv", outcome.out)
    assert Path("smooth.csv").read_text() == Path("poses.csv").read_text()


@pytest.mark.usefixtures("folder")
def test_the_body_is_saved_at_its_newest_pose_with_its_colours(
    servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    end = Pose.from_parts((0.5, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    fake_core.answers = staticmethod(
        lambda time_s: {"world_from_object": end} if time_s > 0.35 else {}
    )
    outcome = servoid_command(
        "track", "video", "--body", "jug.json", "--start", "body", "--save-body", "new.json"
    )
    assert outcome.code == 0, outcome.err
    saved = load_body("new.json")
    assert saved.world_from_object == (0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    assert saved.colors() is not None


@pytest.mark.usefixtures("folder")
def test_without_a_body_the_first_observation_is_modelled(
    servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    outcome = servoid_command("track", "video", "--target", "box:60,40,240,180", "--seed", 4)
    assert outcome.code == 0, outcome.err
    [tracker] = fake_core.made
    assert tracker.kinds()[0] == "start"
    assert tracker.settings.options["seed"] == 4
    away = (
        np.array(tracker.pose.translation) - (MOVING.world_from_left @ [0.012, -0.008, 0.42, 1])[:3]
    )
    assert np.linalg.norm(away) < 0.03


@pytest.mark.usefixtures("folder")
def test_options_reach_the_tracker(servoid_command: Command, fake_core: type[FakeTracker]) -> None:
    outcome = servoid_command(
        "track", "video", *CUP, "--population", 50, "--generations", 7,
        "--budget-ms", 4, "--every", 2, "--observations", "1:", "--no-evolve",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    options = fake_core.made[0].settings.options
    assert (options["population"], options["generations"]) == (50, 7)
    assert options["budget_s"] == pytest.approx(0.004)
    assert [point.observation for point in read_trajectory("poses.csv")] == [1, 3]


@pytest.mark.usefixtures("folder")
def test_the_video_has_an_image_for_each_observation(servoid_command: Command) -> None:
    outcome = servoid_command("track", "video", *CUP, "--video", "out.mp4")
    assert outcome.code == 0, outcome.err
    assert rows(outcome)["video"] == "out.mp4"
    video = cv2.VideoCapture("out.mp4")
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 5
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(10.0)
    assert video.get(cv2.CAP_PROP_FRAME_WIDTH) == 2 * SIZE_PX[0]


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), TrackError("the cameras are on fire")])
def test_what_was_tracked_before_a_stop_is_written_whole(
    stop: BaseException, folder: Path, servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    def answer(time_s: float) -> dict[str, object]:
        if time_s > 0.25:
            raise stop
        return {}

    fake_core.answers = staticmethod(answer)
    before = everything_in(folder)
    outcome = servoid_command("track", "video", *CUP, "--video", "out.mp4")
    interrupted = isinstance(stop, KeyboardInterrupt)
    assert outcome.code == (130 if interrupted else 1)
    assert outcome.err == (
        "interrupted after 3 observations\n" if interrupted else f"error: {stop}\n"
    )
    assert "3 observations" in outcome.out
    assert len(read_trajectory("poses.csv")) == 3
    assert cv2.VideoCapture("out.mp4").get(cv2.CAP_PROP_FRAME_COUNT) == 3
    assert set(everything_in(folder)) - set(before) == {"poses.csv", "out.mp4"}


def test_a_stop_before_the_first_estimate_writes_nothing(
    folder: Path, servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    def answer(_: float) -> dict[str, object]:
        raise KeyboardInterrupt

    fake_core.answers = staticmethod(answer)
    before = everything_in(folder)
    outcome = servoid_command("track", "video", *CUP, "--video", "out.mp4")
    assert (outcome.code, outcome.out) == (130, "")
    assert everything_in(folder) == before


@pytest.mark.usefixtures("folder")
def test_an_interrupt_while_the_calibration_is_checked_loses_no_pose(
    servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("servoid.track.following.doubt_calibration", interrupted)
    assert servoid_command("track", "video", *CUP).code == 130
    assert len(read_trajectory("poses.csv")) == 5


REFUSED: dict[str, tuple[tuple[str, ...], str]] = {
    "no body file": (("--body", "none.json"), r"none\.json"),
    "a body that is none": (("--body", "video/poses.csv"), r"poses\.csv is not valid JSON"),
    "a mesh for a body": (("--body", "cup.obj"), r"cup\.obj is a mesh, .* --out cup\.json"),
    "a pose of six": (
        (*BARE, "--start", "1,2,3,1,0,0"),
        r"'1,2,3,1,0,0' is not a pose; write X,Y,Z",
    ),
    "a pose of words": ((*BARE, "--start", "here"), r"'here' is not a pose; write X,Y,Z"),
    "no rotation": ((*BARE, "--start", "1,2,3,0,0,0,0"), r"'1,2,3,0,0,0,0': .*quaternion"),
    "its own start without a body": (("--start", "body"), r"--start body .* no --body was given"),
    "a start without a body": (("--start", "1,2,3,1,0,0,0"), "no body was given"),
    "two starts": ((*BARE, "--start", "body", "--start", "body"), "'cup' has two starts"),
    "a start for whom": ((*BOTH, "--start", "body"), r"--start body does not say which .* cup="),
    "a target for whom": ((*BOTH, "--target", "click:1,2"), r"such as --target cup=click:1,2; the"),
    "a target for nobody": (
        (*BARE, "--target", "a=click:1,2"),
        r"for 'a', but the objects are cup",
    ),
    "two of one name": ((*BARE, *BARE), r"two bodies are named 'cup'; .* --body b=cup\.json"),
    "a target that is none": (("--target", "cup"), "cup"),
    "an unknown suffix": ((*BARE, "--out", "a.bag"), r"cannot write a\.bag: a trajectory ends in"),
    "a smoothed track of another kind": (
        (*BARE, "--smooth", "a.bag"),
        r"a\.bag: a trajectory ends",
    ),
    "a distance that cannot be": ((*BARE, "--distance", "nan"), "the distance is nan; give a pos"),
    "one file for both": ((*BARE, "--smooth", "poses.csv"), "another file than --out"),
    "no folder": ((*BARE, "--out", "none/a.csv"), "there is no folder"),
    "a video of another kind": ((*BARE, "--video", "a.gif"), r"a\.gif: a video ends in \.mp4"),
    "a body to another kind": ((*BARE, "--save-body", "a.toml"), r"a body ends in \.json"),
    "no pose and no mask": ((*BARE, "--observations", "1:"), "nothing says where 'cup' is in obs"),
    "no observations": ((*BARE, "--observations", "9:"), "selects none of the 5"),
    "no mask and no target": (("--observations", "1:"), "nothing marks the object"),
}


OF_FILES = {
    "no body file",
    "a body that is none",
    "a mesh for a body",
    "no folder",
    "no pose and no mask",
    "no observations",
    "no mask and no target",
}
"""What hangs on what lies on the disk; the rest are options that cannot be."""


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_tracked_is_refused_in_one_line_and_leaves_no_file(
    case: str, folder: Path, servoid_command: Command
) -> None:
    arguments, message = REFUSED[case]
    before = everything_in(folder)
    outcome = servoid_command("track", "video", *arguments)
    assert everything_in(folder) == before
    code = 1 if case in OF_FILES else 2
    assert (outcome.code, outcome.out) == (code, ""), outcome.err
    assert outcome.err.startswith("error: ") and outcome.err.count("\n") == 1, outcome.err
    assert re.search(message, outcome.err), outcome.err


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "option", [("--every", "0"), ("--budget-ms", "-1"), ("--seed", "-1"), ("--method", "magic")]
)
def test_a_value_out_of_range_is_a_wrong_use(
    option: tuple[str, str], servoid_command: Command
) -> None:
    outcome = servoid_command("track", "video", *CUP, *option)
    assert outcome.code == 2
    assert option[0] in outcome.err


def test_a_population_that_cannot_be_is_refused_before_anything_is_read(
    tmp_path: Path, servoid_command: Command
) -> None:
    outcome = servoid_command("track", tmp_path / "none", "--population", "3")
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err == "error: --population must be 8 to 4096, but it is 3\n"


def test_a_capture_that_is_not_there_is_named(folder: Path, servoid_command: Command) -> None:
    outcome = servoid_command("track", folder / "none", *CUP)
    assert outcome.code == 1
    assert re.search(r"error: there is no .*none;", outcome.err)
    (folder / "film.mp4").write_bytes(b"\0\1\2\3")
    outcome = servoid_command("track", folder / "film.mp4", *CUP)
    assert outcome.code == 1
    assert re.search(r"film\.mp4 is not a video: it does not begin like an MP4", outcome.err)


@pytest.mark.usefixtures("folder")
def test_an_encoder_that_is_missing_is_told_before_the_work(
    folder: Path,
    servoid_command: Command,
    monkeypatch: pytest.MonkeyPatch,
    fake_core: type[FakeTracker],
) -> None:
    monkeypatch.setattr("servoid.record.video_file._CODEC", "zzzz")
    before = everything_in(folder)
    outcome = servoid_command("track", "video", *CUP, "--video", "out.mp4")
    assert outcome.code == 1
    assert "no MPEG-4 encoder" in outcome.err
    assert everything_in(folder) == before
    assert fake_core.made == []


@pytest.mark.usefixtures("folder")
def test_nothing_is_shown_on_standard_error_that_is_no_terminal(servoid_command: Command) -> None:
    assert servoid_command("track", "video", *CUP).err == ""
