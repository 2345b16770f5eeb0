"""Grows masks from sparse hints: GrabCut on a small copy, then border refinement at full size."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.errors import TargetError

Mask = NDArray[np.uint8]
Image = NDArray[np.uint8]

LONGEST_SIDE_PX = 128
ROUNDS = 4
_MARGIN = 0.2
_LEAST_MARGIN_PX = 6
_SEED = 1
# The labels of OpenCV's grabCut.
NOT, CERTAIN, MAYBE_NOT, MAYBE = 0, 1, 2, 3


@dataclass(frozen=True)
class Window:
    """A part of an image, and the factor by which its copy is shrunk."""

    rows: slice
    columns: slice
    small_px: tuple[int, int]

    @classmethod
    def around(
        cls, mask: Mask, longest_px: int = LONGEST_SIDE_PX, margin: float = _MARGIN
    ) -> "Window":
        """Return the window around a mask's pixels with a margin, a share of its longer side."""
        (top, bottom), (left, right) = (
            np.flatnonzero(mask.any(axis=axis))[[0, -1]].tolist() for axis in (1, 0)
        )
        border = max(_LEAST_MARGIN_PX, round(margin * max(bottom - top, right - left)))
        rows = slice(max(0, top - border), min(mask.shape[0], bottom + border + 1))
        columns = slice(max(0, left - border), min(mask.shape[1], right + border + 1))
        height, width = rows.stop - rows.start, columns.stop - columns.start
        shrink = min(1.0, longest_px / max(height, width))
        small_px = max(1, round(shrink * width)), max(1, round(shrink * height))
        return cls(rows, columns, small_px)

    @classmethod
    def whole(cls, shape: tuple[int, ...], longest_px: int) -> "Window":
        """Return the window of a whole image of a shape (H, W, ...)."""
        height, width = shape[:2]
        shrink = min(1.0, longest_px / max(height, width))
        small_px = max(1, round(shrink * width)), max(1, round(shrink * height))
        return cls(slice(0, height), slice(0, width), small_px)

    def small(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Crop the window and shrink it; each new pixel is the mean of those it covers."""
        import cv2

        part = np.ascontiguousarray(pixels[self.rows, self.columns])
        return np.asarray(cv2.resize(part, self.small_px, interpolation=cv2.INTER_AREA), np.uint8)

    def full(self, small: Mask, shape: tuple[int, ...]) -> Mask:
        """Insert a small mask at its position in a mask of the image's shape."""
        import cv2

        height = self.rows.stop - self.rows.start
        width = self.columns.stop - self.columns.start
        grown = cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR)
        mask = np.zeros(shape[:2], dtype=np.uint8)
        mask[self.rows, self.columns] = np.where(np.asarray(grown) > 127, 255, 0)
        return mask


def grow_mask(
    image: Image,
    certain: Mask,
    possible: Mask,
    *,
    likely: Mask | None = None,
    rounds: int = ROUNDS,
) -> Mask:
    """Grow a mask with GrabCut from certain pixels into possible pixels.

    Pixels that are not possible are used as background, so there must be some. GrabCut's colour
    models start from `likely`, by default all possible pixels. GrabCut runs on a copy of at most
    128 pixels a side; the border is then refined on the image itself.

    Args:
        image: (H, W, 3) uint8, RGB.
        certain: (H, W) uint8, non-zero where the object certainly is; may be empty.
        possible: (H, W) uint8, non-zero where the object may be.
        likely: (H, W) uint8, non-zero where the object probably is.
        rounds: how often the colour models are learned and the mask is cut.

    Returns:
        (H, W) uint8, 255 on the object; empty if the colours match no object.

    Raises:
        TargetError: no pixel is possible, or all are.

    """
    _check(image, certain, possible)
    possible = np.where((possible != 0) | (certain != 0), 255, 0).astype(np.uint8)
    certain = np.where(certain != 0, 255, 0).astype(np.uint8)
    window = Window.around(possible)
    labels = _labels(
        window.small(certain),
        window.small(possible),
        None if likely is None else window.small(np.where(likely != 0, 255, 0).astype(np.uint8)),
    )
    small = cut(window.small(image), labels, rounds)
    if not small.any():
        return np.zeros(image.shape[:2], dtype=np.uint8)
    mask = refine_border(image, window, small)
    return np.where((mask != 0) & (possible != 0) | (certain != 0), 255, 0).astype(np.uint8)


def cut(small: Image, labels: NDArray[np.uint8], rounds: int) -> Mask:
    """Run GrabCut on a small image; the same labels give the same mask.

    Without background or object pixels, nothing is cut: the mask is empty.
    """
    import cv2

    labels = labels.copy()
    maybe = (labels == CERTAIN) | (labels == MAYBE)
    if not maybe.any() or maybe.all():
        return np.zeros(labels.shape, dtype=np.uint8)
    cv2.setRNGSeed(_SEED)  # grabCut starts from random centres
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(small, labels, None, *models, rounds, cv2.GC_INIT_WITH_MASK)  # type: ignore[reportCallIssue]
    return np.where(labels & 1, 255, 0).astype(np.uint8)


