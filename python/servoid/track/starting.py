"""Starts trackers: at a pose, in masks, or with a body modelled from the first observation."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from servoid import model
from servoid._native import Body, Estimate, Pose
from servoid.brief import brief
from servoid.camera import wrong_size
from servoid.capture import Capture
from servoid.errors import ModelError, TargetError, TrackError
from servoid.model import (
    center_notes,
    find_everywhere,
    mark,
    misregistered,
    swapped_note,
    views_meant,
)
from servoid.segment import Target
from servoid.shape import NO_UNIT, body_size_note, placed
from servoid.source import Instant, cameras_of
from servoid.track.distance_check import DistanceCheck, check_distance
from servoid.track.doubts import (
    body_doubts,
    is_contradicted,
    is_misfit,
    mask_overlaps,
    recognised,
    turn_note,
)
from servoid.track.follower import (
    Adjuster,
    Evolver,
    Follower,
    Rememberer,
    avoid,
    depths_for,
    recall,
)
from servoid.track.masked import Masks, masks_of, poses_at_masks
from servoid.track.request import Request, Subject
from servoid.track.result import Tracked
from servoid.track.smoothing import smoothed
from servoid.words import camera_called

_LEAST_OVERLAP = 0.1  # of a body and a mask; with less they are different objects
_ELSEWHERE = (
    "the given start is not where the mask of the first observation is, so the mask was not used; "
    "if it is the object's mask, correct the start or leave it out; if it is another one's, mark "
    "the object with --target"
)
_IN_DOUBT = "the pose of the start is in doubt, and no image confirms it"


def doubtful(wrong_by: str | None) -> str:
    """Return the notice with each pose that is in doubt from the start, and by what it is wrong."""
    return _IN_DOUBT if wrong_by is None else f"{wrong_by}: no image confirms a pose"


@dataclass(frozen=True, eq=False)
class Followed:
    """One object with its tracker and its first estimate.

    `starting_s` is the time up to the first estimate, including all that came before it, such as
    modelling. `overlap` is the intersection over union of the body's outline and the masks of the
    first observation, their mean; None without masks. `doubts` are those of the notes that doubt
    the mask, the body or the pose. `is_metric` is False if the body's lengths are in an unknown
    unit. `is_wrong` says that mask, appearance or measured distance contradict the start, or that
    the body was made of what is surely wrong, `wrong_by`: all later poses, which follow from it,
    are as well.
    """

    name: str
    tracker: Follower
    initial: Body
    colors: NDArray[np.uint8] | None
    notes: tuple[str, ...]
    first: Tracked
    starting_s: float
    overlap: float | None = None
    doubts: tuple[str, ...] = ()
    is_metric: bool = True
    is_wrong: bool = False
    wrong_by: str | None = None

    __repr__ = brief

    @property
    def body(self) -> Body:
        """Return the current body, in its own frame."""
        return getattr(self.tracker, "body", self.initial)

    def body_at(self, world_from_object: Pose) -> Body:
        """Return the current body at a pose."""
        return placed(self.body, world_from_object)

    @property
    def surface(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the learned surface points and their normals, (N, 3) float64 each."""
        known = getattr(self.tracker, "surface", None)
        return (np.empty((0, 3)), np.empty((0, 3))) if known is None else known[:2]

    def appearance(self) -> bytes | None:
        """Return the appearance of the object, None if the tracker provides none."""
        return self.tracker.appearance() if isinstance(self.tracker, Rememberer) else None

    def smoothed(self, estimates: Sequence[Estimate]) -> list[Pose]:
        """Return world_from_object of its estimates after all known corrections."""
        if not isinstance(self.tracker, Adjuster):
            return [one.world_from_object for one in estimates]
        return smoothed(estimates, self.tracker.keyframe_pose)

    def begin_evolving(self) -> None:
        """Let the body evolve while tracking, if the tracker supports it."""
        if isinstance(self.tracker, Evolver):
            self.tracker.begin_evolving()


@dataclass(frozen=True, eq=False)
class _Known:
    """The known state of an object when its tracker starts; without a pose it is searched for."""

    body: Body
    pose: Pose | None
    masks: Masks | None
    colors: NDArray[np.uint8] | None
    notes: tuple[str, ...] = ()
    others: tuple[Pose, ...] = ()  # at which the body fits its masks about as well
    doubts: tuple[str, ...] = ()  # those of the notes on the masks or the pose
    is_metric: bool = True
    wrong_by: str | None = None  # what its body was made of, if that is surely wrong


