"""Reports the fitness maps: Section 5.1 of the paper, and Fig. 8."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import msgspec
import numpy as np
from msgspec.structs import replace

from servoid.batch import Done, Work
from servoid_experiments.design import Cell, Section, Table, Verdict, about
from servoid_experiments.paper import AS_ASSUMED
from servoid_experiments.paper.maps.case import Fitness, FitnessRow, MapCase, MapRow, MapTrial
from servoid_experiments.paper.maps.drawing import draw_map, draw_ridges
from servoid_experiments.paper.maps.fitness_map import FITNESS_MAP
from servoid_experiments.stage import EyeMode
from servoid_experiments.stats import Spread, spread_of

_QUARTER = 0.25  # of the points' width was the target
_MM = 1e3
_AT_SHARE = 2.0 * float(np.sqrt(2.0 * np.log(1.0 / 0.9)))
"""Width of a normal likelihood at 90 % of its peak, in standard deviations."""


class MapSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The maps of Fig. 8."""

    objects: Annotated[
        tuple[str, ...],
        about("of the simulated world, made of one ellipsoid", min_length=1),
    ] = ("ellipsoid", "painted_ellipsoid")
    eyes: Annotated[
        tuple[EyeMode, ...],
        about("where the eyes look, the first with all seeds; assumed", min_length=1),
    ] = (EyeMode.VERGED, EyeMode.PARALLEL)
    seeds: Annotated[
        int, about("pairs of each object: noise, light, and what was learned", ge=1)
    ] = 10
    vary: Annotated[bool, about("whether assumed numbers are changed, one at a time")] = True
    trial: MapTrial = MapTrial()


QUICK_MAP = MapSettings(
    objects=("ellipsoid",),
    eyes=(EyeMode.VERGED,),
    seeds=2,
    vary=False,
    trial=MapTrial(count=11, points=100),
)


def map_work(settings: MapSettings) -> Work:
    """Return the pairs to score: a whole map of each object and eyes, and ridges for more seeds."""
    cases = [
        MapCase(object_name=name, eyes=eyes, seed=seed, whole=seed == 0, trial=settings.trial)
        for name in settings.objects
        for eyes in settings.eyes
        for seed in range(settings.seeds if eyes is settings.eyes[0] else 1)
    ]
    if settings.vary:
        cases += [
            MapCase(object_name=name, eyes=settings.eyes[0], seed=0, whole=False, trial=changed)
            for name in settings.objects
            for _, changed in map_variants(settings.trial)
        ]
    return Work(FITNESS_MAP, cases)


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


@dataclass(frozen=True)
class _Pairs:
    """All pairs of an object and one direction of the eyes, with a trial that may be varied."""

    variant: str
    object_name: str
    eyes: EyeMode
    rows: Sequence[MapRow]

    def fitness(
        self, fitness: Fitness, take: Callable[[FitnessRow], float | None]
    ) -> Spread | None:
        """Return the statistics of a figure of one fitness."""
        found = [one for row in self.rows for one in row.fitnesses if one.fitness is fitness]
        return spread_of(take(one) for one in found)

    def sigma(self, fitness: Fitness) -> Spread | None:
        """Return the standard deviations of z that the estimates report, in m."""
        return spread_of(one.sigma_z for row in self.rows for one in row.answers
                         if one.fitness is fitness)  # fmt: skip

    def error(self, fitness: Fitness, axis: int) -> Spread | None:
        """Return the errors of the estimates along an axis, in m."""
        answers = [one.error for row in self.rows for one in row.answers if one.fitness is fitness]
        return spread_of(None if error is None else abs(error[axis]) for error in answers)

    @property
    def place(self) -> tuple[str, str, str, int]:
        """Return the first cells of a table's row."""
        return self.variant, self.object_name, self.eyes.value, len(self.rows)


