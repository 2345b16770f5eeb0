"""An arm for the physics engine: its bodies, servos and visuals."""

from dataclasses import dataclass
from typing import Any

from servoid.pose import Pose
from servoid.sim.world.scene.visuals import Visual

HAND, TILT = "servoid hand", "servoid tilt"  # names that hardly occur in an arm's file
EYES = ("servoid left eye", "servoid right eye")


@dataclass(frozen=True)
class JointServo:
    """A joint with a speed servo: its limits in rad, rad/s, rad/s² and N m, and its lag."""

    joint: str
    lower: float
    upper: float
    speed: float
    acceleration: float
    torque: float
    lag_s: float


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot that is ready to be compiled.

    `spec` is a `mujoco.MjSpec` with bodies named `HAND` and `EYES`; the first `hand_count` of the
    `servos` move the hand, the others the cameras. It starts with `angles` or, if they are None,
    with the hand at `world_from_hand`. `notes` are messages for the user.
    """

    spec: Any
    visuals: tuple[Visual, ...]
    servos: tuple[JointServo, ...]
    hand_count: int
    half_baseline: float
    angles: tuple[float, ...] | None = None
    world_from_hand: Pose | None = None
    notes: tuple[str, ...] = ()

    @property
    def turns_eyes(self) -> bool:
        """Return whether the cameras have joints."""
        return len(self.servos) > self.hand_count
