"""The bounds of an arm, by how often its commands really come and how late its joints follow."""

import math
from dataclasses import replace

from msgspec.structs import replace as changed

from servoid.servo.arm import Arm
from servoid.servo.keeping.limiter import Limiter
from servoid.servo.keeping.limits import JointLimits
from servoid.servo.keeping.pace import Pace
from servoid.servo.keeping.workspace_limits import WorkspaceLimits
from servoid.servo.settings import ServoSettings

_STEP = 0.5  # periods, in whose multiples bounds are computed
_STEP_S = 0.02  # of a measured lag, likewise


class PacedBounds:
    """The bounds of an arm whose commands come every so many of its periods.

    Each command may change a speed by as much as in time, so that such an arm is one of a longer
    period that accelerates and brakes less by as much. Its jerk is less by the square.
    """

    def __init__(
        self, arm: Arm, settings: ServoSettings, periods: float = 1.0, late_s: float = 0.0
    ) -> None:
        """Take an arm and its settings; its joints follow `late_s` late, in s.

        Raises:
            MissingExtraError: the solver of the limiter is not installed.

        """
        self.periods: float = periods
        self.period_s: float = periods * arm.period_s
        self.late_s: float = late_s
        joints, hand, safety = arm.joints, settings.hand, settings.safety
        own = settings.joints
        if late_s > own.reaction_s:
            own = changed(own, reaction_s=late_s)
        if periods > 1.0:
            jerk = None if joints.jerk is None else joints.jerk / (periods * periods)
            joints = replace(joints, acceleration=joints.acceleration / periods, jerk=jerk)
            hand = changed(
                hand,
                linear_acceleration=hand.linear_acceleration / periods,
                angular_acceleration=hand.angular_acceleration / periods,
            )
            safety = changed(safety, braking=safety.braking / periods)
        self.joints: JointLimits = JointLimits(joints, own, self.period_s)
        fade_s = 0.5 * self.joints.ramp_s
        self.reaction_s: float = own.reaction_s + self.period_s + fade_s
        self.workspace: WorkspaceLimits = WorkspaceLimits(safety, self.reaction_s, self.period_s)
        self.limiter: Limiter = Limiter(self.period_s, hand, fade_s)

    def at(
        self, arm: Arm, settings: ServoSettings, pace: Pace, late_s: float = 0.0
    ) -> "PacedBounds":
        """Return the bounds for a pace of commands and a lag; these, if both are as before."""
        periods = 1.0 if pace.periods <= 1.0 else math.ceil(pace.periods / _STEP) * _STEP
        late_s = math.ceil(late_s / _STEP_S) * _STEP_S
        if periods == self.periods and late_s == self.late_s:
            return self
        return PacedBounds(arm, settings, periods, late_s)
