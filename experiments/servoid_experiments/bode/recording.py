"""Records object, hand, gaze and recognition in a run, along the object's initial axes."""

import numpy as np

from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.servo import Command, Reason, Tick
from servoid.servo.settings import ServoSettings
from servoid.sim.world import World

_AT_LIMIT = 0.999
_NO_LIMITS = {Reason.UNSEEN, Reason.AWAY}  # reported while the arm moves as usual
_PARALLEL = 1e-3  # lines of sight whose slopes differ by less do not intersect


Course = list[tuple[float, Floats, Floats]]
"""Seconds since the path began, and the true and the reported position then, (3,) in m each."""


class RunRecorder:
    """Records the ticks of a run in a world whose object swings.

    All positions are in the object's frame at the start. `courses` are, by name: what the tracker
    `seen` at the time of its images, the newest estimate `known` in a control period, where the
    object is `predicted` to be then, the point at which the eyes look (`gaze`), and the `hand`.
    """

    def __init__(self, world: World, object_from_body: Pose, settings: ServoSettings) -> None:
        self._world, self._object_from_body, self._settings = world, object_from_body, settings
        self._start_from_world = world.world_from_object_at(world.time_s).inverse()
        self._began_s = world.time_s
        self._known: Floats | None = None
        self._last: Command | None = None
        names = ("seen", "known", "predicted", "gaze", "hand")
        self.courses: dict[str, Course] = {name: [] for name in names}
        self.held_s = 0.0
        self.joint_speed_share, self.joint_acceleration_share = 0.0, 0.0
        self.limited = 0

    def record(self, tick: Tick, counts: bool) -> None:
        """Process a control period; it is recorded only if it counts."""
        if tick.instant is not None and tick.estimate is not None:
            found = self._body_place(tick.estimate.world_from_object)
            if tick.estimate.located:
                self._known = found
            if counts:
                time_s = tick.instant.time_s
                self._add("seen", time_s, found)
        if counts:
            self._keep(tick)
        self._last = tick.command

    def _keep(self, tick: Tick) -> None:
        time_s, command = tick.state.time_s, tick.command
        arm = self._world.arm
        if command.holding:
            self.held_s += arm.period_s
        believed = command.world_from_object
        predicted = None if believed is None else self._body_place(believed)
        hand = np.array(arm.world_from_hand(tick.state.positions).translation)
        self._add("known", time_s, self._known)
        self._add("predicted", time_s, predicted)
        self._add("gaze", time_s, self._gaze(tick.state.positions, self._truth(time_s)))
        self._add("hand", time_s, self._place(hand))
        if self._last is not None:
            self._watch_limits(command, self._last)

    def _add(self, name: str, time_s: float, place: Floats | None) -> None:
        """Record where a signal is at a time, if that is known."""
        if place is not None:
            self.courses[name].append((time_s - self._began_s, self._truth(time_s), place))

    def _watch_limits(self, command: Command, last: Command) -> None:
        """Record the used share of the limits of joints and hand."""
        arm, settings = self._world.arm, self._settings
        joints, hand = arm.joints, settings.hand
        twist = np.linalg.norm(command.twist.reshape(2, 3), axis=1)
        change = np.linalg.norm((command.twist - last.twist).reshape(2, 3), axis=1) / arm.period_s
        speed = np.abs(command.velocities) / (settings.joints.speed_share * joints.speed)
        turning = np.abs(command.velocities - last.velocities) / (
            arm.period_s * settings.joints.acceleration_share * joints.acceleration
        )
        self.joint_speed_share = max(self.joint_speed_share, float(speed.max()))
        self.joint_acceleration_share = max(self.joint_acceleration_share, float(turning.max()))
        of_hand = np.concatenate(
            [
                twist / (hand.linear_speed, hand.angular_speed),
                change / (hand.linear_acceleration, hand.angular_acceleration),
            ]
        )
        most = max(speed.max(), turning.max(), of_hand.max())
        self.limited += bool(most > _AT_LIMIT or command.limiting - _NO_LIMITS)

    def _gaze(self, positions: Floats, truth: Floats) -> Floats:
        """Return the point (3,) at which the eyes look.

        Sideways, it is where the eyes' axes intersect the plane across z that contains the object,
        averaged over both eyes. In depth, it is where the axes intersect as seen from above, or the
        object's depth if they do not.
        """
        eyes = [
            self._start_from_world @ pose for pose in self._world.arm.world_from_cameras(positions)
        ]
        places = np.array([eye.translation for eye in eyes])
        axes = np.array([eye.matrix()[:3, 2] for eye in eyes])
        slopes = axes[:, :2] / axes[:, 2:]
        pierced = places[:, :2] + (truth[2] - places[:, 2:]) * slopes
        sideways, up = 0.5 * (pierced[0] + pierced[1])
        narrowing, gap = slopes[0, 0] - slopes[1, 0], pierced[1, 0] - pierced[0, 0]
        depth = truth[2] + (gap / narrowing if abs(narrowing) > _PARALLEL else 0.0)
        return np.array([sideways, up, depth])

    def _truth(self, time_s: float) -> Floats:
        world_from_object = self._world.world_from_object_at(time_s)
        return self._body_place(world_from_object @ self._object_from_body)

    def _body_place(self, world_from_body: Pose) -> Floats:
        return self._place(np.array(world_from_body.translation))

    def _place(self, point_in_world: Floats) -> Floats:
        return self._start_from_world.transform(point_in_world[None])[0]
