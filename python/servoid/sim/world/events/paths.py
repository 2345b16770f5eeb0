"""Paths of an object, relative to its initial pose."""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from servoid.config import NEAR_M, implausible
from servoid.errors import SimError
from servoid.pose import Floats, Pose, exact
from servoid.words import counted

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_STEP_S = 1e-4  # of the finite differences behind a twist
_SOFT_SHARE = 0.1  # share of a period in which motion on a circle starts up
_WAVES = 3  # sines on each axis of a random path
_SOFT_S = 2.0  # in which a random path starts up
_TURN_OF_METRE = 4.0  # radians that a random path rotates per metre

KINDS = {
    "still": "still",
    "line": "line:METRES@SECONDS[:AXIS], as line:0.2@5s",
    "circle": "circle:RADIUS@PERIOD[:AXIS], about an axis, as circle:0.1@10s",
    "sine": "sine:METRES@PERIOD[:AXIS], A - A cos(2 pi t / T), as sine:0.15@10s",
    "random": "random:SEED[:METRES@SECONDS], as random:7 or random:7:0.05@6s",
    "recorded": "recorded:FILE, poses over time as TUM text or CSV",
}


class Path(Protocol):
    """A path of an object as a function of the time since its start, in seconds."""

    def start_from_object(self, time_s: float) -> Pose:
        """Return the object's pose in the frame that it has at the start."""
        ...


@dataclass(frozen=True)
class Still:
    """A path at rest."""

    def start_from_object(self, time_s: float) -> Pose:  # noqa: ARG002 (always the same)
        """Return the identity."""
        return Pose.identity()


@dataclass(frozen=True)
class Line:
    """A straight path of `length` metres, with smooth acceleration and deceleration."""

    direction: tuple[float, float, float]
    length: float
    seconds: float

    def start_from_object(self, time_s: float) -> Pose:
        """Return the object's pose in the frame that it has at the start."""
        return _shift(self.direction, self.length * _soft_share(time_s / self.seconds))


@dataclass(frozen=True)
class Sine:
    """An oscillation A - A cos(2 pi t / T), to a distance of 2 A and back."""

    direction: tuple[float, float, float]
    amplitude: float
    period_s: float

    def start_from_object(self, time_s: float) -> Pose:
        """Return the object's pose in the frame that it has at the start."""
        phase = 2.0 * math.pi * max(time_s, 0.0) / self.period_s
        return _shift(self.direction, self.amplitude * (1.0 - exact.cos(phase)))  # Eq. (19)


@dataclass(frozen=True)
class Circle:
    """A circle in the plane perpendicular to `axis`, through the start."""

    axis: tuple[float, float, float]
    radius: float
    period_s: float

    def start_from_object(self, time_s: float) -> Pose:
        """Return the object's pose in the frame that it has at the start."""
        soft = _SOFT_SHARE * self.period_s
        phase = 2.0 * math.pi * _soft_time(time_s, soft) / self.period_s
        first, second = _across(self.axis)
        place = self.radius * (exact.sin(phase) * first + (1.0 - exact.cos(phase)) * second)
        return Pose.from_parts(place.tolist(), (1.0, 0.0, 0.0, 0.0))


class Random:
    """A smooth random path in all six degrees of freedom, determined by a seed."""

    def __init__(self, seed: int, size: float, period_s: float) -> None:
        random = np.random.default_rng(seed)
        weights = random.uniform(0.4, 1.0, (6, _WAVES))
        reach = np.array([size] * 3 + [size * _TURN_OF_METRE] * 3)
        self._heights = reach[:, None] * weights / weights.sum(axis=1, keepdims=True)
        self._rates = 2.0 * math.pi / (period_s * random.uniform(0.8, 2.0, (6, _WAVES)))
        self._phases = random.uniform(0.0, 2.0 * math.pi, (6, _WAVES))

    def start_from_object(self, time_s: float) -> Pose:
        """Return the object's pose in the frame that it has at the start."""
        waves = self._heights * exact.sin(self._rates * max(time_s, 0.0) + self._phases)
        motion = _soft_share(time_s / _SOFT_S) * waves.sum(axis=1)
        turn = Pose.exp([0.0, 0.0, 0.0, *motion[3:]])
        return Pose.from_parts(motion[:3].tolist(), turn.quaternion)


