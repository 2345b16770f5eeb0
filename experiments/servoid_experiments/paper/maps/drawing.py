"""Draws fitness maps: the three planes of Fig. 8, and the ridges along z."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from servoid.view.axes import DISTINCT, dress, new_figure, png
from servoid_experiments.design import Picture, Table
from servoid_experiments.paper.maps.case import Fitness, FitnessRow, MapCase, MapRow
from servoid_experiments.paper.maps.places import Places

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage

NAMES = {
    Fitness.POINTS: "the paper's points",
    Fitness.REGION: "region",
    Fitness.SURFACE: "surface",
    Fitness.FULL: "region and surface",
    Fitness.COARSE: "both, coarse",
}
MAPPED = (Fitness.POINTS, Fitness.REGION, Fitness.SURFACE, Fitness.FULL)
_COLORS = dict(zip(MAPPED, DISTINCT, strict=False))
_STYLES = dict(zip(MAPPED, ("-", "--", "-.", (0, (1, 1))), strict=True))
_PLANES = (("xy", 0, 1), ("yz", 1, 2), ("xz", 0, 2))
_MM = 1000.0


def draw_map(case: MapCase, row: MapRow) -> Picture:
    """Draw the planes x-y, y-z and x-z of each fitness."""
    found = {one.fitness: one for one in row.fitnesses}
    figure = new_figure(11.0, 8.2)
    panels = figure.subplots(len(_PLANES), len(MAPPED), squeeze=False)
    shown = None
    for column, fitness in enumerate(MAPPED):
        for line, plane in enumerate(_PLANES):
            shown = _plane(panels[line][column], case, found[fitness], plane)
            if line == 0:
                panels[line][column].set_title(NAMES[fitness], fontsize=12)
    if shown is not None:
        bar = figure.colorbar(shown, ax=panels, shrink=0.6, pad=0.015)
        bar.set_label("fitness, share of its peak", fontsize=11)
    name = f"fitness_map_{case.object_name}_{case.eyes.value}"
    caption = (
        f"Fitness maps as in Fig. 8: {case.title}. Each shade is the best fitness over the third "
        "axis, dark at the peak; the orange line is at 90 % of the peak, the ring around the true "
        "place."
    )
    return Picture(name, caption, png(figure), _map_numbers(name, case, row))


def draw_ridges(rows: Sequence[tuple[MapCase, MapRow]]) -> Picture:
    """Draw the crests along z of all fitnesses, a panel for each row."""
    figure = new_figure(max(5.4 * len(rows), 9.0), 4.7)
    panels = figure.subplots(1, len(rows), squeeze=False, sharey=True)[0]
    for panel, (case, row) in zip(panels, rows, strict=True):
        depths = _MM * np.array(row.crest_depths)
        for one in row.fitnesses:
            if one.fitness in MAPPED and one.ridge.height > 0.0:
                panel.plot(
                    depths,
                    np.array(one.crest) / one.ridge.height,
                    color=_COLORS[one.fitness],
                    linestyle=_STYLES[one.fitness],
                    linewidth=2.0,
                    label=NAMES[one.fitness],
                )
        _likelihood(panel, row)
        panel.axhline(0.9, color="#888888", linewidth=1.0)
        panel.text(-49.0, 0.905, "90 % of the peak", fontsize=9, color="#555555", va="bottom")
        panel.set(xlim=(-50.0, 50.0), ylim=(0.0, 1.04))
        panel.set_title(case.title, fontsize=12)
        panel.set_xlabel("z, from the true place in mm", fontsize=11)
        dress(panel)
    panels[0].set_ylabel("best fitness at this depth,\nshare of its peak", fontsize=11)
    lines, names = panels[0].get_legend_handles_labels()
    figure.legend(lines, names, frameon=False, fontsize=10.5, ncols=5, loc="outside lower center")
    numbers = Table(
        "fitness_ridges",
        ("object", "eyes", "fitness", "z_from_truth_mm", "value"),
        [
            (case.object_name, case.eyes.value, one.fitness.value, f"{_MM * depth:.2f}", value)
            for case, row in rows
            for one in row.fitnesses
            for depth, value in zip(row.crest_depths, one.crest, strict=False)
        ],
    )
    caption = "Ridges along z: the best fitness at each depth. The narrower, the surer is z."
    return Picture(numbers.name, caption, png(figure), numbers)


def _likelihood(panel: "Axes", row: MapRow) -> None:
    """Draw the likelihood of each depth in servoid's estimate, by its own deviation."""
    sigmas = [one.sigma_z for one in row.answers if one.fitness is Fitness.FULL]
    if not sigmas or sigmas[0] is None:
        return
    sigma = _MM * sigmas[0]
    off = np.linspace(-4.0 * sigma, 4.0 * sigma, 81)
    panel.fill_between(
        off,
        np.exp(-0.5 * (off / sigma) ** 2),
        color="#777777",
        alpha=0.5,
        linewidth=0.8,
        label="likelihood of the answer",
    )


def _plane(
    panel: "Axes", case: MapCase, one: FitnessRow, plane: tuple[str, int, int]
) -> "AxesImage":
    """Draw one plane: shades from 0 to the peak, a line at 90 % of it, and the true position."""
    name, across, up = plane
    axes = Places(case.trial).axes
    right, above = _MM * axes[across], _MM * axes[up]
    values = np.array(getattr(one, name))
    share = values / max(float(values.max()), 1e-12)
    half = 0.5 * (right[1] - right[0])
    extent = (right[0] - half, right[-1] + half, above[0] - half, above[-1] + half)
    shown = panel.imshow(
        np.clip(share, 0.0, 1.0), origin="lower", extent=extent, cmap="YlGnBu", vmin=0.0, vmax=1.0
    )
    panel.contour(right, above, share, levels=[0.9], colors="#D55E00", linewidths=1.3)
    place = case.trial.place
    for color, width in (("white", 3.0), ("black", 1.2)):
        panel.plot(
            _MM * place[across], _MM * place[up], "o", mfc="none", mec=color, ms=15, mew=width
        )
    panel.set_xlabel(f"{name[0]} in mm", fontsize=10)
    panel.set_ylabel(f"{name[1]} in mm", fontsize=10)
    panel.tick_params(labelsize=9, length=3)
    if name == "xy":
        panel.invert_yaxis()
    return shown


def _map_numbers(name: str, case: MapCase, row: MapRow) -> Table:
    axes = Places(case.trial).axes
    rows = [
        (one.fitness.value, plane, f"{_MM * place:.1f}", f"{_MM * line:.1f}", value)
        for one in row.fitnesses
        for plane, across, up in _PLANES
        for line, values in zip(axes[up], getattr(one, plane), strict=False)
        for place, value in zip(axes[across], values, strict=False)
    ]
    return Table(name, ("fitness", "plane", "first_mm", "second_mm", "value"), rows)
