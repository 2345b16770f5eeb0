"""Determines the poses of a bag's cameras on their rig, and of the rig in the world."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid.errors import CaptureError
from servoid.exchange.bags.geometry.calibration import LEAST_BASELINE_M, Calibration
from servoid.exchange.bags.geometry.transforms import Transforms
from servoid.exchange.bags.stored.choosing import ImageTopic
from servoid.pose import Pose
from servoid.words import counted, measured

_LOOSE_M, _LOOSE_RAD = 2e-4, 1e-3  # apparent motion of cameras on a rig: TF has measurement errors
_APART = 0.05  # relative difference of two baselines that are not of the same calibration
_APART_M = 1e-3
_MM_PER_M = 1e3


@dataclass(frozen=True)
class Seat:
    """A camera without a pose yet: its topic and its calibration."""

    image: ImageTopic
    calibration: Calibration


@dataclass(frozen=True)
class Placing:
    """The poses of cameras on their rig, and of the rig at each instant, None where unknown."""

    rig_from_camera: tuple[Pose, ...]
    world_from_rig: tuple[Pose | None, ...]
    notes: tuple[str, ...]


def place_cameras(
    place: str,
    seats: Sequence[Seat],
    transforms: Transforms,
    stamps_ns: Sequence[int],
    world: str | None,
    *,
    rests: bool = False,
) -> Placing:
    """Determine the cameras' poses from TF, or from the offsets in a stereo pair's calibrations.

    `world` is the frame of the poses, by default the top of the first camera's tree. If the rig
    `rests`, its motion is not looked up.

    Raises:
        CaptureError: the pose of a camera is unknown, cameras move relative to each other, or TF
            has no frame `world`.
        PoseError: a transform is not a rigid motion.

    """
    frame = seats[0].image.frame
    resting = (Pose.identity(),) * len(stamps_ns)
    if not transforms.knows(frame):
        if world is not None:
            raise CaptureError(
                f"{place}: no TF leads from '{world}' to the camera's frame '{frame}'; record "
                "/tf and /tf_static, or leave the world out: the rig is then static"
            )
        named = f"the frame '{frame}'" if frame else "the camera, as its frame has no name"
        note = f"TF does not include {named}: the rig is assumed to be static, and is the world"
        return Placing(_by_shifts(place, seats), resting, () if rests else (note,))
    top = transforms.root(frame) if world is None else world
    rig = transforms.mount(frame, top)
    seated = tuple(
        _on_rig(place, seats, index, transforms, rig, stamps_ns) for index in range(len(seats))
    )
    disputed = _disputed_baseline(seats, transforms, seated)
    if rests:
        return Placing(seated, resting, disputed)
    poses = tuple(
        transforms.pose(top, rig, stamp) if rig != top else Pose.identity() for stamp in stamps_ns
    )
    notes = [] if world is not None else [f"poses are in the frame '{top}', the top of TF's tree"]
    return Placing(seated, poses, (*notes, *disputed, *transforms.notes()))


def _on_rig(
    place: str,
    seats: Sequence[Seat],
    index: int,
    transforms: Transforms,
    rig: str,
    stamps_ns: Sequence[int],
) -> Pose:
    """Return rig_from_camera of one of the cameras."""
    seat, first = seats[index], seats[0]
    frame = seat.image.frame
    is_shared = index > 0 and frame == first.image.frame
    is_supplied = index > 0 and seat.calibration.rig_from_camera is not None
    if is_shared or is_supplied or not transforms.knows(frame):
        rig_from_first = _on_rig(place, seats, 0, transforms, rig, stamps_ns)
        return rig_from_first @ _first_from(place, first, seat)
    found = [(stamp, transforms.pose(rig, frame, stamp)) for stamp in stamps_ns]
    poses = [pose for _, pose in found if pose is not None]
    if not poses:
        raise CaptureError(
            f"{place}: TF has the pose of '{frame}' on '{rig}' at none of the images' times; "
            "record /tf and /tf_static for as long as the images"
        )
    moved = [(poses[0].inverse() @ pose).log() for pose in poses[1:] if pose != poses[0]]
    if moved:
        far = float(np.max(np.linalg.norm(np.array(moved)[:, :3], axis=1)))
        turned = float(np.max(np.linalg.norm(np.array(moved)[:, 3:], axis=1)))
        if far > _LOOSE_M or turned > _LOOSE_RAD:
            raise CaptureError(
                f"{place}: the cameras of {first.image.topic} and {seat.image.topic} move "
                f"relative to each other, by up to {measured(_MM_PER_M * far)} mm and "
                f"{measured(np.degrees(turned))} degrees; servoid needs cameras that are fixed to "
                "each other, so choose one of them with --topic"
            )
    pose = poses[0]
    turn = seat.calibration.frame_from_camera
    return pose if turn == Pose.identity() else pose @ turn


def _disputed_baseline(
    seats: Sequence[Seat], transforms: Transforms, rig_from_camera: Sequence[Pose]
) -> tuple[str, ...]:
    """Report a pair of cameras whose distance differs between TF and P of their calibrations.

    P is relative to the first camera of a pair, which among several cameras may be another one.
    """
    if len(seats) != 2:
        return ()
    first, second = seats
    is_supplied = any(seat.calibration.rig_from_camera is not None for seat in seats)
    frame = second.image.frame
    is_unknown = frame == first.image.frame or not transforms.knows(frame)
    if is_supplied or is_unknown or any(first.calibration.shift_m):
        return ()
    by_tf = float(np.linalg.norm((rig_from_camera[0].inverse() @ rig_from_camera[1]).translation))
    by_shift = float(np.hypot(*second.calibration.shift_m))
    off = abs(by_tf - by_shift)
    if by_shift < LEAST_BASELINE_M or off <= max(_APART * max(by_tf, by_shift), _APART_M):
        return ()
    return (
        f"the cameras of {first.image.topic} and {second.image.topic} are "
        f"{measured(_MM_PER_M * by_tf)} mm apart by TF, but {measured(_MM_PER_M * by_shift)} "
        "mm by P of their calibrations; TF is used, so check which one is right: all "
        "distances depend on it",
    )


def _by_shifts(place: str, seats: Sequence[Seat]) -> tuple[Pose, ...]:
    """Return rig_from_camera where TF has none: the first camera's frame is the rig.

    If the user supplies the poses of all cameras, those are used.
    """
    supplied = [seat.calibration.rig_from_camera for seat in seats]
    known = tuple(pose for pose in supplied if pose is not None)
    if len(known) == len(seats):
        return known
    rig_from_first = seats[0].calibration.frame_from_camera
    others = (rig_from_first @ _first_from(place, seats[0], seat) for seat in seats[1:])
    return (rig_from_first, *others)


def _first_from(place: str, first: Seat, other: Seat) -> Pose:
    """Return first_from_camera from the offset between the two in their calibrations.

    Raises:
        CaptureError: their calibrations have none.

    """
    supplied = first.calibration.rig_from_camera, other.calibration.rig_from_camera
    if supplied[0] is not None and supplied[1] is not None:
        return supplied[0].inverse() @ supplied[1]
    first_from_other = first.calibration.from_other(other.calibration)
    if first_from_other is None:
        raise CaptureError(
            f"{place}: the pose of the camera of {other.image.topic} (frame "
            f"'{other.image.frame}') relative to that of {first.image.topic} (frame "
            f"'{first.image.frame}') is unknown: no TF, and no offset in P of their calibrations; "
            f"record /tf_static, or choose one of them with --topic"
        )
    return first_from_other


def lost_note(lost: int, count: int) -> str:
    """Report how many observations are left out because the rig's pose is unknown."""
    return (
        f"{lost} of {counted(count, 'observation')} were left out: TF has no pose of the "
        "rig at that time"
    )
