"""What goes wrong with cameras, put into a recording that was fine."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Pose
from servoid.sim import MovingScene

Image = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Moment:
    """One observation in memory: the time, each camera's pose, and its image or None."""

    time_s: float
    world_from_camera: tuple[Pose, ...]
    images: tuple[Image | None, ...]


Moments = list[Moment]
Fault = Callable[[Sequence[Moment]], Moments]


def moments_of(scene: MovingScene, indices: Iterable[int] | None = None) -> Moments:
    """Look at a scene, or at some of its observations; the world is the room."""
    found = []
    for index in range(len(scene)) if indices is None else indices:
        poses = tuple(Pose(pose) for pose in scene.room_from_cameras(index))
        found.append(Moment(scene.time_s(index), poses, scene.look(index).images))
    return found


def with_images(
    moments: Sequence[Moment],
    at: Iterable[int],
    change: Callable[[int, Image], Image | None],
    camera: int | None = None,
) -> Moments:
    """Change the images of some observations, of one camera or of all."""
    chosen, changed = set(at), []
    for index, moment in enumerate(moments):
        images = tuple(
            change(number, image)
            if index in chosen and camera in (None, number) and image is not None
            else image
            for number, image in enumerate(moment.images)
        )
        changed.append(replace(moment, images=images))
    return changed


def dropped(moments: Sequence[Moment], *at: int, camera: int | None = None) -> Moments:
    return with_images(moments, at, lambda _, __: None, camera)


def filled(moments: Sequence[Moment], *at: int, level: int, camera: int | None = None) -> Moments:
    """Make images all of one grey level: 0 is a covered lens, 255 a blinded one."""
    return with_images(moments, at, lambda _, image: np.full_like(image, level), camera)


def wrong_size(moments: Sequence[Moment], *at: int, camera: int | None = None) -> Moments:
    return with_images(moments, at, lambda _, image: image[: len(image) // 2].copy(), camera)


def repeated(moments: Sequence[Moment], *at: int) -> Moments:
    """Deliver the images of the observation before once more, with a new time stamp."""
    changed = list(moments)
    for index in sorted(at):
        changed[index] = replace(changed[index], images=changed[index - 1].images)
    return changed


def shifted_clock(moments: Sequence[Moment], at: int, seconds: float) -> Moments:
    """Move the clock once: it jumps ahead, or runs back where `seconds` is negative."""
    return [
        replace(moment, time_s=moment.time_s + seconds) if index >= at else moment
        for index, moment in enumerate(moments)
    ]


def dead_camera(moments: Sequence[Moment], at: int, camera: int) -> Moments:
    return dropped(moments, *range(at, len(moments)), camera=camera)


def faults(at: int) -> dict[str, Fault]:
    """Name every kind of fault, each striking at the same observation."""
    return {
        "both images dropped": lambda moments: dropped(moments, at),
        "right image dropped": lambda moments: dropped(moments, at, camera=1),
        "images repeated": lambda moments: repeated(moments, at),
        "images black": lambda moments: filled(moments, at, level=0),
        "images white": lambda moments: filled(moments, at, level=255),
        "left image of another size": lambda moments: wrong_size(moments, at, camera=0),
        "clock jumps ahead": lambda moments: shifted_clock(moments, at, 5.0),
        "clock runs back": lambda moments: shifted_clock(moments, at, -0.5),
        "left camera dies": lambda moments: dead_camera(moments, at, 0),
        "right camera dies": lambda moments: dead_camera(moments, at, 1),
    }
