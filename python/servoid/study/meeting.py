"""A hand meets an object: it looks at it, looks around it, and a body of it is modelled."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid import model
from servoid._native import Body
from servoid.errors import ServoError
from servoid.model import ModelResult
from servoid.observe import Instant, Source, open_capture
from servoid.pose import Pose
from servoid.record import write_looks
from servoid.servo import Arm, Command, Controller, LookSettings, halt, next_viewpoint, visit
from servoid.track import Estimate, Follower

Masks = tuple[NDArray[np.uint8] | None, ...]
Watch = Callable[[str, float, Instant | None, Command | None], None]

_PATIENCE = 2000  # control periods in which the first image must come


@dataclass(frozen=True, eq=False)
class Meeting:
    """What is known of an object after it was looked at, at rest in the world.

    `looks` are the observations, `masks` those of the first, by camera, and `capture` the folder
    that holds them. `world_from_hand` is where the hand first stood.
    """

    looks: tuple[Instant, ...]
    masks: Masks
    result: ModelResult
    capture: Path
    world_from_hand: Pose

    @property
    def body(self) -> Body:
        """Return the body, at its place in the world."""
        return self.result.body

    def teach(self, tracker: Follower) -> Estimate:
        """Start a tracker with all that was seen; return where the object was as it was modelled.

        What the tracker says of the other looks is not as true: the body was fitted to all of them.
        """
        pose = self.body.world_from_object
        first = self.looks[0]
        modelled = tracker.start(
            first.time_s, first.world_from_camera, first.images, pose, self.masks
        )
        for look in self.looks[1:]:
            tracker.step(look.time_s, look.world_from_camera, look.images)
        return modelled


def meet(
    arm: Arm,
    source: Source,
    controller: Controller,
    mask: Callable[[Instant], Masks],
    *,
    folder: Path,
    settings: LookSettings,
    request: model.Request,
    watch: Watch | None = None,
) -> Meeting:
    """Look at an object that rests, look around it, model it, and bring the hand back.

    `mask` says where the object is in the first observation, by camera; one camera is enough. The
    observations are written to `folder` as a capture. With one place to look from the hand stays
    where it is. `watch` hears what is being done and its share, with each observation and command.

    Raises:
        ServoError: no image comes.
        ModelError, TargetError, MaskError: the object cannot be modelled from what was seen.
        OutputError: the folder cannot be written.

    """
    tell = watch or (lambda *_: None)
    home = arm.world_from_hand(arm.state().positions)
    looks = [first_look(arm, source)]
    masks = mask(looks[0])
    tell("looking", 0.0, looks[0], None)
    write_looks(folder, source.cameras, looks, masks)
    result = model.fit_capture(open_capture(folder), request)
    went = False
    for number in range(1, settings.count):
        positions = arm.state().positions
        viewpoint = next_viewpoint(arm, result.body, looks, settings, positions)
        if viewpoint is None:
            break
        went = True
        goal = (viewpoint.world_from_hand, _middle(result.body))
        for command, instant in visit(arm, source, controller, goal, settings):
            tell("looking around", number / settings.count, instant, command)
            if instant is not None and not instant.is_dark:
                looks.append(instant)
        _rest(arm, controller, tell, "looking around", number / settings.count)
    if went:
        for command, _ in visit(arm, source, controller, (home, _middle(result.body)), settings):
            tell("coming back", 1.0, None, command)
        _rest(arm, controller, tell, "coming back", 1.0)
    if len(looks) > 1:
        write_looks(folder, source.cameras, looks, masks)
        watched = replace(request, progress=lambda made: tell("modelling", made.share, None, None))
        result = model.fit_capture(open_capture(folder), watched)
    return Meeting(tuple(looks), masks, result, folder, home)


def first_look(arm: Arm, source: Source) -> Instant:
    """Return the first observation in which every camera sees something; the arm rests.

    Raises:
        ServoError: none comes.

    """
    rest = np.zeros(len(arm.joints.names))
    for _ in range(_PATIENCE):
        instant = source.newest()
        if instant is not None and all(image is not None for image in instant.images):
            return instant
        arm.command(rest)
    raise ServoError(
        f"no image came within {_PATIENCE * arm.period_s:.0f} s; check that the cameras run"
    )


def _rest(arm: Arm, controller: Controller, tell: Watch, stage: str, share: float) -> None:
    """Bring the arm to rest: nobody commands it while it is thought about what it saw."""
    for command in halt(arm, controller):
        tell(stage, share, None, command)


def _middle(body: Body) -> NDArray[np.float64]:
    return np.array(body.world_from_object.translation)
