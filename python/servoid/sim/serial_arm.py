"""An arm without physics: a chain of joints with lagging speed servos, and a camera head."""

from collections.abc import Sequence

import numpy as np

from servoid._native import Chain
from servoid.errors import ServoError, SimError
from servoid.pose import Floats, Pose, exact
from servoid.servo import Eyes, Joints, JointState, reached
from servoid.sim.arm_file import ArmFile
from servoid.words import counted

_ODD = slice(0, None, 2)


class SerialArm:
    """An `Arm` of a chain by modified Denavit-Hartenberg parameters; its base is the world.

    The joints' speeds answer commands with a first-order lag within speed and acceleration limits,
    and are integrated exactly. It has a clock of its own: each command lasts one period.
    """

    def __init__(
        self, arm: ArmFile, period_s: float = 0.008, positions: Sequence[float] | None = None
    ) -> None:
        """Put the arm at `positions` in radians, or with its hand where the file starts it.

        Raises:
            SimError: the period is not positive, the file's lists do not fit each other, or the
                start cannot be reached.

        """
        if not period_s > 0:
            raise SimError(f"the control period is {period_s} s; it must be positive")
        self._period_s = period_s
        self._joints = _joints(arm)
        self._eyes = _eyes(arm)
        count = self._joints.hand_count
        self._lag_s = np.repeat([arm.joints.lag_s, arm.eyes.lag_s], [count, len(arm.eyes.names)])
        self._chain = Chain(_links(arm), _pose(arm.hand.flange_from_hand))
        self._time_s = 0.0
        size = len(self._joints.names)
        self._velocities = np.zeros(size)
        self._positions = np.zeros(size)
        start = self._start(arm) if positions is None else np.asarray(positions, dtype=np.float64)
        if start.shape != (size,) or not np.all(np.isfinite(start)):
            raise SimError(f"{size} finite joint angles are needed, but got {positions}")
        self._positions = np.clip(start, self._joints.lower, self._joints.upper)

    @property
    def joints(self) -> Joints:
        """Return the joints and their limits."""
        return self._joints

    @property
    def eyes(self) -> Eyes | None:
        """Return the joints of the cameras."""
        return self._eyes

    @property
    def period_s(self) -> float:
        """Return the control period in seconds."""
        return self._period_s

    @property
    def time_s(self) -> float:
        """Return the time on the arm's own clock in seconds, 0 at the start."""
        return self._time_s

    def state(self) -> JointState:
        """Return the present state of the joints."""
        return JointState(self._time_s, self._positions.copy(), self._velocities.copy())

    def world_from_hand(self, positions: Floats) -> Pose:
        """Return the pose of the hand for these joint positions."""
        return self._chain.world_from_hand(positions)

    def jacobian(self, positions: Floats) -> Floats:
        """Return (6, N) float64: the hand's velocity, linear and angular in the world, by joint."""
        return self._chain.jacobian(positions)

    def world_from_cameras(self, positions: Floats) -> tuple[Pose, ...]:
        """Return the poses of the left and the right camera for these joint positions."""
        eyes = self._eyes
        world_from_tilted = (
            self.world_from_hand(positions)
            @ eyes.hand_from_head
            @ Pose.exp([0.0, 0.0, 0.0, -positions[eyes.tilt], 0.0, 0.0])
        )
        return tuple(
            world_from_tilted
            @ Pose.from_parts([x, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])
            @ Pose.exp([0.0, 0.0, 0.0, 0.0, positions[pan], 0.0])
            for x, pan in (
                (-eyes.half_baseline, eyes.pan_left),
                (eyes.half_baseline, eyes.pan_right),
            )
        )

    def command(self, velocities: Floats) -> None:
        """Command the joint speeds (N,) in rad/s for one control period.

        Raises:
            ServoError: there are not N velocities, or one of them is not finite.

        """
        joints = self._joints
        wanted = np.asarray(velocities, dtype=np.float64)
        if wanted.shape != joints.speed.shape or not np.all(np.isfinite(wanted)):
            raise ServoError(
                f"{len(joints.names)} finite joint speeds are needed, but got {velocities}"
            )
        wanted = np.clip(wanted, -joints.speed, joints.speed)
        travel, speed = _lagged(
            wanted, self._velocities, self._lag_s, joints.acceleration, self._period_s
        )
        reached = self._positions + travel
        self._positions = np.clip(reached, joints.lower, joints.upper)
        self._velocities = np.where(self._positions == reached, speed, 0.0)
        self._time_s += self._period_s

    def _start(self, arm: ArmFile) -> Floats:
        """Solve for the positions of the file's start pose of the hand, with q1 = 0."""
        wanted = _pose(arm.start.world_from_hand)
        for bend in (1.2, -1.2):  # a straight arm is singular
            positions = np.zeros(len(self._joints.names))
            positions[1], positions[3] = -bend / 2.0, bend
            found = reached(self, wanted, positions, slice(1, self._joints.hand_count))
            if found is not None:
                return found
        place = ", ".join(f"{value:g}" for value in wanted.translation)
        raise SimError(
            f"the start pose at ({place}) m cannot be reached with the first joint at 0; "
            "choose another in [start], or give the joints' positions"
        )