def begin(
    capture: Capture,
    instant: Instant,
    subject: Subject | None = None,
    request: Request | None = None,
    *,
    has_others: bool = False,
    others: Sequence[Body] = (),
) -> Followed:
    """Start the tracker of one object in the first observation.

    Without a `subject`, it is the one object in the capture's masks. With `has_others`, other
    objects are tracked as well, so that these masks may be another one's. `others` are those that
    are located already, as bodies at their poses: this one is not found there.

    Raises:
        TrackError: a known body has no pose, target, mask or appearance to locate it, it does not
            fit its mask, the mask is of another object, or a setting is out of range.
        DoubtError: a target may mean several objects, and the request does not trust it.
        TargetError: the object is not marked, or it is not found.
        ModelError, CameraError, ImageError, MaskError: as for `model.fit_capture`.

    """
    subject, request = subject or Subject(), request or Request()
    begun = time.perf_counter()
    known = _look(capture, instant, subject, request)
    cameras = cameras_of(capture)
    make = request.maker or request.method.maker
    recognition = None
    if known.pose is not None:
        plain = request.options(replace(subject, known_shape=False))
        recognition = recognised(
            lambda: make(cameras, known.body, plain), instant, subject, known.pose
        )
        if subject.start is None and recognition is not None and recognition.is_elsewhere:
            # What is recognised tells the pose better than an outline does.
            known = replace(known, pose=recognition.pose, others=())
            recognition = replace(recognition, is_unlike=False)
    overlap = _overlap(capture, instant, known)
    # The outline tells nothing of a turn that it did not even tell at the start, and a body that
    # does not fit is not the object's shape.
    is_known = subject.known_shape and not known.others and not is_misfit(overlap, subject.fitness)
    meant = replace(subject, known_shape=is_known)
    options = request.options(meant)
    tracker = make(cameras, known.body, options)
    called = time.perf_counter()
    avoid(tracker, others)
    estimate = _first_estimate(tracker, instant, known, subject)
    done = time.perf_counter()
    doubts = body_doubts(subject, overlap, recognition)
    confirms = recognition is not None and recognition.confirms
    distance = None if confirms else _distance(capture, instant, known, subject)
    if distance is not None and distance.doubt is not None:
        doubts.append(distance.doubt)
    is_own = bool(subject.targets) or not has_others
    is_unlike = recognition is not None and recognition.is_unlike
    is_off = (
        _ELSEWHERE in known.doubts or is_contradicted(overlap, subject.fitness, is_unlike=is_unlike)
    ) and (is_own and not confirms)
    is_off = is_off or (distance is not None and distance.is_wrong)
    # Without a mask nothing else supports a start at which the images should look as they do not.
    is_unsupported = overlap is None and recognition is not None and recognition.is_expected
    is_off = is_off or (is_unlike and is_unsupported)
    is_elsewhere = subject.body is not None and (is_unlike or is_off)
    # Where the pose was given, the object may look otherwise in another light. One that fits masks
    # alone may be one of several, or of another object, and no later image tells.
    is_guessed = subject.start is None
    wrong_by = known.wrong_by or _wrong_lens(capture)
    is_wrong = wrong_by is not None or (
        is_elsewhere
        and (is_off or is_guessed or (recognition is not None and recognition.is_elsewhere))
    )
    turned = None
    if known.pose is not None and known.others and subject.appearance is None:
        turned = turn_note(known.pose, known.others)
        doubts.append(turned)
    notices = list(estimate.notices)
    if is_elsewhere or is_wrong or turned is not None:
        # That it was given does not make its pose right.
        estimate = estimate.in_doubt(located=not (is_elsewhere or is_wrong))
        notices.append(doubtful(wrong_by))
    return Followed(
        name=subject.name,
        tracker=tracker,
        initial=known.body,
        colors=known.colors,
        notes=(*known.notes, *doubts),
        first=Tracked(
            index=instant.index,
            estimate=estimate,
            seconds=done - called,
            notices=instant.with_notices(notices),
        ),
        starting_s=done - begun,
        overlap=overlap,
        doubts=(*known.doubts, *doubts),
        is_metric=known.is_metric,
        is_wrong=is_wrong,
        wrong_by=wrong_by,
    )


def _first_estimate(
    tracker: Follower, instant: Instant, known: _Known, subject: Subject
) -> Estimate:
    now, poses, images = instant.time_s, instant.world_from_camera, instant.images
    depths = depths_for(tracker, instant)
    if known.pose is not None:
        return tracker.start(now, poses, images, known.pose, known.masks, **depths)
    if subject.appearance is None or not isinstance(tracker, Rememberer):
        raise TrackError(
            f"nothing says where '{subject.name}' is in observation {instant.index}; mark it there "
            "with --target or a mask, give its pose with --start, or give a body that was saved "
            "with its appearance"
        )
    recall(tracker, subject.appearance)
    return tracker.find(now, poses, images, **depths)


def _look(capture: Capture, instant: Instant, subject: Subject, request: Request) -> _Known:
    """Find what is known of an object; errors name the images that cannot be read."""
    _check_meant(capture, instant, subject.targets)
    try:
        return _known(capture, instant, subject, request)
    except (ModelError, TargetError) as error:
        if any(image is None for image in instant.images) and instant.notices:
            lost = "; ".join(instant.notices)
            error.args = (f"of observation {instant.index}, {lost}; so {error}",)
        elif subject.body is None and request.distance_m is None and _are_photographs(capture):
            error.args = (
                f"{error}; or, as these are images of one camera that all have masks: if they show "
                "an object at rest from several sides, model it with servoid model",
            )
        raise


