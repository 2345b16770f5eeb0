"""Chooses where in each image features are detected, and copies masks of the object."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.camera import read_image, read_mask
from servoid.errors import MaskError, ScanError, TargetError
from servoid.scan.footage import image_name
from servoid.scan.staging import Staged
from servoid.segment import BoxTarget, Target, find_object

_SMALL_PX = 480  # the longer side of the images in which changes are detected
_BLUR_PX, _RANGE, _GAP_PX = 1.2, 20.0, 19  # smoothing, grey levels, and the size of holes to close
_BEYOND = 0.01  # of the diagonal: features at the outline belong to the object


def write_inside(inside: Path | Target, staged: Staged, folder: Path) -> None:
    """Write a mask for each staged image, with the image's name and .png at the end.

    Raises:
        ScanError: a mask is missing, or a target finds nothing in most images.
        ImageError, MaskError: a file cannot be used.

    """
    found = 0
    for file in staged.files:
        mask = _mask(inside, staged, file)
        found += bool(mask.any())
        _write(folder / f"{file}.png", mask)
    if 2 * found < len(staged.files):
        raise ScanError(
            f"'{inside}' finds the object in only {found} of {len(staged.files)} images; give "
            "--inside a folder of masks, or a box that contains the object in all images"
        )


def write_moving(staged: Staged, folder: Path) -> None:
    """Write masks of what changes between the images of a stationary camera.

    All masks are the same: the pixels whose brightness varies by more than noise and shadows do.
    """
    import cv2

    width, height = staged.size_px
    by = min(1.0, _SMALL_PX / max(staged.size_px))
    small = (max(1, round(by * width)), max(1, round(by * height)))
    greys = []
    for file in staged.files:
        image = read_image(staged.folder / file, staged.size_px)
        grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        shrunk = cv2.resize(grey, small, interpolation=cv2.INTER_AREA)
        greys.append(cv2.GaussianBlur(shrunk, (0, 0), _BLUR_PX))
    low, high = np.quantile(np.stack(greys), [0.05, 0.95], axis=0)
    moving = np.where(high - low > _RANGE, 255, 0).astype(np.uint8)
    moving = cv2.morphologyEx(moving, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    moving = cv2.morphologyEx(moving, cv2.MORPH_CLOSE, np.ones((_GAP_PX, _GAP_PX), np.uint8))
    mask = cv2.resize(moving, (width, height), interpolation=cv2.INTER_NEAREST)
    for file in staged.files:
        _write(folder / f"{file}.png", np.asarray(mask, np.uint8))


def copy_masks(masks: Path, staged: Staged, folder: Path) -> int:
    """Copy masks of the object that are named like staged images; return their number.

    Raises:
        ScanError: no mask is named like an image.
        MaskError: one cannot be used.

    """
    count = 0
    named = _named(masks)
    for file in staged.files:
        path = named.get(Path(file).stem)
        if path is not None:
            _write(folder / f"{Path(file).stem}.png", read_mask(path, staged.size_px))
            count += 1
    if not count:
        raise ScanError(
            f"no mask in {masks} is named like an image; name them so, such as "
            f"{Path(staged.files[0]).stem}.png"
        )
    return count


def _named(masks: Path) -> dict[str, Path]:
    """Map the names of images to their masks."""
    return {image_name(path.stem): path for path in sorted(masks.glob("*.png"))}


def _mask(inside: Path | Target, staged: Staged, file: str) -> NDArray[np.uint8]:
    width, height = staged.size_px
    if isinstance(inside, Path):
        path = _named(inside).get(Path(file).stem)
        if path is None:
            missing = inside / f"{Path(file).stem}.png"
            raise ScanError(f"--inside: there is no {missing}; give each image a mask of its name")
        return _wider(read_mask(path, staged.size_px))
    mask = np.zeros((height, width), np.uint8)
    if isinstance(inside, BoxTarget):
        left, top = max(0, round(inside.u0)), max(0, round(inside.v0))
        mask[top : round(inside.v1) + 1, left : round(inside.u1) + 1] = 255
        return mask
    image = read_image(staged.folder / file, staged.size_px)
    try:
        return _wider(find_object(inside, image, trusted=True))
    except (TargetError, MaskError):
        return mask


def _wider(mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
    import cv2

    side = 2 * max(1, round(_BEYOND * float(np.hypot(*mask.shape)))) + 1
    return np.asarray(cv2.dilate(mask, np.ones((side, side), np.uint8)), np.uint8)


def _write(path: Path, mask: NDArray[np.uint8]) -> None:
    import cv2

    cv2.imwrite(str(path), mask)
