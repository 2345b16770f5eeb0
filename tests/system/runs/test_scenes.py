"""Bounds of what hangs on chance follow from many seeds, and each is used by a test."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import scene_table
from scene_table import (
    LEAST_MARGIN,
    MOST_FAILING,
    SEEDS,
    TABLE,
    Figures,
    Row,
    Scene,
    Sense,
    all_scenes,
    bound,
    bound_of,
    parse,
    table,
    written,
)

SCENES = all_scenes()
FOLDER = Path(__file__).parents[2]
KEY = ("a scene", "error")
ROWS: dict[tuple[str, str], Row] = {
    KEY: Row(*KEY, "mm", Sense.AT_MOST, 20, (), 1.0, 2.0, 1.5, 3.0),
    ("a scene", "lag"): Row("a scene", "lag", "deg", Sense.AT_LEAST, 20, (7,), 9.0, 6.0, 1.5, 4.0),
}


def faults(rows: dict[tuple[str, str], Row]) -> list[str]:
    """Say what is wrong with the rows of a table."""
    found = []
    for row in rows.values():
        name = f"{row.scene}, {row.measure}"
        if row.bound != bound_of(row.worst, row.margin, row.sense):
            found.append(f"{name}: the bound does not follow from the worst and the margin")
        if row.seeds < SEEDS:
            found.append(f"{name}: {row.seeds} seeds are too few")
        if len(row.failing) > MOST_FAILING * row.seeds:
            found.append(f"{name}: too many seeds fail")
        if row.margin < LEAST_MARGIN:
            found.append(f"{name}: the margin is too small")
        if not all(map(math.isfinite, (row.median, row.worst, row.margin, row.bound))):
            found.append(f"{name}: not all are numbers")
        if (row.worst - row.median) * (1 if row.sense is Sense.AT_MOST else -1) < 0.0:
            found.append(f"{name}: the median is worse than the worst")
    return found


def unused(scenes: dict[str, Scene], texts: list[str]) -> list[str]:
    """Return the scenes that no text names by the function or the family that declares them."""
    whole = "\n".join(texts)
    return [
        name
        for name, one in scenes.items()
        if not re.search(rf"\b({'|'.join(names_of(one))})\b", whole)
    ]


def names_of(scene: Scene) -> list[str]:
    """Return the names in a scene's module that hold it, alone or among others."""
    found = []
    for name, value in vars(__import__(scene.run.__module__)).items():
        held = value.values() if isinstance(value, dict) else value
        if value is scene or (isinstance(held, (list, type({}.values()))) and scene in held):
            found.append(name)
    return found


def test_each_bound_follows_from_many_seeds_and_a_margin() -> None:
    assert faults(table()) == []


@pytest.mark.parametrize(
    "change",
    [{"bound": 3.1}, {"margin": 1.0, "bound": 2.0}, {"seeds": 19}, {"median": 2.5},
     {"worst": math.nan}, {"failing": (1, 2, 3, 4, 5)}],
)  # fmt: skip
def test_a_row_that_does_not_follow_is_found(change: dict[str, Any]) -> None:
    assert faults(ROWS) == []
    assert faults(ROWS | {KEY: replace(ROWS[KEY], **change)}) != []


def test_the_table_holds_what_the_scenes_measure_and_nothing_else() -> None:
    declared = {
        (name, measure): kind
        for name, one in SCENES.items()
        for measure, kind in one.measures.items()
    }
    assert {key: (row.unit, row.sense) for key, row in table().items()} == declared


def test_each_scene_is_used_by_a_test() -> None:
    folders = (FOLDER, FOLDER.parent / "experiments" / "tests")
    tests = sorted(path for folder in folders for path in folder.rglob("test_*.py"))
    texts = [path.read_text(encoding="utf-8") for path in tests]
    assert unused(SCENES, texts) == []
    one = next(iter(SCENES.values()))
    assert unused({one.name: one}, ["nothing"]) == [one.name]


def test_a_table_that_is_written_is_read_back_and_its_rows_are_in_order() -> None:
    assert parse(written(ROWS)) == ROWS
    assert written(dict(reversed(ROWS.items()))) == written(ROWS)
    assert written(table()) == TABLE.read_text(encoding="utf-8")


def test_a_figure_beyond_its_bound_is_told_with_what_is_known_of_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def run(seed: int, folder: Path) -> Figures:
        assert folder.is_dir()
        return {"error": 2.5 + seed, "lag": 4.5 - seed}

    monkeypatch.setattr(scene_table, "table", lambda: ROWS)
    one = Scene("a scene", run, {"error": "mm"}, {"lag": "deg"}, lambda _: False)
    assert one.broken(0) == []
    assert bound(*KEY) == 3.0
    broken = "error is 3.5 mm, which must be at most 3; the worst of 20 seeds was 2"
    assert one.broken(1) == [broken, broken.replace("error is 3.5 mm", "lag is 3.5 deg")
                             .replace("most 3", "least 4").replace("was 2", "was 6")]  # fmt: skip
    assert one.broken(1, "error") == [broken]
    assert one.beyond({"error": math.nan}) != []
    with pytest.raises(KeyError):
        one.beyond({"other": 1.0})


def test_rows_are_joined_from_what_the_seeds_gave() -> None:
    values = [float(value) for value in range(SEEDS)]
    most = Row.of(KEY, ("mm", Sense.AT_MOST), values)
    assert (most.median, most.worst, most.bound) == (9.5, 19.0, bound_of(19.0, 1.5, most.sense))
    least = Row.of(KEY, ("mm", Sense.AT_LEAST), values[1:])
    assert (least.worst, least.bound) == (1.0, 0.67)
    few = Row.of(KEY, ("mm", Sense.AT_MOST), values, (19, 18))
    assert (few.median, few.worst, few.failing) == (9.5, 17.0, (19, 18))
    assert bound("servo followed", "not tracking") == 0.0
