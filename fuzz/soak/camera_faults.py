"""What goes wrong with cameras at random, in images that were fine."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Delivered = Image | None | object  # what a camera driver hands over, whatever it be

RARE = 0.02  # chance of an image to begin a fault, where none is on
LONGEST = 40  # images
STAMPS_S = (-5.0, -0.5, 0.0, 0.5, 5.0, 3600.0, float("nan"))
DRAWN = 16  # boards and noises that are drawn once


@dataclass(frozen=True, eq=False)
class Taken:
    """One observation as it reaches a tracker; None is an image that was dropped."""

    time_s: float
    images: tuple[Delivered, ...]

    @property
    def is_dark(self) -> bool:
        """Say if no camera delivered an image."""
        return all(image is None for image in self.images)


@dataclass(frozen=True, eq=False)
class On:
    """A fault that is on: its kind, the cameras that it strikes, and the images that it lasts."""

    kind: str
    cameras: frozenset[int]
    left: int


class CameraFaults:
    """Lets images be dropped, frozen, dark, blinded, noisy, covered, cut or no images at all.

    Stamps jump, and objects leap, which `leaps` says; what is struck and how long hangs on the
    random numbers alone.
    """

    def __init__(self, random: np.random.Generator, cameras: int) -> None:
        self._random, self._cameras = random, cameras
        self._on: On | None = None
        self._last: list[Delivered] = [None] * cameras
        self._ahead_s = 0.0
        self._board = random.integers(0, 256, (64, 64, 3), np.uint8)
        self._noise = [random.normal(0.0, 40.0, (240, 320, 3)) for _ in range(DRAWN)]

    @property
    def kind(self) -> str:
        """Return the name of the fault that is on, `none` if none is."""
        return "none" if self._on is None else self._on.kind

    def leaps(self) -> bool:
        """Go on to the next image; say if the object leaps before it."""
        if self._on is not None:
            left = self._on.left - 1
            self._on = replace(self._on, left=left) if left > 0 else None
        elif self._random.random() < RARE:
            self._on = self._drawn()
        return self.kind == "leap"

    def strike(self, time_s: float, images: tuple[Image, ...]) -> Taken:
        """Return what arrives of an observation."""
        on = self._on
        if on is not None and on.kind == "stamp":
            jump = float(self._random.choice(STAMPS_S))
            if np.isfinite(jump):
                self._ahead_s += jump
            else:
                return Taken(jump, images)
        arrived = list[Delivered](images)
        change = None if on is None else _CHANGES.get(on.kind)
        if on is not None and change is not None:
            for camera in on.cameras:
                arrived[camera] = change(self, camera, images[camera])
        self._last = arrived
        return Taken(time_s + self._ahead_s, tuple(arrived))

    def _drawn(self) -> On:
        kind = str(self._random.choice([*_CHANGES, "leap", "stamp"]))
        every = range(self._cameras)
        struck = frozenset(every) if self._random.random() < 0.5 else frozenset([self._one()])
        brief = kind in ("leap", "stamp")
        return On(kind, struck, 1 if brief else int(self._random.integers(1, LONGEST + 1)))

    def _one(self) -> int:
        return int(self._random.integers(self._cameras))

    def _dropped(self, camera: int, image: Image) -> Delivered:
        del camera, image
        return None

    def _frozen(self, camera: int, image: Image) -> Delivered:
        return image if self._last[camera] is None else self._last[camera]

    def _dark(self, camera: int, image: Image) -> Delivered:
        del camera
        return image // 50

    def _blinded(self, camera: int, image: Image) -> Delivered:
        del camera
        return np.full_like(image, 255)

    def _noisy(self, camera: int, image: Image) -> Delivered:
        del camera
        noise = self._noise[int(self._random.integers(DRAWN))]
        return np.clip(image + (noise if image.ndim == 3 else noise[..., 0]), 0, 255).astype(
            np.uint8
        )

    def _covered(self, camera: int, image: Image) -> Delivered:
        """Hold a board with print before a camera, over a half or more of the image."""
        del camera
        board = cv2.resize(self._board, (image.shape[1], image.shape[0])).astype(np.uint8)
        cut = int(self._random.integers(image.shape[1] // 4, image.shape[1]))
        covered = image.copy()
        covered[:, :cut] = board[:, :cut] if image.ndim == 3 else board[:, :cut, 0]
        return covered

    def _cut(self, camera: int, image: Image) -> Delivered:
        del camera
        return image[: int(self._random.integers(1, len(image)))].copy()

    def _no_image(self, camera: int, image: Image) -> Delivered:
        del camera
        odd = (image.astype(np.float32), "image", image[..., None, None], np.zeros((0, 0, 3)))
        return odd[int(self._random.integers(len(odd)))]


_CHANGES: dict[str, Callable[[CameraFaults, int, Image], Delivered]] = {
    "dropped": CameraFaults._dropped,
    "frozen": CameraFaults._frozen,
    "dark": CameraFaults._dark,
    "blinded": CameraFaults._blinded,
    "noisy": CameraFaults._noisy,
    "covered": CameraFaults._covered,
    "cut": CameraFaults._cut,
    "no image": CameraFaults._no_image,
}
KINDS = ("none", *_CHANGES, "leap", "stamp")
