"""Computes the joint speeds that may be commanded next, under all limits of the joints."""

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats
from servoid.servo.arm import Joints, JointState
from servoid.servo.keeping.bounds import Window
from servoid.servo.keeping.safety import Reason
from servoid.servo.settings import JointSettings

_CAUSES = np.array(
    [Reason.JOINT_JERK, Reason.JOINT_ACCELERATION, Reason.JOINT_SPEED, Reason.JOINT_LIMIT]
)
_HALVINGS = 12  # candidate accelerations for the largest one that still stops in time
_SIDES = np.array([[-1.0], [1.0]])
_OVERSHOOT = 2.0  # share of its speed limit above which a joint's measured speed cannot be true
JITTER = 0.1
"""The error of measured joint speeds in rad/s, of joints with any limit."""


def stoppable_speed(room: Floats, deceleration: Floats | float, reaction_s: float) -> Floats:
    """Return the greatest speed that stops within `room`, 0 without any room.

    It continues for `reaction_s` before it decreases at `deceleration`; following this curve needs
    less than that deceleration.
    """
    head = np.maximum(room, 0.0)
    return deceleration * (np.sqrt(np.square(reaction_s) + 2.0 * head / deceleration) - reaction_s)


def stopping_distance(
    speed: Floats, acceleration: Floats, deceleration: Floats, jerk: Floats
) -> Floats:
    """Return the stopping distance of a joint at a present acceleration, with limited jerk.

    It brakes as hard as `deceleration` and `jerk` allow, and speeds must not be negative.
    """
    # Equivalent to braking from zero acceleration at another speed.
    start = speed + np.square(acceleration) / (2.0 * jerk)
    long = 0.5 * start * (start / deceleration + deceleration / jerk)
    short = start * np.sqrt(start / jerk)
    whole = np.where(start * jerk >= np.square(deceleration), long, short)
    cubed = acceleration * acceleration * acceleration
    return whole + speed * acceleration / jerk + cubed / (3.0 * np.square(jerk))


