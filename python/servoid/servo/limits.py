"""What the joints may do next: speed windows that hold all of their limits."""

import numpy as np

from servoid.servo.arm import Floats, Joints
from servoid.servo.bounds import Window
from servoid.servo.safety import Reason
from servoid.servo.settings import JointSettings

_CAUSES = np.array([Reason.JOINT_SPEED, Reason.JOINT_LIMIT, Reason.JOINT_ACCELERATION])


def stoppable_speed(room: Floats, deceleration: Floats | float, reaction_s: float) -> Floats:
    """Return the greatest speed that stops within `room`, 0 where there is none.

    It is held for `reaction_s` before it falls at `deceleration`; falling along this curve takes
    less than that deceleration.
    """
    head = np.maximum(room, 0.0)
    return deceleration * (np.sqrt(np.square(reaction_s) + 2.0 * head / deceleration) - reaction_s)


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

    def window(
        self, positions: Floats, previous: Floats, braking: Floats | float = np.inf
    ) -> Window:
        """Return what may follow the `previous` command (N,) with the joints at `positions` (N,).

        Before their stops joints brake no harder than `braking` (N,) in rad/s². The window is never
        empty: where the limits are at odds, it is the hardest braking.
        """
        lower, upper = previous - self._step, previous + self._step
        room = np.array([positions - self._lower, self._upper - positions])
        gently = np.minimum(self._acceleration, braking)
        stops = stoppable_speed(room, gently, self._reaction_s)
        most = np.minimum(self._speed, stops)
        # What accelerations allow comes last: no command ever jumps.
        least = np.minimum(np.maximum(-most[0], lower), upper)
        greatest = np.maximum(np.minimum(most[1], upper), lower)
        slow = np.array([-most[0] >= lower, most[1] <= upper])
        causes = _CAUSES[np.where(slow, np.where(stops < self._speed, 1, 0), 2)]
        return Window(least, greatest, causes.tolist())

    def braked(self, previous: Floats, hand_ticks: float = 0.0) -> Floats:
        """Return the next command of joints that come to rest.

        Those of the hand do so together, along their way, and in no fewer ticks than the hand
        itself needs; so do those of the eyes, but eyes that turn fast do not keep the hand from
        braking.
        """
        ticks = np.abs(previous) / self._step
        braked = previous.copy()
        for part, least in zip(self._parts, (hand_ticks, 0.0), strict=True):
            slowest = max(least, float(np.max(ticks[part], initial=0.0)))
            braked[part] *= max(0.0, 1.0 - 1.0 / slowest) if slowest > 0.0 else 0.0
        return braked
