"""Computes the joint speeds that may be commanded next, under all limits of the joints."""

import numpy as np

from servoid import _native
from servoid.pose import Floats
from servoid.servo.arm import Joints, JointState
from servoid.servo.keeping.bounds import Window
from servoid.servo.keeping.safety import Reason
from servoid.servo.settings import JointSettings

# In the order of the causes that the core counts.
_CAUSES = (Reason.JOINT_JERK, Reason.JOINT_ACCELERATION, Reason.JOINT_SPEED, Reason.JOINT_LIMIT)
_OVERSHOOT = 2.0  # share of its speed limit above which a joint's measured speed cannot be true
_RAMP_S = 0.06  # longest time in which the jerk lets an acceleration rise to the one that is used
_UNLIMITED = np.empty(0)
JITTER = 0.1
"""The error of measured joint speeds in rad/s, of joints with any limit."""


class JointLimits:
    """Enforces the limits of joints in position, speed, acceleration and jerk in each command."""

    def __init__(self, joints: Joints, settings: JointSettings, period_s: float) -> None:
        self._fastest = joints.speed
        self._absurd = _OVERSHOOT * joints.speed + JITTER
        acceleration = settings.acceleration_share * joints.acceleration
        gentle = acceleration / settings.ramp_s
        self.ramp_s: float = settings.ramp_s
        """Longest time in which a joint's acceleration rises from 0 to the greatest one."""
        if joints.jerk is not None:
            # The law knows no jerk: what answers it much later than this, it makes swing.
            acceleration = np.minimum(acceleration, _RAMP_S * joints.jerk)
            self.ramp_s = max(self.ramp_s, float(np.max(acceleration / joints.jerk)))
        ranges = (
            joints.lower + settings.margin,
            joints.upper - settings.margin,
            settings.speed_share * joints.speed,
            acceleration,
            gentle if joints.jerk is None else np.minimum(joints.jerk, gentle),
        )
        reaction_s = settings.reaction_s + period_s
        self._limits = _native.JointLimits(ranges, joints.hand_count, period_s, reaction_s)

    def may_move_at(self, velocities: Floats) -> bool:
        """Return whether the joints can have such measured speeds (N,)."""
        return _native.is_between(velocities, -self._absurd, self._absurd)

    def clipped(self, velocities: Floats) -> Floats:
        """Return the nearest speeds (N,) that the joints' own limits allow."""
        return np.minimum(np.maximum(velocities, -self._fastest), self._fastest)

    def window(
        self,
        state: JointState,
        previous: Floats,
        acceleration: Floats,
        braking: Floats = _UNLIMITED,
    ) -> Window:
        """Return the speeds that may follow the `previous` command (N,) in a state of the joints.

        `acceleration` (N,) is that of the last commands. Before their stops the first joints brake
        no harder than `braking` (n,) in rad/s². The window is never empty: if limits contradict
        each other, it contains only the hardest braking.
        """
        now = state.positions, state.velocities, previous, acceleration
        lower, upper, causes = self._limits.window(now, braking)
        return Window(lower, upper, [[_CAUSES[cause] for cause in side] for side in causes])

    def braked(self, previous: Floats, acceleration: Floats, hand_ticks: float = 0.0) -> Floats:
        """Return the next command of joints that come to rest.

        The joints of the hand stop together, along their path, and in no fewer periods than the
        hand itself needs. The joints of the cameras also stop together, independently of the hand.
        """
        return self._limits.braked(previous, acceleration, hand_ticks)

    def blindly_braked(self, previous: Floats, acceleration: Floats, hand_ticks: float) -> Floats:
        """Return the next command of joints that come to rest, without knowing their state."""
        return self._limits.blindly_braked(previous, acceleration, hand_ticks)
