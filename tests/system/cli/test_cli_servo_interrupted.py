"""An interrupted servo run says what it leaves, and leaves nothing without a word."""

from contextlib import ExitStack
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

from conftest import Command, everything_in

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
pytest.importorskip("daqp", reason="servoing within all limits needs daqp")
pytest.importorskip("matplotlib", reason="the plots of a run need matplotlib")

from interrupted_runs import interrupt_at
from servo_trials import small_settings

from servoid.cli.servo import servoing
from servoid.cli.servo.servo_order import Order
from servoid.exchange.bags.writing import McapRun
from servoid.sim.trial import TrialStep, trial_toml
from servoid.sim.world import World

SHORT = {"run.seconds": 1.0, "run.settle_s": 0.5, "servo.look.count": 1}


def test_an_interrupt_before_the_first_look_leaves_nothing_not_even_a_folder(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_at(monkeypatch, "looking", 0.0)
    config, out = tmp_path / "small.toml", tmp_path / "new" / "run"
    config.write_text(trial_toml(small_settings(SHORT)))
    outcome = servoid_command("servo", "--config", config, "--out", out)
    assert (outcome.code, outcome.out) == (130, "")
    assert outcome.err == "interrupted before servoing began; nothing was written\n"
    assert list(tmp_path.iterdir()) == [config]


@pytest.mark.extended
def test_an_interrupt_before_servoing_names_the_looks_it_leaves_which_can_be_modelled(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_at(monkeypatch, "looking around", 0.0)
    config, out = tmp_path / "small.toml", tmp_path / "run"
    config.write_text(trial_toml(small_settings(SHORT | {"servo.look.count": 2})))
    outcome = servoid_command("servo", "--config", config, "--out", out)
    assert (outcome.code, outcome.out) == (130, "")
    assert outcome.err == (
        f"interrupted before servoing began; {out / 'look'} holds the images so far, of which "
        "servoid model makes a body; nothing else was written\n"
    )
    assert [path.name for path in out.iterdir()] == ["look"]
    assert servoid_command("model", out / "look", "--out", tmp_path / "body.json").code == 0


@pytest.mark.extended
def test_an_interrupt_while_the_recordings_of_a_run_are_closed_loses_none_of_it(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def press() -> NoReturn:
        raise KeyboardInterrupt

    prepare = servoing._Run.prepare

    def preparing(run: servoing._Run, world: World, stack: ExitStack, order: Order) -> None:
        stack.callback(press)
        prepare(run, world, stack, order)

    monkeypatch.setattr(servoing._Run, "prepare", preparing)
    config, out = tmp_path / "small.toml", tmp_path / "run"
    config.write_text(trial_toml(small_settings(SHORT | {"run.seconds": 0.2})))
    outcome = servoid_command("servo", "--config", config, "--out", out, "--no-video")
    assert outcome.code == 130
    assert outcome.err.startswith("interrupted after 0.")
    assert (out / "log.csv").is_file()


@pytest.mark.extended
def test_an_interrupt_while_results_are_written_does_not_say_that_nothing_was(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def press(*_: object) -> NoReturn:
        raise KeyboardInterrupt

    monkeypatch.setattr(servoing, "write_servo_times", press)
    config, out = tmp_path / "small.toml", tmp_path / "run"
    config.write_text(trial_toml(small_settings(SHORT | {"run.seconds": 0.2})))
    outcome = servoid_command("servo", "--config", config, "--out", out, "--no-video")
    assert outcome.code == 130
    assert outcome.err.startswith(f"interrupted while the results were written; {out} holds a part")
    assert (out / "log.csv").is_file()


def test_an_interrupt_before_the_first_look_does_not_claim_the_looks_of_an_earlier_run(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config, out = tmp_path / "small.toml", tmp_path / "run"
    config.write_text(trial_toml(small_settings(SHORT)))
    (out / "look").mkdir(parents=True)
    interrupt_at(monkeypatch, "looking", 0.0)
    outcome = servoid_command("servo", "--config", config, "--out", out)
    assert outcome.err == "interrupted before servoing began; nothing was written\n"
    assert (out / "look").is_dir()


def test_an_interrupted_run_leaves_nothing_of_an_earlier_one_in_its_folder(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_at(monkeypatch, "looking around", 0.0)
    config, out = tmp_path / "small.toml", tmp_path / "run"
    config.write_text(trial_toml(small_settings(SHORT | {"servo.look.count": 2})))
    (out / "look" / "left-04").mkdir(parents=True)
    (out / "model").mkdir()
    for name in ("log.csv", "run.toml", "model/curve.png", "look/left-04/image.png", "mine"):
        (out / name).write_bytes(b"of an earlier run")
    outcome = servoid_command("servo", "--config", config, "--out", out)
    assert outcome.err.endswith(
        "nothing else was written; the files of an earlier run are removed\n"
    )
    left = {name.split("/")[0] for name in everything_in(out)}
    assert left == {"look", "mine"}
    assert {path.name for path in (out / "look").iterdir()} == {
        "capture.toml",
        "left-00",
        "left-00-mask",
        "right-00",
    }


@pytest.mark.extended
@pytest.mark.parametrize("kind", ["mcap", "video"])
def test_a_second_interrupt_while_a_recording_is_closed_says_that_it_is_lost(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    def press(*_: object) -> NoReturn:
        raise KeyboardInterrupt

    if kind == "mcap":
        pytest.importorskip("rosbags", reason="recordings with ROS messages need rosbags")
        monkeypatch.setattr(McapRun, "close", press)
        options, name, other = ("--mcap", "--no-video"), "run.mcap", "servo.mp4"
    else:
        monkeypatch.setattr(servoing.ServoVideo, "__exit__", press)
        options, name, other = (), "servo.mp4", "run.mcap"
    interrupt_at(monkeypatch, "servoing", 0.1)
    config, out = tmp_path / "small.toml", tmp_path / "run"
    config.write_text(trial_toml(small_settings(SHORT)))
    outcome = servoid_command("servo", "--config", config, "--out", out, *options)
    assert outcome.code == 130
    assert outcome.err.endswith(
        f" of 1 s of servoing; {name} could not be completed, and nothing is left of it\n"
    )
    assert other not in outcome.err
    assert not (out / name).exists()
    assert (out / "log.csv").is_file()


@pytest.mark.extended
def test_a_simulation_that_becomes_unstable_ends_the_run_and_loses_nothing(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("rosbags", reason="recordings with ROS messages need rosbags")
    watch = servoing._Run.watch

    def watching(run: servoing._Run, step: TrialStep) -> None:
        watch(run, step)
        if step.stage == "servoing" and step.share >= 0.4 and run._world is not None:
            run._world._servos._data.qvel[2] = np.nan

    monkeypatch.setattr(servoing._Run, "watch", watching)
    monkeypatch.chdir(tmp_path)
    config, out = tmp_path / "small.toml", tmp_path / "run"
    config.write_text(trial_toml(small_settings(SHORT)))
    outcome = servoid_command("servo", "--config", config, "--out", out, "--mcap")
    assert outcome.code == 1
    error = outcome.err.splitlines()[-1]
    assert error.startswith("error: the simulation became unstable at ")
    assert "joint 's3'" in error and "lower world.physics.step_s" in error
    assert error.endswith(f"; {out} holds the run until then")
    assert 40 < len((out / "log.csv").read_text().splitlines()) < 70
    for name in ("run.mcap", "servo.mp4", "report.html", "summary.json"):
        assert (out / name).stat().st_size > 100, name
    ended = "ended after 0.4"
    assert ended in outcome.out.replace("\n", " ")
    assert ended in (out / "report.html").read_text().replace("\N{NO-BREAK SPACE}", " ")
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()
