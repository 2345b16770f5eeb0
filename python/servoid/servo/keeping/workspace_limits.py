"""Keeps the hand in its workspace and away from the object."""

import numpy as np

from servoid._native import VelocityLimits, Workspace, stoppable_speed
from servoid.pose import Floats, Pose, exact
from servoid.servo.arm import Solid
from servoid.servo.keeping.bounds import Rows
from servoid.servo.keeping.safety import Reason
from servoid.servo.settings import SafetySettings

_WATCHED = 0.15  # m: parts that are farther apart, beyond their clearance, are ignored
_WALLS = (*[Reason.WORKSPACE] * 3, Reason.NEAR)


def walls_of(limits: VelocityLimits, jacobian: Floats) -> Rows:
    """Return bounds of the hand's velocity for joint speeds; `jacobian` (6, n) is the hand's."""
    return Rows(*limits.rows(jacobian), _WALLS)


class WorkspaceLimits:
    """Bounds the hand's velocity, so that it brakes before walls, other parts and the object."""

    def __init__(self, settings: SafetySettings, reaction_s: float, period_s: float) -> None:
        self._settings, self._reaction_s = settings, reaction_s
        self._step = settings.braking * period_s
        self._room = Workspace(
            (settings.workspace_lower, settings.workspace_upper),
            least_distance=settings.least_distance,
            braking=settings.braking,
            reaction_s=reaction_s,
            period_s=period_s,
        )

    def allowed(self, world_from_goal: Pose, object_in_world: Floats) -> Pose:
        """Return the goal, moved into the workspace and away from the object if necessary."""
        place = self._room.allowed(world_from_goal.translation, object_in_world)
        return Pose.from_parts(place, world_from_goal.quaternion)

    def apart(
        self, solid: Solid | None, positions: Floats, previous: Floats, hand: slice
    ) -> Rows | None:
        """Return bounds that keep parts of an arm and its room apart, at joint positions (N,).

        `previous` (N,) are the last commanded joint speeds, and `hand` the joints of the hand.
        None if distances or their slopes are not finite: then nothing is known of what is near.
        """
        settings = self._settings
        if solid is None:
            return Rows.none(len(previous[hand]))
        found = solid.clearances(positions, settings.least_clearance + _WATCHED)
        if not len(found.distances):
            return Rows.none(len(previous[hand]))
        if not (exact.is_finite(found.distances) and exact.is_finite(found.slopes)):
            return None
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
        return self._room.velocity_limits((hand, velocity), (object_in_world, object_velocity))
