import html
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from conftest import Command, Outcome, everything_in

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
pytest.importorskip("daqp", reason="servoing within all limits needs daqp")
pytest.importorskip("matplotlib", reason="the plots of a run need matplotlib")

from bag_writing import reads_with
from interrupted_runs import interrupt_at
from servo_trials import log_rows, small_settings

from servoid.cli.servo import servoing
from servoid.cli.servo.leftovers import remove_leftovers
from servoid.servo import Reason
from servoid.shape import load_body
from servoid.sim.trial import TrialSettings, read_trial_settings, trial_toml
from servoid.sim.world import IDEAL

SHORT = {"run.seconds": 1.0, "run.settle_s": 0.5, "servo.look.count": 1}
FORMATS = Path(__file__).parents[3] / "docs" / "formats.md"
PLOTS = ("hand.png", "joints.png", "gaze.png")
FILES = (
    "log.csv",
    "times.csv",
    "run.toml",
    "body.json",
    "summary.json",
    "servo.mp4",
    "report.html",
    *PLOTS,
)


def servo_apart(folder: Path, *arguments: str) -> Outcome:
    """Run `servoid servo` in a process of its own, away from any terminal."""
    code = "from servoid.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "servo", *arguments],
        cwd=folder,
        env=os.environ | {"COLUMNS": "80"},
        capture_output=True,
        text=True,
    )
    return Outcome(done.returncode, done.stdout, done.stderr)


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Outcome]:
    """Run once by a file with settings, for all tests that look at what comes of it."""
    folder = tmp_path_factory.mktemp("servo")
    (folder / "small.toml").write_text(trial_toml(small_settings(SHORT)))
    return folder, servo_apart(folder, "--config", "small.toml", "--out", "new/run")


def rows_of(outcome: Outcome) -> dict[str, str]:
    return dict(re.findall(r"^  (\S.*?)  +(\S.*)$", outcome.out, re.MULTILINE))


def test_a_run_writes_all_its_files_and_names_them(ran: tuple[Path, Outcome]) -> None:
    folder, outcome = ran
    assert outcome.code == 0, outcome.err
    for name in FILES:
        assert (folder / "new" / "run" / name).stat().st_size > 100, name
    named = {word for word in outcome.out.split() if word.startswith("new/run/")}
    assert named >= {f"new/run/{name}" for name in (*FILES, "look") if name not in PLOTS}
    assert all((folder / name).exists() for name in named)
    assert not [name for name in everything_in(folder) if name.endswith(".part")]


def test_the_summary_says_how_well_the_hand_followed_in_eighty_columns(
    ran: tuple[Path, Outcome],
) -> None:
    _, outcome = ran
    assert outcome.err == ""
    assert outcome.out.startswith("Servoed pa10 to painted_ellipsoid, sine:0.05@4s\n")
    rows = rows_of(outcome)
    error = r"\d+\.\d\d mm RMS, \d+\.\d\d mm at 95 %, \d+\.\d\d degrees RMS"
    assert re.fullmatch(f"{error}, after 0.5 s", rows["repeatability"])
    assert re.fullmatch(f"{error}; mean.*", rows["accuracy"])
    assert next(iter(rows)) == "verdict"
    assert rows["world"] == "ideal"
    assert rows["modelled"] == "1 ellipsoid, from 1 viewpoint"
    assert rows["tracked"].startswith("100.0 % of 3")
    assert max(len(line) for line in outcome.out.splitlines() if "run/" not in line) <= 80


def test_the_files_of_a_run_say_the_same(ran: tuple[Path, Outcome]) -> None:
    folder, outcome = ran
    figures = json.loads((folder / "new" / "run" / "summary.json").read_text())
    for kind in ("repeatability", "accuracy"):
        in_mm = f"{1e3 * figures[kind]['position_rms']:.2f} mm RMS"
        assert rows_of(outcome)[kind].startswith(in_mm)
    rows = log_rows(folder / "new" / "run" / "log.csv")
    assert sum(row["status"] == "tracking" for row in rows) == figures["observations"]
    assert {word for row in rows for word in row["holding"].split()} <= {
        reason.name.lower() for reason in Reason
    }
    assert len(load_body(folder / "new" / "run" / "body.json").body()) == 1
    film = cv2.VideoCapture(str(folder / "new" / "run" / "servo.mp4"))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == pytest.approx(15, abs=3)
    page = (folder / "new" / "run" / "report.html").read_text()
    assert "painted_ellipsoid" in page and "<img" in page
    assert page.index("repeatability, RMS") < page.index("accuracy, RMS")


