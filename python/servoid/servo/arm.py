"""Declares the interface of an arm that can be servoed, simulated or real."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from servoid.errors import ServoError
from servoid.pose import Floats, Pose
from servoid.servo.rows import check_range, check_rates, is_index, is_number, row_of


@dataclass(frozen=True, eq=False)
class Joints:
    """The N joints of an arm and its cameras, with their limits.

    All are rows of N numbers, kept as (N,) float64: `lower` and `upper` bound the angles in
    radians, `speed` is in rad/s, `acceleration` in rad/s² and `jerk`, if the arm has one, in
    rad/s³. The first `hand_count` joints move the hand, the others the cameras. A joint that turns
    without an end has the limits -inf and inf.

    Raises:
        ServoError: two joints have one name, a row does not have one number for each name, or a
            limit cannot be true, such as one in degrees.

    """

    names: tuple[str, ...]
    hand_count: int
    lower: Floats
    upper: Floats
    speed: Floats
    acceleration: Floats
    jerk: Floats | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        for name in ("lower", "upper", "speed", "acceleration", "jerk"):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, row_of(f"Joints.{name}", given, len(self.names)))
        count = len(self.names)
        twice = next((name for name in self.names if self.names.count(name) > 1), None)
        if twice is not None:
            raise ServoError(
                f"Joints.names has '{twice}' {self.names.count(twice)} times; give each joint a "
                "name of its own"
            )
        if not is_index(self.hand_count) or not 1 <= self.hand_count <= count:
            raise ServoError(
                f"Joints.hand_count must be a whole number from 1 to {count}, the number of "
                f"joints, but is {self.hand_count!r:.60}"
            )
        check_range(self.names, self.lower, self.upper)
        for name in ("speed", "acceleration", "jerk"):
            if getattr(self, name) is not None:
                check_rates(self.names, name, getattr(self, name))


@dataclass(frozen=True)
class Eyes:
    """Two cameras ("eyes") with a common tilt and a pan each; their head is fixed to the hand.

    The head's frame is like a camera's: x right, y down, z forward; the cameras are at x = -l and
    x = l, where l is `half_baseline` in metres. A positive tilt looks down, about -x; a positive
    pan looks right, about y after the tilt. The integers are indices in `Joints`.
    """

    hand_from_head: Pose
    half_baseline: float
    tilt: int
    pan_left: int
    pan_right: int


@dataclass(frozen=True, eq=False)
class JointState:
    """The readings of the joints' sensors: angles (N,) in radians, speeds (N,) in rad/s, and time.

    The time goes on while the joints rest, too. `stopped` is true if the arm's own driver has
    brought it to a protective stop, in which commands have no effect until somebody resets it.

    Raises:
        ServoError: the time is no number, `stopped` is neither true nor false, or another value is
            not a row of numbers.

    """

    time_s: float
    positions: Floats
    velocities: Floats
    stopped: bool = False

    def __post_init__(self) -> None:
        if not is_number(self.time_s):
            raise ServoError(f"JointState.time_s must be a number, but is {self.time_s!r:.60}")
        if not isinstance(self.stopped, bool | np.bool_):
            raise ServoError(
                f"JointState.stopped must be True or False, but is {self.stopped!r:.60}; if the "
                "driver does not tell, leave it out"
            )
        for name in ("positions", "velocities"):
            object.__setattr__(self, name, row_of(f"JointState.{name}", getattr(self, name)))


@dataclass(frozen=True, eq=False)
class Clearances:
    """The distances (K,) in metres of K pairs of parts, and their gradients, `slopes` (K, N).

    A gradient is the derivative of a distance by each of the N joints, in metres per radian.
    """

    distances: Floats
    slopes: Floats


class Solid(Protocol):
    """The shape of an arm and of its surroundings, for collision avoidance."""

    def clearances(self, positions: Floats, within: float) -> Clearances:
        """Return the distances of parts that are at most `within` from each other."""
        ...


@runtime_checkable
class Shaped(Protocol):
    """An arm that may know its shape; an arm without this member does not."""

    @property
    def solid(self) -> Solid | None:
        """Return the arm's shape, None if it is not known."""
        ...


@runtime_checkable
class Arm(Protocol):
    """An arm that takes joint speeds; positions are (N,) float64 in radians, in order of `joints`.

    The caller calls `command` once per control period; it returns when the next one begins.
    """

    @property
    def joints(self) -> Joints:
        """Return the joints and their limits."""
        ...

    @property
    def eyes(self) -> Eyes | None:
        """Return the joints of the cameras, None if the cameras are fixed to the hand."""
        ...

    @property
    def period_s(self) -> float:
        """Return the control period in seconds."""
        ...

    def state(self) -> JointState:
        """Return the present state of the joints."""
        ...

    def world_from_hand(self, positions: Floats) -> Pose:
        """Return the pose of the hand for these joint positions."""
        ...

    def jacobian(self, positions: Floats) -> Floats:
        """Return (6, N) float64: the hand's velocity, linear and angular in the world, by joint."""
        ...

    def world_from_cameras(self, positions: Floats) -> tuple[Pose, ...]:
        """Return the pose of each camera for these joint positions."""
        ...

    def command(self, velocities: Floats) -> None:
        """Command the joint speeds (N,) in rad/s, and return one control period later.

        Raises:
            ServoError: there are not N velocities, or one of them is not finite.

        """
        ...
