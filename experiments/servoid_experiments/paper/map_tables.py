"""Tables of what the fitness maps show, and the figures that they are made of."""

from collections.abc import Sequence

import numpy as np

from servoid_experiments.findings import Table
from servoid_experiments.paper.eye_pair import EyeMode
from servoid_experiments.paper.intervals import Interval, mean_interval
from servoid_experiments.paper.map_case import Answer, Fitness, FitnessRow, MapRow
from servoid_experiments.paper.map_drawing import NAMES

_MM = 1000.0
AT_SHARE = 2.0 * float(np.sqrt(2.0 * np.log(1.0 / 0.9)))
"""Width of a normal likelihood at 90 % of its peak, in standard deviations."""


class Kind:
    """All pairs of an object before eyes that look in one way."""

    def __init__(self, name: str, eyes: EyeMode, rows: Sequence[MapRow]) -> None:
        self.name, self.eyes, self.rows = name, eyes, rows

    @property
    def title(self) -> str:
        """Return what people call it."""
        return f"{self.name.replace('_', ' ')}, {self.eyes.value} eyes"

    def of(self, fitness: Fitness) -> list[FitnessRow]:
        """Return the rows of one fitness."""
        return [one for row in self.rows for one in row.fitnesses if one.fitness is fitness]

    def width(self, fitness: Fitness) -> Interval | None:
        """Return the width of the crest along z, in m."""
        widths = [one.ridge.crest for one in self.of(fitness)]
        return mean_interval([width for width in widths if width is not None])

    def straight(self, fitness: Fitness, axis: int) -> Interval | None:
        """Return the width along a straight line, in m."""
        widths = [one.ridge.along[axis] for one in self.of(fitness)]
        return mean_interval([width for width in widths if width is not None])

    def from_floor(self, fitness: Fitness) -> Interval | None:
        """Return the width of the crest where the share counts from the lowest value, in m."""
        widths = [one.ridge.crest_from_floor for one in self.of(fitness)]
        return mean_interval([width for width in widths if width is not None])

    def peak_error(self, fitness: Fitness, axis: int) -> Interval | None:
        """Return by how much the peak is off along an axis, in m."""
        return mean_interval([abs(one.ridge.peak[axis]) for one in self.of(fitness)])

    def answers(self, fitness: Fitness) -> list[Answer]:
        """Return the tracker's answers by one kind of evidence, or by both."""
        all_of_them = [one for row in self.rows for one in row.answers]
        return [one for one in all_of_them if one.fitness is fitness]

    def sigma(self, fitness: Fitness) -> Interval | None:
        """Return the answers' own standard deviation of z, in m."""
        found = [one.sigma_z for one in self.answers(fitness)]
        return mean_interval([sigma for sigma in found if sigma is not None])

    def answer_error(self, fitness: Fitness, axis: int) -> Interval | None:
        """Return by how much the answers are off along an axis, in m."""
        found = [one.error for one in self.answers(fitness)]
        return mean_interval([abs(error[axis]) for error in found if error is not None])


def widths(kinds: Sequence[Kind]) -> Table:
    """List how wide the fitnesses are and where their peaks."""
    rows = []
    for kind in kinds:
        for fitness in Fitness:
            rows.append(
                (
                    kind.title,
                    NAMES[fitness],
                    *(_cell(kind.straight(fitness, axis)) for axis in range(3)),
                    _cell(kind.width(fitness)),
                    _cell(kind.from_floor(fitness)),
                    *(_cell(kind.peak_error(fitness, axis), 2) for axis in range(3)),
                )
            )
    return Table(
        headings=(
            "object", "fitness", "width along x", "along y", "along z", "ridge along z",
            "ridge, from the lowest value", "peak off in x", "in y", "in z",
        ),
        rows=rows,
        caption="Widths at 90 % of the peak, and how far the peak is off, mean of the amounts; all "
        "in mm. Straight lines go through the true place.",
    )  # fmt: skip


def answers(kinds: Sequence[Kind]) -> Table:
    """List what the tracker answers, and how sure it is."""
    rows = []
    for kind in kinds:
        for fitness in (Fitness.REGION, Fitness.SURFACE, Fitness.FULL):
            answers = kind.answers(fitness)
            sigma = kind.sigma(fitness)
            rows.append(
                (
                    kind.title,
                    NAMES[fitness],
                    f"{sum(one.error is not None for one in answers)} of {len(answers)}",
                    *(_cell(kind.answer_error(fitness, axis), 2) for axis in range(3)),
                    _cell(sigma, 2),
                    "" if sigma is None else f"{_MM * AT_SHARE * sigma.mean:.2f}",
                )
            )
    return Table(
        headings=(
            "object", "by", "found", "error in x", "in y", "in z", "own deviation of z",
            "ridge of the likelihood",
        ),
        rows=rows,
        caption="What servoid's tracker answers, which also seeks the turn: errors, mean of the "
        "amounts, and its own standard deviation of z with the turn known; all in mm.",
    )  # fmt: skip


def seconds(kinds: Sequence[Kind]) -> Table:
    """List how long the maps took."""
    rows = []
    for kind in kinds:
        for row in kind.rows:
            if row.points_seconds and row.region_seconds:
                ratio = row.points_seconds / row.region_seconds
                rows.append(
                    (
                        kind.title,
                        f"{row.points_seconds:.2f}",
                        f"{row.region_seconds:.2f}",
                        f"{ratio:.0f}",
                    )
                )
    return Table(
        headings=("object", "points, s", "region, s", "ratio"),
        rows=rows,
        caption="Seconds for all places of the box on one thread, beside whatever else ran.",
    )


def _cell(interval: Interval | None, digits: int = 1) -> str:
    return "" if interval is None else interval.mm(digits)
