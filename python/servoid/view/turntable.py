"""Builds the scene of a page's interactive view: ellipsoids about the origin, and cameras."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.view.body_picture import RISE_DEG, TURN_DEG
from servoid.view.solid_picture import Solids

_DIGITS = 7  # the page draws in single precision

Vector = NDArray[np.float64]
Color = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Frustum:
    """A camera's centre and the corners of its image (5, 3), in metres, drawn in a colour."""

    points: NDArray[np.float64]
    color: Color


def turntable_scene(
    solids: Solids,
    axes: tuple[Vector, Vector, Vector],
    frusta: Sequence[Frustum] = (),
    reach: float = 1.0,
) -> dict[str, Any]:
    """Return the scene, ready for JSON: the body about the origin, its radius about 1.

    `axes` are unit vectors to the side, to the front and up, in the coordinates of the solids;
    `reach` is the distance in metres of the farthest camera from the middle of the body.
    """
    side, front, up = axes
    middle, radius = around(solids, np.stack(axes))
    ellipsoids = [
        {
            "center": _round((center - middle) / radius),
            "to_ball": _round(np.linalg.inv(np.linalg.cholesky(shape)) * radius),
            "color": color.tolist(),
        }
        for center, shape, color in zip(solids.centers, solids.shapes, solids.colors, strict=True)
    ]
    cameras = [
        {"points": _round((one.points - middle) / radius), "color": one.color} for one in frusta
    ]
    return {
        "ellipsoids": ellipsoids,
        "cameras": cameras,
        "reach": float(f"{max(1.0, reach / radius):.6g}"),
        "side": _round(side),
        "front": _round(front),
        "up": _round(up),
        "turn": float(np.radians(TURN_DEG)),
        "rise": float(np.radians(RISE_DEG)),
    }


def around(solids: Solids, axes: NDArray[np.float64]) -> tuple[Vector, float]:
    """Return the middle of the box around the ellipsoids, and half its longest side."""
    spans = np.array([solids.extent(axis) for axis in axes])
    middle = axes.T @ spans.mean(axis=1)
    return middle, float((spans[:, 1] - spans[:, 0]).max() / 2.0)


def _round(values: NDArray[np.float64]) -> Any:
    return (
        np.array([float(f"{value:.{_DIGITS}g}") for value in values.ravel()])
        .reshape(values.shape)
        .tolist()
    )