class Recorded:
    """A path of recorded poses over time, from the first to the last.

    Between two poses it follows the screw motion.
    """

    def __init__(self, times_s: Sequence[float], poses: Sequence[Pose]) -> None:
        """Take the poses of an object in any frame, and their times.

        Raises:
            SimError: there are fewer than two poses, times and poses differ in number, or the path
                leads away farther than an arm could follow.

        """
        if len(times_s) != len(poses) or len(poses) < 2:
            raise SimError(
                f"a recorded path needs two poses or more, each with its time; given were "
                f"{counted(len(poses), 'pose')} and {counted(len(times_s), 'time')}"
            )
        self._times = np.asarray(times_s, float) - times_s[0]
        if not (np.diff(self._times) > 0.0).all():
            raise SimError("a recorded path needs times that grow from one pose to the next")
        first = poses[0].inverse()
        self._poses = [first @ pose for pose in poses]
        pairs = zip(self._poses, self._poses[1:], strict=False)
        farthest = max(exact.norm(np.array(pose.translation)) for pose in self._poses)
        absurd = implausible("the farthest point of a recorded path", farthest, NEAR_M)
        if absurd is not None:
            raise SimError(absurd)
        self._screws = [(before.inverse() @ after).log() for before, after in pairs]

    def start_from_object(self, time_s: float) -> Pose:
        """Return the object's pose in the frame that it has at the start."""
        time_s = min(max(time_s, 0.0), float(self._times[-1]))
        index = int(np.searchsorted(self._times, time_s, side="right")) - 1
        index = min(index, len(self._screws) - 1)
        share = (time_s - self._times[index]) / (self._times[index + 1] - self._times[index])
        return self._poses[index] @ Pose.exp((share * self._screws[index]).tolist())


def twist_at(pose_at: Callable[[float], Pose], time_s: float) -> Floats:
    """Return the twist (6,) of a moving pose: velocities of its origin and rotation, in its world.

    `pose_at` gives the pose at a time in seconds.
    """
    before, after = pose_at(time_s - _STEP_S), pose_at(time_s + _STEP_S)
    linear = np.subtract(after.translation, before.translation) / (2.0 * _STEP_S)
    turned = after @ before.inverse()
    angular = Pose.from_parts((0.0, 0.0, 0.0), turned.quaternion).log()[3:] / (2.0 * _STEP_S)
    return np.concatenate([linear, angular])


def parse_path(text: str) -> Path:
    """Parse a path; `KINDS` lists the forms.

    Raises:
        SimError: there is no such path, or its numbers are malformed.

    """
    kind, *rest = text.strip().split(":")
    if kind == "still" and not rest:
        return Still()
    if kind == "random" and len(rest) in (1, 2):
        size, seconds = _size_at_seconds(text, rest[1] if rest[1:] else "0.05@6s")
        return Random(_seed(text, rest[0]), size, seconds)
    if kind == "recorded":
        raise SimError(
            f"the path '{text}' is recorded: read the file and give the world its poses as "
            "path=Recorded(times, poses)"
        )
    if kind in ("line", "circle", "sine") and len(rest) in (1, 2):
        size, seconds = _size_at_seconds(text, rest[0])
        if kind == "circle":
            return Circle(_axis(text, rest[1] if rest[1:] else "z"), size, seconds)
        direction = _axis(text, rest[1] if rest[1:] else "x")
        make = Line if kind == "line" else Sine
        return make(direction, size, seconds)
    raise SimError(f"unknown path '{text}'; write one of: {'; '.join(KINDS.values())}")


def _size_at_seconds(text: str, part: str) -> tuple[float, float]:
    size, at, seconds = part.partition("@")
    try:
        values = float(size), float(seconds.removesuffix("s"))
    except ValueError:
        values = math.nan, math.nan
    if not at or not all(math.isfinite(value) and value > 0.0 for value in values):
        raise SimError(
            f"the path '{text}' has '{part}' where metres and seconds belong; "
            "write two numbers above 0, as 0.15@10s"
        )
    absurd = implausible(f"the size of the path '{text}'", values[0], NEAR_M)
    if absurd is not None:
        raise SimError(absurd)
    return values


def _seed(text: str, part: str) -> int:
    if not part.isdecimal():
        raise SimError(f"the path '{text}' has '{part}' as its seed; write a whole number, as 7")
    return int(part)


def _axis(text: str, part: str) -> tuple[float, float, float]:
    sign = -1.0 if part.startswith("-") else 1.0
    name = part.removeprefix("-")
    if name not in _AXES:
        raise SimError(f"the path '{text}' has '{part}' as its axis; write x, y, z, -x, -y or -z")
    x, y, z = _AXES[name]
    return sign * x, sign * y, sign * z


@functools.lru_cache(maxsize=16)
def _across(axis: tuple[float, float, float]) -> tuple[Floats, Floats]:
    """Return two directions perpendicular to an axis, which form a right-handed system with it."""
    place = int(np.argmax(np.abs(axis)))
    first = np.roll(np.eye(3), 1, axis=0)[place]
    return first, np.cross(axis, first)


def _shift(direction: tuple[float, float, float], length: float) -> Pose:
    return Pose.from_parts([length * part for part in direction], (1.0, 0.0, 0.0, 0.0))


def _soft_share(share: float) -> float:
    share = min(max(share, 0.0), 1.0)
    return share * share * share * (10.0 - (15.0 - 6.0 * share) * share)


def _soft_time(time_s: float, soft_s: float) -> float:
    """Return a warped time that starts slowly and has unit rate after `soft_s`."""
    share = min(max(time_s / soft_s, 0.0), 1.0)
    return soft_s * share * share * share * (1.0 - 0.5 * share) + max(time_s - soft_s, 0.0)