def test_a_figure_has_the_same_name_in_the_terminal_as_on_the_page(
    ran: tuple[Path, Outcome],
) -> None:
    folder, outcome = ran
    page = (folder / "new" / "run" / "report.html").read_text()
    names = re.findall(r'<th scope="row">(.*?)</th>', page)
    labels = list(rows_of(outcome))
    labels = labels[labels.index("world") : labels.index("tracker") + 1]
    assert {"repeatability", "accuracy", "fixation error", "tracked", "held"} <= set(labels)
    assert [label for label in labels if not any(label in name for name in names)] == []
    for row in ("world", "modelled"):
        assert f'<th scope="row">{row}</th><td>{rows_of(outcome)[row]}</td>' in page


def test_the_figures_of_a_run_begin_with_what_terminal_and_page_begin_with(
    ran: tuple[Path, Outcome],
) -> None:
    folder, outcome = ran
    figures = json.loads((folder / "new" / "run" / "summary.json").read_text())
    assert list(figures)[:3] == ["verdict", "reasons", "notes"]
    said = re.sub(r"\n {18}", " ", outcome.out)
    rows = re.findall(r"^  (\S.*?)  +(\S.*)$", said, re.MULTILINE)
    reasons = "; ".join(figures["reasons"])
    words = f"{figures['verdict']}: {reasons}" if reasons else figures["verdict"]
    assert dict(rows)["verdict"] == words
    assert [value for label, value in rows if label == "note"] == figures["notes"]
    assert (figures["world"], figures["ellipsoids"], figures["viewpoints"]) == ("ideal", 1, 1)
    page = html.unescape((folder / "new" / "run" / "report.html").read_text())
    assert all(note in page for note in figures["notes"])


def test_each_figure_of_a_run_has_a_row_on_the_page_of_formats(ran: tuple[Path, Outcome]) -> None:
    folder, _ = ran
    figures = json.loads((folder / "new" / "run" / "summary.json").read_text())
    text = FORMATS.read_text(encoding="utf-8")
    part = text[text.index("## The figures of a servo run") :].split("\n## ")[0]
    documented = re.findall(r"`(\w+)`", "".join(re.findall(r"^\|(.*?)\|", part, re.MULTILINE)))
    assert set(documented) >= set(figures)
    assert set(documented) - set(figures) <= {"middle_rms", "object_rms"}


@pytest.mark.extended
def test_the_settings_of_a_run_repeat_it_to_the_bit(ran: tuple[Path, Outcome]) -> None:
    folder, _ = ran
    first = folder / "new" / "run"
    assert read_trial_settings(first / "run.toml") == small_settings(SHORT)
    options = ("--config", "new/run/run.toml", "--out", "again", "--no-video", "--mcap")
    (folder / "again").mkdir()
    for name in ("run.toml", "servo.mp4"):
        (folder / "again" / name).write_bytes(b"of an earlier run")
    again = servo_apart(folder, *options)
    assert again.code == 0, again.err
    assert not (folder / "again" / "servo.mp4").exists()
    assert "servo.mp4" not in again.out
    for name in ("log.csv", "run.toml", "body.json"):
        assert (folder / "again" / name).read_bytes() == (first / name).read_bytes(), name
    check_recording(folder / "again")


def test_what_an_earlier_run_left_is_removed_and_files_of_others_stay(
    ran: tuple[Path, Outcome], tmp_path: Path
) -> None:
    folder, _ = ran
    shutil.copytree(folder / "new" / "run", tmp_path / "run")
    shutil.copytree(tmp_path / "run" / "look" / "left-00", tmp_path / "run" / "look" / "left-03")
    for name in ("run.mcap", "target.png"):
        (tmp_path / "run" / name).write_bytes(b"of an earlier run")
    assert remove_leftovers(tmp_path / "run")
    assert everything_in(tmp_path / "run").keys() <= {"look"}
    others = ("mine.txt", "model/mine.txt", "look/mine.txt", "look/left-00/mine.txt")
    for name in others:
        (tmp_path / "run" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "run" / name).write_text("mine")
    assert not remove_leftovers(tmp_path / "run")
    assert all((tmp_path / "run" / name).read_text() == "mine" for name in others)


