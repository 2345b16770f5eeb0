"""Which of the numbers that the paper leaves out matter for its Figs. 8 and 9."""

from collections.abc import Sequence

from msgspec.structs import replace

from servoid.batch import Done
from servoid_experiments.findings import Table
from servoid_experiments.paper.intervals import interval
from servoid_experiments.paper.map_case import Fitness, MapCase, MapRow, MapTrial
from servoid_experiments.paper.map_tables import AT_SHARE, Kind
from servoid_experiments.paper.two_case import Procedure, TwoCase, TwoRow, TwoTrial

_MM = 1000.0
_AS_IT_IS = "as above"


def map_variants(trial: MapTrial) -> list[tuple[str, MapTrial]]:
    """Return the trial with one number changed at a time, and what was changed."""
    pair = trial.pair
    width, height = pair.size_px
    fine = replace(pair, size_px=(2 * width, 2 * height))
    coarse = replace(pair, size_px=(width // 2, height // 2))
    variants = [
        ("α a third", replace(trial, alpha=trial.alpha / 3.0)),
        ("α three times", replace(trial, alpha=3.0 * trial.alpha)),
        ("a fifth of the points", replace(trial, points=max(1, trial.points // 5))),
        ("images half as wide", replace(trial, pair=coarse)),
        ("images twice as wide", replace(trial, pair=fine)),
        ("four times the noise", replace(trial, pair=replace(pair, noise=4.0 * pair.noise))),
        ("a plain background", replace(trial, pair=replace(pair, background="plain"))),
    ]
    return [(words, changed) for words, changed in variants if changed != trial]


def two_variants(trial: TwoTrial) -> list[tuple[str, TwoTrial]]:
    """Return the trial with one number of the paper's procedure changed at a time."""
    variants = [
        ("α a third", replace(trial, alpha=trial.alpha / 3.0)),
        ("α three times", replace(trial, alpha=3.0 * trial.alpha)),
        ("a third of the generations", replace(trial, generations=max(1, trial.generations // 3))),
    ]
    return [(words, changed) for words, changed in variants if changed != trial]


def map_table(trial: MapTrial, done: Sequence[Done]) -> Table:
    """List the ridges along z for each changed number."""
    rows = []
    for words, changed in [(_AS_IT_IS, trial), *map_variants(trial)]:
        for name, found in _by_object(changed, done).items():
            kind = Kind(name, found[0][0].eyes, [row for _, row in found])
            widths = (kind.width(one) for one in (Fitness.POINTS, Fitness.SURFACE, Fitness.FULL))
            sigma = kind.sigma(Fitness.FULL)
            rows.append(
                (
                    words,
                    name.replace("_", " "),
                    *("" if width is None else f"{_MM * width.mean:.1f}" for width in widths),
                    "" if sigma is None else f"{_MM * AT_SHARE * sigma.mean:.2f}",
                )
            )
    return Table(
        headings=(
            "changed", "object", "points", "surface", "region and surface", "likelihood",
        ),
        rows=rows,
        caption="Ridges along z in mm at 90 % of the peak, of the first pair, where one assumed "
        "number is changed.",
    )  # fmt: skip


def two_table(trial: TwoTrial, done: Sequence[Done]) -> Table:
    """List the errors of the paper's procedure for each changed number, by the same seeds."""
    variants = two_variants(trial)
    seeds = {one.case.seed for one in done if one.case.trial == variants[0][1]}
    rows = []
    for words, changed in [(_AS_IT_IS, trial), *variants]:
        found = [row for case, row in _paper_rows(done) if case.trial == changed]
        if changed == trial:
            same = _paper_rows(done)
            found = [row for case, row in same if case.trial == trial and case.seed in seeds]
        if found:
            off = (interval([abs(row.error[axis]) for row in found]) for axis in range(3))
            rows.append(
                (
                    words,
                    str(len(found)),
                    *(one.mm() for one in off),
                    interval([row.volume_iou for row in found]).written(2),
                    interval([row.silhouette_iou for row in found]).written(2),
                )
            )
    return Table(
        headings=(
            "changed", "trials", "error in x, mm", "in y, mm", "in z, mm", "volume IoU",
            "silhouette IoU",
        ),
        rows=rows,
        caption="The paper's procedure where one assumed number is changed.",
    )  # fmt: skip


def _by_object(trial: MapTrial, done: Sequence[Done]) -> dict[str, list[tuple[MapCase, MapRow]]]:
    """Return the first pairs of a trial, by object."""
    found: dict[str, list[tuple[MapCase, MapRow]]] = {}
    for one in done:
        first = one.case.seed == 0 and one.case.trial == trial
        if one.row is not None and first and not found.get(one.case.object_name):
            found[one.case.object_name] = [(one.case, one.row)]
    return found


def _paper_rows(done: Sequence[Done]) -> list[tuple[TwoCase, TwoRow]]:
    return [
        (one.case, one.row)
        for one in done
        if one.row is not None and one.case.procedure is Procedure.PAPER
    ]
