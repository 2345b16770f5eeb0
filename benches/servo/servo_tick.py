"""Time one control tick, without images and tracking, while the hand follows a moving target.

Wall time is what a loop on this machine would see, including all other programs; CPU time is what
the tick itself needs. The target is 1 ms.
"""

import time
from dataclasses import dataclass

import numpy as np

from servoid.pose import Pose
from servoid.servo import Controller, JointLaw, ServoSettings
from servoid.servo.settings import JointSettings
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm

SECONDS = 20.0
RATE_HZ = 30.0
GOAL_FROM_OBJECT = Pose.from_parts([0.0, -0.09, 0.545], [1.0, 0.0, 0.0, 0.0])


@dataclass
class Seen:
    """An estimate of the target."""

    time_s: float
    world_from_object: Pose
    covariance: np.ndarray
    unobservable: np.ndarray
    confidence: float = 0.9
    status: str = "tracking"
    located: bool = True


def seen_at(start: Pose, time_s: float) -> Seen:
    """Return the pose of the paper's moving target."""
    shift = 0.15 - 0.15 * np.cos(0.628 * time_s)
    moved = Pose.from_parts([shift, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])
    return Seen(
        time_s, start @ moved, np.diag(np.square(np.repeat([0.0005, 0.005], 3))), np.empty((0, 6))
    )


def measure(law: JointLaw) -> np.ndarray:
    """Return (2, n) microseconds of each tick, as wall time and as CPU time."""
    arm = SerialArm(read_arm())
    controller = Controller(arm, ServoSettings(joints=JointSettings(law=law)))
    start = arm.world_from_hand(arm.state().positions) @ GOAL_FROM_OBJECT
    ticks, seen = [], 0
    while arm.time_s < SECONDS:
        if seen / RATE_HZ <= arm.time_s:
            controller.see(None, seen_at(start, seen / RATE_HZ))
            seen += 1
        state = arm.state()
        wall, processor = time.perf_counter(), time.thread_time()
        command = controller.command(state, GOAL_FROM_OBJECT)
        spent = time.perf_counter() - wall, time.thread_time() - processor
        ticks.append(spent)
        arm.command(command.velocities)
    return 1e6 * np.array(ticks).T


def main() -> None:
    """Print one row per law."""
    print("law    ticks  wall p50   p99 us  processor p50   p99 us")
    for law in JointLaw:
        wall, processor = measure(law)
        row = [*np.percentile(wall, (50, 99)), *np.percentile(processor, (50, 99))]
        cells = "  ".join(f"{value:8.0f}" for value in row)
        print(f"{law.value:5s}  {len(wall):5d}  {cells}")


if __name__ == "__main__":
    main()
