"""`servoid demo`: what runs without any file, what is left out, and where to look."""

import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from conftest import Command
from servoid._native import Pose
from servoid.cli import demo
from servoid.sim.accuracy import median_add_m


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Keep the commands in place of running them."""
    kept: list[str] = []

    def keep(commands: tuple[tuple[str, ...], ...], out: Path) -> None:
        del out
        kept.extend(shlex.join(command) for command in commands)

    monkeypatch.setattr(demo, "_run", keep)
    monkeypatch.setattr(demo, "_against_truth", lambda out: f"none in {out}")
    return kept


def without(monkeypatch: pytest.MonkeyPatch, *missing: str) -> None:
    known = demo.find_spec
    monkeypatch.setattr(demo, "find_spec", lambda name: None if name in missing else known(name))


def test_every_part_runs_where_all_libraries_are(
    servoid_command: Command, typed: list[str], tmp_path: Path
) -> None:
    pytest.importorskip("mujoco")
    pytest.importorskip("daqp")
    pytest.importorskip("matplotlib")
    ran = servoid_command("demo", "--out", tmp_path / "made")
    assert ran.code == 0
    assert [one.split()[0] for one in typed] == ["sample", "model", "sample", "track", "servo"]
    assert all(str(tmp_path / "made") in one for one in typed)
    assert "--report" in typed[1]
    assert "Left out" not in ran.out and "pip install" not in ran.out
    for name in ("report/report.html", "track.mp4", "arm/servo.mp4", "arm/report.html"):
        assert f"  {tmp_path / 'made' / name}\n" in ran.out


def test_what_is_missing_is_named_and_the_rest_goes_on(
    servoid_command: Command, typed: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without(monkeypatch, "mujoco", "daqp", "matplotlib")
    ran = servoid_command("demo", "--out", tmp_path)
    assert ran.code == 0
    assert [one.split()[0] for one in typed] == ["sample", "model", "sample", "track"]
    assert "--report" not in typed[1]
    output = " ".join(ran.out.split())
    assert "Left out: mujoco, daqp, matplotlib are not installed" in output
    assert "pip install 'servoid[sim,servo,view]'" in output
    assert "pip install 'servoid[servo,sim,view]', and again: servoid demo --out" in output
    assert f"{tmp_path}/body.json" in output and "report.html" not in output


def test_a_part_that_fails_ends_the_demo_with_its_own_words(
    servoid_command: Command, tmp_path: Path
) -> None:
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "mine.txt").write_text("not to be replaced")
    ran = servoid_command("demo", "--out", tmp_path)
    assert ran.code == 1
    assert "the folder holds other files" in ran.err
    assert (tmp_path / "photos" / "mine.txt").read_text() == "not to be replaced"


def test_a_folder_that_cannot_be_made_is_told_before_anything_is_drawn(
    servoid_command: Command, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    ran = servoid_command("demo", "--out", tmp_path / "file")
    assert (ran.code, ran.out) == (1, "")


@pytest.mark.extended
def test_the_parts_that_need_no_extra_work_and_are_precise(
    servoid_command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without(monkeypatch, "mujoco", "daqp", "matplotlib")
    monkeypatch.setattr(demo, "_SCENARIO", replace(demo._SCENARIO, count=20))
    ran = servoid_command("demo", "--out", tmp_path / "made")
    assert ran.code == 0, ran.err
    assert max(len(line.replace(str(tmp_path), "")) for line in ran.out.splitlines()) <= 80
    for name in ("body.json", "poses.csv", "track.mp4"):
        assert (tmp_path / "made" / name).stat().st_size > 0
    [line] = [line for line in ran.out.splitlines() if "true motion" in line]
    assert 0.0 < float(line.split()[2]) < 1.5


def test_a_constant_change_of_frames_is_no_error_and_a_shift_is_its_length() -> None:
    points = Pose.identity().transform([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
    true = [Pose.exp([0.01 * n, 0.0, 0.5, 0.0, 0.1 * n, 0.0]) for n in range(4)]
    frame = Pose.exp([0.02, -0.01, 0.03, 0.4, -0.2, 0.1])
    found = [pose @ frame for pose in true]
    assert median_add_m(found, true, points) < 1e-12
    shifted = [found[0], *(Pose.exp([0.003, 0.0, 0.0, 0.0, 0.0, 0.0]) @ one for one in found[1:])]
    assert abs(median_add_m(shifted, true, points) - 0.003) < 1e-12
