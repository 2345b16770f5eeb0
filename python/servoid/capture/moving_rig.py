"""Checks whether images contradict the poses of a rig, such as that of eyes on an arm.

In a recorded rig that moves, right poses predict 94 % and more of the features, and poses that are
inverted, in millimetres, of another order or two lines late none. Poses that are given and never
change are checked as well: with joint states that were not recorded, what moves is the rig.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from servoid._native import Pose
from servoid.capture.capture import Capture
from servoid.capture.matched_features import unit_px
from servoid.capture.mount_fit import (
    fitted_mount,
    fitted_scale,
    refined_mount,
    refined_scale,
)
from servoid.capture.rig_sightings import EXPLAINED_PX, Balls, SeenRig, rests, seen_rig
from servoid.pose import CV_FROM_GL
from servoid.words import digits

_LEAST_COMPARED = 2  # pairs of instants
_HALF = 0.5
_FEW = 0.1
_SHARP_PX = 1.0  # at 1000 px of diagonal: half of the features are nearer, of a good calibration
_MUCH = 4.0  # times nearer, with another mount or scale
_MOST_LATE = 10  # lines
_MILLI = 0.001
_CHECKS = (
    "check that they are world_from_rig, in metres, and of the same times as the images, and "
    "how the cameras are mounted (hand-eye calibration)"
)


@dataclass(frozen=True)
class RigDoubt:
    """What images have against the poses of a rig, in words.

    With `is_sure` the poses are wrong: the images agree with others, or hardly any feature is where
    the poses predict it. Only if the user says so, most of what is seen moves instead, such as
    around a vehicle that carries the rig.
    """

    words: str
    is_sure: bool


def doubt_rig_poses(
    capture: Capture, may_move: Balls | None = None, *, among: Sequence[int] | None = None
) -> str | None:
    """Return a message if images contradict the poses of a recorded rig, else None.

    Poses that all are the identity count as not given.

    Most of what the cameras see must be at rest, apart from `may_move`. Observations `among` these
    indices are compared; without, among all.
    """
    doubt = examine_rig_poses(capture, may_move, among=among)
    return None if doubt is None else doubt.words


def examine_rig_poses(
    capture: Capture, may_move: Balls | None = None, *, among: Sequence[int] | None = None
) -> RigDoubt | None:
    """Return what `doubt_rig_poses` says, and how sure that is."""
    rig = seen_rig(capture, may_move or (lambda _: ()), among)
    if rig is None or len(rig.seen) < _LEAST_COMPARED:
        return None
    agreeing = rig.agreeing()
    if not _contradicts(agreeing):
        return _better(rig)
    offs = np.concatenate(rig.offs_px()[0])
    count, off_px = len(offs), float(np.median(offs))
    fits = round(sum(share * len(one.rays) for share, one in zip(agreeing, rig.seen, strict=True)))
    if rests(rig.world_from_rig):
        return RigDoubt(
            "the poses of the rig are the same at all times, but its cameras move, or most of what "
            "they see: of "
            f"{count} features of its surroundings, {fits} stay where they were, and half move by "
            f"{digits(round(off_px))} px or more; give the pose of each observation, or no poses, "
            "to track in the frame of the first camera",
            is_sure=False,
        )
    how = f"{digits(round(off_px))} px off" if np.isfinite(off_px) else "behind the camera"
    cure = _cure(rig)
    is_sure = cure is not None or float(np.median(agreeing)) < _FEW
    return RigDoubt(
        f"the images contradict the poses of the rig: of {count} features of its surroundings, "
        f"{fits} are where the poses of a later observation predict them, and half are {how} or "
        f"more; {cure or _CHECKS}",
        is_sure=is_sure,
    )


def _contradicts(agreeing: Sequence[float]) -> bool:
    against = sum(share < _HALF for share in agreeing)
    return against >= _LEAST_COMPARED and 2 * against >= len(agreeing)


def _cure(rig: SeenRig) -> str | None:
    """Say with which other poses of the rig or its camera the images agree; None if with none.

    Mistakes that have a name come first.
    """
    poses = (
        (words, replace(rig, world_from_rig=one)) for words, one in _others(rig.world_from_rig)
    )
    mounts = ((words, replace(rig, rig_from_camera=one)) for words, one in _mounts(rig))
    for tried in (lambda: [*poses, *mounts], lambda: _fitted(rig)):
        usual = [(other.usual_px(), words, other) for words, other in tried()]
        off_px, words, other = min(usual, key=lambda one: one[0], default=(np.inf, "", rig))
        if off_px < EXPLAINED_PX * unit_px(rig.lens):
            return f"{words} {100.0 * float(np.median(other.agreeing())):.0f} % would be"
    return None


def _better(rig: SeenRig) -> RigDoubt | None:
    """Return a doubt if poses that predict most features fit much better after a small change."""
    given_px = rig.usual_px()
    if rests(rig.world_from_rig) or not _SHARP_PX * unit_px(rig.lens) <= given_px < np.inf:
        return None
    usual = ((other.usual_px(), words) for words, other in _fitted(rig))
    off_px, words = min(usual, key=lambda one: one[0], default=(np.inf, ""))
    if given_px < _MUCH * off_px:
        return None
    return RigDoubt(
        "the images fit other poses of the cameras better: half of the features of their "
        f"surroundings are {given_px:.1f} px or more from where the poses of a later observation "
        f"predict them; {words} half are {off_px:.1f} px off",
        is_sure=False,
    )


def _others(poses: Sequence[Pose]) -> Iterator[tuple[str, Sequence[Pose]]]:
    """Yield other poses that may be meant, after what to do."""
    yield (
        "invert them: they look like rig_from_world, with which",
        [pose.inverse() for pose in poses],
    )
    yield (
        "change the signs of the second and the third column of each rotation: they look like "
        "those of cameras with y up and z backwards, with which",
        [pose @ CV_FROM_GL for pose in poses],
    )
    yield (
        "write x, y and z in metres: they look like millimetres, with which",
        [Pose.from_parts(_MILLI * np.array(pose.translation), pose.quaternion) for pose in poses],
    )
    yield (
        "write the quaternion as qw, qx, qy, qz: it looks like qx, qy, qz, qw, with which",
        [Pose.from_parts(pose.translation, np.roll(pose.quaternion, 1)) for pose in poses],
    )
    last = len(poses) - 1
    for late in range(1, _MOST_LATE + 1):
        for lines, side in ((late, "later"), (-late, "earlier")):
            yield (
                f"compare their times with those of the images: with the poses of {late} "
                f"{'line' if late == 1 else 'lines'} {side}",
                [poses[min(max(index + lines, 0), last)] for index in range(last + 1)],
            )


def _mounts(rig: SeenRig) -> Iterator[tuple[str, Pose]]:
    """Yield other poses of the camera on the rig that may be meant, after what to do."""
    given = rig.rig_from_camera
    turned = given.matrix().copy()
    turned[:3, :3] = turned[:3, :3].T.copy()
    yield "invert rig_from_camera: it looks like camera_from_rig, with which", given.inverse()
    yield "transpose the rotation of rig_from_camera, with which", Pose(turned)


def _fitted(rig: SeenRig) -> list[tuple[str, SeenRig]]:
    """List rigs that fit what was seen, after what to do."""
    motions, poses, found = rig.motions(), rig.world_from_rig, []
    seen, error = rig.predicted(), rig.error_rad
    scale = fitted_scale(motions, rig.rig_from_camera)
    if scale is not None and scale > 0.0:
        scale = refined_scale(seen, rig.rig_from_camera, scale, error)
        scaled = [
            Pose.from_parts(scale * np.array(pose.translation), pose.quaternion) for pose in poses
        ]
        words = f"compare them with the distance of the cameras: with {scale:.3f} times x, y and z"
        found.append((words, replace(rig, world_from_rig=scaled)))
    mount = fitted_mount(motions)
    starts = () if mount is None else (mount, rig.rig_from_camera)
    for start in starts:
        better = refined_mount(seen, start, error)
        place, turn = (
            f"({', '.join(f'{x + 0.0:.4f}' for x in numbers)})"
            for numbers in (better.translation, better.quaternion)
        )
        words = (
            f"correct how the cameras are mounted (hand-eye calibration): with {rig.name} at "
            f"{place} m and (qw, qx, qy, qz) = {turn} on the rig,"
        )
        found.append((words, replace(rig, rig_from_camera=better)))
    return found