def check_recording(folder: Path) -> None:
    """Check that the run's joints, images and poses are in its recording."""
    rows = log_rows(folder / "log.csv")
    found: dict[str, list[Any]] = {}
    for one in reads_with("mcap_ros2.reader").read_ros2_messages(str(folder / "run.mcap")):
        found.setdefault(one.channel.topic, []).append(one.ros_msg)
    joints = found["/joint_states"]
    assert len(joints) == len(rows)
    for message, row in zip(joints, rows, strict=True):
        expected = [float(row[f"q_{name}"]) for name in message.name]
        assert list(message.position) == pytest.approx(expected, abs=1e-8)
        stamp = message.header.stamp
        assert stamp.sec + 1e-9 * stamp.nanosec == pytest.approx(1.0 + float(row["time_s"]))
    tracked = sum(row["status"] == "tracking" for row in rows)
    assert len(found["/object/pose"]) == tracked > 0
    assert len(found["/left/image_raw"]) >= len([row for row in rows if row["status"]])
    assert len(found["/object/body"]) == 1


def test_printed_settings_read_back_and_options_come_on_top(
    servoid_command: Command, tmp_path: Path
) -> None:
    file = tmp_path / "run.toml"
    printed = servoid_command("servo", "--print-config")
    assert (printed.code, printed.err) == (0, "")
    file.write_text(printed.out)
    assert read_trial_settings(file) == TrialSettings()
    options = ("--object", "drill", "--seconds", "7", "--no-feed-forward", "--seed", "5")
    options += ("--ideal", "--target", "click:150,120", "--trust-target")
    changed = servoid_command("servo", "--print-config", "--config", file, *options)
    assert changed.code == 0, changed.err
    file.write_text(changed.out)
    settings = read_trial_settings(file)
    assert (settings.world.object.name, settings.run.seconds) == ("drill", 7.0)
    assert (settings.world.seed, settings.track.seed) == (5, 5)
    assert not settings.servo.hand.feed_forward
    assert settings.world.ideal and settings.world.in_effect == IDEAL
    assert (settings.run.target, settings.run.trust_target) == ("click:150,120", True)
    assert not TrialSettings().world.ideal
    assert list(tmp_path.iterdir()) == [file]


def test_the_time_of_the_world_is_not_taken_for_that_of_the_wall() -> None:
    words = servoing.stage_words("looking around", 12.4)
    assert words == "looking around, simulated 12 s"
    assert len("servo run ") + 30 + len(f" {words} 0:00:05") <= 80  # with the bar, on one line


