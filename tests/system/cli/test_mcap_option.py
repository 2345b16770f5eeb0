"""`--mcap`, `--topic` and `--world` on the command line."""

import re
import shutil
from pathlib import Path

import pytest
from bag_writing import image, write_bag
from drawn_pairs import Pair
from fake_tracker import FakeTracker, plain_body
from scenes_bags import pixels, stamp, stereo_entries

from conftest import Command, everything_in
from servoid.exchange import open_bag
from servoid.pose import Pose
from servoid.record import read_trajectory
from servoid.shape import save_body

# A ball there overlaps the mask of what is drawn by 0.83.
OWN = Pose(Pair().world_from_left) @ Pose.from_parts((0.012, -0.008, 0.34), (1.0, 0.0, 0.0, 0.0))
CUP = ("--body", "cup.json", "--start", "body")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fake_core: object) -> Path:
    """Stand in a folder with a video, a bag and a body; the core's tracker is the fake."""
    del fake_core
    Pair(centers=tuple((0.012 + 0.004 * i, -0.008, 0.42) for i in range(5))).write(
        tmp_path / "video", rate_hz=10.0
    )
    entries = [image("/debug/image_raw", stamp(0), "debug", pixels(0)), *stereo_entries()]
    write_bag(tmp_path / "run.bag", entries)
    save_body(tmp_path / "cup.json", plain_body(OWN))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def flat(text: str) -> str:
    return " ".join(text.split())


@pytest.mark.usefixtures("folder")
def test_a_run_is_recorded_and_tracked_again_from_the_recording(servoid_command: Command) -> None:
    first = servoid_command("track", "video", *CUP, "--mcap", "run.mcap")
    assert (first.code, first.err) == (0, "")
    assert "  recording    run.mcap\n" in first.out
    again = servoid_command("track", "run.mcap", *CUP, "--out", "again.csv")
    assert (again.code, again.err) == (0, "")
    assert "Tracked run.mcap: 5 observations, 2 cameras" in again.out
    assert Path("again.csv").read_bytes() == Path("poses.csv").read_bytes()


@pytest.mark.usefixtures("folder")
def test_a_recording_of_a_capture_says_that_its_masks_are_left_out(
    servoid_command: Command,
) -> None:
    first = servoid_command("record", "video", "--out", "run.mcap")
    assert (first.code, first.err) == (0, "")
    words = "note masks are not part of a recording; mark the object in it with --target, or give a"
    assert words in flat(first.out)
    recorded = Path("run.mcap").read_bytes()
    shutil.rmtree("video/masks")
    toml = Path("video/capture.toml")
    toml.write_text(re.sub(r"(?m)^masks = .*\n", "", toml.read_text()))
    plain = servoid_command("record", "video", "--out", "run.mcap")
    assert (plain.code, plain.err) == (0, "")
    assert "masks" not in plain.out
    assert Path("run.mcap").read_bytes() == recorded


@pytest.mark.usefixtures("folder")
def test_what_was_guessed_of_a_bag_is_in_the_summary(servoid_command: Command) -> None:
    done = servoid_command("track", "run.bag", *CUP)
    assert done.code == 0, done.err
    assert "left out: /debug/image_raw; --topic chooses others" in flat(done.out)
    assert "poses are in the frame 'world', the top of TF's tree" in flat(done.out)
    assert read_trajectory("poses.csv")[1].time_s == stamp(1) / 10**9


@pytest.mark.usefixtures("folder")
def test_topics_and_the_world_are_chosen(
    servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    chosen = ("--topic", "/stereo/right/image_raw", "--world", "rig")
    done = servoid_command("track", "run.bag", *CUP, *chosen)
    assert done.code == 0, done.err
    assert "6 observations, 1 camera" in done.out and "note" not in done.out
    poses = [
        one for tracker in fake_core.made for _, call in tracker.calls for one in call["poses"]
    ]
    assert {pose.translation for pose in poses} == {(0.1, 0.0, 0.0)}
    wrong = servoid_command("track", "run.bag", *CUP, "--topic", "/left")
    assert wrong.code == 1 and "holds no images on '/left'" in flat(wrong.err)
    wrong = servoid_command("track", "video", *CUP, "--world", "rig")
    assert wrong.code == 1 and "is not a bag" in flat(wrong.err)


def test_what_cannot_be_recorded_is_told_before_the_work(
    folder: Path, servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    before = everything_in(folder)
    wrong = servoid_command("track", "video", *CUP, "--mcap", "run.txt")
    assert (wrong.code, wrong.out) == (2, "")
    assert "ends in .mcap" in flat(wrong.err)
    wrong = servoid_command("track", "video", *CUP, "--mcap", "nowhere/run.mcap")
    assert wrong.code == 1 and "there is no folder" in flat(wrong.err)
    assert everything_in(folder) == before and fake_core.made == []


def test_what_was_tracked_before_a_stop_is_recorded_whole(
    folder: Path, servoid_command: Command, fake_core: type[FakeTracker]
) -> None:
    def answer(time_s: float) -> dict[str, object]:
        if time_s > 0.25:
            raise KeyboardInterrupt
        return {}

    fake_core.answers = staticmethod(answer)
    done = servoid_command("track", "video", *CUP, "--mcap", "run.mcap")
    assert done.code == 130
    assert len(open_bag(folder / "run.mcap")) == 3
    assert not list(folder.glob(".servoid-*"))


@pytest.mark.usefixtures("folder")
def test_a_bag_is_modelled_as_any_capture(servoid_command: Command) -> None:
    asked = ("model", "run.bag", "--out", "body.json", "--topic", "/left")
    wrong = servoid_command(*asked)
    assert wrong.code == 1 and "holds no images on '/left'" in flat(wrong.err)
    wrong = servoid_command("model", "run.bag", "--out", "body.json")
    assert wrong.code == 1 and "nothing marks the object" in flat(wrong.err)
