"""Corrects a trajectory by what was found out later: where its keyframes turned out to stand."""

from collections.abc import Callable, Sequence
from typing import Protocol

from servoid._native import Pose

KeyframePose = Callable[[int], Pose | None]


class Anchored(Protocol):
    """Where an object was found, and to which keyframe that belongs: what is read of an estimate.

    `keyframes` holds that keyframe, if there is one, and then the keyframe that the last pose
    belonged to, if it was another one: each by its number, with world_from_object as it was then.
    """

    @property
    def world_from_object(self) -> Pose:
        """Return the pose that was found."""
        ...

    @property
    def keyframes(self) -> list[tuple[int, Pose]]:
        """Return the keyframe of the pose and that of the last one."""
        ...


def smoothed(estimates: Sequence[Anchored], keyframe_pose: KeyframePose) -> list[Pose]:
    """Return world_from_object of each estimate after all corrections.

    A pose moves as the keyframe does that it belongs to, which `keyframe_pose` gives by its number;
    where the object came from one keyframe to another, what the two are corrected by apart is
    spread over the poses of the first, so that nothing jumps. Where the object was not followed, or
    nothing is known of a keyframe any more, a pose stays as it is.
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
    """Return by what each of its keyframes is corrected since, in the object's frame."""
    now = [(then, keyframe_pose(number)) for number, then in estimate.keyframes]
    return [None if pose is None else then.inverse() @ pose for then, pose in now]