def test_the_line_below_a_picture_has_the_word_of_the_report() -> None:
    goal = SimpleNamespace(error=lambda _: np.array([0.003, 0.0, 0.004, 0.0, 0.0, 0.01]))
    step = SimpleNamespace(stage="servoing", row=SimpleNamespace(hand_from_object=object()))
    trial = SimpleNamespace(log=SimpleNamespace(true_goal=goal))
    line = servoing._line(step, trial)  # type: ignore[arg-type]
    assert line == "servoing; accuracy 5.0 mm, 0.6 deg"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--object cup", r"error: .*'cup'.*bottle, .*mug"),
        ("--path zigzag:3", r"error: .*'zigzag:3'.*still; line:"),
        ("--path sine:0@5s", r"error: .*'0@5s'.*two numbers above 0"),
        ("--path recorded:none.csv", r"error: cannot read none.csv"),
        ("--world robot", r"error: .*'robot'.*pa10"),
        ("--world none.xml", r"error: .*none.xml"),
        ("--background nice", r"error: .*'nice'.*cluttered"),
        ("--seconds -1", r"error: --seconds: expected a number above 0, got -1"),
        ("--looks 0", r"error: --looks: expected a whole number of 1 or more, got 0"),
        ("--goal 0,0,90", r"error: --goal is 90 m, and more than 10 m is not plausible"),
        ("--goal 0,0,-1", r"error: --goal: the object's centre is to be -1 m in front of the hand"),
        (
            "--ideal --seconds 3 --laboratory",
            r"error: --ideal and --laboratory contradict each other; leave one of them out",
        ),
        ("--target boxes", r"error: --target: the target 'boxes' has no known form; .*mask:FILE"),
        ("--target click:5", r"error: .*the target 'click:5' needs 2 numbers"),
        ("--target box:0,0,900,900", r"error: the target 'box:0,0,900,900': the box covers"),
        ("--law best", r"error: --law: .*'best'; choose one of qp, paper"),
        ("--config none.toml", r"error: cannot read none.toml"),
        ("--config wrong.toml", r"error: wrong.toml, line 2, run: unknown key 'secs'; known keys:"),
        (
            "--start-offset 3,0,0",
            r"error: the hand cannot start 3, 0, 0 m .*smaller values; .* are the capture run/look",
        ),
    ],
)
def test_a_run_that_cannot_be_fails_with_one_clear_line(
    options: str,
    message: str,
    servoid_command: Command,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("wrong.toml").write_text("[run]\nsecs = 3\n")
    Path("small.toml").write_text(trial_toml(small_settings(SHORT)))
    config = () if "--config" in options else ("--config", "small.toml")
    outcome = servoid_command("servo", *config, *options.split(), "--out", "run", "--no-video")
    of_files = ("--path recorded", "--world none", "--config", "--start-offset", "--target box:")
    code = 1 if options.startswith(of_files) else 2
    assert (outcome.code, outcome.out) == (code, "")
    assert re.match(message, outcome.err), outcome.err
    assert outcome.err.count("\n") == 1


def test_a_click_that_may_mean_several_objects_is_shown(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    settings = small_settings(
        SHORT | {"world.object.name": "drill", "world.background": "cluttered"}
    )
    Path("small.toml").write_text(trial_toml(settings))
    options = ("--config", "small.toml", "--target", "click:144,114", "--no-video")
    outcome = servoid_command("servo", *options, "--out", "run")
    assert (outcome.code, outcome.out) == (1, "")
    assert "a click moved by 3 px finds another object" in outcome.err
    assert "run/target.png shows the candidates, and --trust-target uses" in outcome.err
    assert cv2.imread("run/target.png") is not None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("", "give one, such as --out out/run"),
        ("--out run --looks 0", "--looks: expected a whole number of 1 or more, got 0"),
        ("--out run --goal 1,2", "1,2"),
        ("--out run --method fast", "fast"),
    ],
)
def test_wrong_usage_is_told_apart_from_failure(
    options: str,
    message: str,
    servoid_command: Command,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = servoid_command("servo", *options.split())
    assert (outcome.code, outcome.out) == (2, "")
    assert message in " ".join(outcome.err.replace("│", " ").split())
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_refused_before_anything_moves(
    servoid_command: Command, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("mine")
    before = everything_in(tmp_path)
    for out in (tmp_path / "file", tmp_path / "file" / "run", tmp_path / "file" / "new" / "run"):
        outcome = servoid_command("servo", "--out", out)
        assert (outcome.code, outcome.out) == (1, "")
        assert re.fullmatch(r"error: cannot write .*\n", outcome.err), outcome.err
    assert everything_in(tmp_path) == before


@pytest.mark.extended
def test_what_was_not_measured_is_not_known(servoid_command: Command, tmp_path: Path) -> None:
    settings = small_settings(SHORT | {"run.settle_s": 1.0, "run.seconds": 1.0})
    (tmp_path / "small.toml").write_text(trial_toml(settings))
    outcome = servoid_command("servo", "--config", tmp_path / "small.toml", "--out", tmp_path / "a")
    rows = rows_of(outcome)
    assert all(rows[kind] == "not known" for kind in ("repeatability", "accuracy"))
    assert rows["verdict"].startswith("unknown: the errors of the hand are unknown: servoing ended")
    assert "nan" not in outcome.out


@pytest.mark.extended
def test_a_goal_out_of_reach_is_said_before_all_errors(
    servoid_command: Command, tmp_path: Path
) -> None:
    far = {"run.goal": (0.0, 0.0, 5.0), "run.seconds": 1.0}
    (tmp_path / "far.toml").write_text(trial_toml(small_settings(SHORT | far)))
    outcome = servoid_command("servo", "--config", tmp_path / "far.toml", "--out", tmp_path / "a")
    rows = rows_of(outcome)
    assert rows["not reached"].startswith("the arm does not reach the goal, for 0.")
    assert list(rows).index("not reached") < list(rows).index("repeatability")


@pytest.mark.extended
def test_what_was_done_until_an_interrupt_is_written(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_at(monkeypatch, "servoing", 0.1)
    config, out = tmp_path / "small.toml", tmp_path / "run"
    config.write_text(trial_toml(small_settings(SHORT | {"run.settle_s": 3.0, "run.seconds": 5.0})))
    outcome = servoid_command("servo", "--config", config, "--out", out)
    assert outcome.code == 130
    assert all(rows_of(outcome)[kind] == "not known" for kind in ("repeatability", "accuracy"))
    assert rows_of(outcome)["verdict"].startswith("unknown: interrupted after 0.")
    assert "nan" not in outcome.out
    rows = log_rows(out / "log.csv")
    assert 40 < len(rows) < 90
    ending = outcome.err.removesuffix("\n")
    assert re.fullmatch(r"interrupted after 0\.\d\d of 5 s of servoing", ending)
    page = (out / "report.html").read_text().replace("\N{NO-BREAK SPACE}", " ")
    assert f"Servoing: unknown: {ending}; the errors" in page
    for name in FILES:
        assert (out / name).stat().st_size > 100, name
    assert not [name for name in everything_in(out) if name.endswith((".part", ".part.mp4"))]
