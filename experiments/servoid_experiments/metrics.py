"""Metrics that compare poses and bodies with the truth: IoU, distances of parts."""

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Pose
from servoid.pose.exact import Floats

_STEP = 0.0025
_MARGIN = 0.01


def held_by(body: Body, points: Floats) -> NDArray[np.bool_]:
    """Return which points (N, 3) in the world are inside an ellipsoid of a body, (N,)."""
    there = body.world_from_object.inverse().transform(np.ascontiguousarray(points))
    held = np.zeros(len(points), np.bool_)
    for center, radii, quaternion in zip(body.centers, body.radii, body.rotations, strict=True):
        turned = Pose.from_parts([0.0, 0.0, 0.0], quaternion.tolist()).inverse()
        own = turned.transform(np.ascontiguousarray(there - center)) / radii
        held |= (own * own).sum(axis=1) < 1.0
    return held


def shape_matrices(body: Body) -> tuple[Floats, Floats]:
    """Return centres (K, 3) and shape matrices (K, 3, 3) of a body's ellipsoids in the world."""
    turn = body.world_from_object.matrix()[:3, :3]
    turns = [Pose.from_parts([0.0, 0.0, 0.0], one.tolist()) for one in body.rotations]
    frames = [turn @ one.matrix()[:3, :3] for one in turns]
    spread = [
        frame @ np.diag(radii**2) @ frame.T for frame, radii in zip(frames, body.radii, strict=True)
    ]
    return body.world_from_object.transform(body.centers), np.array(spread)


def centroid(body: Body) -> Floats:
    """Return the centroid (3,) of a body's volume, in the world."""
    _, middle, _ = body.mass_properties()
    return body.world_from_object.transform(middle[None])[0]


def volume_iou(one: Body, other: Body) -> float:
    """Return the intersection over union of two bodies' volumes.

    It is computed on a grid of 2.5 mm.
    """
    points = _grid([one, other])
    a, b = held_by(one, points), held_by(other, points)
    return float((a & b).sum() / max(int((a | b).sum()), 1))


def nearest_parts(body: Body, true: Body) -> list[int]:
    """Return for each ellipsoid of the true body the index of the other body's nearest centre."""
    found, there = shape_matrices(body)[0], shape_matrices(true)[0]
    away = np.linalg.norm(there[:, None] - found[None], axis=2)
    return [int(index) for index in away.argmin(axis=1)]


def _grid(bodies: list[Body]) -> Floats:
    """Return points (N, 3) over a box that contains all bodies."""
    low, high = [], []
    for body in bodies:
        for center, spread in zip(*shape_matrices(body), strict=True):
            reach = np.sqrt(np.diag(spread))
            low.append(center - reach)
            high.append(center + reach)
    first, last = np.min(low, axis=0) - _MARGIN, np.max(high, axis=0) + _MARGIN
    sides = [np.arange(a, b, _STEP) for a, b in zip(first, last, strict=True)]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3)
