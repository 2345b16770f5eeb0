"""An arm that records its recent states, for cameras on it whose images arrive later."""

from collections import deque
from threading import Lock

import numpy as np

from servoid.errors import ServoError
from servoid.pose import Floats, Pose
from servoid.servo.arguments import check_state
from servoid.servo.arm import Arm, Eyes, Joints, JointState, Shaped, Solid


class RememberingArm:
    """Wraps another arm, and records the states that were read from it.

    `world_from_cameras_at` gives a source of images the past poses of its cameras. A source may
    call it from another thread: calls to the arm's geometry are serialised.
    """

    def __init__(self, arm: Arm, seconds: float = 2.0) -> None:
        """Wrap an arm; states older than `seconds` are dropped.

        Raises:
            ServoError: the arm's state is none of its joints, or it does not know their positions.

        """
        self._arm, self._seconds = arm, seconds
        self._states: deque[JointState] = deque()
        self._lock, self._geometry = Lock(), Lock()
        self.state()
        if not self._states:
            raise ServoError(
                "the arm's state holds numbers that are not finite; wait until its sensors answer"
            )

    @property
    def joints(self) -> Joints:
        """Return the joints and their limits."""
        return self._arm.joints

    @property
    def eyes(self) -> Eyes | None:
        """Return the joints of the cameras, None if the cameras are fixed to the hand."""
        return self._arm.eyes

    @property
    def solid(self) -> Solid | None:
        """Return the arm's shape, None if it is not known."""
        return self._arm.solid if isinstance(self._arm, Shaped) else None

    @property
    def period_s(self) -> float:
        """Return the control period in seconds."""
        return self._arm.period_s

    def state(self) -> JointState:
        """Return the present state of the joints, and record it.

        Raises:
            ServoError: it is none of the arm's joints.

        """
        state = self._arm.state()
        check_state(state, self._arm.joints)
        with self._lock:
            self._remember(state)
        return state

    def _remember(self, state: JointState) -> None:
        finite = np.isfinite([state.time_s, *state.positions]).all()
        if finite and self._states and state.time_s < self._states[-1].time_s:
            self._states.clear()  # the arm's clock was restarted
        if finite and (not self._states or state.time_s > self._states[-1].time_s):
            self._states.append(state)
            while state.time_s - self._states[0].time_s > self._seconds:
                self._states.popleft()

    def world_from_hand(self, positions: Floats) -> Pose:
        """Return the pose of the hand for these joint positions."""
        with self._geometry:
            return self._arm.world_from_hand(positions)

    def jacobian(self, positions: Floats) -> Floats:
        """Return (6, N) float64: the hand's velocity, linear and angular in the world, by joint."""
        with self._geometry:
            return self._arm.jacobian(positions)

    def world_from_cameras(self, positions: Floats) -> tuple[Pose, ...]:
        """Return the pose of each camera for these joint positions."""
        with self._geometry:
            return self._arm.world_from_cameras(positions)

    def command(self, velocities: Floats) -> None:
        """Command the joint speeds (N,) in rad/s, and return one control period later.

        Raises:
            ServoError: there are not N velocities, or one of them is not finite.

        """
        self._arm.command(velocities)

    def positions_at(self, time_s: float) -> Floats:
        """Return interpolated joint positions (N,) at a time.

        Before the first recorded state and after the last, the joints are assumed to be at rest.
        """
        with self._lock:
            states = tuple(self._states)
        times = [state.time_s for state in states]
        after = int(np.searchsorted(times, time_s))
        if after in (0, len(times)):
            return states[min(after, len(times) - 1)].positions.copy()
        earlier, later = states[after - 1], states[after]
        share = (time_s - earlier.time_s) / (later.time_s - earlier.time_s)
        return earlier.positions + share * (later.positions - earlier.positions)

    def world_from_cameras_at(self, time_s: float) -> tuple[Pose, ...]:
        """Return the pose of each camera at a time of the arm's clock."""
        return self.world_from_cameras(self.positions_at(time_s))
