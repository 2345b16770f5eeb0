"""Smooths a trajectory with the later corrections of its keyframes."""

from collections.abc import Callable, Sequence
from typing import Protocol

from servoid._native import Pose

KeyframePose = Callable[[int], Pose | None]


class Anchored(Protocol):
    """The parts of an estimate that smoothing reads: its pose and its keyframe.

    `keyframes` holds the keyframe of the pose, if there is one, and then the keyframe of the
    previous pose, if it was another one: each as its number and world_from_object at that time.
    """

    @property
    def world_from_object(self) -> Pose:
        """Return the estimated pose."""
        ...

    @property
    def keyframes(self) -> list[tuple[int, Pose]]:
        """Return the keyframes of this pose and the previous one."""
        ...


def smoothed(estimates: Sequence[Anchored], keyframe_pose: KeyframePose) -> list[Pose]:
    """Return world_from_object of each estimate after all corrections.

    A pose moves with its keyframe, whose corrected pose `keyframe_pose` returns by its number.
    Between one keyframe and the next, the difference of their corrections is spread over the poses
    of the first, so that the trajectory does not jump. Where the object was not tracked, or a
    keyframe is no longer known, a pose is unchanged.
    """
    corrections = [_corrections(one, keyframe_pose) for one in estimates]
    poses = [
        one.world_from_object @ (found[0] or Pose.identity()) if found else one.world_from_object
        for one, found in zip(estimates, corrections, strict=True)
    ]
    begin = 0
    for at in range(1, len(estimates)):
        numbers, before = _numbers(estimates[at]), _numbers(estimates[at - 1])
        if numbers[:1] == before[:1]:
            continue
        if numbers[1:] and numbers[1:] == before[:1]:
            own, last = corrections[at]
            if own is not None and last is not None:
                jump = (last.inverse() @ own).log()
                for place in range(begin, at):
                    share = (place - begin) / (at - begin)
                    poses[place] = poses[place] @ Pose.exp([share * part for part in jump])
        begin = at
    return poses


def _numbers(estimate: Anchored) -> list[int]:
    return [number for number, _ in estimate.keyframes]


def _corrections(estimate: Anchored, keyframe_pose: KeyframePose) -> list[Pose | None]:
    """Return the correction of each keyframe of an estimate since then, in the object's frame."""
    now = [(then, keyframe_pose(number)) for number, then in estimate.keyframes]
    return [None if pose is None else then.inverse() @ pose for then, pose in now]
