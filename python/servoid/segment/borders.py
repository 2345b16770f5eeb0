"""Compares the border of a mask with the edges of its image."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.brief import brief
from servoid.pose import exact
from servoid.segment.segment import Image, Mask

_SIZE_PX = 150.0  # to which an object is shrunk, the root of its area
_COARSE_PX = 60.0  # to which it is shrunk where its place is sought
_LEAST_PIXELS = 60  # of a mask, below which nothing is reported
_BLUR = 0.02  # of the object's size, the error of a border that is none
_AWAY = (0.12, 0.25)  # of the object's size, to which the border is displaced
_WAYS = 8  # directions of these displacements
_AROUND = 0.45  # of the object's size, around it, in which it is displaced
_LEAST_INSIDE = 0.7  # share of a displaced border that must be inside the image
_LEAST_COMPARED = 10  # displaced borders
_STEEP = 0.01  # response of the filter to a mask, below which there is no border
_FLAT = 8.0  # response of the filter to one grey level per pixel; less is no edge
_SEARCHED, _STEP = 0.36, 0.03  # of the object's size, how far and how finely a place is sought


@dataclass(frozen=True, eq=False)
class _Border:
    """The pixels of a border (N, 2) as x, y, its normals (N, 2), and the image's gradients.

    The latter are (H, W, C, 2), `size` is that of the object, in the same pixels, which are `by`
    of the image's.
    """

    pixels: NDArray[np.intp]
    normals: NDArray[np.float32]
    gradients: NDArray[np.float32]
    size: float
    by: float

    __repr__ = brief

    def contrast(self, shift: NDArray[np.float64]) -> float | None:
        """Return the mean contrast across the border if it is displaced; None outside the image."""
        x, y = (self.pixels + np.rint(shift).astype(np.intp)).T
        height, width = self.gradients.shape[:2]
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        if not len(x) or inside.mean() < _LEAST_INSIDE:
            return None
        across = self.gradients[y[inside], x[inside]]
        normals = self.normals[inside][:, None]
        along = (across * normals).sum(axis=2)
        return float(np.sqrt((along * along).sum(axis=1)).mean())


def border_rank(image: Image, mask: Mask) -> float | None:
    """Return the share of displaced borders that lie on weaker edges than the mask's own border.

    It is 1 for masks of this image: nowhere around the object does its outline fit the image as
    well. `image` is (H, W, 3) or (H, W) uint8, `mask` (H, W) uint8. None if the object is too small
    to tell, at the border of the image, or the image is flat.
    """
    border = _border(image, mask)
    if border is None:
        return None
    angles = [2.0 * np.pi * way / _WAYS for way in range(_WAYS)]
    ways = np.array([(exact.cos(angle), exact.sin(angle)) for angle in angles])
    near = max(1.0, _BLUR * border.size) * np.concatenate([[[0.0, 0.0]], ways])
    away = np.concatenate([share * border.size * ways for share in _AWAY])
    own, others = (
        [each for each in map(border.contrast, shifts) if each is not None]
        for shifts in (near, away)
    )
    here, there = max(own, default=0.0), np.array(others)
    if len(there) < _LEAST_COMPARED or max(here, there.max()) < _FLAT:
        return None
    return float((there < here).mean())


def fitting_shift(image: Image, mask: Mask) -> tuple[float, float, float] | None:
    """Return the displacement (x, y) at which a mask's border lies on the strongest edges.

    It is in pixels, and beside it stands the object's size, the root of its area. None as for
    `border_rank`, and where no place is found.
    """
    border = _border(image, mask, _COARSE_PX)
    if border is None:
        return None
    along = np.arange(-_SEARCHED, _SEARCHED + _STEP, _STEP) * border.size
    shifts = np.stack(np.meshgrid(along, along), axis=2).reshape(-1, 2)
    told = [border.contrast(shift) for shift in shifts]
    if all(contrast is None for contrast in told):
        return None
    x, y = shifts[np.argmax([contrast or 0.0 for contrast in told])] / border.by
    return float(x), float(y), border.size / border.by


def _border(image: Image, mask: Mask, size_px: float = _SIZE_PX) -> _Border | None:
    """Return the border of a mask; None if it is too small."""
    import cv2

    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    area = int(np.count_nonzero(mask))
    if area < _LEAST_PIXELS:
        return None
    around = int(_AROUND * np.sqrt(area)) + 2
    part = tuple(
        slice(max(0, int(places[0]) - around), int(places[-1]) + around + 1)
        for places in (rows, columns)
    )
    by = min(1.0, size_px / float(np.sqrt(area)))
    pixels = np.ascontiguousarray(image[part])
    inside = (mask[part] != 0).astype(np.float32)
    if by < 1.0:
        pixels = np.asarray(cv2.resize(pixels, None, fx=by, fy=by, interpolation=cv2.INTER_AREA))
        inside = np.asarray(cv2.resize(inside, None, fx=by, fy=by, interpolation=cv2.INTER_AREA))
    size = by * float(np.sqrt(area))
    blur = max(1.0, _BLUR * size)
    smooth = np.asarray(cv2.GaussianBlur(pixels.astype(np.float32), (0, 0), blur), np.float32)
    smooth = smooth.reshape(*smooth.shape[:2], -1)
    soft = np.asarray(cv2.GaussianBlur(inside, (0, 0), blur), np.float32)
    normals = _gradients(soft[..., None])[:, :, 0]
    steep = np.sqrt((normals * normals).sum(axis=2))
    if steep.max() < _STEEP:  # the object fills the image
        return None
    y, x = np.nonzero(steep > 0.5 * steep.max())
    return _Border(
        pixels=np.stack([x, y], axis=1),
        normals=normals[y, x] / steep[y, x, None],
        gradients=_gradients(smooth),
        size=size,
        by=by,
    )


def _gradients(channels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the gradients of an image (H, W, C), (H, W, C, 2), by Sobel's filter."""
    import cv2

    ways = ((1, 0), (0, 1))
    made = [
        [np.asarray(cv2.Sobel(channel, cv2.CV_32F, *way)) for way in ways]
        for channel in np.moveaxis(np.ascontiguousarray(channels), 2, 0)
    ]
    return np.moveaxis(np.array(made, np.float32), (0, 1), (2, 3))
