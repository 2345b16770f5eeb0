import sys
from pathlib import Path

import msgspec
import pytest
from servo_trials import small_trial

from conftest import Command, everything_in
from servoid.cli import extras
from servoid.errors import ServoError
from servoid.servo import JointLaw, ServoSettings, as_the_paper
from servoid.sim.trial import TrialSettings, changed, read_trial_settings
from servoid.sim.trial.settings import check_ages, check_events
from servoid.track import Method


def test_everything_that_is_missing_is_named_at_once(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda library: library != "daqp" or None)
    assert "pip install 'servoid[servo]'" in servoid_command("servo", "--out", tmp_path / "a").err
    monkeypatch.setattr(extras, "find_spec", lambda _library: None)
    outcome = servoid_command("servo", "--out", tmp_path / "b")
    assert outcome.code == 1
    assert outcome.err.startswith(
        "error: servoid servo needs mujoco, daqp, matplotlib, which are not"
    )
    assert outcome.err.endswith("pip install 'servoid[sim,servo,view]'\n")
    outcome = servoid_command("study", "bode", "--out", tmp_path / "b")
    assert outcome.err.startswith("error: servoid study needs matplotlib, pyarrow, mujoco, daqp")
    assert everything_in(tmp_path) == {}


def test_settings_are_printed_without_any_extra(
    servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("servoid.cli.servo.servoing", "servoid.view", "mujoco", "daqp"):
        monkeypatch.setitem(sys.modules, module, None)
    assert servoid_command("servo", "--print-config").code == 0


@pytest.mark.parametrize(
    "wrong", [("--object", "cup"), ("--path", "sinus:1"), ("--world", "none.xml")]
)
def test_a_world_that_cannot_be_leaves_nothing_behind(
    servoid_command: Command, tmp_path: Path, wrong: tuple[str, str]
) -> None:
    pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
    pytest.importorskip("daqp", reason="servoing within all limits needs daqp")
    pytest.importorskip("matplotlib", reason="the plots of a run need matplotlib")
    outcome = servoid_command("servo", *wrong, "--out", tmp_path / "run")
    assert outcome.code == (1 if wrong[1] == "none.xml" else 2)
    assert wrong[1] in outcome.err
    assert everything_in(tmp_path) == {}


TELEPORT = "[[world.faults]]\ntype = 'teleport'\nat_s = 1\n"
DROP = "[[world.faults]]\ntype = 'drop'\nat_s = 40\nseconds = 1\n"


@pytest.mark.parametrize(
    ("key", "event"),
    [
        ("world.faults[1].at_s", TELEPORT + DROP),
        ("world.light.step_at_s", "[world.light]\nstep_at_s = 40"),
    ],
)
def test_what_begins_after_the_end_of_the_run_is_refused_and_nothing_is_left(
    key: str, event: str, servoid_command: Command, tmp_path: Path
) -> None:
    pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
    pytest.importorskip("daqp", reason="servoing within all limits needs daqp")
    pytest.importorskip("matplotlib", reason="the plots of a run need matplotlib")
    config = tmp_path / "events.toml"
    config.write_text(event)
    before = everything_in(tmp_path)
    outcome = servoid_command("servo", "--config", config, "--out", tmp_path / "run")
    assert outcome.code == 1
    assert f"{key} is 40 s, but servoing ends after 30 s" in outcome.err
    assert "raise run.seconds" in outcome.err
    assert everything_in(tmp_path) == before
    longer = changed(read_trial_settings(config), {"run.seconds": 41}, "the test")
    check_events(longer)  # an option may make the run long enough


@pytest.mark.parametrize(
    ("slow", "words"),
    [
        ("[world.cameras]\nlatency_s = 0.3", ("0.3363 s old", "world.cameras.latency_s 0.3 s")),
        ("[world.cameras]\nrate_hz = 2", ("0.543 s old", "world.cameras.rate_hz 2 0.5 s")),
        ("[world.lab]\ntrack_s = 0.2", ("0.44 s old", "world.lab.track_s 0.2 s")),
    ],
)
def test_images_that_get_too_old_for_the_arm_to_move_are_refused_and_nothing_is_left(
    slow: str, words: tuple[str, ...], servoid_command: Command, tmp_path: Path
) -> None:
    pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
    pytest.importorskip("daqp", reason="servoing within all limits needs daqp")
    pytest.importorskip("matplotlib", reason="the plots of a run need matplotlib")
    config = tmp_path / "slow.toml"
    config.write_text(slow)
    before = everything_in(tmp_path)
    outcome = servoid_command("servo", "--config", config, "--out", tmp_path / "run")
    assert outcome.code == 1
    told = (*words, "the arm is held from 0.25 s on (servo.safety.coast_s)", "raise servo.safety")
    assert [word for word in told if word not in outcome.err] == []
    assert everything_in(tmp_path) == before
    longer = changed(read_trial_settings(config), {"servo.safety.coast_s": 0.6}, "the test")
    check_ages(longer)


@pytest.mark.extended
@pytest.mark.parametrize(
    ("key", "near", "far"),
    [("world.cameras.latency_s", 0.216, 0.218), ("world.cameras.rate_hz", 4.8, 4.6)],
)
def test_images_are_refused_just_where_the_arm_would_stay_held(
    key: str, near: float, far: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
    pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

    def held(value: float) -> list[bool]:
        values = {key: value, "servo.look.count": 1, "run.seconds": 5.0}
        log = small_trial(tmp_path / str(value), values).log
        return [bool(row.tick.command.holding) for row in log.rows]

    assert not any(held(near))
    with pytest.raises(ServoError, match=r"raise servo.safety.coast_s above 0.25\d+"):
        held(far)
    monkeypatch.setattr("servoid.sim.trial.servoing.check_ages", lambda _: None)
    rows = held(far)
    assert all(rows[len(rows) // 10 :])


def test_one_option_sets_all_of_the_papers_servoing(
    servoid_command: Command, tmp_path: Path
) -> None:
    def settings(*options: str) -> TrialSettings:
        text = servoid_command("servo", *options, "--print-config").out
        file = tmp_path / "run.toml"
        file.write_text(text, encoding="utf-8")
        return read_trial_settings(file)

    theirs = settings("--paper")
    assert theirs.track.method is Method.PAPER
    assert theirs.servo == as_the_paper(ServoSettings(), turn_told=False)
    assert theirs.servo.joints.law is JointLaw.PAPER
    assert not (theirs.servo.hand.feed_forward or theirs.servo.gaze.feed_forward)
    assert not theirs.servo.target.compensate
    assert msgspec.structs.replace(theirs, servo=ServoSettings(), track=TrialSettings().track) == (
        TrialSettings()
    )
    ours = settings("--paper", "--law", "qp", "--feed-forward", "--method", "region")
    assert (ours.servo.joints.law, ours.track.method) == (JointLaw.QP, Method.REGION)
    assert ours.servo.hand.feed_forward


def test_the_object_waits_where_the_hand_wants_it() -> None:
    settings = TrialSettings()
    assert settings.world.object.hand_from_object[4:] == settings.run.goal
