import sys
from pathlib import Path

import pytest
from conftest import Command, everything_in

from servoid.cli import servo_order


def test_everything_that_is_missing_is_named_at_once(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(servo_order, "find_spec", lambda library: library != "daqp" or None)
    assert "pip install 'servoid[servo]'" in servoid_command("servo", "--out", tmp_path / "a").err
    monkeypatch.setattr(servo_order, "find_spec", lambda _library: None)
    outcome = servoid_command("servo", "--out", tmp_path / "b")
    assert outcome.code == 1
    assert outcome.err.startswith("error: servoid servo needs mujoco, daqp, matplotlib, not")
    assert outcome.err.endswith("pip install 'servoid[sim,servo,view]'\n")
    assert everything_in(tmp_path) == {}


def test_settings_are_printed_without_any_extra(
    servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("servoid.cli.servoing", "servoid.view", "mujoco", "daqp"):
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
    assert outcome.code == 1
    assert wrong[1] in outcome.err
    assert everything_in(tmp_path) == {}
