"""Sources of observations: a live rig, a recording and a simulation look the same."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Pose

_COUNTED = re.compile(r"\bcamera (\d+)\b")
_MISSING = " delivered no image"


@dataclass(frozen=True, eq=False)
class Instant:
    """One observation, ready for a tracker.

    `images` are those of the ideal pinhole cameras, (H, W) or (H, W, 3) uint8 RGB, None where a
    camera delivered nothing that can be used; `notices` say why. `depths` are depth images in their
    pixels, (H, W) float32, metres along z, NaN where unknown; none at all where no camera measures
    depth. `names` are the cameras'. `index` counts the observations that arrived, also those that
    nobody asked for in time.
    """

    index: int
    time_s: float
    world_from_camera: tuple[Pose, ...]
    images: tuple[NDArray[np.uint8] | None, ...]
    notices: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    depths: tuple[NDArray[np.float32] | None, ...] = ()

    def with_notices(self, notices: Sequence[str]) -> tuple[str, ...]:
        """Join what a tracker noticed, which counts cameras, to what is known of the images.

        Each is said once, with the cameras' names, and an image whose fault is known is not
        reported missing as well.
        """
        found = list(self.notices)
        for notice in notices:
            named = _COUNTED.sub(self._name, notice)
            known = any(one.startswith(f"{named.removesuffix(_MISSING)}: ") for one in self.notices)
            if named not in found and not (named.endswith(_MISSING) and known):
                found.append(named)
        return tuple(found)

    def _name(self, counted: re.Match[str]) -> str:
        number = int(counted[1])
        return f"camera {self.names[number]}" if number < len(self.names) else counted[0]

    @property
    def is_dark(self) -> bool:
        """Return whether no camera delivered an image."""
        return all(image is None for image in self.images)


@runtime_checkable
class Source(Protocol):
    """Delivers observations as they come."""

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the ideal pinhole cameras whose images are delivered."""
        ...

    def newest(self) -> Instant | None:
        """Return the newest observation that has arrived and was not returned yet, else None.

        Older ones that were not asked for are dropped. `time_s` of an observation is when its
        images were taken, on the clock of the arm, which is before they arrive.
        """
        ...
