"""Notices joint states that have stopped, and joints that do not move as commanded."""

from math import ceil

import numpy as np

from servoid.pose import Floats
from servoid.servo.arm import JointState
from servoid.servo.keeping.joint_lag import STEP_S, WINDOW, JointLag
from servoid.servo.keeping.limits import JITTER
from servoid.servo.keeping.safety import Reason
from servoid.servo.settings import SafetySettings

_STILL_RAD = 1e-3  # between two states of joints at rest
_SPANS = (10, 40, 160)  # steps over which motions are compared: sudden faults, and slow creeping


class ArmWatch:
    """Decides, once per control period, whether the arm's states show that it obeys.

    States that stop are a fault until they come again. Joints that do not obey are one until
    `resume`, or until the arm reports a stop of its own: joints at rest would show no fault.
    """

    def __init__(
        self, settings: SafetySettings, period_s: float, count: int, reaction_s: float = np.inf
    ) -> None:
        """Take the number of joints, and the lag in s for which their bounds allow."""
        self._stale_s, self._period_s = settings.stale_s, period_s
        self._lag = JointLag(reaction_s)
        self._motions = _Motions(settings, count, self._lag)
        self._stamp_s = -np.inf
        self._repeats = 0  # control periods since the time stamp advanced
        self._disobeys = False

    @property
    def fault(self) -> Reason | None:
        """Return what is wrong with the arm at present, None if nothing is."""
        if self._disobeys:
            return Reason.DISOBEYED
        is_late = self._repeats * self._period_s > self._stale_s
        return Reason.STALE if is_late and self._repeats > 1 else None

    @property
    def late_s(self) -> float:
        """Return the lag in s of joints that are later than their bounds allow, otherwise 0."""
        return self._lag.late_s

    @property
    def limiting(self) -> frozenset[Reason]:
        """Return what is to be told of joints that are late."""
        return frozenset({Reason.LAGGING}) if self._lag.late_s > 0.0 else frozenset()

    def see(self, state: JointState, velocities: Floats) -> bool:
        """Process a finite state, and return whether the hand may move.

        `velocities` (N,) in rad/s are those of the last command, 0 if there is none.
        """
        last_s, self._stamp_s = self._stamp_s, state.time_s
        self._repeats = 0 if state.time_s > last_s else self._repeats + 1
        if state.stopped:  # such an arm may send no newer states
            self._repeats = 0
            self.resume()
            return True
        if self.fault is not None or state.time_s - last_s > self._stale_s + self._period_s:
            self._motions.forget()  # without commands, joints may have come to rest
        if self.fault is None and state.time_s != last_s:
            self._disobeys = not self._motions.agree(state, velocities)
        return self.fault is None

    def resume(self) -> None:
        """Let joints that did not obey move again."""
        self._disobeys = False
        self._motions.forget()


class _Motions:
    """Compares each joint's measured motion with the commanded one over the same time.

    A joint follows its commands with latency and lag. Whatever these are, if they end within
    `joint_lag_s`, its motion over a span is a mean of those that were commanded over spans of the
    same length that ended at most that time ago. So it is between the least and the greatest.
    """

    def __init__(self, settings: SafetySettings, count: int, lag: JointLag) -> None:
        self._count, self._measured = count, lag
        self._off, self._share = settings.joint_off, settings.joint_share
        self._lag = ceil(settings.joint_lag_s / STEP_S)
        self._kept = self._lag + max(_SPANS) + 1
        # Columns: commanded angles, the length of their way, and measured angles.
        self._rows = np.zeros((2 * self._kept, 3 * count))
        self._end = self._known = 0
        self._row: Floats | None = None
        self._positions: Floats | None = None  # of the last state
        self._time_s = self._next_s = 0.0

    def forget(self) -> None:
        """Begin anew with the next state."""
        self._row = None

    def agree(self, state: JointState, velocities: Floats) -> bool:
        """Process a newer state and the speeds (N,) commanded until then; judge the motions."""
        last, elapsed_s = self._row, state.time_s - self._time_s
        before, self._time_s, self._positions = self._positions, state.time_s, state.positions
        if last is None or not 0.0 < elapsed_s < self._kept * STEP_S:
            self._begin(state, state.positions if before is None else before)
            return True
        way = elapsed_s * velocities
        went = state.positions - last[2 * self._count :]
        went -= 2.0 * np.pi * np.rint(went / (2.0 * np.pi))  # where an encoder begins anew
        change = np.concatenate([way, np.abs(way), went])
        self._row = last + change
        agrees = True
        while self._next_s <= state.time_s:
            self._keep(self._row - (state.time_s - self._next_s) / elapsed_s * change)
            self._next_s += STEP_S
            agrees = agrees and self._judge()
            self._measure()
        return agrees

    def _begin(self, state: JointState, before: Floats) -> None:
        """Begin at a state; joints that rest where they were before count as having rested."""
        self._row = np.concatenate([np.zeros(2 * self._count), state.positions])
        self._rows[: self._kept] = self._row
        self._end = self._kept
        rests = np.abs(state.velocities).max() <= JITTER
        # An arm that measures no speeds returns zeros.
        rests = rests and np.abs(state.positions - before).max() <= _STILL_RAD
        self._known = self._kept if rests else 1
        self._next_s = state.time_s + STEP_S

    def _keep(self, row: Floats) -> None:
        if self._end == len(self._rows):
            self._rows[: self._kept] = self._rows[-self._kept :]
            self._end = self._kept
        self._rows[self._end] = row
        self._end += 1
        self._known = min(self._known + 1, self._kept)

    def _measure(self) -> None:
        """Measure the lag of the joints by the newest rows."""
        end, count = self._end, self._count
        first = end - 1 - WINDOW
        if self._known > self._lag + WINDOW:
            commanded = self._rows[first - self._lag : end, :count]
            self._measured.see(commanded, self._rows[first:end, 2 * count :])

    def _judge(self) -> bool:
        """Return whether all joints moved as commanded until the newest row."""
        end, count, rows = self._end, self._count, self._rows
        first = end - 1 - self._lag
        for span in _SPANS:
            if self._known <= self._lag + span:
                break
            told = rows[first:end, : 2 * count] - rows[first - span : end - span, : 2 * count]
            most, least = told.max(axis=0), told[:, :count].min(axis=0)
            went = rows[end - 1, 2 * count :] - rows[end - 1 - span, 2 * count :]
            off = np.maximum(went - most[:count], least - went) - self._share * most[count:]
            if off.max() > self._off:
                return False
        return True
