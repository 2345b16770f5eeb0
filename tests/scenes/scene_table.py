"""Scenes whose outcome hangs on chance, and the bounds that many seeds of each have set.

A scene runs what its test runs, for any seed, and returns figures by their names. `scenes.tsv`
holds the median and the worst of each figure over many seeds and the bound that follows, so that a
bound changes with its cause: `benches/scenes.py` measures the table anew.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

TABLE = Path(__file__).with_name("scenes.tsv")
COLUMNS = ("scene", "measure", "unit", "sense", "seeds", "failing")
COLUMNS += ("median", "worst", "margin", "bound")
DIGITS, BOUND_DIGITS = 3, 2  # significant ones
SEEDS, MARGIN, LEAST_MARGIN = 20, 1.5, 1.25
MOST_FAILING = 0.2  # of the seeds
HEAD = f"""\
# What chance does to the scenes of the tests: benches/scenes.py measured this, and writes it anew.
# Each figure is that of a scene over seeds 0, 1, 2 and so on; seeds in which the scene fails as a
# whole are listed as failing, and only the median knows them. Where a figure may be at most its bound,
# bound = worst * margin; where it must be at least its bound, bound = worst / margin; both to
# {BOUND_DIGITS} digits. A margin is chosen by hand, {LEAST_MARGIN} or more, and stays when the rest is measured anew.
"""  # noqa: E501

Figures = Mapping[str, float]


class Sense(Enum):
    """On which side of its bound a figure must be."""

    AT_MOST = "at most"
    AT_LEAST = "at least"


@dataclass(frozen=True)
class Row:
    """What many seeds of a scene gave for one of its figures."""

    scene: str
    measure: str
    unit: str
    sense: Sense
    seeds: int
    failing: tuple[int, ...]
    median: float
    worst: float
    margin: float
    bound: float

    @classmethod
    def of(
        cls,
        key: tuple[str, str],
        kind: tuple[str, Sense],
        values: Sequence[float],
        failing: tuple[int, ...] = (),
    ) -> "Row":
        """Join what the seeds gave, with the usual margin."""
        kept = [value for seed, value in enumerate(values) if seed not in failing]
        worst = max(kept) if kind[1] is Sense.AT_MOST else min(kept)
        median, worst = (rounded(one, DIGITS) for one in (float(np.median(values)), worst))
        bound = bound_of(worst, MARGIN, kind[1])
        return cls(*key, *kind, len(values), failing, median, worst, MARGIN, bound)

    def cells(self) -> list[str]:
        """Write the row."""
        numbers = (self.median, self.worst, self.margin, self.bound)
        failing = ",".join(map(str, self.failing)) or "none"
        texts = [self.scene, self.measure, self.unit, self.sense.value, str(self.seeds), failing]
        return texts + [f"{one:.{DIGITS}g}" for one in numbers]

    def breaks(self, value: float) -> bool:
        """Say whether a value is beyond the bound, or is no number."""
        kept = value <= self.bound if self.sense is Sense.AT_MOST else value >= self.bound
        return not kept


def rounded(value: float, digits: int) -> float:
    """Round to some significant digits."""
    return float(f"{value:.{digits}g}")


def bound_of(worst: float, margin: float, sense: Sense) -> float:
    """Return the bound that follows from the worst value and a margin."""
    far = worst * margin if sense is Sense.AT_MOST else worst / margin
    return rounded(far, BOUND_DIGITS)


def parse(text: str) -> dict[tuple[str, str], Row]:
    """Read a table; rows are found by the names of scene and measure."""
    lines = [line.split("\t") for line in text.splitlines() if line and line[0] != "#"]
    assert tuple(lines[0]) == COLUMNS
    return {(cells[0], cells[1]): _row(cells) for cells in lines[1:]}


def _row(cells: Sequence[str]) -> Row:
    name, measure, unit, sense, seeds, failing, *numbers = cells
    failed = () if failing == "none" else tuple(map(int, failing.split(",")))
    return Row(
        name, measure, unit, Sense(sense), int(seeds), failed, *(float(one) for one in numbers)
    )


def written(rows: Mapping[tuple[str, str], Row]) -> str:
    """Write a table, its rows in the order of their names."""
    lines = [list(COLUMNS), *(rows[key].cells() for key in sorted(rows))]
    return HEAD + "".join("\t".join(cells) + "\n" for cells in lines)


@cache
def table() -> dict[tuple[str, str], Row]:
    """Return the table that lies beside this file."""
    return parse(TABLE.read_text(encoding="utf-8"))


def bound(scene: str, measure: str) -> float:
    """Return the bound of a figure."""
    return table()[scene, measure].bound


@dataclass(frozen=True)
class Scene:
    """A course that hangs on chance; `at_most` and `at_least` give its figures' units.

    `fails` says of its figures whether what the scene is about failed, as it may for few seeds.
    """

    name: str
    run: Callable[[int, Path], Figures]
    at_most: Mapping[str, str]
    at_least: Mapping[str, str]
    fails: Callable[[Figures], bool]

    @property
    def measures(self) -> dict[str, tuple[str, Sense]]:
        """Return the unit and the sense of each figure."""
        most = {name: (unit, Sense.AT_MOST) for name, unit in self.at_most.items()}
        return most | {name: (unit, Sense.AT_LEAST) for name, unit in self.at_least.items()}

    def figures(self, seed: int) -> Figures:
        """Run the scene in a folder of its own."""
        with TemporaryDirectory() as folder:
            found = self.run(seed, Path(folder))
        assert set(found) == set(self.measures), f"{self.name} gave {sorted(found)}"
        return found

    def beyond(self, figures: Figures, *names: str) -> list[str]:
        """Say which figures, or which of those named, are beyond their bounds."""
        rows = [(table()[self.name, measure], figures[measure]) for measure in names or figures]
        assert rows
        return [
            f"{row.measure} is {value:.{DIGITS}g} {row.unit}, which must be {row.sense.value} "
            f"{row.bound:g}; the worst of {row.seeds} seeds was {row.worst:g}"
            for row, value in rows
            if row.breaks(value)
        ]

    def broken(self, seed: int, *names: str) -> list[str]:
        """Run the scene, and say which figures are beyond their bounds."""
        return self.beyond(self.figures(seed), *names)


_SCENES: dict[str, Scene] = {}  # those of the modules that have been imported


def scene(
    name: str,
    at_most: Mapping[str, str],
    at_least: Mapping[str, str] | None = None,
    fails: Callable[[Figures], bool] = lambda _: False,
) -> Callable[[Callable[[int, Path], Figures]], Scene]:
    """Declare a function of a seed and an empty folder as a scene, with its figures' units."""

    def declare(run: Callable[[int, Path], Figures]) -> Scene:
        assert name not in _SCENES
        _SCENES[name] = Scene(name, run, at_most, at_least or {}, fails)
        return _SCENES[name]

    return declare


def all_scenes() -> dict[str, Scene]:
    """Return the scenes of all modules that lie beside this one, by their names."""
    for path in sorted(TABLE.parent.glob("scenes_*.py")):
        import_module(path.stem)
    return dict(sorted(_SCENES.items()))
