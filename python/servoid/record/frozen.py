"""Notices cameras that send the same image again and again."""

from collections.abc import Sequence
from dataclasses import dataclass

from servoid.source import MountedCamera, RawImage, RawInstant
from servoid.words import camera_called

_LEAST_S = 2.0
_LEAST_IMAGES = 10


@dataclass(frozen=True, eq=False)
class _Run:
    """Equal images of a camera, in sequence."""

    image: RawImage
    first_s: float
    last_s: float
    count: int = 1

    @property
    def seconds(self) -> float:
        return self.last_s - self.first_s


class FrozenWatch:
    """Compares the images of each camera with the ones before: noise makes each of them another."""

    def __init__(self, rig: Sequence[MountedCamera]) -> None:
        self._names = [camera.name for camera in rig]
        self._runs: list[_Run | None] = [None] * len(rig)
        self._longest: list[_Run | None] = [None] * len(rig)

    def add(self, raw: RawInstant) -> None:
        """Take in an observation."""
        for place, image in enumerate(raw.images):
            if image is None:
                continue
            run = self._runs[place]
            if run is not None and _is_same(run.image, image):
                run = _Run(image, run.first_s, image.time_s, run.count + 1)
            else:
                run = _Run(image, image.time_s, image.time_s)
            self._runs[place] = run
            longest = self._longest[place]
            if longest is None or run.seconds > longest.seconds:
                self._longest[place] = run

    def notes(self) -> list[str]:
        """Return a message on each camera that sent one image for seconds."""
        return [
            f"{camera_called(name)} sent the same image {run.count} times, bit by bit, from "
            f"{run.first_s:.1f} to {run.last_s:.1f} s: it is frozen, or its sender repeats itself"
            for name, run in zip(self._names, self._longest, strict=True)
            if run is not None and run.seconds >= _LEAST_S and run.count >= _LEAST_IMAGES
        ]


def _is_same(one: RawImage, other: RawImage) -> bool:
    if one.encoded is not None and other.encoded is not None:
        return one.encoded == other.encoded
    return one.pixels.shape == other.pixels.shape and one.pixels.tobytes() == other.pixels.tobytes()
