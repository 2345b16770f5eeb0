"""What the joints may do next: speed windows that hold all of their limits."""

from dataclasses import dataclass

import numpy as np

from servoid.servo.arm import Floats, Joints
from servoid.servo.settings import JointSettings


def stoppable_speed(room: Floats, deceleration: Floats | float, reaction_s: float) -> Floats:
    """Return the greatest speed that stops within `room`, 0 where there is none.

    It is held for `reaction_s` before it falls at `deceleration`; falling along this curve takes
    less than that deceleration.
    """
    head = np.maximum(room, 0.0)
    return deceleration * (np.sqrt(np.square(reaction_s) + 2.0 * head / deceleration) - reaction_s)


@dataclass(frozen=True, eq=False)
class Window:
    """The least and the greatest speeds (n,) that joints may be told, in rad/s."""

    lower: Floats
    upper: Floats

    def part(self, joints: slice) -> "Window":
        """Return the window of some of the joints."""
        return Window(self.lower[joints], self.upper[joints])

    def bounded(self, velocities: Floats) -> Floats:
        """Return the nearest speeds inside."""
        return np.minimum(np.maximum(velocities, self.lower), self.upper)


class JointLimits:
    """Holds the limits of joints in speed, acceleration and position, for each next command."""

    def __init__(self, joints: Joints, settings: JointSettings, period_s: float) -> None:
        self._lower = joints.lower + settings.margin
        self._upper = joints.upper - settings.margin
        self._speed = settings.speed_share * joints.speed
        self._acceleration = settings.acceleration_share * joints.acceleration
        self._step = self._acceleration * period_s
        self._reaction_s = settings.reaction_s + period_s
        self._parts = slice(0, joints.hand_count), slice(joints.hand_count, None)

    def window(self, positions: Floats, previous: Floats) -> Window:
        """Return what may follow the `previous` command (N,) with the joints at `positions` (N,).

        It is never empty: where the limits are at odds, it is the hardest braking.
        """
        lower, upper = previous - self._step, previous + self._step
        room = np.array([positions - self._lower, self._upper - positions])
        down, up = stoppable_speed(room, self._acceleration, self._reaction_s)
        least, most = np.maximum(-self._speed, -down), np.minimum(self._speed, up)
        # What accelerations allow comes last: no command ever jumps.
        return Window(
            np.minimum(np.maximum(least, lower), upper), np.maximum(np.minimum(most, upper), lower)
        )

    def braked(self, previous: Floats) -> Floats:
        """Return the next command of joints that come to rest.

        Those of the hand do so together, along their way, and so do those of the eyes, but eyes
        that turn fast do not keep the hand from braking.
        """
        steps = np.abs(previous) / self._step
        braked = previous.copy()
        for part in self._parts:
            slowest = float(np.max(steps[part], initial=0.0))
            braked[part] *= max(0.0, 1.0 - 1.0 / slowest) if slowest > 0.0 else 0.0
        return braked
