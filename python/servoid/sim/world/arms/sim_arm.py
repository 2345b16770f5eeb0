"""An arm in a simulated world, with the interface of a real one."""

from collections.abc import Callable

import numpy as np

from servoid.errors import ServoError
from servoid.pose import Floats, Pose
from servoid.servo import Eyes, Joints, JointState, Solid
from servoid.sim.world.arms.calibration import Calibration
from servoid.sim.world.arms.encoders import Encoders
from servoid.sim.world.arms.kinematics import Kinematics
from servoid.sim.world.arms.protective_stop import ProtectiveStop

_AT_REST = 0.02  # rad/s, above the encoders' noise of a joint at rest


class SimArm:
    """Implements `servoid.servo.Arm`; only a command advances the world's time.

    Simulated time is independent of wall-clock time. Its state is that of a robot's software: from
    its encoders and its calibration.
    """

    def __init__(
        self,
        kinematics: Kinematics,
        calibration: Calibration,
        encoders: Encoders,
        period_s: float,
        advance: Callable[[Floats], None],
        solid: Solid,
        protection: ProtectiveStop,
    ) -> None:
        self._kinematics, self._calibration, self._encoders = kinematics, calibration, encoders
        self._period_s, self._advance = period_s, advance
        self._solid, self._protection = solid, protection

    @property
    def joints(self) -> Joints:
        """Return the joints and their limits."""
        return self._kinematics.joints

    @property
    def eyes(self) -> Eyes | None:
        """Return the joints of the cameras, None if the cameras are fixed to the hand."""
        return self._calibration.eyes

    @property
    def solid(self) -> Solid:
        """Return the shapes of the arm and of its room."""
        return self._solid

    @property
    def period_s(self) -> float:
        """Return the control period in seconds."""
        return self._period_s

    def state(self) -> JointState:
        """Return the present state of the joints, from their encoders."""
        return self._encoders.state()

    def world_from_hand(self, positions: Floats) -> Pose:
        """Return the pose of the hand for these joint positions."""
        return self._kinematics.world_from_hand(self._checked(positions, "angles"))

    def jacobian(self, positions: Floats) -> Floats:
        """Return (6, N) float64: the hand's velocity, linear and angular in the world, by joint."""
        return self._kinematics.jacobian(self._checked(positions, "angles"))

    def world_from_cameras(self, positions: Floats) -> tuple[Pose, ...]:
        """Return the calibrated pose of each camera for these joint positions."""
        return self._calibration.world_from_eyes(self._checked(positions, "angles"))

    def command(self, velocities: Floats) -> None:
        """Command the joint speeds (N,) in rad/s, and return one control period later.

        Raises:
            ServoError: there are not N velocities, or one of them is not finite.
            SimError: the simulated physics became unstable; from then on the arm rests.

        """
        self._advance(self._checked(velocities, "speeds"))

    def reset(self) -> None:
        """Let the arm move again after a protective stop; a persisting contact stops it again.

        Raises:
            ServoError: it is not at rest yet.

        """
        fastest = float(np.abs(self._encoders.state().velocities).max())
        if fastest > _AT_REST:
            raise ServoError(
                f"a joint still moves at {fastest:.3g} rad/s; reset the arm when all are below "
                f"{_AT_REST:g} rad/s"
            )
        self._protection.reset()

    def _checked(self, values: Floats, what: str) -> Floats:
        values = np.asarray(values, dtype=np.float64)
        names = self.joints.names
        needed = f"{len(names)} finite joint {what} are needed, one for each of {', '.join(names)}"
        if values.shape != (len(names),):
            raise ServoError(f"{needed}; the array given has shape {values.shape}")
        if not np.isfinite(values).all():
            wrong = int(np.argmin(np.isfinite(values)))
            raise ServoError(f"{needed}; that of {names[wrong]} is {values[wrong]}")
        return values
