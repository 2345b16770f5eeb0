"""Reports models of two ellipsoids by three: Section 5.2 of the paper, and Fig. 9."""

from collections.abc import Callable, Sequence
from typing import Annotated

import msgspec
import numpy as np
from msgspec.structs import replace

from servoid.batch import Done, Work
from servoid_experiments.design import Cell, Section, Table, Verdict, about
from servoid_experiments.paper import AS_ASSUMED
from servoid_experiments.paper.two.drawing import draw_errors, draw_models
from servoid_experiments.paper.two.modelling import (
    TWO_ELLIPSOIDS,
    Procedure,
    TwoCase,
    TwoRow,
    TwoTrial,
)
from servoid_experiments.stats import interval_cells, interval_headings, over

_MM = 1000.0
_ALIKE = 0.9  # IoU of silhouettes from which on shapes count as equal in a figure

Rows = dict[Procedure, list[TwoRow]]


_PARTS = ("upper", "lower")
_FIGURES: dict[str, Callable[[TwoRow], float]] = {
    **{f"error_{'xyz'[i]}_mm": lambda row, i=i: _MM * abs(row.error[i]) for i in range(3)},
    "volume_iou": lambda row: row.volume_iou,
    "silhouette_iou": lambda row: row.silhouette_iou,
    "volume_ratio": lambda row: row.volume_ratio,
    **{
        f"{part}_error_{'xyz'[i]}_mm": lambda row, at=at, i=i: _MM * abs(row.part_errors[at][i])
        for at, part in enumerate(_PARTS)
        for i in range(3)
    },
    **{
        f"{part}_radius_{i + 1}_larger_mm": lambda row, at=at, i=i: _MM * row.radius_errors[at][i]
        for at, part in enumerate(_PARTS)
        for i in range(3)
    },
    "seconds": lambda row: row.seconds,
}
"""Centroid, shapes, and of the ellipsoid nearest to each true one its centre and its radii."""


class TwoSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The models of Fig. 9."""

    procedures: Annotated[
        tuple[Procedure, ...],
        about(
            "paper: the paper's own; servoid's with pair: silhouettes of the pair; "
            "stereo: and its measured depth; depth: and a depth camera; looks: four pairs",
            min_length=1,
        ),
    ] = tuple(Procedure)
    seeds: Annotated[int, about("trials of each: noise, light, place and search", ge=1)] = 30
    vary_seeds: Annotated[
        int,
        about("trials of the paper's procedure with each assumed number changed; 0: none", ge=0),
    ] = 5
    trial: TwoTrial = TwoTrial()


QUICK_TWO = TwoSettings(
    procedures=(Procedure.PAPER, Procedure.LOOKS),
    seeds=2,
    vary_seeds=0,
    trial=TwoTrial(points=100, population=40, generations=60),
)


def two_work(settings: TwoSettings) -> Work:
    """Return the models to make."""
    cases = [
        TwoCase(procedure=procedure, seed=seed, trial=settings.trial)
        for seed in range(settings.seeds)
        for procedure in settings.procedures
    ]
    cases += [
        TwoCase(procedure=Procedure.PAPER, seed=seed, trial=changed)
        for _, changed in two_variants(settings.trial)
        for seed in range(settings.vary_seeds)
    ]
    return Work(TWO_ELLIPSOIDS, cases)


def two_variants(trial: TwoTrial) -> list[tuple[str, TwoTrial]]:
    """Return the trial with one number of the paper's procedure changed at a time."""
    variants = [
        ("α a third", replace(trial, alpha=trial.alpha / 3.0)),
        ("α three times", replace(trial, alpha=3.0 * trial.alpha)),
        ("a third of the generations", replace(trial, generations=max(1, trial.generations // 3))),
    ]
    return [(words, changed) for words, changed in variants if changed != trial]


def two_section(settings: TwoSettings, done: Sequence[Done]) -> Section:
    """Draw the models, and list how they differ from the truth."""
    kept = [(one.case, one.row) for one in done if one.row is not None]
    plain = [(case, row) for case, row in kept if case.trial == settings.trial]
    rows: Rows = {
        kind: found
        for kind in settings.procedures
        if (found := [row for case, row in plain if case.procedure is kind])
    }
    first = [one for one in plain if one[0].seed == min(case.seed for case, _ in plain)]
    lines = [_line(kind.value, AS_ASSUMED, found) for kind, found in rows.items()]
    lines += [
        _line(Procedure.PAPER.value, variant, found)
        for variant, trial in two_variants(settings.trial)
        if (found := [row for case, row in kept if case.trial == trial])
    ]
    table = Table(
        "two_ellipsoids",
        ("procedure", "variant", "trials", *interval_headings(_FIGURES)),
        lines,
        "Means over the trials, with the half width of their 95 % intervals: the centroid's error, "
        "by magnitude; shapes; of the model's ellipsoid nearest to each true one the centre's "
        "error, by magnitude, and by how much its radii are larger; seconds on one thread.",
    )
    return Section(
        heading="Section 5.2: an object of two ellipsoids, modelled with three (Fig. 9)",
        findings=_findings(rows),
        pictures=(draw_models(first), draw_errors(rows)) if rows else (),
        tables=(table,),
    )


def _findings(rows: Rows) -> dict[str, Verdict]:
    paper = rows.get(Procedure.PAPER)
    if not paper:
        return {}
    alike = over(row.silhouette_iou for row in paper).mean >= _ALIKE
    x, y, z = (over(abs(row.error[i]) for row in paper).mean for i in range(3))
    ours = [_off(found) for kind, found in rows.items() if kind is not Procedure.PAPER]
    nearer = ours and max(ours) < _off(paper)
    return {
        "The shape of the model agrees with the object.": (
            Verdict.AGREES if alike else Verdict.DIFFERS
        ),
        "The model is off in x and in z.": Verdict.AGREES if y < min(x, z) else Verdict.PARTLY,
        "To model arbitrary shapes from one pair (the paper's aim).": (
            Verdict.BEYOND if nearer else Verdict.PARTLY
        ),
    }


def _off(rows: Sequence[TwoRow]) -> float:
    """Return the mean error of the centroid."""
    return over(float(np.linalg.norm(row.error)) for row in rows).mean


def _line(procedure: str, variant: str, rows: Sequence[TwoRow]) -> tuple[Cell, ...]:
    spreads = [over(map(take, rows)) for take in _FIGURES.values()]
    return (procedure, variant, len(rows), *interval_cells(spreads))
