"""The inner loop of the cameras: tilt and pans that keep each optical axis on the target."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats, Pose, exact
from servoid.servo.arm import Eyes, JointState
from servoid.servo.keeping.bounds import Window
from servoid.servo.settings import GazeMode, GazeSettings

_NEAREST = 0.02  # m: below this distance from a camera, the target's direction is undefined


@dataclass(frozen=True, eq=False)
class Gaze:
    """The desired gaze: angles (3,) of tilt, left and right pan, and their rates."""

    angles: Floats
    rates: Floats


def fixation(half_baseline: float, point_in_head: Floats, velocity_in_head: Floats) -> Gaze:
    """Return the gaze at a point (3,) that moves at a velocity (3,), in the head's frame."""
    x, y, z = point_in_head
    x_rate, y_rate, z_rate = velocity_in_head
    # In the tilted head's frame, the target is straight ahead except for the pans.
    ahead = max(exact.hypot(y, z), _NEAREST)
    ahead_rate = (y * y_rate + z * z_rate) / ahead
    angles, rates = [exact.arctan2(y, z)], [(z * y_rate - y * z_rate) / (ahead * ahead)]
    for aside in (x + half_baseline, x - half_baseline):
        angles.append(exact.arctan2(aside, ahead))
        rates.append((ahead * x_rate - aside * ahead_rate) / (ahead * ahead + aside * aside))
    return Gaze(np.array(angles), np.array(rates))


def seen_from_head(
    eyes: Eyes, world_from_hand: Pose, hand_twist: Floats, point: Floats, velocity: Floats
) -> tuple[Floats, Floats]:
    """Return position and velocity (3,) in the head of a point (3,) that moves in the world.

    `hand_twist` (6,) is the hand's own motion in the world, which the head shares.
    """
    world_from_head = (world_from_hand @ eyes.hand_from_head).matrix()
    turn = world_from_head[:3, :3]
    offset = point - world_from_hand.translation
    x, y, z = hand_twist[3:]
    a, b, c = offset
    carried = hand_twist[:3] + np.array([y * c - z * b, z * a - x * c, x * b - y * a])
    place = exact.product(turn.T, point - world_from_head[:3, 3])
    return place, exact.product(turn.T, velocity - carried)


class GazeControl:
    """Controls tilt and pans by a PD law on their angles, with feed-forward of desired rates."""

    def __init__(self, eyes: Eyes, settings: GazeSettings) -> None:
        self._eyes, self._settings = eyes, settings
        self.places: NDArray[np.int64] = np.array([eyes.tilt, eyes.pan_left, eyes.pan_right])

    def wanted(
        self, world_from_hand: Pose, hand_twist: Floats, point: Floats, velocity: Floats
    ) -> Gaze:
        """Return the gaze for a point (3,) that moves at a velocity (3,) in the world."""
        if self._settings.mode is GazeMode.PARALLEL:
            return Gaze(np.zeros(3), np.zeros(3))
        seen = seen_from_head(self._eyes, world_from_hand, hand_twist, point, velocity)
        return fixation(self._eyes.half_baseline, *seen)

    def velocities(self, state: JointState, gaze: Gaze, window: Window) -> Floats:
        """Return the speeds (3,) in rad/s of tilt and pans, inside the window of all N joints."""
        settings, places = self._settings, self.places
        error = gaze.angles - state.positions[places]
        wanted = settings.gain * error + settings.rate_gain * (
            gaze.rates - state.velocities[places]
        )
        if settings.feed_forward:
            wanted = wanted + gaze.rates
        return np.minimum(np.maximum(wanted, window.lower[places]), window.upper[places])
