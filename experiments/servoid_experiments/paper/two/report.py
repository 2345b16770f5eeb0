"""Reports models of two ellipsoids by three: Section 5.2 of the paper, and Fig. 9."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from servoid.batch import Done, Work
from servoid_experiments.paper.two.case import Procedure, TwoCase, TwoRow, TwoTrial
from servoid_experiments.paper.two.drawing import Shown, draw_errors, draw_models
from servoid_experiments.paper.two.modelling import TWO_ELLIPSOIDS, first_pair
from servoid_experiments.paper.unstated import AS_IT_IS, two_variants
from servoid_experiments.report import Cell, Finding, Picture, Section, Table, Verdict
from servoid_experiments.stats import over

_MM = 1000.0
_ALIKE = 0.9  # IoU of silhouettes from which on shapes count as equal in a figure

Rows = dict[Procedure, list[TwoRow]]


class TwoSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The models of Fig. 9."""

    procedures: Annotated[
        tuple[Procedure, ...],
        Meta(
            min_length=1,
            description="paper: the paper's own; servoid's with pair: silhouettes of the pair; "
            "stereo: and its measured depth; depth: and a depth camera; looks: four pairs",
        ),
    ] = tuple(Procedure)
    seeds: Annotated[
        int, Meta(ge=1, description="trials of each: noise, light, place and search")
    ] = 30
    vary_seeds: Annotated[
        int,
        Meta(
            ge=0,
            description="trials of the paper's procedure with each assumed number changed; 0: none",
        ),
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


def two_section(settings: TwoSettings, done: Sequence[Done], folder: Path) -> Section:
    """Draw the models into a folder, and list how they differ from the truth.

    Raises:
        OutputError: a picture cannot be written.

    """
    plain = [one for one in done if one.case.trial == settings.trial]
    rows: Rows = {
        kind: found
        for kind in settings.procedures
        if (found := [one.row for one in plain if one.row and one.case.procedure is kind])
    }
    return Section(
        heading="Section 5.2: an object of two ellipsoids, modelled with three (Fig. 9)",
        findings=_findings(rows),
        pictures=_pictures(plain, rows, folder),
        tables=(_table(settings, rows, done),),
    )


def _findings(rows: Rows) -> tuple[Finding, ...]:
    paper = rows.get(Procedure.PAPER)
    if not paper:
        return ()
    alike = over(paper, lambda row: row.silhouette_iou).mean >= _ALIKE
    x, y, z = (over(paper, lambda row, i=i: abs(row.error[i])).mean for i in range(3))
    paper_off = over(paper, _length).mean
    ours = [found for kind, found in rows.items() if kind is not Procedure.PAPER]
    nearer = all(over(found, _length).mean < paper_off for found in ours)
    return (
        Finding(
            "The shape of the model agrees with the object.",
            Verdict.AGREES if alike else Verdict.DIFFERS,
        ),
        Finding(
            "The model is off in x and in z.",
            Verdict.AGREES if y < min(x, z) else Verdict.PARTLY,
        ),
        Finding(
            "To model arbitrary shapes from one pair (the paper's aim).",
            Verdict.BEYOND if ours and nearer else Verdict.PARTLY,
        ),
    )


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


def _table(settings: TwoSettings, rows: Rows, done: Sequence[Done]) -> Table:
    lines: list[tuple[Cell, ...]] = [
        _line(kind.value, AS_IT_IS, found) for kind, found in rows.items()
    ]
    for variant, trial in two_variants(settings.trial):
        found = [one.row for one in done if one.row is not None and one.case.trial == trial]
        if found:
            lines.append(_line(Procedure.PAPER.value, variant, found))
    figures = [name for name in _FIGURES for name in (name, f"{name}_95_half_width")]
    return Table(
        "two_ellipsoids",
        "Means over the trials, with the half width of their 95 % intervals: the centroid's error, "
        "by magnitude; shapes; of the model's ellipsoid nearest to each true one the centre's "
        "error, by magnitude, and by how much its radii are larger; seconds on one thread.",
        ("procedure", "variant", "trials", *figures),
        lines,
    )


def _line(procedure: str, variant: str, rows: Sequence[TwoRow]) -> tuple[Cell, ...]:
    spreads = [over(rows, take) for take in _FIGURES.values()]
    cells = [cell for one in spreads for cell in (one.mean, one.half)]
    return (procedure, variant, len(rows), *cells)


def _pictures(plain: Sequence[Done], rows: Rows, folder: Path) -> tuple[Picture, ...]:
    if not rows:
        return ()
    kept = [(one.case, one.row) for one in plain if one.row is not None]
    first = min(case.seed for case, _ in kept)
    shown = [Shown(case, row) for case, row in kept if case.seed == first]
    models, errors = folder / "two_ellipsoids.png", folder / "two_ellipsoids_errors.png"
    draw_models(first_pair(shown[0].case), shown, models)
    draw_errors(rows, errors)
    return (
        Picture(
            models,
            f"Models of the same pair (seed {first}) as in Fig. 9: black the true object, blue the "
            "model's ellipsoids. Above in the left image, below seen from above (x-z) and from "
            "the side (z-y), z away from the hand.",
        ),
        Picture(
            errors,
            "Errors of all trials: dots are trials, diamonds means, bars their 95 % intervals.",
        ),
    )


def _length(row: TwoRow) -> float:
    return float(np.linalg.norm(row.error))
