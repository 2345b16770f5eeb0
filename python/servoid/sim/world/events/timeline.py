"""The course of a world over time: the object's motion, the light, and faults."""

import math

import numpy as np

from servoid.pose import Floats, Pose, exact
from servoid.sim.world.events.faults import Occlude, Teleport, is_on
from servoid.sim.world.events.motions import compose, row_of
from servoid.sim.world.events.paths import Path, twist_at
from servoid.sim.world.settings import WorldSettings

_SLIDE_S = 0.3  # in which the board moves in front of the object
_ASIDE = 1.2  # metres from where it starts
_AWAY = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -50.0])  # out of sight


class Timeline:
    """Returns the state at any simulated time; the object rests until its path starts."""

    def __init__(self, settings: WorldSettings, world_from_start: Pose, path: Path) -> None:
        self._settings, self._world_from_start, self._path = settings, world_from_start, path
        self.path_starts_s: float | None = None
        teleports = [one for one in settings.faults if isinstance(one, Teleport)]
        self._leaps = [
            (one.at_s, one.by, Pose.exp([0.0, 0.0, 0.0, *one.turn])) for one in teleports
        ]
        self._last: tuple[float, Pose] | None = None

    def world_from_object_at(self, time_s: float) -> Pose:
        """Return the pose of the object."""
        since = self._since_start(time_s)
        # Cached, as the truth is requested several times for the same time.
        if self._last is not None and self._last[0] == since:
            return self._last[1]
        pose = self._path.start_from_object(since)
        for at_s, by, turn in self._leaps:
            if since >= at_s:
                place = np.add(pose.translation, by)
                pose = Pose.from_parts(place, (turn @ pose).quaternion)
        pose = self._world_from_start @ pose
        self._last = since, pose
        return pose

    def twist_at(self, time_s: float) -> Floats:
        """Return the object's twist (6,) in the world: its origin's and its angular velocity."""
        return twist_at(self.world_from_object_at, time_s)

    def level_at(self, time_s: float) -> float:
        """Return the brightness of the light."""
        light, since = self._settings.light, self._since_start(time_s)
        level = light.level
        if light.step_at_s is not None and since >= light.step_at_s:
            level *= light.step_to
        swing = exact.sin(2.0 * math.pi * max(since, 0.0) / light.swing_period_s)
        return level * (1.0 + light.swing * swing)

    def board_at(self, time_s: float) -> Floats:
        """Return the pose (7,) of the occluding board: before the object, or out of sight."""
        since = self._since_start(time_s)
        for fault in self._settings.faults:
            if isinstance(fault, Occlude) and is_on(fault, since):
                begun, left = since - fault.at_s, fault.at_s + fault.seconds - since
                aside = _ASIDE * (1.0 - min(1.0, begun / _SLIDE_S, left / _SLIDE_S))
                before = np.array([1.0, 0.0, 0.0, 0.0, aside, 0.0, -fault.distance])
                place = Pose.from_parts(
                    self.world_from_object_at(time_s).translation, self._world_from_start.quaternion
                )
                return compose(row_of(place), before)
        return _AWAY

    def _since_start(self, time_s: float) -> float:
        return -1.0 if self.path_starts_s is None else time_s - self.path_starts_s
