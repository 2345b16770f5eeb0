"""A closed loop without images: a serial arm, a controller, and estimates that a test makes up."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from fake_tracker import FakeEstimate
from numpy.typing import NDArray

from servoid.pose import Pose
from servoid.servo import Command, Controller, JointState, ServoSettings
from servoid.servo.moving import change_between, shifted_and_turned
from servoid.servo.settings import HandSettings
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid.source.source import Instant

Floats = NDArray[np.float64]
Path = Callable[[float], Pose]
Seen = tuple[Instant | None, FakeEstimate | None]

GOAL_FROM_OBJECT = Pose.from_parts([0.0, -0.09, 0.545], [1.0, 0.0, 0.0, 0.0])  # Eq. (20)
WORLD_FROM_START = Pose.from_parts([-0.89, 0.0, 0.5], [0.5, -0.5, -0.5, 0.5])  # Eq. (17)
WORLD_FROM_OBJECT = WORLD_FROM_START @ GOAL_FROM_OBJECT
RATE_HZ = 30.0
LATENCY_S = 0.05
PERIOD_S = 0.016  # twice as long as the arm's own, so that tests take half the time


def still(pose: Pose) -> Path:
    return lambda _: pose


def to_and_fro(period_s: float) -> Path:
    """Make the paper's path of Eq. (19)."""
    pulse = 2.0 * np.pi / period_s
    identity = [1.0, 0.0, 0.0, 0.0]
    return lambda time_s: (
        WORLD_FROM_OBJECT
        @ Pose.from_parts([0.15 - 0.15 * np.cos(pulse * time_s), 0.0, 0.0], identity)
    )


def goal_at(offset: Floats) -> Pose:
    """Put the object so that the hand's goal is off its start by a shift and a turn (6,)."""
    return shifted_and_turned(WORLD_FROM_START, offset) @ GOAL_FROM_OBJECT


@dataclass
class Tick:
    """What was at one tick; `error` (6,) leads from the goal to the hand, in the world."""

    time_s: float
    state: JointState
    command: Command
    error: Floats
    hand_twist: Floats
    fixation: float


@dataclass
class Loop:
    """Runs a path of the object before a controller and keeps all ticks."""

    path: Path
    settings: ServoSettings = field(default_factory=ServoSettings)
    positions: Floats | None = None
    spoil: Callable[[Instant, FakeEstimate], Seen] = lambda instant, estimate: (instant, estimate)
    noise: tuple[float, float] = (0.0, 0.0)  # m and rad
    seed: int = 0  # of the noise
    goal: Callable[[float], Pose | None] = lambda _: GOAL_FROM_OBJECT

    def __post_init__(self) -> None:
        positions = None if self.positions is None else self.positions.tolist()
        self.arm = SerialArm(read_arm(), PERIOD_S, positions)
        self.controller = Controller(self.arm, self.settings)
        self.random = np.random.default_rng(self.seed)
        self.taken = 0
        self.on_the_way: list[Seen] = []
        self.ticks: list[Tick] = []

    def run(self, seconds: float) -> list[Tick]:
        end = self.arm.time_s + seconds
        first = len(self.ticks)
        while self.arm.time_s < end:
            self._take_images()
            while self.on_the_way and self._arrives_s() <= self.arm.time_s:
                self.controller.see(*self.spoil(*self.on_the_way.pop(0)))  # type: ignore[arg-type]
            state = self.arm.state()
            command = self.controller.command(state, self.goal(state.time_s))
            self.ticks.append(self._tick(state, command))
            self.arm.command(command.velocities)
        return self.ticks[first:]

    def _arrives_s(self) -> float:
        instant, _ = self.on_the_way[0]
        assert instant is not None
        return instant.time_s + LATENCY_S

    def _take_images(self) -> None:
        while self.taken / RATE_HZ <= self.arm.time_s:
            time_s = self.taken / RATE_HZ
            image = self.random.integers(0, 255, (8, 8, 3)).astype(np.uint8)
            cameras = self.arm.world_from_cameras(self.arm.state().positions)
            noise = self.random.normal(size=6) * np.repeat(self.noise, 3)
            pose = shifted_and_turned(self.path(time_s), noise)
            estimate = FakeEstimate(time_s, pose, confidence=1.0)
            estimate.covariance = np.diag(np.square(np.repeat(self.noise, 3)))
            instant = Instant(self.taken, time_s, cameras, (image, image))
            self.on_the_way.append((instant, estimate))
            self.taken += 1

    def _tick(self, state: JointState, command: Command) -> Tick:
        true_object = self.path(state.time_s)
        goal = self.goal(state.time_s) or GOAL_FROM_OBJECT
        hand = self.arm.world_from_hand(state.positions)
        seen = [
            (pose.inverse() @ true_object).translation
            for pose in self.arm.world_from_cameras(state.positions)
        ]
        return Tick(
            state.time_s,
            state,
            command,
            change_between(true_object @ goal.inverse(), hand),
            self.arm.jacobian(state.positions) @ state.velocities,
            max(float(np.arctan2(np.hypot(x, y), z)) for x, y, z in seen),
        )


def position_errors(ticks: list[Tick]) -> Floats:
    """Return (n,) metres between hand and goal."""
    return np.array([np.linalg.norm(tick.error[:3]) for tick in ticks])


def turn_errors(ticks: list[Tick]) -> Floats:
    """Return (n,) radians between hand and goal."""
    return np.array([np.linalg.norm(tick.error[3:]) for tick in ticks])


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def broken_limits(loop: Loop) -> list[str]:
    """Say which limits of the joints the commands or the joints themselves broke."""
    joints, period_s = loop.arm.joints, loop.arm.period_s
    commands = np.array([tick.command.velocities for tick in loop.ticks])
    positions = np.array([tick.state.positions for tick in loop.ticks])
    changes = np.diff(commands, axis=0, prepend=np.zeros((1, commands.shape[1])))
    steps = np.abs(changes) / period_s
    asked = loop.settings.joints
    jerk = asked.acceleration_share * joints.acceleration / asked.ramp_s
    jerks = np.abs(np.diff(changes / period_s, axis=0)) / period_s
    wrong = {
        "jerk": np.any(jerks > jerk * (1.0 + 1e-6)),
        "speed": np.any(np.abs(commands) > joints.speed),
        "acceleration": np.any(steps > joints.acceleration * (1.0 + 1e-9)),
        "position": np.any((positions <= joints.lower) | (positions >= joints.upper)),
        "number": not np.all(np.isfinite(commands)),
    }
    return [name for name, broken in wrong.items() if broken]


def hand_shares_of(told: Floats, went: Floats, period_s: float) -> dict[str, float]:
    """Return the greatest shares of the hand's limits that its velocities (T, 6) made use of.

    They are those of commands, and those with which it went.
    """
    hand = HandSettings()
    speeds = np.array([hand.linear_speed, hand.angular_speed])
    accelerations = np.array([hand.linear_acceleration, hand.angular_acceleration])
    found = {}
    for name, twists in (("told", told.reshape(-1, 2, 3)), ("went", went.reshape(-1, 2, 3))):
        changes = np.diff(twists, axis=0, prepend=np.zeros((1, 2, 3))) / period_s
        found[f"{name} speed"] = float((np.linalg.norm(twists, axis=2) / speeds).max())
        found[f"{name} acceleration"] = float(
            (np.linalg.norm(changes, axis=2) / accelerations).max()
        )
    return found
