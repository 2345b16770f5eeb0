"""Keeps the hand in its workspace and off the object."""

from dataclasses import dataclass

import numpy as np

from servoid.pose import Pose, exact
from servoid.servo.arm import Floats
from servoid.servo.limits import stoppable_speed
from servoid.servo.safety import Reason
from servoid.servo.settings import SafetySettings

_NOTED = 1e-4  # m/s: less is no intervention
_BLIND = 1e-6  # m: nearer than this to the object there is no direction away


@dataclass(frozen=True, eq=False)
class Keep:
    """Bounds (3,) of the hand's velocity in the world, and of its speed towards the object.

    `toward` (3,) is the unit direction to the object, whose own velocity is part of `closing`.
    """

    lower: Floats
    upper: Floats
    toward: Floats
    closing: float

    def slowed(self, velocities: Floats, jacobian: Floats) -> Floats:
        """Return joint speeds (n,), slowed down together as far as the bounds ask for."""
        linear = exact.product(jacobian[:3], velocities)
        speeds = np.concatenate([linear, -linear, [exact.dot(self.toward, linear)]])
        bounds = np.concatenate([self.upper, -self.lower, [self.closing]])
        fast = speeds > np.maximum(bounds, 0.0) + _NOTED
        if not np.any(fast):
            return velocities
        return velocities * float(np.min(np.maximum(bounds[fast], 0.0) / speeds[fast]))


class Guard:
    """Knows the workspace and the least distance, and how to brake before them."""

    def __init__(self, settings: SafetySettings, reaction_s: float) -> None:
        self._settings, self._reaction_s = settings, reaction_s
        self._lower = np.array(settings.workspace_lower)
        self._upper = np.array(settings.workspace_upper)

    def allowed(self, world_from_goal: Pose, object_in_world: Floats) -> Pose:
        """Return the goal, moved into the workspace and away from the object if it must be."""
        place = np.array(world_from_goal.translation)
        away = place - object_in_world
        distance = exact.norm(away)
        if _BLIND < distance < self._settings.least_distance:
            place = object_in_world + away * (self._settings.least_distance / distance)
        place = np.minimum(np.maximum(place, self._lower), self._upper)
        return Pose.from_parts(place.tolist(), world_from_goal.quaternion)

    def keep(self, hand: Floats, object_in_world: Floats, object_velocity: Floats) -> Keep:
        """Return what bounds the hand at a place (3,) in the world, before the object (3,)."""
        away = object_in_world - hand
        distance = exact.norm(away)
        toward = away / distance if distance > _BLIND else np.zeros(3)
        apart = distance - self._settings.least_distance
        room = np.array([*(hand - self._lower), *(self._upper - hand), apart])
        # Where no room is left, speeds lead back.
        speeds = np.copysign(
            stoppable_speed(np.abs(room), self._settings.braking, self._reaction_s), room
        )
        closing = float(speeds[6]) + exact.dot(toward, object_velocity)
        return Keep(-speeds[:3], speeds[3:6], toward, closing)

    def kept(self, twist: Floats, keep: Keep) -> tuple[Floats, frozenset[Reason]]:
        """Return a hand velocity (6,) in the world within bounds, and what it ran into."""
        result, reasons = twist.copy(), set()
        excess = exact.dot(keep.toward, result[:3]) - keep.closing
        if excess > 0.0 and np.any(keep.toward):
            result[:3] -= excess * keep.toward
            if excess > _NOTED:
                reasons.add(Reason.NEAR)
        boxed = np.minimum(np.maximum(result[:3], keep.lower), keep.upper)
        if np.abs(boxed - result[:3]).max() > _NOTED:
            reasons.add(Reason.WORKSPACE)
        result[:3] = boxed
        return result, frozenset(reasons)
