"""Sentences about how tracking went; each number in them is computed from the trials."""

from collections.abc import Sequence

from servoid_experiments.sweeping import (
    Curve,
    Factor,
    Panel,
    Value,
    at,
    highest,
    known,
    lowest,
    written,
)
from servoid_experiments.tracking.figures import Trials, position, turn
from servoid_experiments.tracking.metrics import of_tracked, success, wrongly_sure
from servoid_experiments.tracking.plan import BASELINE, HIDDEN, WAY, Plan

HOLDS = 0.9  # success from which on a tracker counts as holding
_LOSS = 0.05  # of the images; less is no matter
_GROWTH = 1.25  # of an error; less is no matter


def center_words(plan: Plan, sweep: Trials, near: float) -> list[str]:
    """Say how both trackers do in the centre."""
    said = []
    for series in (plan.ours, plan.paper):
        share = sweep.at_center(series, lambda row: success(row, near))
        place = sweep.at_center(series, of_tracked(position, 50.0))
        angle = sweep.at_center(series, of_tracked(turn, 50.0))
        if share is None:
            continue
        how = f"In the centre {series.name} is right in {_percent(share.middle)} of the images"
        if place is not None:
            how += f", with a median error of {place.middle:.1f} mm"
        if series is plan.ours and angle is not None:
            how += f" and {angle.middle:.1f} degrees"
        said.append(f"{how}.")
    return said


def cost_words(plan: Plan, panels: Sequence[Panel], sweep: Trials, near: float) -> list[str]:
    """Say which factors cost servoid images, the dearest first, and where it is wrongly sure."""
    losses: list[tuple[float, Factor, Value, float]] = []
    for panel in panels:
        curve, center = panel.curves[0], at(panel.curves[0], plan.ours.center(panel.factor))
        worst = lowest(curve)
        if worst is not None and center is not None:
            losses.append((center - worst[1], panel.factor, *worst))
    losses.sort(key=lambda one: -one[0])
    dear = [one for one in losses if one[0] >= _LOSS]
    cheap = [one[1].title for one in losses if one[0] < _LOSS]
    said = []
    if dear:
        parts = [f"{_at(factor, value)} {_percent(share)}" for _, factor, value, share in dear]
        said.append(
            f"What costs {plan.ours.name} images, the dearest first, with the share that is left "
            f"at the worst value: {'; '.join(parts)}."
        )
    if cheap:
        said.append(
            f"What costs it less than {_percent(_LOSS)} of the images wherever it was tried: "
            f"{', '.join(cheap)}."
        )
    return said + _single_words(plan, panels, cheap) + _sure_words(plan, sweep, near)


def search_words(plan: Plan, panels: Sequence[Panel]) -> list[str]:
    """Say what more generations are worth where the object moves far between images."""
    curves = _pair(panels, WAY)
    if curves is None or plan.thorough is None:
        return []
    once, often = curves
    gains = [
        (at(often, value) or 0.0, value, share)
        for value, share in known(once)
        if at(often, value) is not None
    ]
    if not gains:
        return []
    better, value, share = max(gains, key=lambda one: one[0] - one[2])
    count = plan.thorough.centers[0].generations
    if better - share < _LOSS / 2.0:
        return [f"{count} generations an image do not track faster motion than the centre's."]
    return [
        f"{count} generations an image gain most at {written(value)} mm from image to image: "
        f"{_percent(better)} of the images rather than {_percent(share)}."
    ]


def found_again_words(plan: Plan, panels: Sequence[Panel]) -> list[str]:
    """Say how often a hidden object is tracked, and found again."""
    panel = next((one for one in panels if one.factor.key == HIDDEN), None)
    if panel is None:
        return []
    said = []
    for series in (plan.ours, plan.paper):
        curves = [curve for curve in panel.curves if curve.name == series.name]
        behind, after = curves[0], lowest(curves[1])
        shares = [
            f"{_percent(share)} with {_percent(value)} hidden"
            for value, share in known(behind)
            if isinstance(value, float | int) and value > 0.0
        ]
        if shares and after is not None:
            said.append(
                f"While part of the object is hidden, {series.name} is right in "
                f"{', '.join(shares)}; afterwards in at least {_percent(after[1])}."
            )
    return said


