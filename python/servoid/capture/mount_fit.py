"""Finds how a camera is mounted on a rig that moves, from what the camera saw move.

If B is a motion of the rig, A the same motion as the camera sees it, and X the pose of the camera
on the rig, B X = X A (Tsai and Lenz, 1989). The rotation of X takes the rotation vectors of A to
those of B; its translation then follows from linear equations. What is found so is refined until
features are where the motions of the rig predict them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid._native import Pose
from servoid.camera import resect
from servoid.pose import Floats, exact, robust_fit

Motion = tuple[Pose, Pose]
"""A motion of the rig, rig_from_rig_later, and what the camera saw: camera_from_camera_later."""

_LEAST_MOTIONS = 3
_LEAST_SPREAD = 0.02  # rad: of rotation vectors, across the axis about which they turn most


@dataclass(frozen=True, eq=False)
class Predicted:
    """What a camera saw before a motion of its rig and after it.

    `rig_from_later` is the motion, `points` (N, 3) are places in the camera's first frame, and
    `rays` (N, 3) unit vectors to them from its later one.
    """

    rig_from_later: Pose
    points: Floats
    rays: Floats

    def off(self, rig_from_camera: Pose, scale: float) -> Floats:
        """Return how far features are off, as a vector each, (N, 3), in radians."""
        shift = scale * np.array(self.rig_from_later.translation)
        motion = Pose.from_parts(shift, self.rig_from_later.quaternion)
        moved = (rig_from_camera.inverse() @ motion.inverse() @ rig_from_camera).transform(
            self.points
        )
        return np.cross(moved, self.rays) / exact.lengths(moved)[:, None]


def seen_motion(points: Floats, rays: Floats, error: float) -> Pose | None:
    """Return how a camera moved, camera_from_camera_later, or None if no motion explains enough.

    `points` (N, 3) are places in its first frame, `rays` (N, 3) unit vectors to them from its later
    one; `error` is how far a ray may be off, in radians.
    """
    found = resect(points, rays, error)
    return None if found is None or 2 * len(found[1]) < len(points) else found[0].inverse()


def fitted_mount(motions: Sequence[Motion]) -> Pose | None:
    """Return the pose of the camera on the rig, rig_from_camera, that fits motions best.

    None if they are too few, or turn about one axis only, which determines no pose.
    """
    if len(motions) < _LEAST_MOTIONS:
        return None
    of_rig, of_camera = (
        np.array([motion[which].log()[3:] for motion in motions]) for which in (0, 1)
    )
    spread = np.sqrt(np.maximum(exact.eigh(exact.product(of_rig.T.copy(), of_rig))[0], 0.0))
    if spread[1] < _LEAST_SPREAD:
        return None
    turn = _rotation(of_camera, of_rig)
    matrix, right = np.zeros((3, 3)), np.zeros(3)
    for rig, camera in motions:
        change = rig.matrix()[:3, :3] - np.eye(3)
        rest = exact.product(turn, np.array(camera.translation)) - np.array(rig.translation)
        matrix += exact.product(change.T.copy(), change)
        right += exact.product(change.T.copy(), rest)
    rig_from_camera = np.eye(4)
    try:
        rig_from_camera[:3, :3], rig_from_camera[:3, 3] = turn, exact.solve(matrix, right)
    except ValueError:
        return None
    return Pose(rig_from_camera)


def refined_mount(seen: Sequence[Predicted], start: Pose, error: float) -> Pose:
    """Return the pose of the camera on the rig near `start` with which most features fit.

    `error` is how far they may be off, in radians.
    """

    def off(numbers: Floats) -> Floats:
        return np.concatenate([one.off(start @ Pose.exp(numbers), 1.0) for one in seen])

    fit = robust_fit(off, 6, error)
    return start if fit is None else start @ Pose.exp(fit.numbers)


def refined_scale(
    seen: Sequence[Predicted], rig_from_camera: Pose, start: float, error: float
) -> float:
    """Return the scale of the rig's translations near `start` with which most features fit."""

    def off(numbers: Floats) -> Floats:
        scale = start * exact.exp(float(numbers[0]))
        return np.concatenate([one.off(rig_from_camera, scale) for one in seen])

    fit = robust_fit(off, 1, error)
    return start if fit is None else start * exact.exp(float(fit.numbers[0]))


def fitted_scale(motions: Sequence[Motion], rig_from_camera: Pose) -> float | None:
    """Return by what the rig's translations are multiplied to fit motions; None if it stands."""
    product = square = 0.0
    for rig, camera in motions:
        seen = (rig_from_camera @ camera @ rig_from_camera.inverse()).translation
        product += exact.dot(np.array(rig.translation), np.array(seen))
        square += exact.dot(np.array(rig.translation), np.array(rig.translation))
    return product / square if square > 0.0 else None


def _rotation(before: Floats, after: Floats) -> Floats:
    """Return the rotation (3, 3) that best takes vectors (N, 3) to others, by Horn's method."""
    sums = exact.product(before.T.copy(), after)
    trace, mixed = np.trace(sums), sums - sums.T
    axis = np.array([mixed[1, 2], mixed[2, 0], mixed[0, 1]])
    form = np.zeros((4, 4))
    form[0, 0], form[0, 1:], form[1:, 0] = trace, axis, axis
    form[1:, 1:] = sums + sums.T - trace * np.eye(3)
    best = exact.eigh(form)[1][:, 3]
    return Pose.from_parts((0.0, 0.0, 0.0), best).matrix()[:3, :3]
