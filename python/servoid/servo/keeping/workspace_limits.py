"""Keeps the hand in its workspace and away from the object."""

from dataclasses import dataclass

import numpy as np

from servoid.pose import Floats, Pose, exact
from servoid.servo.arm import Solid
from servoid.servo.keeping.bounds import Rows
from servoid.servo.keeping.limits import stoppable_speed
from servoid.servo.keeping.safety import Reason
from servoid.servo.settings import SafetySettings

_WATCHED = 0.15  # m: parts that are farther apart, beyond their clearance, are ignored
_BLIND = 1e-6  # m: at smaller distances from the object, the direction away is undefined


@dataclass(frozen=True, eq=False)
class VelocityLimits:
    """Bounds (3,) of the hand's velocity in the world, and of its speed towards the object.

    `toward` (3,) is the unit direction to the object; `closing` includes the object's velocity.
    """

    lower: Floats
    upper: Floats
    toward: Floats
    closing: float

    def rows(self, jacobian: Floats) -> Rows:
        """Return these bounds for joint speeds; `jacobian` (6, n) is that of the hand."""
        linear = jacobian[:3]
        return Rows(
            np.concatenate([linear, exact.product(self.toward, linear)[None]]),
            np.array([*self.lower, -np.inf]),
            np.array([*self.upper, self.closing if np.any(self.toward) else np.inf]),
            (*[Reason.WORKSPACE] * 3, Reason.NEAR),
        )


class WorkspaceLimits:
    """Bounds the hand's velocity, so that it brakes before walls, other parts and the object."""

    def __init__(self, settings: SafetySettings, reaction_s: float, period_s: float) -> None:
        self._settings, self._reaction_s = settings, reaction_s
        self._step = settings.braking * period_s
        self._lower = np.array(settings.workspace_lower)
        self._upper = np.array(settings.workspace_upper)

    def allowed(self, world_from_goal: Pose, object_in_world: Floats) -> Pose:
        """Return the goal, moved into the workspace and away from the object if necessary."""
        place = np.array(world_from_goal.translation)
        away = place - object_in_world
        distance = exact.norm(away)
        if _BLIND < distance < self._settings.least_distance:
            place = object_in_world + away * (self._settings.least_distance / distance)
        place = np.minimum(np.maximum(place, self._lower), self._upper)
        return Pose.from_parts(place.tolist(), world_from_goal.quaternion)

    def apart(self, solid: Solid, positions: Floats, previous: Floats, hand: slice) -> Rows:
        """Return bounds that keep parts of an arm and its room apart, at joint positions (N,).

        `previous` (N,) are the last commanded joint speeds, and `hand` the joints of the hand.
        """
        settings = self._settings
        found = solid.clearances(positions, settings.least_clearance + _WATCHED)
        if not len(found.distances):
            return Rows.none(len(previous[hand]))
        room = found.distances - settings.least_clearance
        speeds = np.copysign(
            stoppable_speed(np.abs(room), settings.braking, self._reaction_s), room
        )
        rates = exact.product(found.slopes, previous)
        others = rates - exact.product(found.slopes[:, hand], previous[hand])  # the cameras' part
        lower = np.minimum(-speeds, rates + self._step) - others
        reasons = (Reason.COLLISION,) * len(lower)
        return Rows(found.slopes[:, hand], lower, np.full(len(lower), np.inf), reasons)

    def velocity_limits(
        self, hand: Floats, velocity: Floats, object_in_world: Floats, object_velocity: Floats
    ) -> VelocityLimits:
        """Return the bounds on the hand at a position (3,) in the world, for the object at (3,).

        No bound requires a deceleration above `braking` from the hand's last velocity (3,).
        """
        away = object_in_world - hand
        distance = exact.norm(away)
        toward = away / distance if distance > _BLIND else np.zeros(3)
        apart = distance - self._settings.least_distance
        room = np.array([*(hand - self._lower), *(self._upper - hand), apart])
        # Without any room left, only speeds that move back are allowed.
        speeds = np.copysign(
            stoppable_speed(np.abs(room), self._settings.braking, self._reaction_s), room
        )
        closing = float(speeds[6]) + exact.dot(toward, object_velocity)
        return VelocityLimits(
            np.minimum(-speeds[:3], velocity + self._step),
            np.maximum(speeds[3:6], velocity - self._step),
            toward,
            max(closing, exact.dot(toward, velocity) - self._step),
        )
