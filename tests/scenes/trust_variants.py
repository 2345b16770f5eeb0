"""Makes recordings harder, in memory and the same each time: other light, noise, covered eyes.

`benches/trust` measures what a tracker makes of them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.camera import Lens, Picture, read_mask
from servoid.camera.images import shrink
from servoid.capture import Capture, CaptureCamera
from servoid.sim.samples.folder import encode

NOISE, LIGHT, QUALITY = 15.0, 0.4, 30  # grey levels; times; of JPEG, to 100
STRUCK = 3  # images in a row that a fault strikes
# In each quarter of a recording: times of light at the left and right edge of the images, and its
# tint.
LAMPS = ((1.0, 1.0), (1.4, 0.3), (0.35, 0.35), (0.5, 1.6))
TINTS = ((1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.1, 1.0, 0.75), (0.9, 1.0, 1.1))

Image = NDArray[np.uint8]
Size = tuple[int, int]
Paint = Callable[[Image, int, int], Image]  # of an image, by its camera and observation
Change = Callable[[Capture, int, Path], Capture]  # of a capture, by a seed; a folder to write to


@dataclass(frozen=True, kw_only=True)
class Painted(Picture):
    """A picture that is changed when it is read; `full_px` is its size on disk, if not as asked."""

    paint: Callable[[Image], Image]
    full_px: Size | None = None

    def read(self, size_px: Size, by: int = 1) -> Image:
        """Read the image, change it, and shrink it; otherwise as `Picture.read`."""
        changed = self.paint(super().read(self.full_px or size_px))
        return np.asarray(shrink(changed, by), np.uint8)


@dataclass(frozen=True)
class Variant:
    """A recording as it is, or made harder; `every` counts images, `eyes` the cameras it needs."""

    name: str
    change: Change = lambda capture, _seed, _folder: capture
    every: int = 1
    eyes: int = 1


def painted(capture: Capture, paint: Paint) -> Capture:
    """Change each image of a capture when it is read."""
    cameras = []
    for number, camera in enumerate(capture.cameras):
        pictures = [
            picture and _painted(picture, number, index, paint)
            for index, picture in enumerate(camera.pictures)
        ]
        cameras.append(replace(camera, pictures=tuple(pictures)))
    return replace(capture, cameras=tuple(cameras))


def _painted(picture: Picture, number: int, index: int, paint: Paint) -> Painted:
    where = (picture.path, picture.index, picture.label, picture.upright)
    return Painted(*where, paint=lambda image: paint(image, number, index))


def noisy(capture: Capture, seed: int, _folder: Path) -> Capture:
    """Add noise to all images."""

    def paint(image: Image, number: int, index: int) -> Image:
        random = np.random.default_rng([seed, number, index])
        return _levels(image + random.normal(0.0, NOISE, image.shape))

    return painted(capture, paint)


def dark(capture: Capture, _seed: int, _folder: Path) -> Capture:
    """Take light from all images."""
    return painted(capture, lambda image, _number, _index: _levels(LIGHT * image))


def relit(capture: Capture, _seed: int, _folder: Path) -> Capture:
    """Switch lamps on either side on and off, after each quarter of the images."""
    count = len(capture)

    def paint(image: Image, _number: int, index: int) -> Image:
        quarter = min(len(LAMPS) * index // count, len(LAMPS) - 1)
        across = np.linspace(*LAMPS[quarter], image.shape[1])
        return _levels(image * (across[:, None] * np.array(TINTS[quarter])))

    return painted(capture, paint)


def coarse(capture: Capture, _seed: int, _folder: Path) -> Capture:
    """Store all images as JPEG of low quality."""

    def paint(image: Image, _number: int, _index: int) -> Image:
        data = np.frombuffer(encode(".jpg", image, QUALITY), np.uint8)
        stored = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)
        return np.ascontiguousarray(stored[..., ::-1])

    return painted(capture, paint)


def covered(capture: Capture, _seed: int, _folder: Path) -> Capture:
    """Cover the second eye from the middle on."""
    middle = len(capture) // 2

    def paint(image: Image, number: int, index: int) -> Image:
        return np.zeros_like(image) if number == 1 and index >= middle else image

    return painted(capture, paint)


def halved(capture: Capture, _seed: int, folder: Path) -> Capture:
    """Make all images half as large; masks are written to a folder."""
    return replace(capture, cameras=tuple(_halved(one, folder) for one in capture.cameras))


def _halved(camera: CaptureCamera, folder: Path) -> CaptureCamera:
    full, lens = camera.lens.size_px, camera.lens
    size = (full[0] // 2, full[1] // 2)

    def smaller(image: Image) -> Image:
        return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)

    def mask(path: Path) -> Path:
        small = smaller(read_mask(path, full))
        target = folder / f"{camera.name}-{path.stem}.png"
        target.write_bytes(encode(".png", np.where(small > 127, np.uint8(255), np.uint8(0))))
        return target

    pictures = [
        one and Painted(one.path, one.index, one.label, one.upright, paint=smaller, full_px=full)
        for one in camera.pictures
    ]
    return replace(
        camera,
        lens=Lens(
            model=lens.model,
            size_px=size,
            focal_px=(0.5 * lens.focal_px[0], 0.5 * lens.focal_px[1]),
            # Pixel (0, 0) is the centre of the first pixel.
            center_px=(0.5 * lens.center_px[0] - 0.25, 0.5 * lens.center_px[1] - 0.25),
            distortion=lens.distortion,
        ),
        pictures=tuple(pictures),
        mask_paths=tuple(path and mask(path) for path in camera.mask_paths),
    )


def faulty(capture: Capture, _seed: int, _folder: Path) -> Capture:
    """Let one fault after another strike: no images, no last image, frozen, black, white."""
    faults = (_dropped, _dropped_last, _frozen, _filled(0), _filled(255))
    for number, fault in enumerate(faults, 1):
        first = number * len(capture) // (len(faults) + 1)
        struck = range(first, min(first + STRUCK, len(capture)))
        capture = fault(capture, struck)
    return capture


def _struck(
    capture: Capture, struck: range, change: Callable[[CaptureCamera, int], Picture | None]
) -> Capture:
    cameras = []
    for camera in capture.cameras:
        pictures = list(camera.pictures)
        for index in struck:
            pictures[index] = change(camera, index)
        cameras.append(replace(camera, pictures=tuple(pictures)))
    return replace(capture, cameras=tuple(cameras))


def _dropped(capture: Capture, struck: range) -> Capture:
    return _struck(capture, struck, lambda _camera, _index: None)


def _dropped_last(capture: Capture, struck: range) -> Capture:
    last = replace(capture, cameras=capture.cameras[-1:])
    return replace(capture, cameras=(*capture.cameras[:-1], *_dropped(last, struck).cameras))


def _frozen(capture: Capture, struck: range) -> Capture:
    return _struck(capture, struck, lambda camera, _index: camera.pictures[struck[0] - 1])


def _filled(level: int) -> Callable[[Capture, range], Capture]:
    def paint(image: Image, _number: int, _index: int) -> Image:
        return np.full_like(image, level)

    def fill(camera: CaptureCamera, index: int) -> Picture | None:
        picture = camera.pictures[index]
        return picture and _painted(picture, 0, index, paint)

    return lambda capture, struck: _struck(capture, struck, fill)


def _levels(image: NDArray[np.floating]) -> Image:
    return np.clip(np.rint(image), 0.0, 255.0).astype(np.uint8)


VARIANTS = {
    one.name: one
    for one in (
        Variant("as it is"),
        Variant("every 2nd", every=2),
        Variant("every 3rd", every=3),
        Variant("every 4th", every=4),
        Variant("noise", noisy),
        Variant("half size", halved),
        Variant("JPEG", coarse),
        Variant("dark", dark),
        Variant("lamps", relit),
        Variant("eye covered", covered, eyes=2),
        Variant("faults", faulty),
    )
}
