"""What the fitness maps show: Section 5.1 of the paper, and Fig. 8."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from servoid.batch import Done, Work
from servoid_experiments.findings import Finding, Picture, Section, Verdict
from servoid_experiments.paper.eye_pair import EyeMode
from servoid_experiments.paper.fitness_map import FITNESS_MAP
from servoid_experiments.paper.left_out import map_table, map_variants
from servoid_experiments.paper.map_case import Fitness, MapCase, MapRow, MapTrial
from servoid_experiments.paper.map_drawing import draw_map, draw_ridges
from servoid_experiments.paper.map_tables import AT_SHARE, Kind, answers, seconds, widths

_MM = 1000.0
_QUARTER = 0.25


class MapSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The maps of Fig. 8."""

    objects: Annotated[
        tuple[str, ...],
        Meta(min_length=1, description="of the simulated world, made of one ellipsoid"),
    ] = ("ellipsoid", "painted_ellipsoid")
    eyes: Annotated[
        tuple[EyeMode, ...],
        Meta(min_length=1, description="where the eyes look, the first with all seeds; assumed"),
    ] = (EyeMode.VERGED, EyeMode.PARALLEL)
    seeds: Annotated[
        int, Meta(ge=1, description="pairs of each object: noise, light, and what was learned")
    ] = 10
    vary: Annotated[
        bool, Meta(description="whether assumed numbers are changed, one at a time")
    ] = True
    trial: MapTrial = MapTrial()


QUICK_MAP = MapSettings(
    objects=("ellipsoid",),
    eyes=(EyeMode.VERGED,),
    seeds=2,
    vary=False,
    trial=MapTrial(count=11, points=100),
)


def map_work(settings: MapSettings) -> Work:
    """Return the pairs to score: a whole map of each object and eyes, and ridges of more seeds."""
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


def map_section(settings: MapSettings, done: Sequence[Done], folder: Path) -> Section:
    """Draw the maps into a folder and say what they show.

    Raises:
        OutputError: a picture cannot be written.

    """
    told = [(one.case, one.row) for one in done if one.row is not None]
    pairs = [(case, row) for case, row in told if case.trial == settings.trial]
    failed = len(done) - len(told)
    kinds = _kinds(settings, pairs)
    if not kinds:
        return Section("Section 5.1: the fitness map", ("Every trial of this part failed.",))
    return Section(
        heading="Section 5.1: the fitness map (Fig. 8)",
        words=(*_words(settings), *_missing(failed)),
        findings=(_position(kinds), _ridge(kinds), _sharpest(kinds)),
        pictures=_pictures(pairs, folder),
        tables=(
            widths(kinds),
            answers(kinds),
            *([map_table(settings.trial, done)] if settings.vary else []),
            seconds(kinds),
        ),
    )


def _kinds(settings: MapSettings, pairs: Sequence[tuple[MapCase, MapRow]]) -> list[Kind]:
    """Sort rows by object and eyes, those that have any."""
    kinds = []
    for name in settings.objects:
        for eyes in settings.eyes:
            rows = [row for one, row in pairs if (one.object_name, one.eyes) == (name, eyes)]
            if rows:
                kinds.append(Kind(name, eyes, rows))
    return kinds


def _words(settings: MapSettings) -> tuple[str, ...]:
    trial = settings.trial
    spacing = 2.0 * trial.half / (trial.count - 1)
    place = ", ".join(f"{_MM * x:.0f}" for x in trial.place)
    return (
        f"A true model is put at {trial.count}³ = {trial.count**3:,} places, every "
        f"{_MM * spacing:.3g} mm around the object, which is at ({place}) mm before the hand, and "
        "is turned as the object is. The maps show the best fitness over the third axis, from 0, "
        "where a model sees nothing of the object, to the peak.",
        "Four fitnesses are compared: the paper's points (its equations 1 to 7); servoid's region "
        "term; its surface term, patches of the surface compared at the image's own resolution; "
        "and the sum of both, by which servoid seeks poses (S48), though on coarser images. The "
        "look of the surface was learned in another pair, in which the object was "
        f"{_MM * trial.taught_shift:.0f} mm away and turned by {trial.taught_turn_deg:.0f} "
        "degrees, with other noise and, from the second seed on, other light.",
        "The width of a ridge is how far along z the fitness stays above 90 % of its peak, with "
        "the best x and y at each depth; all these fitnesses are 0 where nothing of the object "
        "is seen, so that the share has the same meaning for each. Counted from the lowest value "
        "in the box, the ridges are wider (table). Intervals are 95 %, by Student's t over "
        "seeds.",
        "servoid does not answer with the best of these scores. It goes on from there to the place "
        "where the likelihood of surface points and outline is greatest (S47). The ridge of the "
        "likelihood is that of the normal distribution that the tracker reports, again at 90 % of "
        f"the peak: {AT_SHARE:.2f} standard deviations of z with the turn known.",
    )


def _missing(failed: int) -> tuple[str, ...]:
    return (f"{failed} trials of this part failed and are left out.",) if failed else ()


