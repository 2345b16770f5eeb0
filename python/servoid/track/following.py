"""Tracks objects through a capture or a live source, and yields each result at once."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from servoid.brief import brief
from servoid.capture import (
    Capture,
    Observation,
    doubt_calibration,
    doubt_edited,
    doubt_moved,
    doubt_step,
    examine_rig_poses,
    is_refuted,
)
from servoid.errors import TrackError
from servoid.source import Feed, Instant, read_instants
from servoid.track.apart import (
    Pairs,
    body_of,
    check_targets_differ,
    marked_in_one_place,
    others_of,
    still_together,
    told_apart,
)
from servoid.track.follower import avoid, depths_for
from servoid.track.gone import gone_note
from servoid.track.request import Request, Subject
from servoid.track.result import Tracked, TrackResult
from servoid.track.starting import Followed, begin, doubtful
from servoid.words import counted

_MOVES = (
    "; if most of what the cameras see moves instead, as around a vehicle: --trust-poses, or "
    "trust_poses in Python"
)


@dataclass(frozen=True, eq=False)
class TrackStep:
    """The result of one observation: an estimate for each object, in the order of the subjects.

    `share` is the share of the capture that is done, 0 to 1; 0 where the end is unknown.
    """

    instant: Instant
    objects: tuple[Followed, ...]
    tracked: tuple[Tracked, ...]
    share: float

    __repr__ = brief


def follow(
    capture: Capture, subjects: Sequence[Subject] | None = None, request: Request | None = None
) -> Iterator[TrackStep]:
    """Track objects through a capture, and yield the result of each observation.

    An observation without a readable image is passed to the trackers without images; only before
    the start are such observations skipped. Without `subjects`, the one object in the capture's
    masks is tracked.

    Raises:
        TrackError: no observation is selected, none has an image, two objects have one name, or a
            tracker cannot start.
        As for `begin`: errors of the first observation or the settings.

    """
    request = request or Request()
    if not isinstance(capture, Capture):
        raise TrackError(
            f"a capture is followed, but {_described(capture)} was given; open it with "
            "servoid.capture.open_capture"
        )
    subjects = _checked(subjects)
    observations = _chosen(capture, request.observations, request.every)
    instants = read_instants(capture, observations)
    first, why = None, ""
    for instant in instants:
        if not instant.is_dark:
            first = instant
            break
        why = why or next(iter(instant.notices), "")
    if first is None:
        raise TrackError(
            f"{capture.path}: no image of the {counted(len(observations), 'observation')} "
            f"can be read: {why or 'check the first'}"
        )
    passed = next(at for at, one in enumerate(observations) if one.index == first.index)
    objects = _begin_all(capture, first, subjects, request)
    if passed:
        note = (
            f"the first {counted(passed, 'observation has', 'observations have')} no image "
            "that can be read"
        )
        objects = tuple(replace(one, notes=(*one.notes, note)) for one in objects)
    begun = _begun(first, objects, subjects, request)
    for count, step in enumerate(_steps(begun, instants, request.evolve_every), start=1):
        yield replace(step, share=(passed + count) / len(observations))


def follow_live(
    feed: Feed, subjects: Sequence[Subject] | None = None, request: Request | None = None
) -> Iterator[TrackStep]:
    """Track objects through a live source, always in its newest observation.

    A recording of the same observations, tracked by `follow`, gives the same estimates. The end is
    unknown, so `share` is 0. `observations` and `every` of a request are ignored.

    Raises:
        CaptureError: no image came.
        TrackError: two objects have one name, or a tracker cannot start.
        As for `begin`: errors of the first observation or the settings.

    """
    request = request or Request()
    subjects = _checked(subjects)
    capture, first = feed.first()
    objects = _begin_all(capture, first, subjects, request)
    begun = _begun(first, objects, subjects, request)
    yield from _steps(begun, iter(feed), request.evolve_every)


def track_capture(
    capture: Capture,
    subjects: Sequence[Subject] | None = None,
    request: Request | None = None,
    watch: Callable[[TrackStep], None] | None = None,
) -> list[TrackResult]:
    """Track objects through a capture, and return the track of each, in the order of the subjects.

    The images are compared with each other, with the calibration and with the poses of the rig, as
    `doubt_capture` does.
    `watch` is called after each observation. If it raises, or Ctrl-C is pressed, nothing is
    returned; use `follow` and `Collector` to keep the results so far.

    Raises:
        As for `follow`.

    """
    collector = Collector()
    for step in follow(capture, subjects, request):
        collector.add(step)
        if watch is not None:
            watch(step)
    return doubt_capture(capture, collector.results(), request)


def doubt_capture(
    capture: Capture, results: Sequence[TrackResult], request: Request | None = None
) -> list[TrackResult]:
    """Return tracks with what the images have against the calibration and the poses of the rig.

    `results` are the tracks of all objects in the capture; what was tracked does not rest, and is
    left out. Cameras out of step are reported alone, as they contradict a right calibration, too,
    and so are images that were shifted or enlarged after they were taken. Where it is sure that the
    calibration or the poses of the rig are wrong, or that the images were changed, those of the
    object are wrong, and none has the status `tracking`; where one of several cameras was moved
    meanwhile, none has it from there on. A request that trusts the poses of the rig leaves what
    contradicts only these at a doubt.
    """
    if not results:
        return []
    among = [one.index for one in results[0].tracked]
    gone = gone_note(
        [one.notices for one in results[0].tracked],
        [one.estimate.time_s for one in results[0].tracked],
        len(capture.cameras),
    )
    results = [replace(one, gone=gone) for one in results]
    late = doubt_step(capture, among=among)
    if late is not None:
        return [replace(one, step_doubt=late) for one in results]

    def may_move(index: int) -> list[tuple[NDArray[np.float64], float]]:
        return [ball for one in results if (ball := one.ball_at(index)) is not None]

    edited = doubt_edited(capture, may_move, among=among)
    if edited is not None:
        return [replace(one.unconfirmed(), edit_doubt=edited) for one in results]
    moved = doubt_moved(capture, may_move, among=among)
    if moved is not None and moved.is_apart:
        told = (one.unconfirmed(moved.since) for one in results)
        return [replace(one, calibration_doubt=moved.words) for one in told]
    together = None if moved is None else moved.words
    last = results[0].tracked[-1].index
    doubt = doubt_calibration(capture, last=last)
    if doubt is not None:
        told = (one.unconfirmed() for one in results) if is_refuted(capture) else results
        return [replace(one, calibration_doubt=doubt, rig_doubt=together) for one in told]
    found = examine_rig_poses(capture, may_move, among=among)
    if found is None:
        return [replace(one, rig_doubt=together) for one in results]
    if not found.is_sure or (request is not None and request.trust_poses):
        return [replace(one, rig_doubt=found.words) for one in results]
    words = f"{found.words}{_MOVES}"
    return [replace(one.unconfirmed(), rig_doubt=words) for one in results]


@dataclass(frozen=True, eq=False)
class _Begun:
    """The first observation, the objects whose trackers it started, and which bodies evolve.

    `nested` are those that were marked in one place.
    """

    first: Instant
    objects: tuple[Followed, ...]
    evolving: tuple[bool, ...]
    nested: Pairs


def _steps(begun: _Begun, instants: Iterator[Instant], evolve_every: int) -> Iterator[TrackStep]:
    """Yield the first step, and one for each further observation; `share` is left to the caller."""
    objects, nested = begun.objects, begun.nested
    last = tuple(one.first for one in objects)
    yield TrackStep(begun.first, objects, last, 0.0)
    for count, instant in enumerate(instants, start=1):
        is_turn = count % evolve_every == 0
        tracked = list(last)
        for place, (one, evolves) in enumerate(zip(objects, begun.evolving, strict=True)):
            avoid(one.tracker, others_of(place, objects, tracked, nested))
            tracked[place] = _step(one, instant, is_turn and evolves)
        nested = still_together(objects, tracked, nested)
        last = told_apart(objects, tracked, nested)
        yield TrackStep(instant, objects, last, 0.0)


class Collector:
    """Collects steps into tracks."""

    def __init__(self) -> None:
        self._objects: tuple[Followed, ...] = ()
        self._tracked: list[tuple[Tracked, ...]] = []

    def __len__(self) -> int:
        return len(self._tracked)

    def add(self, step: TrackStep) -> None:
        """Keep the estimates of a step, without its images."""
        self._objects = step.objects
        self._tracked.append(step.tracked)

    def results(self) -> list[TrackResult]:
        """Return the track of each object so far."""
        results = []
        for place, one in enumerate(self._objects):
            tracked = tuple(step[place] for step in self._tracked)
            body = one.body_at(tracked[-1].estimate.world_from_object)
            same = one.colors is not None and len(one.colors) == len(body)
            results.append(
                TrackResult(
                    name=one.name,
                    tracked=tracked,
                    smoothed=one.smoothed([each.estimate for each in tracked]),
                    body=body,
                    colors=one.colors if same else None,
                    appearance=one.appearance(),
                    notes=one.notes,
                    doubts=one.doubts,
                    starting_s=one.starting_s,
                    overlap=one.overlap,
                    wrong_by=one.wrong_by,
                    is_metric=one.is_metric,
                )
            )
        return results


def _step(one: Followed, instant: Instant, may_evolve: bool) -> Tracked:
    called = time.perf_counter()
    seen = (instant.time_s, instant.world_from_camera, instant.images)
    estimate = one.tracker.step(*seen, **depths_for(one.tracker, instant))
    done = time.perf_counter()
    notices = list(estimate.notices)
    if one.is_wrong:
        estimate = estimate.in_doubt(located=False)
        notices.append(doubtful(one.wrong_by))
    tracked = Tracked(
        index=instant.index,
        estimate=estimate,
        seconds=done - called,
        notices=instant.with_notices(notices),
    )
    if may_evolve and tracked.is_tracked:
        one.begin_evolving()
    return tracked


def _begin_all(
    capture: Capture, first: Instant, subjects: Sequence[Subject], request: Request
) -> tuple[Followed, ...]:
    check_targets_differ(subjects)
    has_others = len(subjects) > 1
    begun: dict[str, Followed] = {}
    # What is marked or placed goes first, so that nothing that is sought is found there.
    for subject in sorted(subjects, key=lambda one: one.is_sought):
        others = [body_of(one, one.first) for one in begun.values() if one.first.estimate.located]
        begun[subject.name] = begin(
            capture, first, subject, request, has_others=has_others, others=others
        )
    return tuple(begun[subject.name] for subject in subjects)


def _begun(
    first: Instant,
    objects: tuple[Followed, ...],
    subjects: Sequence[Subject],
    request: Request,
) -> _Begun:
    nested = marked_in_one_place(subjects, objects)
    told = told_apart(objects, [one.first for one in objects], nested)
    apart = tuple(replace(one, first=each) for one, each in zip(objects, told, strict=True))
    return _Begun(first, apart, tuple(request.evolves(subject) for subject in subjects), nested)


def _checked(given: Sequence[Subject] | None) -> list[Subject]:
    """Return the objects to track: one without properties if none are given."""
    subjects = [Subject()] if given is None else list(given)
    if not subjects:
        raise TrackError("nothing to track was given; give at least one subject")
    for subject in subjects:
        if not isinstance(subject, Subject):
            raise TrackError(
                f"a subject to track must be a servoid.track.Subject, but {_described(subject)} "
                "was given; write Subject(body=...) for a body, Subject(name=...) for a name"
            )
    names = [subject.name for subject in subjects]
    for name in names:
        if names.count(name) > 1:
            raise TrackError(f"two objects are named '{name}'; give each its own name")
    return subjects


def _described(given: object) -> str:
    return f"{given!r:.40} of type {type(given).__name__}"


def _chosen(capture: Capture, observations: slice, every: int) -> list[Observation]:
    """List the selected observations: every `every`-th of the slice.

    Raises:
        TrackError: none is selected.

    """
    found = capture.observations()[observations][::every]
    if not found:
        raise TrackError(
            f"{capture.path}: the range of observations selects none of the {len(capture)}; "
            f"choose among 0 to {len(capture) - 1}"
        )
    return found
