"""The sensitivity to the constants that the paper does not state: each is changed alone."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import msgspec

from servoid.batch import Experiment, Results, Work
from servoid.view.axes import DISTINCT, new_figure, png
from servoid.view.page import INK, QUIET_INK
from servoid_experiments.design import Picture, Positive, Section, Table, Verdict, about, rows_of
from servoid_experiments.drawing import dress_across, legend_below
from servoid_experiments.paper import AS_ASSUMED
from servoid_experiments.paper.servoing.settings import (
    Constants,
    Settle,
    constants,
    with_constant,
)
from servoid_experiments.paper.servoing.trial import ServoingCase, ServoingRow, run_servoing
from servoid_experiments.stats import Spread, over

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_FIXED = ("Eq", "Sec", "Title")  # constants that the paper states are not changed
_MOST = 12  # constants drawn for a figure

# Runs with a number of their own: those of the base are not shared with another study's batch.
SENSITIVITY = Experiment("sensitivity", run_servoing, ServoingCase, ServoingRow)


LAG = "phase lag of the hand [deg]"
SPREAD = "spread of the recognised z [mm]"
MEASURES: dict[str, Callable[[ServoingRow], float]] = {
    LAG: lambda row: row.followed.hand_lag_deg,
    SPREAD: lambda row: 1e3 * row.followed.seen_spread[2],
}


class Shape(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An ellipsoid that the paper may mean."""

    name: str
    radii: tuple[Positive, Positive, Positive]


class SensitivitySettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Runs of the paper's method at T = 10 s; numbers are halved and doubled unless listed here."""

    omega: Annotated[float, about("of the object's motion, rad/s (Sec. 5.3)", gt=0)] = 0.628
    seeds: Annotated[int, about("runs of each change", ge=1)] = 1
    base_seeds: Annotated[int, about("runs with all constants as assumed", ge=2)] = 5
    settle_s: Settle = 2.0
    left_out: Annotated[tuple[str, ...], about("constants that are not changed")] = (
        "scene.rest_s",
        "law.turn_rate_gain",
    )
    shapes: Annotated[tuple[Shape, ...], about("other ellipsoids of 90 and 45 mm, radii in m")] = (
        Shape(name="long along x", radii=(0.045, 0.0225, 0.0225)),
        Shape(name="long along z", radii=(0.0225, 0.0225, 0.045)),
        Shape(name="twice as big", radii=(0.045, 0.09, 0.045)),
    )
    backgrounds: Annotated[tuple[str, ...], about("other backgrounds")] = ("cluttered",)
    links: Annotated[tuple[str, ...], about("other link lengths")] = ("jsi",)
    sizes_px: Annotated[tuple[tuple[int, int], ...], about("other sizes of an image")] = (
        (160, 120),
        (640, 480),
    )


def quick_sensitivity() -> SensitivitySettings:
    """Return settings of a study that takes seconds and shows only that everything works."""
    chosen = ("search.population", "law.position_gain")
    return SensitivitySettings(
        omega=4.0,
        base_seeds=2,
        settle_s=0.5,
        left_out=tuple(name for name, *_ in constants(Constants()) if name not in chosen),
    )


@dataclass(frozen=True)
class Change:
    """One constant with another value, and all constants with it."""

    constant: str
    written: str
    constants: Constants

    @property
    def name(self) -> str:
        """Return the name of the runs with this change."""
        return f"{self.constant} = {self.written}"


def changes(settings: SensitivitySettings, given: Constants) -> list[Change]:
    """List the changes of all constants that the paper does not state."""
    found, shapes = [], {one.radii: one.name for one in settings.shapes}
    for name, _, _, source in constants(given):
        if source.startswith(_FIXED) or name in settings.left_out:
            continue
        table, key = name.split(".")
        for value in _others(settings, name, getattr(getattr(given, table), key)):
            try:
                changed = with_constant(given, name, value)
            except msgspec.ValidationError:
                continue  # twice a share may exceed its maximum
            found.append(Change(name, shapes.get(value, _written(value)), changed))
    return found