def _position(kinds: Sequence[Kind]) -> Finding:
    """Compare where the peaks are."""
    off = {
        fitness: [
            float(np.abs(one.map_peak).max())
            for kind in kinds
            for one in kind.of(fitness)
            if one.map_peak
        ]
        for fitness in (Fitness.POINTS, Fitness.FULL)
    }
    before = "The fitness is highest at the true position of the object."
    if not all(off.values()):
        return Finding(before, "No map was made.", Verdict.DIFFERS, "Its trials failed.")
    points, full = (max(values) for values in off.values())
    count = len(off[Fitness.POINTS])
    agrees = points < 1e-6
    return Finding(
        before=before,
        ours=f"In {count} map{'' if count == 1 else 's'} the highest place lies at most "
        f"{_MM * points:.0f} mm off the true one along an axis with the paper's points, "
        f"and at most {_MM * full:.0f} mm with region and surface.",
        verdict=Verdict.AGREES if agrees else Verdict.PARTLY,
        why="The true pose is one of the places, and what is drawn is what the model expects."
        if agrees
        else "The points look alike at neighbouring places.",
    )


def _ridge(kinds: Sequence[Kind]) -> Finding:
    """Compare how wide the points' ridge is along z and across."""
    kind = kinds[0]
    across, along = kind.straight(Fitness.POINTS, 0), kind.straight(Fitness.POINTS, 2)
    ridge = kind.width(Fitness.POINTS)
    if across is None or along is None or ridge is None:
        return Finding("The ridge along z is wide.", "It was not measured.", Verdict.DIFFERS, "")
    ratio = along.mean / across.mean
    return Finding(
        before="Along z the top of the fitness is wider than along x and y.",
        ours=f"With the paper's points and the {kind.title}, the fitness stays above 90 % of its "
        f"peak for {across.mm()} mm along x, {along.mm()} mm along z, and "
        f"{ridge.mm()} mm along the ridge itself.",
        verdict=Verdict.AGREES if ratio > 2.0 else Verdict.PARTLY,
        why=f"A millimetre along z moves the outlines {ratio:.1f} times less than one along x. How "
        "wide the paper's own ridge is in millimetres it does not say, nor α, on which it hangs.",
    )


def _sharpest(kinds: Sequence[Kind]) -> Finding:
    """Say what servoid's terms do to the ridge."""
    said, sums = [], []
    for kind in kinds:
        points, full, sigma = (
            kind.width(Fitness.POINTS),
            kind.width(Fitness.FULL),
            kind.sigma(Fitness.FULL),
        )
        surface = kind.width(Fitness.SURFACE)
        if points is None or full is None or surface is None or sigma is None:
            continue
        likely = AT_SHARE * sigma.mean
        sums.append(full.mean / points.mean)
        said.append(
            f"{kind.title}: points {_MM * points.mean:.1f} mm, surface term "
            f"{_MM * surface.mean:.1f} mm, sum of region and surface {_MM * full.mean:.1f} mm "
            f"({full.mean / points.mean:.2f} of the points'), likelihood of the answer "
            f"{_MM * likely:.2f} mm ({likely / points.mean:.3f} of the points'){_truly(kind)}."
        )
    return Finding(
        before="Recognition in z must become better (the paper's future work).",
        ours=" ".join(said),
        verdict=Verdict.BEYOND if sums and max(sums) <= _QUARTER else Verdict.PARTLY,
        why="Three of the widths are one measure, the score at 90 % of its peak; by it the sum has "
        f"{min(sums, default=1.0):.2f} to {max(sums, default=1.0):.2f} of the points' width, and "
        f"{_QUARTER:g} was aimed at. The likelihood is another measure: how sure servoid is, which "
        "after so few images is never more than it supposes beforehand. Pattern on the surface "
        "moves against pattern in the other eye by a fraction of a "
        "pixel for each millimetre, which a patch of some pixels feels and an outline hardly. "
        "The region term alone is no sharper than the points: areas change evenly with the place. "
        "On an object of one hue there is little for the surface term to see; there the likelihood "
        "is that of the outline, read to a fraction of a pixel.",
    )


def _truly(kind: Kind) -> str:
    """Say how far peaks and answers are off, which tells if the likelihood is too narrow."""
    peak, off = kind.peak_error(Fitness.POINTS, 2), kind.answer_error(Fitness.FULL, 2)
    sigma = kind.sigma(Fitness.FULL)
    if peak is None or off is None or sigma is None:
        return ""
    return (
        f"; in z the points' peak is off by {_MM * peak.mean:.2f} mm and servoid's answer by "
        f"{_MM * off.mean:.2f} mm, with a standard deviation of {_MM * sigma.mean:.2f} mm of its "
        "own"
    )


def _pictures(pairs: Sequence[tuple[MapCase, MapRow]], folder: Path) -> tuple[Picture, ...]:
    whole = [(case, row) for case, row in pairs if case.whole]
    pictures = []
    for case, row in whole:
        file = folder / f"fitness_map_{case.object_name}_{case.eyes.value}.png"
        draw_map(case, row, file)
        name = case.object_name.replace("_", " ")
        pictures.append(
            Picture(
                file,
                f"Fitness maps as in Fig. 8: {name}, {case.eyes.value} eyes. Each shade is the "
                "best fitness over the third axis, dark at the peak; the orange line is at 90 % of "
                "the peak, the ring around the true place.",
            )
        )
    if whole:
        file = folder / "fitness_ridges.png"
        first = [(case, row) for case, row in whole if case.eyes is whole[0][0].eyes]
        titled = [
            (f"{case.object_name.replace('_', ' ')}, {case.eyes.value} eyes", case, row)
            for case, row in first
        ]
        draw_ridges(titled, file)
        caption = "Ridges along z: the best fitness at each depth. The narrower, the surer is z."
        pictures.append(Picture(file, caption))
    return tuple(pictures)
