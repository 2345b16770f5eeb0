from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("pyarrow", reason="tables of trials need pyarrow")

import pyarrow.parquet
from batch_trials import DRAW, NO_NUMBER, STUMBLE, Case, Inner, Kind, Row, draw

from servoid.batch import (
    BatchProgress,
    Done,
    Experiment,
    InProcess,
    Processes,
    Work,
    run_batch,
    workers_for,
)
from servoid.errors import StudyError


def cases(count: int, folder: Path | None = None) -> list[Case]:
    return [Case(seed, folder=None if folder is None else str(folder)) for seed in range(count)]


def values(trials: Sequence[Done]) -> list[Row | None]:
    return [done.row for done in trials]


def test_rows_are_the_same_in_this_process_and_in_several(tmp_path: Path) -> None:
    here = run_batch([Work(DRAW, cases(9))], tmp_path / "here")["draw"]
    apart = run_batch([Work(DRAW, cases(9))], tmp_path / "apart", Processes(2))["draw"]
    assert values(here) == values(apart)
    assert values(here)[:3] == [draw(case) for case in cases(3)]
    tables = [(tmp_path / name / "draw.parquet").read_bytes() for name in ("here", "apart")]
    assert tables[0] == tables[1]


@settings(max_examples=10, deadline=None)
@given(st.permutations(range(8)))
def test_rows_do_not_depend_on_the_order_of_the_cases(
    tmp_path_factory: pytest.TempPathFactory, order: list[int]
) -> None:
    mixed = [cases(8)[place] for place in order]
    found = run_batch([Work(DRAW, mixed)], tmp_path_factory.mktemp("mixed"))["draw"]
    assert [done.case for done in found] == mixed
    for done in found:
        assert done.row == (None if done.case.seed == 3 else draw(done.case))


def test_a_failed_trial_is_recorded_and_stops_nothing(tmp_path: Path) -> None:
    done = run_batch([Work(DRAW, cases(6))], tmp_path)["draw"]
    assert [trial.row is None for trial in done] == [False] * 3 + [True] + [False] * 2
    assert done[3].failure == "seed 3 cannot be modelled; choose another"
    table = pyarrow.parquet.read_table(tmp_path / "draw.parquet").to_pydict()
    assert table["failure"][3] == done[3].failure
    assert table["value"][3] is None


def test_a_bug_in_a_trial_is_recorded_as_one(tmp_path: Path) -> None:
    done = run_batch([Work(STUMBLE, cases(6)[5:])], tmp_path)["stumble"]
    assert done[0].failure == "this is a bug in servoid: IndexError: out of range"


def test_a_number_that_is_none_makes_a_trial_fail(tmp_path: Path) -> None:
    done = run_batch([Work(NO_NUMBER, cases(1))], tmp_path)["no_number"]
    assert done[0].row is None
    assert "value" in done[0].failure


@pytest.mark.extended
def test_a_trial_that_kills_its_process_is_recorded_and_stops_no_other(tmp_path: Path) -> None:
    done = run_batch([Work(STUMBLE, cases(8))], tmp_path, Processes(2))["stumble"]
    assert [trial.row is None for trial in done] == [seed in (3, 4, 5) for seed in range(8)]
    assert done[4].failure == "its process died 3 times"


def test_what_is_done_is_not_done_again_but_what_failed_is(tmp_path: Path) -> None:
    marks = tmp_path / "marks"
    marks.mkdir()
    first = run_batch([Work(DRAW, cases(5, marks))], tmp_path / "out")["draw"]
    again = run_batch([Work(DRAW, cases(7, marks))], tmp_path / "out", Processes(2))["draw"]
    assert values(again)[:5] == values(first)
    runs = {int(mark.name): len(mark.read_text()) for mark in marks.iterdir()}
    assert runs == {seed: 2 if seed == 3 else 1 for seed in range(7)}


