"""The inner loop of the cameras: tilt and pans that keep each optical axis on the target."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid import _native
from servoid.pose import Floats, Pose
from servoid.servo.arm import Eyes, Joints, JointState
from servoid.servo.keeping.bounds import Window
from servoid.servo.settings import GazeMode, GazeSettings

_SURE_BRAKING = 0.3  # share of the joints' acceleration, with which late commands still stop them


@dataclass(frozen=True, eq=False)
class Gaze:
    """The desired gaze: angles (3,) of tilt, left and right pan, and their rates."""

    angles: Floats
    rates: Floats


def fixation(half_baseline: float, point_in_head: Floats, velocity_in_head: Floats) -> Gaze:
    """Return the gaze at a point (3,) that moves at a velocity (3,), in the head's frame."""
    return Gaze(*_native.fixation(half_baseline, point_in_head, velocity_in_head))


class GazeControl:
    """Controls tilt and pans by a PD law on their angles, with feed-forward of desired rates."""

    def __init__(
        self, eyes: Eyes, joints: Joints, settings: GazeSettings, reaction_s: float
    ) -> None:
        """Take an arm's eyes and joints, and the time until joints brake, of commands in time."""
        self._eyes, self._settings = eyes, settings
        self._reaction_s = reaction_s
        self.places: NDArray[np.int64] = np.array([eyes.tilt, eyes.pan_left, eyes.pan_right])
        self._braking = _SURE_BRAKING * joints.acceleration[self.places]

    def wanted(
        self, world_from_hand: Pose, hand_twist: Floats, point: Floats, velocity: Floats
    ) -> Gaze:
        """Return the gaze for a point (3,) that moves at a velocity (3,) in the world."""
        if self._settings.mode is GazeMode.PARALLEL:
            return Gaze(np.zeros(3), np.zeros(3))
        head = self._eyes.hand_from_head
        seen = _native.seen_from_head(world_from_hand, head, hand_twist, point, velocity)
        return fixation(self._eyes.half_baseline, *seen)

    def velocities(
        self, state: JointState, gaze: Gaze, window: Window, periods: float = 1.0
    ) -> Floats:
        """Return the speeds (3,) in rad/s of tilt and pans, inside the window of all N joints.

        Commands follow each other in so many `periods` of the arm. If they are late, joints brake
        later and less than the gain needs, and would swing about the target.
        """
        settings, places = self._settings, self.places
        error = gaze.angles - state.positions[places]
        pull = settings.gain * error
        if periods > 1.0:
            braking, reaction_s = self._braking / periods, self._reaction_s * periods
            most = _native.stoppable_speed(np.abs(error), braking, reaction_s)
            pull = np.minimum(np.maximum(pull, -most), most)
        wanted = pull + settings.rate_gain * (gaze.rates - state.velocities[places])
        if settings.feed_forward:
            wanted = wanted + gaze.rates
        return np.minimum(np.maximum(wanted, window.lower[places]), window.upper[places])
