"""Short motions of joints that end at rest, so that an arm without further commands stops."""

from dataclasses import dataclass

import numpy as np

from servoid.pose import Floats
from servoid.servo.arm import Joints
from servoid.servo.link.settings import LinkSettings
from servoid.words import counted

_ROUNDED = 1.0 + 1e-6
_SHORTEST_S = 1e-3  # minimum between two knots, so that rounding errors do not determine slopes
_SLACK_S = 0.01  # tolerance for very slow motions, which end at once


@dataclass(frozen=True, eq=False)
class StoppingTrajectory:
    """Joint speeds (K, N) in rad/s at times (K,) in s, linear in between; the last are 0.

    Times begin at 0 and increase. Before the first one the speeds are the first, after the last
    one the joints rest.
    """

    times_s: Floats
    speeds: Floats

    @classmethod
    def after(
        cls, velocities: Floats, joints: Joints, settings: LinkSettings
    ) -> "StoppingTrajectory":
        """Return a motion that keeps speeds (N,) for `settings.hold_s` and then brakes.

        The joints of the hand stop together, along their path, and so do those of the cameras.
        """
        deceleration = settings.braking_share * joints.acceleration
        hand = np.arange(len(velocities)) < joints.hand_count
        needed = np.abs(velocities) / deceleration
        ends = [_braking_s(needed[part], velocities[part]) for part in (hand, ~hand)]
        if abs(ends[0] - ends[1]) < _SHORTEST_S and min(ends) > 0.0:
            ends = [max(ends)] * 2
        braking = np.where(hand, *ends)
        knots = sorted({0.0, *ends})
        shares = [
            np.where(braking > knot, 1.0 - knot / np.maximum(braking, 1e-12), 0.0) for knot in knots
        ]
        times = [0.0, *(settings.hold_s + knot for knot in knots)]
        speeds = [velocities, *(share * velocities for share in shares)]
        return cls(np.array(times), np.array(speeds))

    @classmethod
    def resting(cls, count: int, seconds: float) -> "StoppingTrajectory":
        """Return a motion of `count` joints that stay at rest."""
        return cls(np.array([0.0, seconds]), np.zeros((2, count)))

    @property
    def end_s(self) -> float:
        """Return the time from the beginning until all joints are at rest."""
        return float(self.times_s[-1])

    def at(self, time_s: float) -> Floats:
        """Return the speeds (N,) at a time after its beginning."""
        if time_s >= self.end_s:
            return np.zeros(self.speeds.shape[1])
        after = int(np.searchsorted(self.times_s, time_s, side="right"))
        if after == 0:
            return self.speeds[0].copy()
        before = after - 1
        length = self.times_s[after] - self.times_s[before]
        share = (time_s - self.times_s[before]) / length
        return self.speeds[before] + share * (self.speeds[after] - self.speeds[before])

    def fault(self, joints: Joints, hold_s: float) -> str | None:
        """Return why the motion must not be executed, None if it may.

        Besides its form and the joints' limits, it must brake in time: it ends at most `hold_s`,
        10 ms, and twice the braking time from its first speeds after its beginning.
        """
        times, speeds = self.times_s, self.speeds
        if times.ndim != 1 or len(times) < 2 or speeds.shape != (len(times), len(joints.names)):
            needed = counted(len(joints.names), "speed")
            return f"{needed} at each of two times or more are needed"
        if not (np.isfinite(times).all() and np.isfinite(speeds).all()):
            return "it contains numbers that are not finite"
        if times[0] != 0.0 or not np.all(np.diff(times) > 0.0):
            return "its times must begin at 0 and increase"
        if speeds[-1].any():
            return "it does not end at rest"
        slopes = np.abs(np.diff(speeds, axis=0)) / np.diff(times)[:, None]
        if np.any(np.abs(speeds) > _ROUNDED * joints.speed):
            return "it exceeds the joints' speed limits"
        if np.any(slopes > _ROUNDED * joints.acceleration):
            return "it exceeds the joints' acceleration limits"
        braking_s = float(np.max(np.abs(speeds[0]) / joints.acceleration))
        longest = hold_s + _SLACK_S + 2.0 * braking_s
        if times[-1] > _ROUNDED * longest:
            return f"it comes to rest after {times[-1]:.3f} s; {longest:.3f} s are allowed"
        return None


def _braking_s(needed: Floats, velocities: Floats) -> float:
    """Return the time in which joints brake together, from the times that each one needs."""
    # The least speeds need a time that rounds to 0.
    return max(float(needed.max()), _SHORTEST_S) if velocities.any() else 0.0