def _are_photographs(capture: Capture) -> bool:
    """Return whether a capture may be one to model from: a recording seldom has many masks."""
    views = capture.all_views()
    return len(capture.cameras) == 1 < len(views) and all(view.has_mask for view in views)


def _check_meant(capture: Capture, instant: Instant, targets: Sequence[Target]) -> None:
    """Check that the images that targets mean can be read; a hue window may match in the others.

    Raises:
        TargetError: one cannot; another image shows the object elsewhere.

    """
    views = [view for view in capture.all_views() if view.index == instant.index]
    seen = dict(zip((camera.name for camera in capture.cameras), instant.images, strict=True))
    others = [view.name for view in views if seen[view.camera_name] is not None]
    for target in targets:
        meant = views_meant(target, views) if views else []
        if meant and not any(view.name in others for view in meant):
            raise TargetError(
                f"the target '{target}' means {meant[0].name}, which cannot be read: "
                f"{'; '.join(instant.notices)}; replace that image"
                + (f", or mark the object in another one, such as @{others[0]}" if others else "")
            )


def _known(capture: Capture, instant: Instant, subject: Subject, request: Request) -> _Known:
    usable, only = _usable(capture, instant), slice(instant.index, instant.index + 1)
    modelling = model.Request(
        seed=request.seed,
        trust_targets=request.trust_targets,
        trust_calibration=True,  # compared at the end
        progress=request.progress,
    )
    if subject.body is None:
        made = model.fit_capture(
            usable,
            modelling,
            targets=subject.targets,
            observations=only,
            distance_m=request.distance_m,
        )
        masks = masks_of(usable, made.used_views)
        return _Known(
            body=made.body,
            pose=made.body.world_from_object,
            masks=masks,
            colors=made.colors,
            notes=made.all_notes,
            doubts=made.all_doubts,
            is_metric=made.is_metric,
            wrong_by=made.wrong_by,
        )
    size = body_size_note(subject.body) if subject.is_metric else None
    if capture.metric and not subject.is_metric:
        size = NO_UNIT
    seen = (view for view in usable.all_views() if view.index == instant.index)
    doubts: tuple[str, ...] = (*(() if size is None else (size,)), *center_notes(seen))
    known = _Known(
        subject.body,
        subject.start,
        None,
        subject.colors,
        doubts,
        doubts=doubts,
        is_metric=subject.is_metric,
    )
    if subject.targets or any(view.index == instant.index for view in usable.views()):
        marked = mark(usable, subject.targets, only, trusted=request.trust_targets)
        # A mask in a single camera does not determine the distance of the object.
        views = marked.views if subject.start is not None else find_everywhere(marked, modelling)
        swapped = swapped_note([view.mask() for view in marked.views], marked.views)
        doubts = (*doubts, *marked.doubts, *(() if swapped is None else (swapped,)))
        off = misregistered(marked.views)
        doubts = doubts if off is None else (*doubts, off.words)
        known = replace(
            known,
            masks=masks_of(usable, views),
            notes=(*doubts, *marked.notes),
            doubts=doubts,
        )
    if subject.start is None:
        found = poses_at_masks(capture, instant, subject, known.masks, request.seed)
        pose, *others = found or (None,)
        return replace(known, pose=pose, others=tuple(others))
    if known.masks is not None:
        outlined = placed(subject.body, subject.start)
        overlaps = mask_overlaps(capture, instant, outlined, known.masks)
        if overlaps.size and overlaps.max() <= _LEAST_OVERLAP:
            doubts = (*known.doubts, _ELSEWHERE)
            return replace(known, masks=None, notes=(*known.notes, _ELSEWHERE), doubts=doubts)
    return known


def _wrong_lens(capture: Capture) -> str | None:
    found = (wrong_size(camera_called(one.name), one.lens) for one in capture.cameras)
    return next((words for words in found if words is not None), None)


def _overlap(capture: Capture, instant: Instant, known: _Known) -> float | None:
    """Return by how much a body at its pose overlaps its masks, the mean; None if it has none."""
    if known.pose is None or known.masks is None:
        return None
    overlaps = mask_overlaps(capture, instant, placed(known.body, known.pose), known.masks)
    return float(overlaps.mean()) if overlaps.size else None


def _distance(
    capture: Capture, instant: Instant, known: _Known, subject: Subject
) -> DistanceCheck | None:
    """Compare the distance of a given body with what is measured, where both are in metres."""
    if subject.body is None or known.pose is None or not (capture.metric and known.is_metric):
        return None
    views = [view for view in _usable(capture, instant).all_views() if view.index == instant.index]
    return check_distance(views, placed(known.body, known.pose))


def _usable(capture: Capture, instant: Instant) -> Capture:
    """Return the capture without the images of the instant that could not be read."""
    cameras = []
    for camera, image in zip(capture.cameras, instant.images, strict=True):
        pictures = list(camera.pictures)
        if image is None:
            pictures[instant.index] = None
        cameras.append(camera if image is not None else replace(camera, pictures=tuple(pictures)))
    return replace(capture, cameras=tuple(cameras))
