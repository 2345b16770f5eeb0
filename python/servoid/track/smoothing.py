"""Corrects a trajectory by what was found out later: where its keyframes turned out to stand."""

from collections.abc import Callable, Sequence
from typing import Protocol

from servoid._native import Pose

KeyframePose = Callable[[int], Pose | None]


class Believed(Protocol):
    """Where an object was believed to be: what is read of an estimate.

    `keyframes` are those that it belongs to and from which the object came there, by number, with
    where they were believed to stand.
    """

    @property
    def world_from_object(self) -> Pose:
        """Return the pose that was believed."""
        ...

    @property
    def keyframes(self) -> list[tuple[int, Pose]]:
        """Return the keyframe of the pose and the one before, each with its number."""
        ...


def smoothed(estimates: Sequence[Believed], keyframe_pose: KeyframePose) -> list[Pose]:
    """Return world_from_object of each estimate after all corrections.

    A pose moves as the keyframe does that it belongs to, which `keyframe_pose` gives by its number,
    and, the nearer the next keyframe, the more as that one, so that nothing jumps where one takes
    over from another. Where the object was not followed a pose stays as it is.
    """
    corrections = [_corrections(one, keyframe_pose) for one in estimates]
    poses = [
        one.world_from_object @ found[0] if found else one.world_from_object
        for one, found in zip(estimates, corrections, strict=True)
    ]
    begin = 0
    for at in range(1, len(estimates)):
        numbers, before = _numbers(estimates[at]), _numbers(estimates[at - 1])
        if numbers[:1] == before[:1]:
            continue
        if numbers[1:] == before[:1] and len(corrections[at]) == 2:
            own, last = corrections[at]
            jump = (last.inverse() @ own).log()
            for place in range(begin, at):
                share = (place - begin) / (at - begin)
                poses[place] = poses[place] @ Pose.exp([share * part for part in jump])
        begin = at
    return poses


def _numbers(estimate: Believed) -> list[int]:
    return [number for number, _ in estimate.keyframes]


def _corrections(estimate: Believed, keyframe_pose: KeyframePose) -> list[Pose]:
    """Return by what the pose is corrected with each of its keyframes, in the object's frame."""
    now = [(then, keyframe_pose(number)) for number, then in estimate.keyframes]
    return [then.inverse() @ pose for then, pose in now if pose is not None]
