"""What an arm must be able to do to be servoed, simulated or real."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from servoid.errors import ServoError
from servoid.pose import Pose
from servoid.words import counted

Floats = NDArray[np.float64]


def _row(what: str, given: object, count: int | None = None) -> Floats:
    """Take a row of numbers, one for each joint where it is known how many there are."""
    try:
        numbers = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ServoError(f"{what} must be a row of numbers, but is {given!r:.60}") from error
    if numbers.ndim != 1 or count not in (None, len(numbers)):
        expected = (
            "a row of numbers"
            if count is None
            else f"{counted(count, 'number')}, one for each name"
        )
        raise ServoError(f"{what} must be {expected}, but has shape {numbers.shape}")
    return numbers


@dataclass(frozen=True, eq=False)
class Joints:
    """The N joints of an arm and its eyes, with what each may do.

    All are rows of N numbers, kept as (N,) float64: `lower` and `upper` bound the angles in
    radians, `speed` is in rad/s, `acceleration` in rad/s² and `jerk`, if the arm says it, in
    rad/s³. The first `hand_count` joints move the hand, the rest the eyes.

    Raises:
        ServoError: a row has not one number for each name.

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
                object.__setattr__(self, name, _row(f"Joints.{name}", given, len(self.names)))


@dataclass(frozen=True)
class Eyes:
    """Two eyes that share a tilt and have a pan each; their head is fixed to the hand.

    The head's frame is like a camera's: x right, y down, z forward; the eyes sit at x = -l and
    x = l, where l is `half_baseline` in metres. A positive tilt looks down, about -x; a positive
    pan looks right, about y as the tilt has left it. The numbers are places in `Joints`.
    """

    hand_from_head: Pose
    half_baseline: float
    tilt: int
    pan_left: int
    pan_right: int


@dataclass(frozen=True, eq=False)
class JointState:
    """What the joints' sensors say: angles (N,) in radians, speeds (N,) in rad/s, and when.

    `stopped` says that the arm's own driver has brought it to a protective stop, in which commands
    do nothing until somebody resets it.

    Raises:
        ServoError: something else than a row of numbers was given.

    """

    time_s: float
    positions: Floats
    velocities: Floats
    stopped: bool = False

    def __post_init__(self) -> None:
        for name in ("positions", "velocities"):
            object.__setattr__(self, name, _row(f"JointState.{name}", getattr(self, name)))


@dataclass(frozen=True, eq=False)
class Clearances:
    """How far K pairs of parts are apart: distances (K,) in metres, and their slopes (K, N).

    A slope says by how much a distance grows with each of the N joints, in metres per radian.
    """

    distances: Floats
    slopes: Floats


class Solid(Protocol):
    """What an arm may tell of its own shape and of what stands around it."""

    def clearances(self, positions: Floats, within: float) -> Clearances:
        """Return the distances of parts that are no farther than `within` from each other."""
        ...


@runtime_checkable
class Shaped(Protocol):
    """An arm that may know its shape; one that has no such member does not."""

    @property
    def solid(self) -> Solid | None:
        """Return what knows the arm's shape, None if nothing does."""
        ...


@runtime_checkable
class Arm(Protocol):
    """An arm that takes joint speeds; positions are (N,) float64 in radians, in order of `joints`.

    Whoever drives it calls `command` once a control period; it returns when the next one begins.
    """

    @property
    def joints(self) -> Joints:
        """Return the joints and their limits."""
        ...

    @property
    def eyes(self) -> Eyes | None:
        """Return how the eyes turn, None if the cameras are fixed to the hand."""
        ...

    @property
    def period_s(self) -> float:
        """Return the control period in seconds."""
        ...

    def state(self) -> JointState:
        """Return what the joints do now."""
        ...

    def world_from_hand(self, positions: Floats) -> Pose:
        """Return where the hand is with the joints at these positions."""
        ...

    def jacobian(self, positions: Floats) -> Floats:
        """Return (6, N) float64: the hand's velocity, linear and angular in the world, by joint."""
        ...

    def world_from_cameras(self, positions: Floats) -> tuple[Pose, ...]:
        """Return where each camera is with the joints at these positions."""
        ...

    def command(self, velocities: Floats) -> None:
        """Have the joints turn at (N,) rad/s, and return one control period later.

        Raises:
            ServoError: there are not N velocities, or one of them is no number.

        """
        ...