class JointLimits:
    """Enforces the limits of joints in position, speed, acceleration and jerk in each command."""

    def __init__(self, joints: Joints, settings: JointSettings, period_s: float) -> None:
        self._lower = joints.lower + settings.margin
        self._upper = joints.upper - settings.margin
        self._speed = settings.speed_share * joints.speed
        self._fastest = joints.speed
        self._acceleration = settings.acceleration_share * joints.acceleration
        gentle = self._acceleration / settings.ramp_s
        self._jerk = gentle if joints.jerk is None else np.minimum(joints.jerk, gentle)
        self._period_s = period_s
        self._reaction_s = settings.reaction_s + period_s
        self._parts = slice(0, joints.hand_count), slice(joints.hand_count, None)

    def may_move_at(self, velocities: Floats) -> bool:
        """Return whether the joints can have such measured speeds (N,)."""
        return bool(np.all(np.abs(velocities) <= _OVERSHOOT * self._fastest + JITTER))

    def clipped(self, velocities: Floats) -> Floats:
        """Return the nearest speeds (N,) that the joints' own limits allow."""
        return np.minimum(np.maximum(velocities, -self._fastest), self._fastest)

    def window(
        self,
        state: JointState,
        previous: Floats,
        acceleration: Floats,
        braking: Floats | float = np.inf,
    ) -> Window:
        """Return the speeds that may follow the `previous` command (N,) in a state of the joints.

        `acceleration` (N,) is that of the last commands. Before their stops joints brake no harder
        than `braking` (N,) in rad/s². The window is never empty: if limits contradict each other,
        it contains only the hardest braking.
        """
        # The first row is for motion downwards, the second for motion upwards.
        speed, before = (
            _SIDES * previous,
            np.clip(_SIDES * acceleration, -self._acceleration, self._acceleration),
        )
        room = np.array([state.positions - self._lower, self._upper - state.positions])
        goes = np.maximum(_SIDES * state.velocities, 0.0)
        change = self._jerk * self._period_s
        hardest = np.maximum(before - change, -self._acceleration)
        choices = np.array(
            [
                before + change,
                np.broadcast_to(self._acceleration, before.shape),
                self._up_to_speed(speed),
            ]
        )
        cause = choices.argmin(axis=0)
        most = np.maximum(choices.min(axis=0), hardest)
        gently = np.minimum(self._acceleration, braking)
        stopping = self._stopping((speed, goes, room), (hardest, most), gently)
        cause[stopping < most] = len(choices)
        lower, upper = _SIDES * (speed + self._period_s * stopping)
        return Window(np.minimum(lower, upper), upper, _CAUSES[cause].tolist())

    def braked(self, previous: Floats, acceleration: Floats, hand_ticks: float = 0.0) -> Floats:
        """Return the next command of joints that come to rest.

        The joints of the hand stop together, along their path, and in no fewer periods than the
        hand itself needs. The joints of the cameras also stop together, independently of the hand.
        """
        braked = previous.copy()
        for part, ticks in zip(self._parts, (hand_ticks, 0.0), strict=True):
            braked[part] *= 1.0 - self._braking_share(part, previous, acceleration, ticks)
        return braked

    def blindly_braked(self, previous: Floats, acceleration: Floats, hand_ticks: float) -> Floats:
        """Return the next command of joints that come to rest, without knowing their state."""
        change = self._jerk * self._period_s
        least = np.maximum(acceleration - change, -self._acceleration)
        most = np.minimum(acceleration + change, self._acceleration)
        wanted = (self.braked(previous, acceleration, hand_ticks) - previous) / self._period_s
        return previous + self._period_s * np.minimum(np.maximum(wanted, least), most)

    def _up_to_speed(self, speed: Floats) -> Floats:
        """Return the greatest accelerations (2, N) that can vanish before the speed limit."""
        left, step = self._speed - speed, self._jerk * self._period_s
        fading = np.sqrt(np.square(step) + 2.0 * self._jerk * np.maximum(left, 0.0)) - step
        return np.where(left >= 0.0, fading, left / self._period_s)

    def _stopping(
        self,
        now: tuple[Floats, Floats, Floats],
        between: tuple[Floats, Floats],
        braking: Floats,
    ) -> Floats:
        """Return the greatest accelerations (2, N) after which joints stop within their room.

        `now` are the commanded speeds, the actual speeds, and the room, (2, N) each.
        """
        speed, goes, room = now
        least, most = between

        def stops(acceleration: Floats) -> NDArray[np.bool_]:
            later = speed + self._period_s * acceleration
            ahead = np.maximum(later, 0.0)
            way = stopping_distance(ahead, acceleration, braking, self._jerk)
            rests = (later <= 0.0) & (acceleration <= 0.0)
            # Lagging joints move on after the commanded speed is zero.
            return rests | (way + self._reaction_s * np.maximum(ahead, goes) <= room)

        if np.all(stops(most)):
            return most
        good, bad = np.where(stops(most), most, least), most
        for _ in range(_HALVINGS):
            middle = 0.5 * (good + bad)
            holds = stops(middle)
            good, bad = np.where(holds, middle, good), np.where(holds, bad, middle)
        return good

    def _braking_share(
        self, part: slice, previous: Floats, acceleration: Floats, ticks: float
    ) -> float:
        """Return the share of speed that joints lose per period if they stop together."""
        speeds, period_s = np.abs(previous[part]), self._period_s
        fastest = float(np.max(speeds, initial=0.0))
        if fastest == 0.0:
            return 1.0
        moving = speeds > 0.0
        most = float(np.min(self._acceleration[part][moving] * period_s / speeds[moving]))
        jerk = float(np.min(self._jerk[part][moving] * period_s * period_s / speeds[moving]))
        if jerk >= 1.0 and max(ticks, 1.0 / most) <= 1.0:
            return 1.0
        last = -float((acceleration[part] * previous[part]).sum()) * period_s
        last /= float(np.square(previous[part]).sum())
        fading = float(np.sqrt(jerk * jerk + 2.0 * jerk)) - jerk
        return min(1.0, most, 1.0 / max(ticks, 1e-9), fading, max(last, 0.0) + jerk)
