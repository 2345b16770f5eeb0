"""Confirms measured joint speeds before a command relies on them."""

import numpy as np

from servoid.servo.arm import Joints, JointState
from servoid.servo.keeping.limits import JITTER

_LEAST_PERIODS = 0.5  # between two states, below which their positions tell no speed


class Confirming:
    """Compares measured speeds with the change of the positions, until both agree once.

    Without an earlier command, the next one continues from the measured speeds. If they were wrong,
    joints at rest would be commanded to move.
    """

    def __init__(self, joints: Joints, period_s: float) -> None:
        self._acceleration, self._period_s = joints.acceleration, period_s
        self._last: JointState | None = None
        self._is_confirmed = False

    def see(self, state: JointState, *, anew: bool) -> bool:
        """Process a state, and return whether its speeds may be relied on.

        `anew` is true if there is no recent command. Speeds as low as those of a joint at rest need
        no confirmation.
        """
        last, self._last = self._last, state
        if anew or not self._is_confirmed:
            low = bool(np.all(np.abs(state.velocities) <= JITTER))
            self._is_confirmed = low or (last is not None and self._agrees(last, state))
        return self._is_confirmed

    def _agrees(self, last: JointState, state: JointState) -> bool:
        elapsed_s = state.time_s - last.time_s
        if elapsed_s < _LEAST_PERIODS * self._period_s:
            return False
        mean = (state.positions - last.positions) / elapsed_s
        # Joints may have accelerated between the two states.
        off = JITTER + self._acceleration * min(elapsed_s, self._period_s)
        return bool(np.all(np.abs(state.velocities - mean) <= off))