def refine_border(image: Image, window: Window, small: Mask) -> Mask:
    """Scale a small mask up to the image's size, and align its border with the image's edges.

    Fast guided filter (He and Sun): in each square of the small image, the mask is fitted by a
    linear function of colour, which is then applied to the colours of the full image.
    """
    import cv2

    mask = window.full(small, image.shape)
    part = image[window.rows, window.columns]
    height, width = part.shape[:2]
    if window.small_px == (width, height):
        return mask
    reach = 2 * round(max(1.0, width / window.small_px[0])) + 1
    inside = np.ascontiguousarray(mask[window.rows, window.columns])
    kernel = np.ones((reach, reach), np.uint8)
    near = np.asarray(cv2.dilate(inside, kernel)) != np.asarray(cv2.erode(inside, kernel))
    maps = color_lines(window.small(image).astype(np.float32) / 255.0, _share(small))
    lines = np.asarray(cv2.resize(maps, (width, height), interpolation=cv2.INTER_LINEAR))[near]
    soft = (lines[:, :3] * (part[near] / np.float32(255.0))).sum(axis=1) + lines[:, 3]
    inside[near] = np.where(soft > 0.5, 255, 0)
    mask[window.rows, window.columns] = inside
    return mask


def _share(mask: Mask) -> NDArray[np.float32]:
    return (mask / 255.0).astype(np.float32)


def color_lines(
    guide: NDArray[np.float32],
    values: NDArray[np.float32],
    *,
    side_px: int = 5,
    smooth: float = 1e-4,
) -> NDArray[np.float32]:
    """Fit values by a linear function of colour in each square: (H, W, 4) slopes and offset."""
    import cv2

    def mean(pixels: NDArray[np.floating]) -> NDArray[np.float32]:
        return np.asarray(cv2.blur(np.ascontiguousarray(pixels), (side_px, side_px)), np.float32)

    center, level = mean(guide), mean(values)
    pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
    rr, rg, rb, gg, gb, bb = (
        mean(guide[..., a] * guide[..., b])
        - center[..., a] * center[..., b]
        + (smooth if a == b else 0.0)
        for a, b in pairs
    )
    r, g, b = np.moveaxis(mean(guide * values[..., None]) - center * level[..., None], 2, 0)
    # The inverse of the symmetric covariance matrix in closed form.
    c_rr, c_rg, c_rb = gg * bb - gb * gb, gb * rb - rg * bb, rg * gb - gg * rb
    c_gg, c_gb, c_bb = rr * bb - rb * rb, rg * rb - rr * gb, rr * gg - rg * rg
    determinant = rr * c_rr + rg * c_rg + rb * c_rb
    slope = (
        np.stack(
            [
                c_rr * r + c_rg * g + c_rb * b,
                c_rg * r + c_gg * g + c_gb * b,
                c_rb * r + c_gb * g + c_bb * b,
            ],
            axis=2,
        )
        / np.maximum(determinant, smooth * smooth * smooth)[..., None]
    )
    offset = level - (slope * center).sum(axis=2)
    return mean(np.concatenate([slope, offset[..., None]], axis=2))


def _labels(certain: Mask, possible: Mask, likely: Mask | None) -> NDArray[np.uint8]:
    labels = np.where(possible > 0, MAYBE if likely is None else MAYBE_NOT, NOT)
    if likely is not None:
        labels[(possible > 0) & (likely > 127)] = MAYBE
    labels[certain == 255] = CERTAIN
    return labels.astype(np.uint8)


def check_image(image: Image) -> None:
    """Check that an image is valid for segmentation.

    Raises:
        TargetError: it is not (H, W, 3) uint8, or it is empty.

    """
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 or not image.size:
        raise TargetError(
            f"the image has the shape {image.shape} and the type {image.dtype}; give (H, W, 3) "
            "uint8 in RGB order"
        )


def _check(image: Image, certain: Mask, possible: Mask) -> None:
    check_image(image)
    for name, mask in (("certain", certain), ("possible", possible)):
        if mask.shape != image.shape[:2]:
            raise TargetError(
                f"the mask of {name} pixels has the shape {mask.shape}, the image "
                f"{image.shape[:2]}; give a mask of the image's size"
            )
    if not (possible.any() or certain.any()):
        raise TargetError("no pixel may belong to the object; mark some as possible")
    if ((possible != 0) | (certain != 0)).all():
        raise TargetError(
            "every pixel may belong to the object, so there is no background; leave some out"
        )
