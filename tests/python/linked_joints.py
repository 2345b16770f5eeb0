"""The joints' side of the link without sockets: a receiver, simulated joints, and their steps."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from servoid.servo import JointState
from servoid.servo.link import (
    CommandReceiver,
    LinkSettings,
    MotionCommand,
    Refusal,
    Start,
    StoppingTrajectory,
)
from servoid.sim.arm_file import read_arm
from servoid.sim.joint_driver import PERIOD_S
from servoid.sim.serial_arm import SerialArm

Floats = NDArray[np.float64]
SETTINGS = LinkSettings()


@dataclass
class Bench:
    """Steps a receiver and its joints; keeps what the joints were told, (steps, N)."""

    settings: LinkSettings = SETTINGS
    number: int = 0
    told: list[Floats] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.arm = SerialArm(read_arm(), PERIOD_S)
        self.joints = self.arm.joints
        self.receiver = CommandReceiver(self.joints, PERIOD_S, self.settings)

    @property
    def state(self) -> JointState:
        return self.arm.state()

    def start(self) -> Refusal | None:
        return self.receiver.take(Start(self.receiver.session), self.state)

    def motion(self, share: float | Floats) -> StoppingTrajectory:
        """Make a motion at a share of the joints' fastest speeds."""
        return StoppingTrajectory.after(share * self.joints.speed, self.joints, self.settings)

    def command(self, motion: StoppingTrajectory, **changes: object) -> MotionCommand:
        """Make the next command, as a loop would that saw the joints just now."""
        self.number += 1
        values = {
            "session": self.receiver.session,
            "number": self.number,
            "stamp_s": self.state.time_s,
            "times_s": motion.times_s.tolist(),
            "speeds": motion.speeds.tolist(),
        }
        return MotionCommand(**(values | changes))  # type: ignore[arg-type]

    def take(self, share: float | Floats, **changes: object) -> Refusal | None:
        return self.receiver.take(self.command(self.motion(share), **changes), self.state)

    def step(self, seconds: float = PERIOD_S) -> None:
        for _ in range(round(seconds / PERIOD_S)):
            self.told.append(self.receiver.speeds(self.state))
            self.arm.command(self.told[-1])

    def drive(self, share: float | Floats, seconds: float, every_s: float = 0.008) -> None:
        """Command the same speeds again and again."""
        for _ in range(round(seconds / every_s)):
            assert self.take(share) is None
            self.step(every_s)

    def broken_limits(self) -> list[str]:
        told = np.array([np.zeros(len(self.joints.names)), *self.told])
        slopes = np.abs(np.diff(told, axis=0)) / PERIOD_S
        wrong = {
            "speed": np.any(np.abs(told) > self.joints.speed),
            "acceleration": np.any(slopes > self.joints.acceleration * (1 + 1e-9)),
            "number": not np.all(np.isfinite(told)),
        }
        return [name for name, is_wrong in wrong.items() if is_wrong]