def _others(settings: SensitivitySettings, name: str, value: Any) -> tuple[Any, ...]:
    """Return other values of a constant."""
    listed: dict[str, tuple[Any, ...]] = {
        "scene.radii": tuple(one.radii for one in settings.shapes),
        "scene.background": settings.backgrounds,
        "arm.links": settings.links,
        "eyes.size_px": settings.sizes_px,
    }
    if name in listed:
        return listed[name]
    if isinstance(value, int):
        return (max(1, value // 2), 2 * value)
    return (0.5 * value, 2.0 * value)


def _written(value: Any) -> str:
    if isinstance(value, tuple):
        return " x ".join(_written(part) for part in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def sensitivity_work(settings: SensitivitySettings, given: Constants) -> list[Work]:
    """Return the runs, those with the constants as assumed first."""
    runs = [(AS_ASSUMED, given, settings.base_seeds)]
    runs += [(one.name, one.constants, settings.seeds) for one in changes(settings, given)]
    cases = [
        ServoingCase(
            name=name,
            seed=seed,
            omega=settings.omega,
            settle_s=settings.settle_s,
            periods=1,
            constants=changed,
        )
        for name, changed, seeds in runs
        for seed in range(seeds)
    ]
    return [Work(SENSITIVITY, cases)]


@dataclass(frozen=True)
class Effect:
    """The effect of a constant's other values: a name for each, and the figure with it.

    `greatest` is the largest change of the figure, and `clear` is whether it exceeds the
    differences between runs with other seeds.
    """

    constant: str
    was: str
    values: tuple[tuple[str, float], ...]
    greatest: float
    clear: bool

    @property
    def title(self) -> str:
        """Return the constant with its values."""
        others = " | ".join(name for name, _ in self.values)
        return f"{self.constant.replace('_', ' ')}: {self.was}\n({others})"


def sensitivity_sections(
    settings: SensitivitySettings, given: Constants, results: Results
) -> list[Section]:
    """Draw and list the effect of each changed constant on the hand's lag and the recognised z."""
    base = rows_of(results, SENSITIVITY, name=AS_ASSUMED)
    if len(base) < 2:
        return []
    rows = [
        (one, found)
        for one in changes(settings, given)
        if (found := rows_of(results, SENSITIVITY, name=one.name))
    ]
    middles = {name: over(map(take, base)) for name, take in MEASURES.items()}
    now = {name: value for name, value, _, _ in constants(given)}
    effects = {
        name: _effects(
            now, middles[name], [(one, over(map(take, found)).mean) for one, found in rows]
        )
        for name, take in MEASURES.items()
    }
    table = Table(
        "sensitivity_effects",
        ("figure", "constant", "assumed", "greatest_effect", "beyond_seeds"),
        [
            (name, one.constant, one.was, one.greatest, "yes" if one.clear else "no")
            for name, found in effects.items()
            for one in found
        ],
        "Greatest effect of each constant, and whether it is more than 95 % of single runs differ "
        "by their seed: of twenty constants that do nothing, one counts all the same.",
    )
    findings = {"Gains, search and cameras are not given.": Verdict.PARTLY}
    heading = "Which of the constants that the paper leaves out matter"
    tables = (table, _holds_table([row for _, found in rows for row in found]))
    return [Section(heading, findings, (_draw_tornado(effects, middles),), tables)]


def _effects(
    now: Mapping[str, str], base: Spread, found: Sequence[tuple[Change, float]]
) -> list[Effect]:
    """Return the effect of each constant's change on a figure, the largest first."""
    values: dict[str, list[tuple[str, float]]] = {}
    for one, value in found:
        values.setdefault(one.constant, []).append((one.written, value))
    effects = []
    for constant, pairs in values.items():
        effect = max((value - base.mean for _, value in pairs), key=abs)
        clear = abs(effect) > base.reach
        effects.append(Effect(constant, now[constant], tuple(pairs), effect, clear))
    return sorted(effects, key=lambda one: -abs(one.greatest))


def _holds_table(rows: Sequence[ServoingRow]) -> Table:
    """Count the runs with another value in which the paper's findings still hold."""
    late = sum(row.followed.hand_lag_deg > 0.0 for row in rows)
    unsteady = sum(row.followed.seen_spread[2] > row.followed.seen_spread[0] for row in rows)
    return Table(
        "sensitivity_holds",
        ("runs", "hand_lags", "z_less_steady_than_x"),
        [(len(rows), late, unsteady)],
        "Runs with another value, and those in which the hand lags, and z is less steady than x.",
    )


def _draw_tornado(
    effects: Mapping[str, Sequence[Effect]], middles: Mapping[str, Spread]
) -> Picture:
    """Draw a panel for each figure, the first effects at the top; all of them are in its numbers.

    `middles` are the figures with the assumed constants.
    """
    from matplotlib.patches import Patch

    shown = {name: all_of[:_MOST] for name, all_of in effects.items()}
    heights = [len(few) for few in shown.values()]
    figure = new_figure(9.6, 0.36 * sum(heights) + 0.9 * len(heights))
    panels = figure.subplots(len(shown), 1, height_ratios=heights, squeeze=False)[:, 0]
    for axes, (name, few) in zip(panels, shown.items(), strict=True):
        _draw_effects(axes, few, middles[name].mean, middles[name].reach)
        axes.set_title(name, loc="left", color=INK, fontsize=11)
    handles = [Patch(color=color) for color in DISTINCT[:3]]
    legend_below(figure, handles, ("first value in brackets", "second", "third"), columns=3)
    rows = [
        (name, one.title, value, figure_value, middles[name].mean, middles[name].reach)
        for name, all_of in effects.items()
        for one in all_of
        for value, figure_value in one.values
    ]
    head = ("figure", "constant", "value", "with it", "as assumed", "by chance")
    caption = (
        "What the paper's method does at the fast motion when one constant is changed, the "
        "greatest effects above. The grey band holds 95 % of single runs that differ by their seed "
        "alone."
    )
    return Picture("sensitivity", caption, png(figure), Table("sensitivity", head, rows))


def _draw_effects(axes: "Axes", few: Sequence[Effect], middle: float, band: float) -> None:
    """Draw a row of bars from the centre for each constant."""
    axes.axvspan(middle - band, middle + band, color="#e4e0d8", linewidth=0)
    for row, one in enumerate(few):
        # If both bars point to one side, both must be visible.
        height = 0.8 / len(one.values)
        for place, (_, value) in enumerate(one.values):
            axes.barh(
                row - 0.4 + (place + 0.5) * height,
                value - middle,
                height,
                left=middle,
                color=DISTINCT[place % len(DISTINCT)],
            )
    axes.axvline(middle, color=QUIET_INK, linewidth=0.9)
    axes.set_yticks(range(len(few)), [one.title for one in few])
    axes.invert_yaxis()
    dress_across(axes)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", labelsize=8)
