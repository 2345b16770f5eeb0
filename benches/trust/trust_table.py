"""Stores the measured reliability of the tracker: one row per sequence and variant, over seeds.

Used by the scripts beside it. Rows contain counts, so that rows can be combined; printed and drawn
figures are derived from them.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from scipy.stats import chi2
from trust_verdicts import Verdicts

TABLE = Path(__file__).with_name("trust.tsv")
BINS = 10  # of the confidence
REGION = 0.95  # probability of the covariance's region
FREEDOMS = (3, 3, 6)  # of position, rotation and both
HEAD = """\
# How far a tracker's words can be trusted: benches/trust/trust.py measured this, and writes it anew.
# Counts are over all seeds. wrong and longest are of each seed: images that are said to be tracked and
# are wrong, and how many in a row. found_after are the images until a lost object was tracked rightly
# again, 0: never. In ten steps of the confidence: told, images that are tracking or searching, told_right,
# those of them whose pose is right, and so for tracking. covered are the images, of those tracked rightly,
# whose true place, turn, and both lie in the region that the covariance gives 95 %.
"""  # noqa: E501

Counts = tuple[int, ...]
Key = tuple[str, str]


@dataclass(frozen=True)
class Row:
    """The results of the seeds of a sequence and variant; see `HEAD`."""

    sequence: str
    variant: str
    images: Counts
    tracked: int
    right: int
    wrong: Counts
    longest: Counts
    found_after: Counts
    add_mm: float
    told: Counts
    told_right: Counts
    tracking: Counts
    tracking_right: Counts
    covered: Counts

    @property
    def key(self) -> Key:
        """Return the key that identifies the row."""
        return self.sequence, self.variant

    @property
    def wrong_percent(self) -> list[float]:
        """Return the share of images that were wrong and reported as tracked, by seed."""
        pairs = zip(self.wrong, self.images, strict=True)
        return [100.0 * wrong / images for wrong, images in pairs]

    @property
    def right_percent(self) -> float:
        """Return the share of the images that were tracked rightly."""
        return 100.0 * self.right / sum(self.images)

    @property
    def tracked_percent(self) -> float:
        """Return the share of images that were reported as tracked."""
        return 100.0 * self.tracked / sum(self.images)

    @property
    def found(self) -> list[int]:
        """Return the number of images that each recovered loss took."""
        return [one for one in self.found_after if one]

    @property
    def covered_percent(self) -> list[float]:
        """Return the coverage of the covariance: of positions, of rotations, and of both.

        They are NaN where nothing was tracked rightly.
        """
        return [100.0 * one / self.right if self.right else np.nan for one in self.covered]


def row_of(key: Key, runs: Sequence[Verdicts]) -> Row:
    """Count the results of the runs of one sequence and variant."""
    tracking = np.concatenate([run.tracking for run in runs])
    wrong = np.concatenate([run.wrong for run in runs])
    followed = ~np.concatenate([run.lost for run in runs])
    right = tracking & ~wrong
    steps = np.concatenate([run.confidence for run in runs])
    steps = np.minimum((BINS * steps).astype(int), BINS - 1)
    add = np.concatenate([run.add for run in runs])[tracking]
    surprise = np.concatenate([run.surprise for run in runs])[right]
    bounds = [chi2.ppf(REGION, freedom) for freedom in FREEDOMS]

    def counted(chosen: np.ndarray) -> Counts:
        return tuple(np.bincount(steps[chosen], minlength=BINS).tolist())

    return Row(
        *key,
        images=tuple(len(run) for run in runs),
        tracked=int(tracking.sum()),
        right=int(right.sum()),
        wrong=tuple(int(run.trusted_wrong.sum()) for run in runs),
        longest=tuple(run.longest_wrong for run in runs),
        found_after=tuple(after or 0 for run in runs for after in run.losses),
        add_mm=round(1e3 * float(np.median(add)), 3) if len(add) else np.nan,
        told=counted(followed),
        told_right=counted(followed & ~wrong),
        tracking=counted(tracking),
        tracking_right=counted(right),
        covered=tuple((surprise <= bounds).sum(axis=0).tolist()),
    )


def joined(key: Key, rows: Iterable[Row]) -> Row:
    """Combine rows to one; ADD is then the median of theirs."""
    rows = list(rows)
    adds = [one.add_mm for one in rows if not np.isnan(one.add_mm)]

    def total(part: Callable[[Row], Counts]) -> Counts:
        return tuple(np.sum([part(one) for one in rows], axis=0).tolist())

    def strung(part: Callable[[Row], Counts]) -> Counts:
        return tuple(number for one in rows for number in part(one))

    return Row(
        *key,
        images=strung(lambda one: one.images),
        tracked=sum(one.tracked for one in rows),
        right=sum(one.right for one in rows),
        wrong=strung(lambda one: one.wrong),
        longest=strung(lambda one: one.longest),
        found_after=strung(lambda one: one.found_after),
        add_mm=float(np.median(adds)) if adds else np.nan,
        told=total(lambda one: one.told),
        told_right=total(lambda one: one.told_right),
        tracking=total(lambda one: one.tracking),
        tracking_right=total(lambda one: one.tracking_right),
        covered=total(lambda one: one.covered),
    )


def written(rows: Mapping[Key, Row]) -> str:
    """Format a table."""
    names = [field.name for field in fields(Row)]
    lines = [names, *([_cell(getattr(one, name)) for name in names] for one in rows.values())]
    return HEAD + "".join("\t".join(line) + "\n" for line in lines)


def _cell(value: str | float | Counts) -> str:
    return " ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def parse(text: str) -> dict[Key, Row]:
    """Read a table."""
    names, *lines = (line.split("\t") for line in text.splitlines() if line[:1] != "#")
    rows = [_row(dict(zip(names, line, strict=True))) for line in lines]
    return {row.key: row for row in rows}


def _row(cells: dict[str, str]) -> Row:
    values = {}
    for field in fields(Row):
        cell = cells[field.name]
        if field.type in (Counts, "Counts"):
            values[field.name] = tuple(map(int, cell.split()))
        else:
            values[field.name] = {str: str, int: int, float: float}[field.type](cell)
    return Row(**values)
