"""Sources of observations: live rigs, recordings and simulations have the same interface."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Pose
from servoid.brief import brief
from servoid.words import camera_called

_COUNTED = re.compile(r"\bcamera (\d+)\b")
_MISSING = " delivered no image"


@dataclass(frozen=True, eq=False)
class Instant:
    """One observation, ready for a tracker.

    `images` are those of the ideal pinhole cameras, (H, W) or (H, W, 3) uint8 RGB, None where a
    camera delivered nothing usable; `notices` give the reasons. `depths` are depth images in their
    pixels, (H, W) float32, metres along z, NaN where unknown; empty if no camera measures depth.
    `names` are the cameras' names. `index` counts the observations that arrived, including those
    that nobody requested in time.
    """

    index: int
    time_s: float
    world_from_camera: tuple[Pose, ...]
    images: tuple[NDArray[np.uint8] | None, ...]
    notices: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    depths: tuple[NDArray[np.float32] | None, ...] = ()

    __repr__ = brief

    def with_notices(self, notices: Sequence[str]) -> tuple[str, ...]:
        """Merge a tracker's notices, which number the cameras, with the notices of the images.

        Each is reported once, with the cameras' names. An image whose fault is known is not
        reported as missing as well.
        """
        found = list(self.notices)
        for notice in notices:
            named = _COUNTED.sub(self._name, notice)
            known = any(one.startswith(f"{named.removesuffix(_MISSING)}: ") for one in self.notices)
            if named not in found and not (named.endswith(_MISSING) and known):
                found.append(named)
        return tuple(found)

    def called(self, number: int) -> str:
        """Name the camera of an image in a sentence: `camera left`, or its number without names."""
        return camera_called(self.names[number] if number < len(self.names) else str(number))

    def _name(self, counted: re.Match[str]) -> str:
        return self.called(int(counted[1]))

    @property
    def is_dark(self) -> bool:
        """Return whether no camera delivered an image."""
        return all(image is None for image in self.images)


@runtime_checkable
class Source(Protocol):
    """Delivers observations as they arrive."""

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the ideal pinhole cameras whose images are delivered."""
        ...

    def newest(self) -> Instant | None:
        """Return the newest observation that has arrived and was not yet returned, else None.

        Older ones that were not requested are dropped. `time_s` of an observation is when its
        images were taken, on the arm's clock, which is before they arrive.
        """
        ...
