"""Draws the object of two ellipsoids and its models: Fig. 9, and the errors over seeds."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from servoid._native import Body, Pose
from servoid.pose.exact import Floats
from servoid.view.axes import DISTINCT, new_figure, png
from servoid.view.model.contact_sheet import outline_points
from servoid_experiments.design import Picture, Table
from servoid_experiments.drawing import dress_across
from servoid_experiments.metrics import shape_matrices
from servoid_experiments.paper.eye_pair import EyePair, paper_hand, true_body
from servoid_experiments.paper.two.modelling import (
    OBJECT_NAME,
    Procedure,
    TwoCase,
    TwoRow,
    first_pair,
)
from servoid_experiments.stats import over

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAMES = {
    Procedure.PAPER: "the paper's",
    Procedure.PAIR: "servoid, the pair",
    Procedure.STEREO: "servoid, pair with\nits own depth",
    Procedure.DEPTH: "servoid, pair with\na depth camera",
    Procedure.LOOKS: "servoid, four pairs",
}
_MM = 1000.0
_TRUE = "#111111"
_MODEL = DISTINCT[0]
_AROUND_PX = 30
_SIDES = ((0, 2, "x", "z"), (2, 1, "z", "y"))
_SIDE_ORDER = "seen from above", "seen from the side"


def draw_models(shown: Sequence[tuple[TwoCase, TwoRow]]) -> Picture:
    """Draw models of one pair side by side: in the left image, from above, and from the side."""
    figure = new_figure(2.45 * len(shown), 7.6)
    panels = figure.subplots(3, len(shown), squeeze=False)
    pair = first_pair(shown[0][0])
    true = true_body(OBJECT_NAME, paper_hand().inverse() @ pair.world_from_object)
    for column, (case, row) in enumerate(shown):
        body = Body(
            world_from_object=Pose.identity(),
            centers=np.array(row.centers),
            radii=np.array(row.radii),
            rotations=np.array(row.rotations),
        )
        _image(panels[0][column], pair, body)
        panels[0][column].set_title(NAMES[case.procedure], fontsize=10.5)
        for line, side in enumerate(_SIDES, start=1):
            _side(panels[line][column], true, body, side)
            if column == 0:
                words = _SIDE_ORDER[line - 1]
                panels[line][column].set_ylabel(f"{words}\n{side[3]} in mm", fontsize=10)
    panels[0][0].set_ylabel("left image", fontsize=10)
    caption = (
        f"Models of the same pair (seed {shown[0][0].seed}) as in Fig. 9: black the true object, "
        "blue the model's ellipsoids. Above in the left image, below seen from above (x-z) and "
        "from the side (z-y), z away from the hand."
    )
    return Picture("two_ellipsoids", caption, png(figure))


def draw_errors(rows: Mapping[Procedure, Sequence[TwoRow]]) -> Picture:
    """Draw the errors of all seeds, with their means and 95 % intervals."""
    figure = new_figure(11.0, 4.6)
    panels = figure.subplots(1, 4, sharey=True)
    kinds = [kind for kind in Procedure if rows.get(kind)]
    for axis, panel in enumerate(panels[:3]):
        values = {kind: [_MM * row.error[axis] for row in rows[kind]] for kind in kinds}
        _dots(panel, values, f"centroid's error in {'xyz'[axis]}, mm")
        panel.axvline(0.0, color="#888888", linewidth=1.0)
    _dots(
        panels[3],
        {kind: [row.volume_iou for row in rows[kind]] for kind in kinds},
        "volume in common, IoU",
    )
    panels[3].set_xlim(0.0, 1.02)
    panels[0].set_yticks(range(len(kinds)), [NAMES[kind] for kind in kinds], fontsize=10)
    panels[0].set_ylim(len(kinds) - 0.5, -0.5)
    caption = "Errors of all trials: dots are trials, diamonds means, bars their 95 % intervals."
    numbers = _numbers(rows)
    return Picture(numbers.name, caption, png(figure), numbers)


def _image(panel: "Axes", pair: EyePair, body: Body) -> None:
    """Draw the image, the object's true outline, and those of a model's ellipsoids in the hand."""
    rows, columns = np.nonzero(pair.masks[0])
    panel.imshow(pair.images[0])
    eye = pair.cameras[0], paper_hand().inverse() @ pair.world_from_cameras[0]
    panel.contour(pair.masks[0] != 0, levels=[0.5], colors="white", linewidths=2.6)
    panel.contour(pair.masks[0] != 0, levels=[0.5], colors=_TRUE, linewidths=1.2)
    for outline in body.outlines(*eye):
        if outline is not None:
            edge = _ellipse(*outline)
            panel.plot(*edge, color="white", linewidth=2.6)
            panel.plot(*edge, color=_MODEL, linewidth=1.4)
    middle = np.array([columns.mean(), rows.mean()])
    half = 0.5 * max(np.ptp(columns), np.ptp(rows)) + _AROUND_PX
    panel.set_xlim(middle[0] - half, middle[0] + half)
    panel.set_ylim(middle[1] + half, middle[1] - half)
    panel.set_xticks([])
    panel.set_yticks([])


def _side(panel: "Axes", true: Body, body: Body, side: tuple[int, int, str, str]) -> None:
    """Draw the outlines of both bodies, in the hand, in orthographic view along an axis of it."""
    across, up, right, _ = side
    middle = _MM * shape_matrices(true)[0].mean(axis=0)
    for centers, spread, color, style in (
        (*shape_matrices(body), _MODEL, "-"),
        (*shape_matrices(true), _TRUE, "--"),
    ):
        for center, matrix in zip(centers, spread, strict=True):
            axes = [across, up]
            edge = _ellipse(_MM * center[axes], _MM**2 * matrix[np.ix_(axes, axes)])
            if style == "-":
                panel.fill(*edge, color=color, alpha=0.15, linewidth=0.0)
            panel.plot(*edge, color=color, linestyle=style, linewidth=1.4)
    panel.set_xlim(middle[across] - 115.0, middle[across] + 115.0)
    panel.set_ylim(middle[up] - 115.0, middle[up] + 115.0)
    panel.set_aspect("equal")
    if up == 1:
        panel.invert_yaxis()
    panel.set_xlabel(f"{right} in mm", fontsize=10)
    panel.tick_params(labelsize=8.5, length=3)


def _ellipse(center: Floats, spread: Floats) -> tuple[Floats, Floats]:
    """Return the edge of the ellipse with a centre (2,) and a shape matrix (2, 2)."""
    edge = outline_points(center, spread, 120)
    right, up = np.vstack([edge, edge[:1]]).T
    return right, up


def _dots(panel: "Axes", values: Mapping[Procedure, Sequence[float]], label: str) -> None:
    for place, (kind, numbers) in enumerate(values.items()):
        beside = place + np.linspace(-0.22, 0.22, len(numbers)) if len(numbers) > 1 else [place]
        color = DISTINCT[1] if kind is Procedure.PAPER else _MODEL
        panel.plot(numbers, beside, ".", color=color, alpha=0.45, markersize=5)
        found = over(numbers)
        half = found.half or 0.0
        panel.plot([found.mean - half, found.mean + half], [place] * 2, color=_TRUE, linewidth=2.2)
        panel.plot(found.mean, place, "D", color=_TRUE, markersize=5)
    panel.set_xlabel(label, fontsize=10.5)
    dress_across(panel)


def _numbers(rows: Mapping[Procedure, Sequence[TwoRow]]) -> Table:
    lines = [
        (
            kind.value,
            number,
            *(f"{_MM * x:.4f}" for x in row.error),
            *(f"{x:.5f}" for x in (row.volume_iou, row.silhouette_iou, row.volume_ratio)),
        )
        for kind, found in rows.items()
        for number, row in enumerate(found)
    ]
    head = ("procedure", "trial", "x_mm", "y_mm", "z_mm", "volume_iou", "silhouette_iou", "volume")
    return Table("two_ellipsoids_errors", head, lines)
