"""Marks the object of a simulated world in its first image, as a person would do it."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from servoid.errors import TargetError
from servoid.segment import BoxTarget, ClickTarget, Target, find_object, parse_target
from servoid.servo import Masks
from servoid.sim.trial.settings import BY_BOX, BY_CLICK, BY_HAND, RunSettings
from servoid.sim.world import World, hand_drawn, hand_missed
from servoid.source import Instant

Mask = NDArray[np.uint8]


def marker(world: World, run: RunSettings) -> Callable[[Instant], Masks]:
    """Return the target that marks the object in the first observation of a world.

    Raises:
        TargetError: the target names a view of no camera.

    """
    if run.target == BY_HAND:
        return lambda _: _alone(_drawn(world), world, 0)
    target = None if run.target in (BY_BOX, BY_CLICK) else parse_target(run.target)
    place = _camera(world, target)

    def mark(instant: Instant) -> Masks:
        meant = target or _pointed(world, run.target)
        image = instant.images[place]
        assert image is not None  # the first observation contains images of all cameras
        return _alone(find_object(meant, image, trusted=run.trust_target), world, place)

    return mark


def _camera(world: World, target: Target | None) -> int:
    view = None if target is None else target.view
    if view is None:
        return 0
    if view not in world.camera_names:
        raise TargetError(
            f"the target '{target}' is meant for the view '{view}', but the cameras are "
            f"{', '.join(world.camera_names)}; leave it out for the first"
        )
    return world.camera_names.index(view)


def _alone(mask: Mask, world: World, place: int) -> Masks:
    masks: list[Mask | None] = [None] * len(world.cameras)
    masks[place] = mask
    return tuple(masks)


def _drawn(world: World) -> Mask:
    """Return the object's mask with the error of a hand-drawn outline."""
    settings = world.settings
    return hand_drawn(world.masks()[0], settings.in_effect.mask_px, settings.seed)


def _pointed(world: World, kind: str) -> Target:
    """Return a box or a click on the object, with the error of a person."""
    settings = world.settings
    # People choose whole pixels.
    missed = np.rint(hand_missed(4, settings.in_effect.mask_px, settings.seed))
    rows, columns = np.nonzero(world.masks()[0])
    if not len(rows):
        raise TargetError(
            "the object is not visible in the first left image, so it cannot be marked there; "
            "choose another world.object.hand_from_object"
        )
    if kind == BY_CLICK:
        # A person clicks well inside the object, whatever its shape.
        middle = np.argmin(np.square(rows - rows.mean()) + np.square(columns - columns.mean()))
        return ClickTarget(float(columns[middle] + missed[0]), float(rows[middle] + missed[1]))
    corners = np.array([columns.min(), rows.min(), columns.max(), rows.max()]) + missed
    left, top, right, bottom = corners.tolist()
    return BoxTarget(left, top, right, bottom)
