"""All tuning constants of the tracker are in one table, with value, unit and meaning."""

import csv

import pytest
from rust_constants import FACTORS, ROOT, TRACK, Constant, changed, constants, tuned, written

PAGE = ROOT / "docs" / "tables" / "tuning.tsv"
ALL = list(constants())


def test_each_constant_has_a_unit_and_a_row_for_each_is_all_there_is() -> None:
    rows = tuned()
    assert [one.key for one in ALL] == list(rows), "run benches/trust/tuning.py and give the unit"
    assert all(row.unit for row in rows.values())


def test_the_page_shows_what_the_code_says() -> None:
    with PAGE.open(encoding="utf-8", newline="") as file:
        shown = [
            (row["file"], row["constant"], row["value"], row["meaning"])
            for row in csv.DictReader(file, delimiter="\t")
        ]
    expected = [(one.file, one.name, one.value, one.meaning) for one in ALL]
    assert shown == expected, "run benches/trust/tuning.py"


def test_a_meaning_is_missing_only_below_one_that_speaks_for_both() -> None:
    for before, one in zip([None, *ALL], ALL, strict=False):
        assert one.meaning or (before and before.file == one.file), one


@pytest.mark.parametrize("factor", FACTORS)
def test_a_change_of_a_constant_changes_that_line_and_no_other(factor: float) -> None:
    for one in ALL:
        other = one.scaled(factor)
        if other is None:
            continue
        before = (TRACK / one.file).read_text(encoding="utf-8")
        after = changed(before, one, other)
        # What was wrapped is one line now.
        assert after.replace(other.value, "") != before
        assert f"const {one.name}: " in after
        assert other.value in after
        assert len(after.split(";")) == len(before.split(";"))


def test_all_numbers_of_a_constant_are_scaled_and_nothing_else() -> None:
    constant = Constant("a.rs", "LINES2", "[(6, 1.5), (MOST_8, 1e-3)]", "")
    other = constant.scaled(2.0)
    assert other is not None
    assert other.value == "[(12, 3.000000000e+00), (MOST_8, 2.000000000e-03)]"
    assert Constant("a.rs", "MIDDLE", "MOST_8 / HALF", "").scaled(2.0) is None
    assert Constant("a.rs", "ONE", "1", "").scaled(1.25) is None


def test_what_is_written_is_read_again() -> None:
    rows = tuned()
    text = written(rows)
    assert text == (ROOT / "benches" / "trust" / "tuning.tsv").read_text(encoding="utf-8")
