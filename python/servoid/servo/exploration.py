"""Explores an object: views it from several viewpoints, and models a body from the images."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid import model
from servoid._native import Body
from servoid.capture import Capture, doubt_for_model, farthest_off, is_refuted, open_capture
from servoid.errors import ServoError
from servoid.model import ModelResult
from servoid.pose import Pose
from servoid.servo.arm import Arm
from servoid.servo.controller import Command, Controller
from servoid.servo.loop import brought_to_rest
from servoid.servo.next_best_view import check_runs, greatest_gain, next_viewpoint, visit
from servoid.servo.settings import LookSettings
from servoid.source import Instant, Source, write_looks
from servoid.track import Estimate, Follower
from servoid.words import counted, joined, were

Masks = tuple[NDArray[np.uint8] | None, ...]
ExplorationCallback = Callable[[str, float, Instant | None, Command | None], None]

_OFF = 10.0  # at 1000 px of diagonal: a hand-eye calibration that is off by 1.5 degrees
_PATIENCE = 2000  # control periods within which an image must arrive


@dataclass(frozen=True, eq=False)
class Exploration:
    """The result of exploring an object at rest in the world.

    `looks` are the observations, `masks` those of the first, by camera, and `capture` the folder
    that contains them. `world_from_hand` is the hand's first pose. `notes` are messages for the
    user.
    """

    looks: tuple[Instant, ...]
    masks: Masks
    result: ModelResult
    capture: Path
    world_from_hand: Pose
    notes: tuple[str, ...] = ()

    @property
    def body(self) -> Body:
        """Return the body, at its pose in the world."""
        return self.result.body

    @property
    def all_notes(self) -> tuple[str, ...]:
        """Return the messages on the looks and on the body."""
        return (*self.notes, *self.result.all_notes)

    def start_tracker(self, tracker: Follower) -> Estimate:
        """Start a tracker with all observations; return the estimate at the modelled pose.

        The tracker's estimates for the other looks are less accurate: the body was fitted to all.
        """
        pose = self.body.world_from_object
        first = self.looks[0]
        modelled = tracker.start(
            first.time_s, first.world_from_camera, first.images, pose, self.masks
        )
        for look in self.looks[1:]:
            tracker.step(look.time_s, look.world_from_camera, look.images)
        return modelled


def explore(
    arm: Arm,
    source: Source,
    controller: Controller,
    mask: Callable[[Instant], Masks],
    *,
    folder: Path,
    settings: LookSettings,
    request: model.Request,
    watch: ExplorationCallback | None = None,
) -> Exploration:
    """View an object at rest from several viewpoints, model it, and move the hand back.

    `mask` returns the object's masks in the first observation, by camera; one camera is enough. The
    observations are written to `folder` as a capture. With a single viewpoint the hand does not
    move. `watch` is called with stage and progress at each observation and command. The images are
    compared with the calibration of the cameras before the hand moves, and with the poses of the
    arm once it is back, unless the request trusts the calibration. What they contradict is a doubt
    of the model.

    Raises:
        ServoError: a camera gives no image, the arm's own driver has stopped it, or the images
            contradict the calibration or the poses of the cameras so far that the hand would miss
            the object.
        ModelError, TargetError, MaskError: the object cannot be modelled from the images.
        OutputError: the folder cannot be written.

    """
    progress = _Progress(arm, source, controller, settings, watch or (lambda *_: None))
    home = arm.world_from_hand(arm.state().positions)
    first = first_look(arm, source)
    masks = mask(first)
    progress.report("looking", 0.0, first, None)

    def modelled(looks: list[Instant], watched: model.Request) -> ModelResult:
        write_looks(folder, source.cameras, looks, masks)
        capture = open_capture(folder)
        doubt = None if request.trust_calibration else _doubt(capture)
        made = model.fit_capture(capture, replace(watched, trust_calibration=True))
        return made.doubted([doubt])

    result = modelled([first], request)
    looks = progress.around(result.body, first, home)
    if len(looks) > 1:
        watched = replace(
            request, progress=lambda made: progress.report("modelling", made.share, None, None)
        )
        result = modelled(looks, watched)
    return Exploration(tuple(looks), masks, result, folder, home, progress.notes(len(looks)))


def _doubt(capture: Capture) -> str | None:
    """Return what the images of looks have against calibration and poses, if it is little.

    Raises:
        ServoError: it is much.

    """
    doubt = doubt_for_model(capture)
    if doubt is not None and (is_refuted(capture) or farthest_off(capture) > _OFF):
        raise ServoError(
            f"{doubt}. The hand would be led beside the object, so there is no servoing; "
            f"{capture.path.parent} holds the images. To servo nevertheless: --trust-calibration, "
            "or trust_calibration in Python"
        )
    return doubt


@dataclass
class _Progress:
    """Moves a hand to successive viewpoints; `late` counts those that it did not reach in time.

    `ended` says why it visits no more of them.
    """

    arm: Arm
    source: Source
    controller: Controller
    settings: LookSettings
    report: ExplorationCallback
    visited: int = field(default=0, init=False)
    late: int = field(default=0, init=False)
    ended: str | None = field(default=None, init=False)

    def around(self, body: Body, first: Instant, home: Pose) -> list[Instant]:
        """Return observations from viewpoints around a body, with the first, and move back."""
        looks, place = [first], np.array(body.world_from_object.translation)
        for number in range(1, self.settings.count):
            positions = self.arm.state().positions
            viewpoint = next_viewpoint(self.arm, body, looks, self.settings, positions)
            if viewpoint is None:
                self.ended = self._why_none(body, looks)
                break
            share = number / self.settings.count
            seen = self._go("looking around", share, (viewpoint.world_from_hand, place))
            looks += [] if seen is None or seen.is_dark else [seen]
        if self.visited:
            self._go("coming back", 1.0, (home, place))
        return looks

    def notes(self, looks: int) -> tuple[str, ...]:
        """Report why there are fewer looks than asked for, and viewpoints not reached in time."""
        return (*self._fewer(looks), *self._late())

    def _fewer(self, looks: int) -> Iterator[str]:
        if self.ended is not None:
            views = counted(looks, "viewpoint")
            yield (
                f"the object was viewed from {views}, of {self.settings.count} at most "
                f"(servo.look.count): {self.ended}"
            )
        unseen = max(self.visited, 1) - looks  # `visited` counts the way back as well
        if unseen > 0:
            yield f"{counted(unseen, 'viewpoint')} gave no image and {were(unseen)} left out"

    def _late(self) -> Iterator[str]:
        if self.late:
            yield (
                f"{self.late} of {self.visited} viewpoints, including the start, "
                f"{were(self.late)} not reached within "
                f"{self.settings.patience_s:g} s (servo.look.patience_s); the images were taken "
                "from where the hand was"
            )

    def _why_none(self, body: Body, looks: list[Instant]) -> str:
        """Return why there is no further viewpoint, and which settings decide it."""
        least = f"another {100.0 * self.settings.least_gain:g} % of the surface"
        if greatest_gain(body, looks, self.settings) < self.settings.least_gain:
            return (
                f"no further one within {self.settings.widest_deg:g} degrees of the first shows "
                f"{least} (servo.look.widest_deg, servo.look.least_gain)"
            )
        return f"the arm reaches no further one that shows {least} (servo.look.least_gain)"

    def _go(
        self, stage: str, share: float, goal: tuple[Pose, NDArray[np.float64]]
    ) -> Instant | None:
        """Visit a viewpoint, and bring the arm to rest before the computation that follows."""
        seen, late = None, False

        def watch(command: Command) -> None:
            self.report(stage, share, None, command)

        with brought_to_rest(self.arm, self.controller, watch):
            for step in visit(self.arm, self.source, self.controller, goal, self.settings):
                self.report(stage, share, step.instant, step.command)
                seen, late = step.instant, step.late
        self.visited += 1
        self.late += late
        return seen


def first_look(arm: Arm, source: Source) -> Instant:
    """Return the first observation in which every camera delivered an image; the arm rests.

    Raises:
        ServoError: none comes, or the arm's own driver has stopped it.

    """
    given: Counter[str] = Counter()
    notice, came = "", 0
    for instant in _observations(arm, source):
        if all(image is not None for image in instant.images):
            return instant
        came += 1
        notice = instant.notices[-1] if instant.notices else notice
        for number, image in enumerate(instant.images):
            given[instant.called(number)] += image is not None
    raise ServoError(_why_no_look(given, came, arm.period_s, notice))


def awaited(arm: Arm, source: Source) -> Instant:
    """Return the next observation; the arm stays at rest.

    Raises:
        ServoError: none comes, or the arm's own driver has stopped it.

    """
    for instant in _observations(arm, source):
        return instant
    raise ServoError(_why_no_look({}, 0, arm.period_s, ""))


def _observations(arm: Arm, source: Source) -> Iterator[Instant]:
    """Yield the observations that come while the arm rests, as long as one is waited for.

    Raises:
        ServoError: the arm's own driver has stopped it.

    """
    rest = np.zeros(len(arm.joints.names))
    for _ in range(_PATIENCE):
        check_runs(arm.state(), "while it waited for images")
        instant = source.newest()
        if instant is not None:
            yield instant
        arm.command(rest)


def _why_no_look(given: Mapping[str, int], came: int, period_s: float, notice: str) -> str:
    """Return why no observation had an image of each camera.

    `given` counts the images of each camera in the observations that `came`, and `notice` is the
    newest one.
    """
    within = f"within {_PATIENCE * period_s:.0f} s"
    dark = [name for name, count in given.items() if count == 0]
    told = [f"{name} gave {count}" for name, count in given.items() if count]
    if not told:
        return f"no image came {within}; check that the cameras run{notice and f' ({notice})'}"
    if not dark:
        return (
            f"none of {counted(came, 'observation')} {within} had an image of every camera: "
            f"{joined(told)}; check the cameras{notice and f' ({notice})'}"
        )
    return (
        f"{joined(dark)} gave no image {within}, while {joined(told)}; "
        f"check {joined(dark)}{notice and f' ({notice})'}"
    )