def map_section(settings: MapSettings, done: Sequence[Done]) -> Section:
    """Draw the maps, and list their widths and peaks, and servoid's answers."""
    kept = [(one.case, one.row) for one in done if one.row is not None]
    variants = map_variants(settings.trial) if settings.vary else []
    pairs = [
        _Pairs(variant, name, eyes, rows)
        for variant, trial in [(AS_ASSUMED, settings.trial), *variants]
        for name in settings.objects
        for eyes in settings.eyes
        if (rows := [row for case, row in kept
                     if (case.trial, case.object_name, case.eyes) == (trial, name, eyes)])
    ]  # fmt: skip
    shown = [(case, row) for case, row in kept if case.whole and case.trial == settings.trial]
    pictures = [draw_map(case, row) for case, row in shown]
    if shown:
        pictures.append(draw_ridges([one for one in shown if one[0].eyes is shown[0][0].eyes]))
    return Section(
        heading="Section 5.1: the fitness map (Fig. 8)",
        findings=_findings([one for one in pairs if one.variant == AS_ASSUMED]),
        pictures=pictures,
        tables=(_widths(pairs), _answers(pairs)),
    )


def _widths(pairs: Sequence[_Pairs]) -> Table:
    takes: dict[str, Callable[[FitnessRow], float | None]] = {
        "ridge_mm": lambda one: one.ridge.crest,
        "ridge_from_lowest_mm": lambda one: one.ridge.crest_from_floor,
        **{f"width_{'xyz'[i]}_mm": lambda one, i=i: one.ridge.along[i] for i in range(3)},
        **{f"peak_off_{'xyz'[i]}_mm": lambda one, i=i: abs(one.ridge.peak[i]) for i in range(3)},
    }
    return Table(
        "fitness_widths",
        ("variant", "object", "eyes", "pairs", "fitness", *takes, "ridge_mm_95_half_width"),
        [
            (*one.place, fitness.value, *map(_mean, found), _half(found[0]))
            for one in pairs
            for fitness in Fitness
            for found in [[one.fitness(fitness, take) for take in takes.values()]]
        ],
        "Widths at 90 % of the peak: of the ridge along z, and along straight lines through the "
        "true place; and by how much the peak is off. Means over the pairs.",
    )


def _answers(pairs: Sequence[_Pairs]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for one in pairs:
        for fitness in (Fitness.REGION, Fitness.SURFACE, Fitness.FULL):
            sigma = one.sigma(fitness)
            width = None if sigma is None else _MM * (_AT_SHARE * sigma.mean)
            errors = [_mean(one.error(fitness, axis)) for axis in range(3)]
            rows.append((*one.place, fitness.value, *errors, _mean(sigma), width))
    return Table(
        "fitness_answers",
        ("variant", "object", "eyes", "pairs", "by", "error_x_mm", "error_y_mm", "error_z_mm",
         "sigma_z_mm", "likelihood_mm"),
        rows,
        "What servoid's tracker answers, which also seeks the turn: errors by magnitude, its own "
        "standard deviation of z, and how wide that likelihood is at 90 % of its peak. Means over "
        "the pairs.",
    )  # fmt: skip


def _mean(spread: Spread | None) -> float | None:
    return None if spread is None else _MM * spread.mean


def _half(spread: Spread | None) -> float | None:
    return None if spread is None or spread.half is None else _MM * spread.half


def _findings(pairs: Sequence[_Pairs]) -> dict[str, Verdict]:
    """Compare the positions of the peaks, and the widths of the ridges, with the paper's claims."""
    off = [
        float(np.abs(one.map_peak).max())
        for kind in pairs
        for row in kind.rows
        for one in row.fitnesses
        if one.fitness is Fitness.POINTS and one.map_peak
    ]
    found = {}
    if off:
        verdict = Verdict.AGREES if max(off) < 1e-6 else Verdict.PARTLY
        found["The fitness is highest at the true position."] = verdict
    widths = [
        pairs[0].fitness(Fitness.POINTS, lambda one, i=i: one.ridge.along[i]) if pairs else None
        for i in (0, 2)
    ]
    if widths[0] and widths[1]:
        wide = widths[1].mean > 2.0 * widths[0].mean
        verdict = Verdict.AGREES if wide else Verdict.PARTLY
        found["The top is wider along z than along x and y."] = verdict
    ratios = [
        ours.mean / points.mean
        for one in pairs
        if (points := one.fitness(Fitness.POINTS, lambda row: row.ridge.crest))
        and (ours := one.fitness(Fitness.FULL, lambda row: row.ridge.crest))
    ]
    if ratios:
        verdict = Verdict.BEYOND if max(ratios) <= _QUARTER else Verdict.PARTLY
        found["Recognition in z must become better (future work)."] = verdict
    return found
