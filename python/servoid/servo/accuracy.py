"""Measures the accuracy of a run: the true object in the hand against its desired pose.

The pose of the modelled body in the true object is not needed: the middle of each follows from its
own shape, and the desired rotation is the true one at the start.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from servoid.pose import Floats, Pose, exact
from servoid.words import finite

if TYPE_CHECKING:
    from servoid.servo.log import ServoLog

_MOMENTS = 24  # times of a run at which surfaces are compared


@dataclass(frozen=True, eq=False)
class TrueGoal:
    """The desired pose of the true object in the hand, and the shapes of object and body.

    `hand_from_object` is the desired pose of the true object. `middle` (3,), `points` (P, 3) and
    `normals` (P, 3) describe its true surface, in its frame; `spin_axis` (3,) is an axis of
    rotational symmetry. `body_middle` (3,) and `body_points` (Q, 3) are those of the modelled
    body, in its own frame.
    """

    hand_from_object: Pose
    middle: Floats
    points: Floats
    normals: Floats
    body_middle: Floats
    body_points: Floats
    spin_axis: Floats | None = None

    def error(self, hand_from_object: Pose) -> Floats:
        """Return the hand's error relative to its goal at the true object, (6,): m and rad.

        The first three are in the goal's frame, the last three a rotation vector.
        """
        here = _spun(hand_from_object, self.hand_from_object, self.spin_axis)
        off = self.hand_from_object @ here.inverse()
        turn = Pose.from_parts([0.0, 0.0, 0.0], off.quaternion).log()[3:]
        return np.concatenate([off.translation, turn])

    def object_error(self, hand_from_object: Pose) -> float:
        """Return the distance of the object's middle from its desired position in the hand."""
        there = _moved(self.hand_from_object, self.middle)
        return exact.norm(_moved(hand_from_object, self.middle) - there)

    def surface_error(self, hand_from_object: Pose) -> float:
        """Return the mean distance of points of the true surface from their desired positions."""
        here = _spun(hand_from_object, self.hand_from_object, self.spin_axis)
        off = here.transform(self.points) - self.hand_from_object.transform(self.points)
        return float(np.mean(exact.lengths(off)))

    def middle_error(self, hand_from_object: Pose, hand_from_body: Pose) -> float:
        """Return the distance of the body's estimated middle from the object's true one."""
        off = _moved(hand_from_body, self.body_middle) - _moved(hand_from_object, self.middle)
        return exact.norm(off)

    def body_error(self, hand_from_object: Pose, hand_from_body: Pose) -> float:
        """Return the mean distance of the estimated surface from the true one."""
        places = (hand_from_object.inverse() @ hand_from_body).transform(self.body_points)
        apart = places[:, None] - self.points[None]
        nearest = (apart * apart).sum(axis=2).argmin(axis=1)
        rows = np.arange(len(places))
        across = np.abs((apart[rows, nearest] * self.normals[nearest]).sum(axis=1))
        return float(np.mean(across))


@dataclass(frozen=True)
class Accuracy:
    """The accuracy of a run, in metres and radians; NaN where the truth is not known.

    `position_rms`, `position_95` and `turn_rms` are errors of the hand relative to its goal at the
    true object, and `offset` is the length of its mean position error. `object_rms` is the error of
    the true object's middle in the hand, and `surface` the mean error of the points of its surface.
    The last two describe the estimate: `middle_rms` is the distance from the modelled body's middle
    to the true object's, and `body` the mean distance from the modelled surface to the true one.
    """

    position_rms: float = np.nan
    position_95: float = np.nan
    turn_rms: float = np.nan
    offset: float = np.nan
    object_rms: float = np.nan
    surface: float = np.nan
    middle_rms: float = np.nan
    body: float = np.nan

    @classmethod
    def of(cls, log: "ServoLog", settle_s: float) -> "Accuracy":
        """Measure a log from `settle_s` seconds on."""
        true_goal = log.true_goal
        later = log.times >= settle_s
        rows = [row for row, counts in zip(log.rows, later, strict=True) if counts]
        held = [row.hand_from_object for row in rows if row.hand_from_object is not None]
        if true_goal is None or not held:
            return cls()
        errors = log.true_errors[log.times >= settle_s]
        errors = errors[np.isfinite(errors).all(axis=1)]
        distances = exact.lengths(errors[:, :3])
        pairs = [
            (row.hand_from_object, row.hand_from_body)
            for row in rows
            if row.hand_from_object is not None and row.hand_from_body is not None
        ]
        some = [pairs[place] for place in _evenly(len(pairs))]
        return cls(
            position_rms=rms(distances),
            position_95=float(np.percentile(distances, 95.0)),
            turn_rms=rms(exact.lengths(errors[:, 3:])),
            offset=exact.norm(errors[:, :3].mean(axis=0)),
            object_rms=rms(np.array([true_goal.object_error(one) for one in held])),
            surface=float(
                np.mean([true_goal.surface_error(held[at]) for at in _evenly(len(held))])
            ),
            middle_rms=rms(np.array([true_goal.middle_error(*pair) for pair in pairs])),
            body=float(np.mean([true_goal.body_error(*pair) for pair in some])) if some else np.nan,
        )

    def numbers(self) -> dict[str, Any]:
        """Return the figures by name, ready for JSON; None where they are not known."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return {name: finite(value) for name, value in values.items()}


def _evenly(count: int) -> list[int]:
    """Return at most `_MOMENTS` evenly spaced indices of `count` items."""
    return sorted({round(place) for place in np.linspace(0, count - 1, min(count, _MOMENTS))})


def _moved(pose: Pose, point: Floats) -> Floats:
    return pose.transform(np.ascontiguousarray(point)[None])[0]


def _spun(pose: Pose, other: Pose, axis: Floats | None) -> Pose:
    """Return a pose rotated about its own axis, if it has one, to be nearest to another."""
    return pose if axis is None else spun_like(pose, other, axis)


def spun_like(pose: Pose, other: Pose, axis: Floats) -> Pose:
    """Return a pose rotated about its own unit axis (3,) so that it differs least from another."""
    w, *vector = (pose.inverse() @ other).quaternion
    angle = 2.0 * exact.arctan2(exact.dot(axis, np.array(vector)), w)
    return pose @ Pose.exp([0.0, 0.0, 0.0, *(angle * axis)])


def rms(values: Floats) -> float:
    """Return the root mean square of the finite values of (N,); NaN where there are none."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if len(known) else np.nan
