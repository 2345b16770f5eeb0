"""Evaluates a bag's tree of transforms at any time."""

from array import array
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from servoid.config import MOST_TRANSFORMS
from servoid.errors import CaptureError, located
from servoid.exchange.bags.stored.header import NS_PER_S, tidy_frame
from servoid.pose import Pose, joined
from servoid.words import counted

TF_MESSAGE = "tf2_msgs/msg/TFMessage"
TF_KINDS = (TF_MESSAGE, "tf/msg/tfMessage")

_BEYOND_NS = NS_PER_S // 10  # beyond its first and last transform, for which a frame is held
_GAP_NS = NS_PER_S // 4
_GAP_PERIODS = 4.0

Numbers = tuple[float, float, float, float, float, float, float]


@dataclass
class Edge:
    """The transforms of a frame relative to its parent over time, as x, y, z, qx, qy, qz, qw.

    A constant edge is valid at any time.
    """

    parent: str
    child: str
    is_static: bool
    stamps_ns: "array[int]" = field(default_factory=lambda: array("q"))
    numbers: "array[float]" = field(default_factory=lambda: array("d"))

    def add(self, stamp_ns: int, numbers: Numbers) -> None:
        """Add a transform; of a static one the newest is used."""
        if self.is_static:
            del self.stamps_ns[:], self.numbers[:]
        self.stamps_ns.append(stamp_ns)
        self.numbers.extend(numbers)

    def sort(self) -> None:
        """Sort the transforms, and keep the last one of each time."""
        stamps = np.frombuffer(self.stamps_ns, np.int64)
        if (np.diff(stamps) > 0).all():
            return
        rows = np.frombuffer(self.numbers, np.float64).reshape(-1, 7)
        # Of equal times, reversal puts the last one written first, which is kept.
        unique, first = np.unique(stamps[::-1], return_index=True)
        kept = rows[::-1][first]
        del stamps, rows
        self.stamps_ns = array("q", unique.tolist())
        self.numbers = array("d", kept.ravel().tolist())

    @property
    def is_constant(self) -> bool:
        """Return whether all transforms are the same."""
        rows = np.frombuffer(self.numbers, np.float64).reshape(-1, 7)
        return self.is_static or bool((rows == rows[0]).all())

    def pose(self, index: int) -> Pose:
        """Return parent_from_child of one transform.

        Raises:
            PoseError: it is not a rigid motion.

        """
        x, y, z, qx, qy, qz, qw = self.numbers[7 * index : 7 * index + 7]
        with located(f"the transform from {self.parent} to {self.child}"):
            return joined((x, y, z), (qw, qx, qy, qz))


@dataclass
class Timeline:
    """A sorted edge that can be evaluated, with statistics on its gaps."""

    edge: Edge
    across: int = 0
    widest_ns: int = 0
    held: int = 0

    def __post_init__(self) -> None:
        self._constant = self.edge.pose(0) if self.edge.is_constant else None
        steps = np.diff(np.frombuffer(self.edge.stamps_ns, np.int64))
        usual = float(np.median(steps)) if len(steps) else 0.0
        self._gap_ns = max(_GAP_NS, _GAP_PERIODS * usual)

    def at(self, stamp_ns: int) -> Pose | None:
        """Return parent_from_child at a time; None if no transform is near enough.

        Between two transforms, the position is interpolated linearly and the rotation at constant
        rate.
        """
        if self._constant is not None:
            return self._constant
        stamps = self.edge.stamps_ns
        after = bisect_right(stamps, stamp_ns)
        if after and stamps[after - 1] == stamp_ns:
            return self.edge.pose(after - 1)
        if after in (0, len(stamps)):
            nearest = 0 if after == 0 else len(stamps) - 1
            if abs(stamps[nearest] - stamp_ns) > _BEYOND_NS:
                return None
            self.held += 1
            return self.edge.pose(nearest)
        wide = stamps[after] - stamps[after - 1]
        if wide > self._gap_ns:
            self.across += 1
            self.widest_ns = max(self.widest_ns, wide)
        share = (stamp_ns - stamps[after - 1]) / wide
        return between(self.edge.pose(after - 1), self.edge.pose(after), share)

    def notes(self) -> Iterator[str]:
        """Return messages for the user on the evaluated poses."""
        name = f"TF from {self.edge.parent} to {self.edge.child}"
        if self.across:
            yield (
                f"{name} has gaps of up to {self.widest_ns / NS_PER_S:.2g} s; poses of "
                f"{self.across} observations are interpolated across them"
            )
        if self.held:
            yield (
                f"{name} begins later or ends earlier than the images; its nearest transform was "
                f"used for {counted(self.held, 'observation')}"
            )