def error_words(plan: Plan, panels: Sequence[Panel]) -> list[str]:
    """Say which factors raise servoid's error, the greatest first."""
    growths: list[tuple[float, Panel, Value, float]] = []
    for panel in panels:
        worst = highest(panel.curves[0])
        center = at(panel.curves[0], plan.ours.center(panel.factor))
        if worst is not None and center:
            growths.append((worst[1] / center, panel, *worst))
    growths.sort(key=lambda one: -one[0])
    parts = [
        f"{_at(panel.factor, value)} {error:.1f} mm"
        for ratio, panel, value, error in growths
        if ratio >= _GROWTH
    ]
    if not parts:
        return [
            f"No factor raises the median error of {plan.ours.name} by more than "
            f"{_percent(_GROWTH - 1.0)}."
        ]
    return [
        f"What raises the median error of {plan.ours.name}, the greatest first, with the error at "
        f"the worst value: {'; '.join(parts)}."
    ]


def eyes_words(plan: Plan, panels: Sequence[Panel]) -> list[str]:
    """Say what the baseline and the eyes' direction do to servoid's error."""
    curves = _pair(panels, BASELINE)
    if curves is None:
        return []
    one, other = curves
    ends = known(one)
    if len(ends) < 2:
        return []
    (near, wide) = ends[0], ends[-1]
    eyes = [series.centers[0].scene.eyes.value for series in (plan.ours, plan.other_eyes[0])]
    said = [
        f"With {eyes[0]} eyes the median error is {near[1]:.1f} mm at a baseline of "
        f"{written(near[0])} mm and {wide[1]:.1f} mm at {written(wide[0])} mm."
    ]
    ratios = [share / error for value, error in ends if (share := at(other, value)) and error]
    if ratios:
        said.append(
            f"With {eyes[1]} eyes it is {min(ratios):.2f} to {max(ratios):.2f} times that of "
            f"{eyes[0]} ones at the same baseline."
        )
    return said


def _single_words(plan: Plan, panels: Sequence[Panel], cheap: Sequence[str]) -> list[str]:
    """Say which of the factors that cost little by the median cost single scenes much."""
    parts = []
    for panel in panels:
        curve = panel.curves[0]
        pairs = [
            (spread.low, value)
            for value, spread in zip(curve.values, curve.spreads, strict=True)
            if spread is not None
        ]
        least, value = min(pairs, key=lambda pair: pair[0], default=(1.0, ""))
        if panel.factor.title in cheap and least < HOLDS:
            parts.append(f"{_at(panel.factor, value)} {_percent(least)}")
    if not parts:
        return []
    return [
        f"Of these some cost {plan.ours.name} more in single scenes; the share that is left in the "
        f"worst scene at the worst value: {'; '.join(parts)}."
    ]


def _sure_words(plan: Plan, sweep: Trials, near: float) -> list[str]:
    worst: tuple[float, Factor, Value] | None = None
    for factor in plan.factors:
        for value in plan.ours.values(factor):
            at_value = (factor, value)
            spread = sweep.spread(plan.ours, at_value, lambda row: wrongly_sure(row, near))
            if spread is not None and (worst is None or spread.middle > worst[0]):
                worst = (spread.middle, factor, value)
    if worst is None or worst[0] == 0.0:
        return [f"{plan.ours.name} is nowhere wrongly sure, by the median over the seeds."]
    share, factor, value = worst
    return [
        f"Where {plan.ours.name} is most often wrongly sure, it says that it tracks and does "
        f"not in {_percent(share)} of the images: {_at(factor, value).removesuffix(':')}."
    ]


def _pair(panels: Sequence[Panel], key: str) -> tuple[Curve, Curve] | None:
    """Return servoid's solid and dashed curve of a factor, if it was varied."""
    for panel in panels:
        if panel.factor.key == key:
            own = [curve for curve in panel.curves if curve.name == panel.curves[0].name]
            return (own[0], own[1]) if len(own) > 1 else None
    return None


def _at(factor: Factor, value: Value) -> str:
    unit = f" {factor.unit}" if factor.unit and factor.unit != "share" else ""
    return f"{factor.title} ({written(value).replace(chr(10), ' ')}{unit}):"


def _percent(share: float | Value) -> str:
    assert isinstance(share, float | int)
    return f"{100.0 * share:.0f} %"
