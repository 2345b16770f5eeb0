"""Doubts whether a given body is that of the object which is to be followed, and placed right."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Pose, View, silhouette_ious
from servoid.capture import Capture
from servoid.errors import TrackError
from servoid.pose import exact
from servoid.shape import body_sides
from servoid.source import Instant, cameras_of
from servoid.track.follower import Follower, Rememberer, Surfaced, depths_for, recall
from servoid.track.request import Subject
from servoid.track.unobservable import unobservable_axes

_CONTRADICTED = 0.6  # overlap of a given body and its mask; right poses of coarse bodies reach 0.7
_GOOD_OVERLAP = 0.85  # of a body and its own masks, 0.93 to 0.97; other bodies reach 0.5 to 0.95
_COARSE = 0.7  # of a body whose own overlap with its masks is not known
_USUAL = 0.9
# Overlap below the fitness of a body that is coarse itself: right poses of one or two ellipsoids
# reach 0.01 to 0.09.
_WORSE, _CLEARLY_WORSE = 0.08, 0.15
_TURN = 0.5  # radians between the start and a pose that may be right, above which they differ
# Normals of points that face a camera, as cosines from its direction; and the share of a body's
# points, from which on those would be recognised at a right pose.
_FACING, _FACING_SHARE = 0.5, 0.15
_UNSEEN = 0.5  # confidence of the found pose below which the stored appearance is not seen there
# By which a pose is wrong: in metres, or a share of the longest side if that is more; a rotation.
WRONG_M, WRONG_SHARE = 0.02, 0.1
_WRONG_RAD = np.radians(15.0)
_UNLIKE = (
    "the images at the given start do not match the appearance in the body's file; correct the "
    "start, or leave it out to search for the object; if it only looks otherwise in another light, "
    "mark it with a mask or a target as well"
)
_ELSEWHERE = (
    "the appearance in the body's file is recognised {shift} and {degrees:.0f} degrees from the "
    "given start, so that all poses are wrong by as much; correct the start, or leave it out to "
    "search for the object"
)
_OTHER = (
    "the object in the mask does not match the appearance in the body's file: it may be another "
    "object, or another side of it, so that no pose is reported as tracking; give its own body, or "
    "if it is the same one in another light, its pose as the start"
)
_STRANGER = (
    "the object in the mask is not the one in the body's file: it does not match its appearance, "
    "and its outline overlaps the mask by {overlap:.2f} only (intersection over union), while its "
    "fitness to what it was made of is {fitness:.2f}; give that object's own body, or no body, to "
    "model it from this observation"
)
_MISFIT = (
    "the outline of the body overlaps the mask by {overlap:.2f} only (intersection over union, its "
    "own mask by about {own:.2g}): poses are wrong by as much as they differ, and mean nothing if "
    "it is another object; check the body and the mask"
)
_MISPLACED = (
    "the outline of the body at the given start overlaps the mask by {overlap:.2f} only "
    "(intersection over union, at the object's pose by about {own:.2g}): poses are wrong by as "
    "much as they differ; check start, body and mask"
)
_LOOSE = (
    "the outline of the body that was modelled overlaps its mask by {overlap:.2f} only "
    "(intersection over union, usually by about {own:.2g}): the mask may hold more than the "
    "object, or a part of it; look at the mask"
)


@dataclass(frozen=True, eq=False)
class Recognition:
    """The pose at which a body's stored appearance is recognised, near that of the start if it can.

    `is_unlike` says that it is not seen where the start is, `is_sure` that the images confirm the
    pose where it is seen; `off` is the distance of the two, in the body's unit and radians.
    `is_expected` says that a side which the appearance holds faces a camera at the start.
    """

    pose: Pose
    is_unlike: bool
    is_sure: bool
    off: tuple[float, float]
    is_expected: bool = False

    @property
    def is_elsewhere(self) -> bool:
        """Return whether it is surely recognised at another pose than that of the start."""
        return self.is_unlike and self.is_sure

    @property
    def confirms(self) -> bool:
        """Return whether it is surely recognised at the pose of the start."""
        return self.is_sure and not self.is_unlike


def is_misfit(overlap: float | None, fitness: float | None) -> bool:
    """Return whether a body overlaps its masks by less than the object's own body does.

    `fitness` is that of the body to what it was made of, None where it is not known.
    """
    return overlap is not None and overlap < _least(_GOOD_OVERLAP, fitness)


def is_contradicted(overlap: float | None, fitness: float | None, *, is_unlike: bool) -> bool:
    """Return whether masks clearly contradict a given body at its pose; as for `is_misfit`.

    Where its appearance is not recognised either, `is_unlike`, it is enough that it misfits.
    """
    if is_unlike:
        least = _COARSE if fitness is None else _least(_GOOD_OVERLAP, fitness)
    else:
        least = _least(_CONTRADICTED, fitness, _CLEARLY_WORSE)
    return overlap is not None and overlap < least


def _least(overlap: float, fitness: float | None, worse: float = _WORSE) -> float:
    return overlap if fitness is None else min(overlap, fitness - worse)


def body_doubts(
    subject: Subject, overlap: float | None, recognition: Recognition | None
) -> list[str]:
    """Report a body that is probably not the object's, or not where the object is.

    `overlap` is the intersection over union of its outline and the masks, None without masks;
    `recognition` is that of its stored appearance, None without one.

    Raises:
        TrackError: neither its appearance nor its outline is that of the object in the mask, though
            the body is known to fit better.

    """
    if subject.body is None:
        is_loose = is_misfit(overlap, None)
        return [_LOOSE.format(overlap=overlap, own=_USUAL)] if is_loose else []
    is_placed = subject.start is not None
    misfits = is_misfit(overlap, subject.fitness)
    is_unlike = recognition is not None and recognition.is_unlike
    if is_unlike and misfits and not is_placed and subject.fitness is not None:
        raise TrackError(_STRANGER.format(overlap=overlap, fitness=subject.fitness))
    doubts = [_UNLIKE if is_placed else _OTHER] if is_unlike else []
    if recognition is not None and recognition.is_elsewhere and is_placed:
        shift, turn = recognition.off
        words = f"{1e3 * shift:.0f} mm" if subject.is_metric else f"{shift:.3g} (no unit)"
        doubts = [_ELSEWHERE.format(shift=words, degrees=np.degrees(turn))]
    if misfits:
        own = _USUAL if subject.fitness is None else min(_USUAL, subject.fitness)
        doubts.append((_MISPLACED if is_placed else _MISFIT).format(overlap=overlap, own=own))
    return doubts


def turn_note(pose: Pose, others: Sequence[Pose]) -> str:
    """Report that the orientation at the start may be another one."""
    turns = [exact.norm((pose.inverse() @ other).log()[3:]) for other in others]
    return (
        "the body fits its mask in other orientations about as well, rotated by up to "
        f"{np.degrees(max(turns)):.0f} degrees from the one that is used, so that all poses may be "
        "rotated by as much; give its pose as a start, or a body that was saved with its appearance"
    )


def mask_overlaps(
    capture: Capture,
    instant: Instant,
    body: Body,
    masks: Sequence[NDArray[np.uint8] | None],
) -> NDArray[np.float64]:
    """Return the intersection over union of a body's outline and each mask, (M,) float64.

    `masks` has one entry per camera of the capture, None where there is no mask.
    """
    views = [
        View(camera=camera, world_from_camera=pose, mask=mask)
        for camera, pose, mask in zip(
            cameras_of(capture), instant.world_from_camera, masks, strict=True
        )
        if mask is not None
    ]
    return silhouette_ious(body, views) if views else np.empty(0)


def recognised(
    make: Callable[[], Follower], instant: Instant, subject: Subject, pose: Pose
) -> Recognition | None:
    """Recognise the object's stored appearance near the pose of the start, or anywhere else.

    It is sought in the whole images only if the start was given and nothing is recognised there:
    masks mark an object that may be another one. None if a given body has no appearance.

    Raises:
        TrackError: the appearance cannot be read, or it is not that of the body.

    """
    near = _recognised_by(make, instant, subject, (pose, pose))
    if near is None or near.is_sure or subject.start is None:
        return near
    anywhere = _recognised_by(make, instant, subject, (pose, None))
    return anywhere if anywhere is not None and anywhere.is_elsewhere else near


def _recognised_by(
    make: Callable[[], Follower],
    instant: Instant,
    subject: Subject,
    start: tuple[Pose, Pose | None],
) -> Recognition | None:
    """Search near a pose or, for None, anywhere, and compare what is found with the start."""
    if subject.body is None or subject.appearance is None:
        return None
    probe = make()
    if not isinstance(probe, Rememberer):
        return None
    recall(probe, subject.appearance)
    pose, near = start
    now, poses, images = instant.time_s, instant.world_from_camera, instant.images
    try:
        found = probe.find(now, poses, images, near, **depths_for(probe, instant))
    except TrackError:  # these images cannot be searched: no conclusion
        return None
    change = (pose.inverse() @ found.world_from_object).log()
    _, observable = unobservable_axes(found.unobservable, np.eye(3))
    shift, turn = exact.norm(change[:3]), exact.norm(exact.product(observable.T, change[3:]))
    is_sure = found.status == "tracking"
    allowed_m, allowed_rad = float(subject.body.radii.max()), _TURN
    if is_sure:
        wrong = WRONG_SHARE * float(body_sides(subject.body).max())
        wrong = max(WRONG_M, wrong) if subject.is_metric else wrong
        allowed_m, allowed_rad = min(allowed_m, wrong), _WRONG_RAD
    is_near = shift < allowed_m and turn < allowed_rad
    return Recognition(
        pose=found.world_from_object,
        is_unlike=found.confidence < _UNSEEN or not is_near,
        is_sure=is_sure,
        off=(shift, turn),
        is_expected=_faces(probe, pose, poses),
    )


def _faces(tracker: Follower, pose: Pose, world_from_camera: Sequence[Pose]) -> bool:
    """Return whether a good share of the known surface points face a camera at a pose."""
    if not isinstance(tracker, Surfaced):
        return False
    points, normals, _ = tracker.surface
    facing = np.zeros(len(points), bool)
    for one in world_from_camera:
        ways = (pose.inverse() @ one).translation - points
        facing |= (normals * ways).sum(axis=1) > _FACING * exact.lengths(ways)
    return int(facing.sum()) > _FACING_SHARE * len(points)
