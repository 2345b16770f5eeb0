"""An arm that is driven over a socket, as the loop uses it."""

import time
from typing import Protocol

import numpy as np

from servoid.errors import ServoError
from servoid.pose import Floats, Pose
from servoid.servo.arm import Eyes, Joints, JointState, Shaped, Solid
from servoid.servo.link.driver import Driver
from servoid.servo.link.lines import Address
from servoid.servo.link.messages import MotionCommand, State
from servoid.servo.link.settings import LinkSettings
from servoid.servo.link.stopping import StoppingTrajectory


class ArmModel(Protocol):
    """The geometry of an arm; every `Arm` has it."""

    @property
    def joints(self) -> Joints:
        """Return the joints and their limits."""
        ...

    @property
    def eyes(self) -> Eyes | None:
        """Return the joints of the cameras, None if the cameras are fixed to the hand."""
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


class LinkedArm:
    """Implements `Arm` over a socket to its driver; a context manager, in which the arm may move.

    Each command is a motion that ends at rest, so that the arm stops without further commands. The
    joints' limits are those of the driver. After the driver has ended a session, the arm moves
    again only after another `start`.
    """

    def __init__(
        self,
        model: ArmModel,
        address: Address,
        settings: LinkSettings | None = None,
        *,
        period_s: float = 0.008,
    ) -> None:
        """Connect to the driver at an address, without moving.

        Raises:
            ServoError: no driver answers, it is busy, or it drives other joints than the model's,
                or in longer periods.

        """
        self._model, self._settings, self._period_s = model, settings or LinkSettings(), period_s
        self._driver = Driver(address, self._settings)
        try:
            self._joints = _joints(self._driver, model, period_s)
        except ServoError:
            self._driver.close()
            raise
        self._slack_s = 0.5 * self._driver.welcome.period_s
        self._session, self._number = "", 0

    def __enter__(self) -> "LinkedArm":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def joints(self) -> Joints:
        """Return the joints and their limits."""
        return self._joints

    @property
    def eyes(self) -> Eyes | None:
        """Return the joints of the cameras, None if the cameras are fixed to the hand."""
        return self._model.eyes

    @property
    def solid(self) -> Solid | None:
        """Return the arm's shape, None if the model has none."""
        return self._model.solid if isinstance(self._model, Shaped) else None

    @property
    def period_s(self) -> float:
        """Return the control period in seconds."""
        return self._period_s

    @property
    def last_state(self) -> State:
        """Return the driver's last state."""
        return self._driver.received.state

    def world_from_hand(self, positions: Floats) -> Pose:
        """Return the pose of the hand for these joint positions."""
        return self._model.world_from_hand(positions)

    def jacobian(self, positions: Floats) -> Floats:
        """Return (6, N) float64: the hand's velocity, linear and angular in the world, by joint."""
        return self._model.jacobian(positions)

    def world_from_cameras(self, positions: Floats) -> tuple[Pose, ...]:
        """Return the pose of each camera for these joint positions."""
        return self._model.world_from_cameras(positions)

    def now_s(self) -> float:
        """Return the time of the driver's clock, for stamping images; thread-safe."""
        received = self._driver.received
        return _number(received.state.time_s) + time.monotonic() - received.read_s

    def start(self) -> None:
        """Let the arm move, once its joints are at rest.

        Raises:
            ServoError: the driver does not start in time, or is gone.

        """
        self._session, self._number = self._driver.start(), 0

    def state(self) -> JointState:
        """Return the present state of the joints.

        Raises:
            ServoError: the connection is closed.

        """
        state = self._driver.newest().state
        return JointState(
            _number(state.time_s),
            _numbers(state.positions),
            _numbers(state.velocities),
            state.stopped,
        )

    def command(self, velocities: Floats) -> None:
        """Command the joint speeds (N,) in rad/s; without another command, the joints come to rest.

        It returns one control period, by the driver's clock, after the state that was read last.

        Raises:
            ServoError: there are not N velocities, or one of them is not finite; the arm was not
                started, the driver ended the session, is silent, or is gone.

        """
        wanted = np.asarray(velocities, dtype=np.float64)
        speed = self._joints.speed
        if wanted.shape != speed.shape or not np.all(np.isfinite(wanted)):
            raise ServoError(f"{len(speed)} finite joint speeds are needed, but got {velocities}")
        state = self.last_state
        self._check_session(state)
        stamp_s = _number(state.time_s)
        self._driver.send(self._message(np.clip(wanted, -speed, speed), stamp_s))
        # Never sooner: the next command may differ from this one by a period's acceleration.
        begun = time.monotonic()
        while _number(self.last_state.time_s) < stamp_s + self._period_s - self._slack_s:
            self._driver.listen()
            if time.monotonic() - begun > self._period_s + self._settings.silence_s:
                raise ServoError(
                    f"the arm's driver at {self._driver.place} sends states, but its clock does "
                    f"not advance from {stamp_s:g} s; the arm comes to rest"
                )

    def close(self) -> None:
        """Close the connection; the present motion is completed."""
        self._driver.close()

    def _message(self, velocities: Floats, stamp_s: float) -> MotionCommand:
        motion = StoppingTrajectory.after(velocities, self._joints, self._settings)
        self._number += 1
        return MotionCommand(
            session=self._session,
            number=self._number,
            stamp_s=stamp_s,
            times_s=motion.times_s.tolist(),
            speeds=motion.speeds.tolist(),
        )

    def _check_session(self, state: State) -> None:
        if not self._session:
            raise ServoError("the arm was not started; enter its context, or call start()")
        if state.session != self._session:
            raise ServoError(
                f"the arm's driver has ended the session: {state.ended or 'it was restarted'}; "
                "the arm comes to rest, and moves again after another start()"
            )


def _joints(driver: Driver, model: ArmModel, period_s: float) -> Joints:
    """Return the driver's joints, and check that they are those of the model."""
    welcome, joints = driver.welcome, model.joints
    if tuple(welcome.names) != joints.names or welcome.hand_count != joints.hand_count:
        raise ServoError(
            f"the arm's driver at {driver.place} drives the joints {', '.join(welcome.names)}, of "
            f"which {welcome.hand_count} move the hand; the model has {', '.join(joints.names)} "
            f"and {joints.hand_count}"
        )
    if not period_s >= welcome.period_s:
        raise ServoError(
            f"a control period of {period_s:g} s was asked for, but the arm's driver at "
            f"{driver.place} has one of {welcome.period_s:g} s; give no shorter one"
        )
    limits = (welcome.lower, welcome.upper, welcome.speed, welcome.acceleration)
    jerk = joints.jerk if welcome.jerk is None else np.array(welcome.jerk)
    bounds = (np.array(values) for values in limits)
    return Joints(joints.names, joints.hand_count, *bounds, jerk=jerk)


def _number(value: float | None) -> float:
    return np.nan if value is None else value


def _numbers(values: list[float | None]) -> Floats:
    return np.array([_number(value) for value in values])
