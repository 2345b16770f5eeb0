"""What every study must do; a new one is one more line in `STUDIES`."""

import msgspec
import pytest

pytest.importorskip("pyarrow", reason="tables of trials need pyarrow")
pytest.importorskip("mujoco", reason="studies need mujoco")
pytest.importorskip("matplotlib", reason="studies need matplotlib")

import importlib
from pathlib import Path
from typing import Any

from commands import Command, servoid_command

from servoid.batch.table import write_table
from servoid.errors import StudyError
from servoid.servo import settings_toml
from servoid_experiments.design import Study
from servoid_experiments.running import STUDIES, read_study_settings, study_named

__all__ = ["servoid_command"]


@pytest.fixture(scope="module", params=STUDIES)
def study(request: pytest.FixtureRequest) -> Study[Any]:
    return study_named(request.param)


def test_a_study_goes_by_its_name_and_asks_something(study: Study[Any]) -> None:
    assert study_named(study.name) is study
    assert study.title
    assert study.question[0].isupper()


def test_settings_read_back_as_they_were_written(study: Study[Any], tmp_path: Path) -> None:
    for settings in (study.settings(), study.quick):
        assert isinstance(settings, study.settings)
        (tmp_path / "a.toml").write_text(settings_toml(settings), encoding="utf-8")
        assert read_study_settings(study, tmp_path / "a.toml") == settings


def test_every_setting_says_what_it_is(study: Study[Any]) -> None:
    lines = settings_toml(study.settings()).splitlines()
    silent = [line for line in lines if "=" in line and "  # " not in line]
    assert silent == []


def test_the_plan_is_the_same_each_time_and_has_no_twin_experiments(study: Study[Any]) -> None:
    for settings in (study.settings(), study.quick):
        plan, again = study.plan(settings), study.plan(settings)
        names = [work.experiment.name for work in plan]
        assert len(set(names)) == len(names)
        assert [list(work.cases) for work in plan] == [list(work.cases) for work in again]
        assert all(len(work.cases) > 0 for work in plan)


def test_a_quick_study_is_smaller(study: Study[Any]) -> None:
    whole, quick = (
        sum(len(work.cases) for work in study.plan(settings))
        for settings in (study.settings(), study.quick)
    )
    assert quick < whole


def test_cases_go_through_json_unchanged(study: Study[Any]) -> None:
    for work in study.plan(study.settings()):
        for case in work.cases:
            content = msgspec.json.encode(case)
            assert msgspec.json.decode(content, type=work.experiment.case) == case


def test_cases_and_rows_fit_into_a_table(study: Study[Any], tmp_path: Path) -> None:
    for work in study.plan(study.quick):
        write_table(work.experiment, [], tmp_path / "a.parquet")
        module = importlib.import_module(work.experiment.run.__module__)
        assert getattr(module, work.experiment.run.__name__) is work.experiment.run


def test_defaults_are_printed_and_nothing_else_happens(
    study: Study[Any], servoid_command: Command, tmp_path: Path
) -> None:
    printed = servoid_command("study", study.name, "--print-config")
    assert printed.code == 0
    assert printed.out == settings_toml(study.settings())
    quick = servoid_command("study", study.name, "--quick", "--print-config")
    assert quick.out == settings_toml(study.quick)
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_study_is_refused() -> None:
    with pytest.raises(StudyError, match="choose one of paper"):
        study_named("nothing")


def test_a_study_without_a_folder_is_refused(servoid_command: Command) -> None:
    ran = servoid_command("study", "bode")
    assert ran.code == 2
    assert "nothing says where" in ran.err


def test_an_unknown_key_of_settings_is_told(servoid_command: Command, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("nonsense = 1\n")
    ran = servoid_command("study", "bode", "--config", tmp_path / "a.toml", "--out", tmp_path / "o")
    assert ran.code == 1
    assert "unknown key 'nonsense'" in ran.err
    assert not (tmp_path / "o").exists()


def test_a_file_of_settings_and_quick_together_are_refused(
    servoid_command: Command, tmp_path: Path
) -> None:
    (tmp_path / "a.toml").write_text("")
    asked = ("--config", tmp_path / "a.toml", "--quick", "--out", tmp_path / "o")
    ran = servoid_command("study", "bode", *asked)
    assert ran.code == 2
    assert "leave one of them out" in ran.err
