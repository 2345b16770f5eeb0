"""The encoders of an arm's joints."""

from servoid.pose import Floats
from servoid.servo import JointState
from servoid.sim.world.arms.joint_servos import JointServos
from servoid.sim.world.lab import Lab


class Encoders:
    """Reads joints with the errors of a laboratory; repeated readings at a time are equal.

    A control period has `steps` physics steps; `hand_count` joints move the hand.
    """

    def __init__(self, servos: JointServos, lab: Lab, steps: int, hand_count: int) -> None:
        self._servos, self._lab, self._steps = servos, lab, steps
        self._count = len(servos.positions)
        self._zeros = lab.zeros(self._count, hand_count)

    def state(self) -> JointState:
        """Return the present state of the joints, with errors."""
        servos, step = self._servos, self._servos.steps
        return JointState(
            servos.time_s,
            self._read(servos.positions, step),
            servos.velocities + self._lab.speed_noise(self._count, step),
            servos.protection.stopped,
        )

    def positions_at(self, time_s: float) -> Floats:
        """Return the measured angles (N,) at a time within the last second.

        Readings once per control period are interpolated linearly.
        """
        servos = self._servos
        if not self._lab.settings.read_once:
            return servos.positions_at(time_s) + self._zeros
        place = time_s / (self._steps * servos.step_s)
        newest = servos.steps // self._steps
        before = min(max(int(place), 0), max(newest - 1, 0))
        share = min(max(place - before, 0.0), 1.0)
        earlier, later = (
            self._read(servos.positions_of(step), step)
            for step in (before * self._steps, min(before + 1, newest) * self._steps)
        )
        return (1.0 - share) * earlier + share * later

    def _read(self, positions: Floats, step: int) -> Floats:
        return positions + self._zeros + self._lab.angle_noise(self._count, step)