class Transforms:
    """A forest of frames, collected from the messages of a bag."""

    def __init__(self, place: str) -> None:
        self._place = place
        self._edges: dict[str, Edge] = {}
        self._timelines: dict[str, Timeline] = {}
        self._count = 0

    def add(self, message: Any, *, is_static: bool) -> None:
        """Add a decoded message of transforms.

        Raises:
            CaptureError: there are too many, or a frame has two parents.

        """
        for one in message.transforms:
            stamp = one.header.stamp
            parent, child = tidy_frame(one.header.frame_id), tidy_frame(one.child_frame_id)
            edge = self._edges.get(child)
            if edge is None:
                edge = self._edges[child] = Edge(parent, child, is_static)
            if edge.parent != parent:
                raise CaptureError(
                    f"{self._place}: TF gives the frame '{child}' two parents, '{edge.parent}' and "
                    f"'{parent}'; record only the right one"
                )
            place, turn = one.transform.translation, one.transform.rotation
            edge.is_static = edge.is_static and is_static
            edge.add(
                stamp.sec * NS_PER_S + stamp.nanosec,
                (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w),
            )
            self._count += not is_static
            if self._count > MOST_TRANSFORMS:
                raise CaptureError(
                    f"{self._place} holds more than {MOST_TRANSFORMS} transforms, the maximum that "
                    "servoid accepts; filter /tf, or cut the bag"
                )

    def close(self) -> None:
        """Sort all transforms; from here on, poses can be evaluated."""
        for edge in self._edges.values():
            edge.sort()

    def knows(self, frame: str) -> bool:
        """Return whether a frame is in any transform."""
        return frame in self._edges or any(edge.parent == frame for edge in self._edges.values())

    def frames(self) -> list[str]:
        """List all frames."""
        return sorted({name for edge in self._edges.values() for name in (edge.parent, edge.child)})

    def root(self, frame: str) -> str:
        """Return the frame at the top of a frame's tree.

        Raises:
            CaptureError: the frames form a cycle.

        """
        return self._line(frame)[-1]

    def mount(self, frame: str, world: str) -> str:
        """Return the highest frame, not above `world`, to which a frame is rigidly connected."""
        for above in self._line(frame):
            edge = self._edges.get(above)
            if edge is None or not edge.is_static or above == world:
                return above
        return frame

    def pose(self, target: str, source: str, stamp_ns: int) -> Pose | None:
        """Return target_from_source at a time, None if a transform is too far away in time.

        Raises:
            CaptureError: the two frames are not connected.
            PoseError: a transform is not a rigid motion.

        """
        down, up = self._line(source), self._line(target)
        shared = next((name for name in down if name in up), None)
        if shared is None:
            raise CaptureError(
                f"{self._place}: no TF leads from '{target}' to '{source}'; the frames of that "
                f"tree are {_some(self._tree(source))}"
            )
        shared_from_source = self._climb(source, shared, stamp_ns)
        if target == shared or shared_from_source is None:
            return shared_from_source
        shared_from_target = self._climb(target, shared, stamp_ns)
        return (
            None
            if shared_from_target is None
            else shared_from_target.inverse() @ shared_from_source
        )

    def notes(self) -> list[str]:
        """Return messages for the user on all poses that were requested."""
        return [note for one in self._timelines.values() for note in one.notes()]

    def _climb(self, frame: str, above: str, stamp_ns: int) -> Pose | None:
        """Return above_from_frame, where `above` is an ancestor or the frame itself."""
        found: Pose | None = None
        while frame != above:
            step = self._timeline(frame).at(stamp_ns)
            if step is None:
                return None
            found = step if found is None else step @ found
            frame = self._edges[frame].parent
        return Pose.identity() if found is None else found

    def _timeline(self, child: str) -> Timeline:
        if child not in self._timelines:
            with located(self._place):
                self._timelines[child] = Timeline(self._edges[child])
        return self._timelines[child]

    def _line(self, frame: str) -> list[str]:
        """List a frame and all its ancestors, the nearest first."""
        line = [frame]
        while line[-1] in self._edges:
            line.append(self._edges[line[-1]].parent)
            if line[-1] in line[:-1]:
                raise CaptureError(
                    f"{self._place}: the frames of TF form a cycle: "
                    f"{', '.join(line)}; record the right tree"
                )
        return line

    def _tree(self, frame: str) -> list[str]:
        root = self.root(frame)
        return [name for name in {*self.frames(), frame} if self._line(name)[-1] == root]


def between(a: Pose, b: Pose, share: float) -> Pose:
    """Return the pose `share` of the way from one to another: tf2's interpolation.

    The position is interpolated linearly, and the rotation along the shortest path.
    """
    turn = (_turned(a).inverse() @ _turned(b)).log()
    place = (1.0 - share) * np.array(a.translation) + share * np.array(b.translation)
    halfway = _turned(a) @ Pose.exp(share * turn)
    return Pose.from_parts(place, halfway.quaternion)


def _turned(pose: Pose) -> Pose:
    return Pose.from_parts((0.0, 0.0, 0.0), pose.quaternion)


def _some(names: Sequence[str]) -> str:
    listed = sorted(names)
    return ", ".join(listed if len(listed) <= 8 else [*listed[:7], "..."])