def test_a_batch_that_is_broken_off_goes_on_where_it_was(tmp_path: Path) -> None:
    marks = tmp_path / "marks"
    marks.mkdir()
    work = [Work(DRAW, cases(9, marks))]

    def break_off(progress: BatchProgress) -> None:
        if progress.done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_batch(work, tmp_path / "out", watch=break_off)
    reports: list[BatchProgress] = []
    run_batch(work, tmp_path / "out", watch=reports.append)
    runs = {int(mark.name): len(mark.read_text()) for mark in marks.iterdir()}
    assert set(runs) == set(range(9))
    assert all(count == 1 for seed, count in runs.items() if seed != 3)
    assert reports[0].recalled in (3, 4)
    assert reports[-1].done == reports[-1].total == 9
    assert reports[-1].seconds_left == 0.0


def test_a_damaged_file_of_a_trial_is_made_anew(tmp_path: Path) -> None:
    first = run_batch([Work(DRAW, cases(3))], tmp_path)["draw"]
    for number, path in enumerate(sorted((tmp_path / "trials" / "draw").iterdir())):
        path.write_bytes(path.read_bytes()[: 7 * number])
    assert values(run_batch([Work(DRAW, cases(3))], tmp_path)["draw"]) == values(first)


def test_a_newer_version_of_an_experiment_takes_no_older_rows() -> None:
    newer = Experiment("draw", draw, Case, Row, version=2)
    assert newer.key(Case(0)) != DRAW.key(Case(0))
    assert len({DRAW.key(case) for case in (*cases(50), Case(0, Inner(2.0)))}) == 51


def test_a_case_that_holds_no_finite_number_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="numbers must be finite"):
        run_batch([Work(DRAW, [Case(0, Inner(float("nan")))])], tmp_path)


def test_equal_cases_are_one_trial(tmp_path: Path) -> None:
    marks = tmp_path / "marks"
    marks.mkdir()
    twice = [*cases(3, marks), *cases(3, marks)]
    done = run_batch([Work(DRAW, twice)], tmp_path / "out")["draw"]
    assert values(done)[:3] == values(done)[3:]
    assert all(len(mark.read_text()) == 1 for mark in marks.iterdir())


def test_a_table_holds_cases_and_rows_in_typed_columns(tmp_path: Path) -> None:
    case = Case(2, Inner(0.5, "slow"), Kind.LARGE, (1.0, 2.0, 3.0))
    row = run_batch([Work(DRAW, [case])], tmp_path)["draw"][0].row
    table = pyarrow.parquet.read_table(tmp_path / "draw.parquet")
    assert table.schema.metadata[b"experiment"] == b"draw"
    assert table.schema.field("case.inner.gain").metadata == {b"description": b"of a loop, 1/s"}
    assert str(table.schema.field("course").type) == "list<element: double>"
    line = table.to_pylist()[0]
    assert line["case.seed"] == 2
    assert (line["case.inner.gain"], line["case.inner.name"]) == (0.5, "slow")
    assert (line["case.kind"], line["case.place"]) == ("large", [1.0, 2.0, 3.0])
    assert (line["value"], line["course"], line["open"]) == (row.value, row.course, 0.5)
    assert line["by_name"] == [("large", 2)]
    assert line["failure"] is None


def test_a_function_that_no_other_process_finds_is_refused() -> None:
    def inside(case: Case) -> Row:
        return draw(case)

    with pytest.raises(StudyError, match="at the top level of a module"):
        Experiment("inside", inside, Case, Row)


@pytest.mark.parametrize("name", ["", "a b", "../a", "A", "a/b"])
def test_a_name_that_no_file_should_have_is_refused(name: str) -> None:
    with pytest.raises(StudyError, match="cannot name an experiment"):
        Experiment(name, draw, Case, Row)


def test_two_works_of_one_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="merge their cases into one"):
        run_batch([Work(DRAW, cases(1)), Work(DRAW, cases(2))], tmp_path)


def test_processes_and_a_cluster_together_are_refused() -> None:
    with pytest.raises(StudyError, match="leave one of the two out"):
        workers_for(2, "tcp://127.0.0.1:8786")
    assert workers_for(1, None) == InProcess()
    assert workers_for(None, None) == Processes(None)


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    with pytest.raises(OSError, match="cannot make the folder"):
        run_batch([Work(DRAW, cases(1))], tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
