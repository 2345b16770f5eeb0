"""The folder of a servo run belongs to one run, and is not made in vain."""

from pathlib import Path

import pytest

from conftest import Command, everything_in

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
pytest.importorskip("daqp", reason="servoing within all limits needs daqp")
pytest.importorskip("matplotlib", reason="the plots of a run need matplotlib")

from servo_trials import small_settings

from servoid.output import claimed
from servoid.sim.trial import trial_toml


def test_a_folder_into_which_another_run_writes_is_refused_and_unchanged(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(trial_toml(small_settings()))
    Path("run").mkdir()
    Path("run/log.csv").write_text("of the other run")
    before = everything_in(tmp_path)
    with claimed(Path("run")):
        outcome = servoid_command("servo", "--config", "small.toml", "--out", "run")
    assert (outcome.code, outcome.out) == (1, "")
    assert outcome.err.startswith("error: another run is writing into run; wait until it has")
    assert everything_in(tmp_path) == before
    with claimed(Path("run")):  # a claim ends with its block
        pass


@pytest.mark.parametrize("name", ["body.json", "log.csv", "model/summary.json"])
def test_files_that_no_run_wrote_are_not_replaced(
    name: str, servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(trial_toml(small_settings()))
    Path("mine/model").mkdir(parents=True)
    Path("mine/target.png").write_text("of a target that was ambiguous")
    Path("mine", name).write_text("of a person")
    before = everything_in(tmp_path)
    outcome = servoid_command("servo", "--config", "small.toml", "--out", "mine")
    assert (outcome.code, outcome.out) == (1, "")
    assert f"mine: it holds {name}, but no run.toml" in " ".join(outcome.err.split())
    assert everything_in(tmp_path) == before


@pytest.mark.parametrize("target", ["mask:none.png", "box:0,0,900,900"])
def test_a_run_whose_target_marks_nothing_leaves_no_folder(
    target: str, servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(trial_toml(small_settings()))
    outcome = servoid_command(
        "servo", "--config", "small.toml", "--target", target, "--out", "new/run"
    )
    assert (outcome.code, outcome.out) == (1, "")
    assert everything_in(tmp_path).keys() == {"small.toml"}
