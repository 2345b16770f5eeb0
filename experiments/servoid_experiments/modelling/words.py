"""Sentences about how modelling went; each number in them is computed from the trials."""

from functools import partial
from operator import le

from servoid_experiments.modelling.figures import (
    Trials,
    filling,
    mean_of_objects,
    outline,
    seconds,
    volume,
)
from servoid_experiments.modelling.plan import ELLIPSOIDS, VIEWS, Plan
from servoid_experiments.sweeping import Factor, Value, beside, written

_LOSS = 0.02  # of an IoU below the centre's: still close to it


def center_words(plan: Plan, sweep: Trials) -> list[str]:
    """Say how good bodies are in the centre, object by object."""
    case, parts = plan.series[0].centers[0], []
    for one in plan.series:
        held, seen = sweep.at_center(one, volume), sweep.at_center(one, outline)
        if held is not None and seen is not None:
            parts.append(f"{one.name} {held.middle:.2f} and {seen.middle:.2f}")
    return [
        f"In the centre, {case.views} masks and {case.ellipsoids} ellipsoids, the IoU of the "
        f"volume and that of outlines that were not used are: {', '.join(parts)}."
    ]


def matter_words(plan: Plan, sweep: Trials) -> list[str]:
    """Say how far each factor changes the volume, the one that matters most first."""
    changes: list[tuple[float, str]] = []
    for factor in plan.factors:
        pairs = _volumes(plan, sweep, factor)
        if len(pairs) < 2:
            continue
        worst, best = min(pairs, key=_iou), max(pairs, key=_iou)
        said = (
            f"{factor.title} ({best[1]:.2f} at {_shown(factor, best[0])}, {worst[1]:.2f} at "
            f"{_shown(factor, worst[0])})"
        )
        changes.append((best[1] - worst[1], said))
    if not changes:
        return []
    changes.sort(key=lambda one: -one[0])
    return [
        "How far each factor changes the IoU of the volume, on average over the objects, the one "
        f"that matters most first: {'; '.join(said for _, said in changes)}."
    ]


def enough_words(plan: Plan, sweep: Trials) -> list[str]:
    """Say with how few views and ellipsoids, and with how much noise, bodies stay close."""
    said = []
    for factor in plan.factors:
        pairs = _volumes(plan, sweep, factor)
        center = dict(pairs).get(plan.series[0].center(factor))
        if center is None:
            continue
        close = beside(pairs, plan.series[0].center(factor), partial(le, center - _LOSS))
        few = factor.key in (VIEWS, ELLIPSOIDS)
        said.append(
            _named(factor, close[0]) if few else f"{factor.title} up to {_shown(factor, close[-1])}"
        )
    if not said:
        return []
    return [
        f"What leaves the IoU of the volume within {_LOSS:g} of the centre's, each by itself: "
        f"{', '.join(said)}."
    ]


def filling_words(plan: Plan, sweep: Trials) -> list[str]:
    """Say where bodies hold much less or much more than the objects do."""
    found: list[tuple[float, str]] = []
    for one in plan.series:
        for factor in plan.factors:
            for value in one.values(factor):
                spread = sweep.spread(one, (factor, value), filling)
                if spread is not None:
                    found.append((spread.middle, f"{one.name} with {_named(factor, value)}"))
    if not found:
        return []
    least, most = min(found), max(found)
    return [
        f"Of all bodies one holds least of its object's volume, {_times(least[0])}, {least[1]}, "
        f"and one most, {_times(most[0])}, {most[1]}."
    ]


def time_words(plan: Plan, sweep: Trials) -> list[str]:
    """Say what views and ellipsoids cost."""
    said = []
    for factor in plan.factors:
        values = plan.series[0].values(factor)
        if factor.key not in (VIEWS, ELLIPSOIDS) or len(values) < 2:
            continue
        ends = [
            (value, mean_of_objects(plan, sweep, (factor, value), seconds))
            for value in (values[0], values[-1])
        ]
        said += [
            f"{taken:.2g} s with {_named(factor, value)}"
            for value, taken in ends
            if taken is not None
        ]
    if not said:
        return []
    return [
        "One processor of the machine on which the study ran takes, on average over the objects, "
        f"{', '.join(said)}."
    ]


def _volumes(plan: Plan, sweep: Trials, factor: Factor) -> list[tuple[Value, float]]:
    """Return the IoU of the volume, on average over the objects, at each value."""
    found = []
    for value in plan.series[0].values(factor):
        iou = mean_of_objects(plan, sweep, (factor, value), volume)
        if iou is not None:
            found.append((value, iou))
    return found


def _iou(pair: tuple[Value, float]) -> float:
    return pair[1]


def _times(share: float) -> str:
    return f"{share:.2f} times" if share < 10.0 else f"{share:.0f} times"


def _named(factor: Factor, value: Value) -> str:
    """Name a value: 1 view, 3 views, cameras off by 5 mm."""
    if factor.key not in (VIEWS, ELLIPSOIDS):
        return f"{factor.title} {_shown(factor, value)}"
    return f"{written(value)} {factor.title.removesuffix('s') if value == 1 else factor.title}"


def _shown(factor: Factor, value: Value) -> str:
    if factor.unit == "share":
        assert isinstance(value, float | int)
        return f"{100.0 * value:g} %"
    return f"{written(value)} {factor.unit}".rstrip()