def _lagged(
    wanted: Floats, speed: Floats, lag_s: Floats, acceleration: Floats, time_s: float
) -> tuple[Floats, Floats]:
    """Return travel and speed after `time_s` of d speed/dt = clip((wanted - speed) / lag)."""
    gap = wanted - speed
    # A large difference is limited by the acceleration, a small one by the lag.
    ramp = np.clip((np.abs(gap) - acceleration * lag_s) / acceleration, 0.0, time_s)
    slope = np.sign(gap) * acceleration
    after_ramp = speed + slope * ramp
    left = wanted - after_ramp
    rest = time_s - ramp
    faded = left * exact.exp(-rest / lag_s)
    travel = speed * ramp + 0.5 * slope * ramp * ramp + wanted * rest - lag_s * (left - faded)
    return travel, wanted - faded


def _joints(arm: ArmFile) -> Joints:
    """Join the limits of the chain's joints and of the cameras' joints, in radians."""
    parts = (arm.joints, arm.eyes)
    names = tuple(name for part in parts for name in part.names)
    limits = {
        key: np.radians([value for part in parts for value in getattr(part, f"{key}_deg")])
        for key in ("lower", "upper", "speed", "acceleration")
    }
    for key, values in limits.items():
        if len(values) != len(names):
            raise SimError(
                f"{counted(len(names), 'joint is', 'joints are')} named, but {key}_deg has "
                f"{counted(len(values), 'value')}"
            )
    if len(arm.chain.twists_deg) != len(arm.joints.names):
        raise SimError(
            f"{counted(len(arm.joints.names), 'joint is', 'joints are')} named, but twists_deg has "
            f"{counted(len(arm.chain.twists_deg), 'value')}"
        )
    if len(arm.eyes.names) != 3:
        raise SimError(f"a tilt and two pans are needed, but eyes are named {arm.eyes.names}")
    if not (arm.joints.lag_s > 0 and arm.eyes.lag_s > 0):
        raise SimError(f"lag_s is {arm.joints.lag_s} and {arm.eyes.lag_s}; it must be positive")
    return Joints(names, len(arm.joints.names), **limits)


def _eyes(arm: ArmFile) -> Eyes:
    first = len(arm.joints.names)
    return Eyes(Pose.identity(), arm.eyes.half_baseline, first, first + 1, first + 2)


def _links(arm: ArmFile) -> list[tuple[float, float]]:
    """Return the twist in radians and the length in metres of each link; every other has none."""
    twists = np.radians(arm.chain.twists_deg)
    along = np.zeros(len(twists))
    if len(along[_ODD]) != len(arm.lengths):
        raise SimError(f"{len(arm.lengths)} of {counted(len(along[_ODD]), 'length')} were given")
    along[_ODD] = arm.lengths
    return list(zip(twists.tolist(), along.tolist(), strict=True))


def _pose(numbers: Sequence[float]) -> Pose:
    return Pose.from_parts(numbers[4:], numbers[:4])
