"""Measures depth from a stereo pair: rectifies, matches, and maps back to one image's pixels."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Pose
from servoid.brief import brief
from servoid.errors import ImageError, TargetError
from servoid.pose import exact
from servoid.stereo.disparity import Match, coarse_disparity, match
from servoid.stereo.rectification import Rectification

_FAR_PX = 1e6  # outside every image
_STEPS = 32  # per pixel: the resolution of interpolation
_MARGIN_PX = 12
_COARSE_SIDE_PX = 64.0
_MOST_COARSE = 4.0
_MOST_COARSE_CELLS = 2e7
_MOST_CELLS = 1e8
_MOST_ROUGH_CELLS = 2e6
_LARGEST_SHARE = 0.75  # the largest disparity to search, of the image's longer side


@dataclass(frozen=True)
class StereoDepth:
    """Depth of the pixels of image a along its camera's z axis, and its expected error.

    `depth` and `sigma_m` are (H, W) float32 in metres, NaN where unknown. `sigma_m` is one standard
    deviation, from the images' noise and texture; it does not include wrong matches.
    """

    depth: NDArray[np.float32]
    sigma_m: NDArray[np.float32]

    __repr__ = brief


def stereo_depth(
    image_a: NDArray[np.uint8],
    image_b: NDArray[np.uint8],
    camera_a: Camera,
    camera_b: Camera,
    a_from_b: Pose,
    *,
    mask_a: NDArray[np.uint8] | None = None,
) -> StereoDepth:
    """Measure depth from a stereo pair, in the pixels of image a.

    The cameras may be side by side or above each other, in either order, and may be rotated towards
    each other. They have no distortion, so undistort images of a lens first.

    Args:
        image_a: (H, W, 3) uint8, RGB; so is `image_b`.
        image_b: the image of the other camera at the same instant.
        camera_a: the camera of `image_a`.
        camera_b: the camera of `image_b`.
        a_from_b: the pose of camera b in the frame of camera a.
        mask_a: (H, W) uint8, non-zero on the object: only its pixels are measured, and faster.

    Raises:
        CameraError: the cameras coincide, are one behind the other, or share no field of view.
        ImageError: an image does not have the size of its camera.
        TargetError: the mask is empty or of another size, or b does not see the masked area.

    """
    _check(image_a, camera_a, "a")
    _check(image_b, camera_b, "b")
    wanted = _wanted(image_a, mask_a)
    pair = Rectification.of(camera_a, camera_b, a_from_b)
    part = _Part.around(pair, wanted)
    grays = _gray(image_a), _gray(image_b)
    nearest, farthest = _range_px(pair, part, grays, wanted)
    # Matching takes memory for each pixel and disparity, so large images are matched at reduced
    # size.
    cells = float(part.size_px[0]) * part.size_px[1] * (farthest - nearest)
    if cells > _MOST_CELLS:
        share = exact.power(_MOST_CELLS / cells, 1.0 / 3.0)
        pair = replace(pair, focal_px=share * pair.focal_px)
        part = _Part.around(pair, wanted)
        nearest, farthest = int(share * nearest), int(share * farthest) + 1
    found, shift = _match(pair, part, grays, wanted, (nearest, farthest))
    return _back(pair, part, found, shift, wanted)


def rough_depth(
    image_a: NDArray[np.uint8],
    image_b: NDArray[np.uint8],
    camera_a: Camera,
    camera_b: Camera,
    a_from_b: Pose,
    *,
    mask_a: NDArray[np.uint8] | None = None,
) -> NDArray[np.float32]:
    """Measure depth as `stereo_depth` does, but on small images and at all distances.

    It is fast and separates near from far. Surfaces are accurate to a few per cent, borders to a
    few pixels.

    Args:
        image_a: (H, W, 3) uint8, RGB; so is `image_b`.
        image_b: the image of the other camera at the same instant.
        camera_a: the camera of `image_a`.
        camera_b: the camera of `image_b`.
        a_from_b: the pose of camera b in the frame of camera a.
        mask_a: (H, W) uint8: only pixels that are not zero are measured.

    Returns:
        (H, W) float32, in metres along the z axis of camera a, NaN where unknown.

    Raises:
        CameraError, ImageError, TargetError: as for `stereo_depth`.

    """
    _check(image_a, camera_a, "a")
    _check(image_b, camera_b, "b")
    wanted = _wanted(image_a, mask_a)
    pair = Rectification.of(camera_a, camera_b, a_from_b)
    part = _Part.around(pair, wanted)
    most = _largest_px(pair, part)
    cells = float(part.size_px[0]) * part.size_px[1] * most
    shrink = max(1.0, exact.power(cells / _MOST_ROUGH_CELLS, 1.0 / 3.0))
    found, known = _coarse(pair, part, (_gray(image_a), _gray(image_b)), most, shrink)
    disparity = np.where(known, found, np.float32(np.nan)).astype(np.float32)
    small = _Part(
        (part.first_px[0] / shrink, part.first_px[1] / shrink),
        (disparity.shape[1], disparity.shape[0]),
    )
    pair = replace(pair, focal_px=pair.focal_px / shrink)
    return _back(pair, small, Match(disparity, np.zeros_like(disparity)), 0, wanted).depth


def _wanted(image: NDArray[np.uint8], mask: NDArray[np.uint8] | None) -> NDArray[np.bool_]:
    shape = image.shape[:2]
    if mask is None:
        return np.ones(shape, bool)
    if mask.shape != shape or not mask.any():
        raise TargetError(
            f"the mask has the shape {mask.shape} and {int((mask != 0).sum())} pixels of the "
            f"object; give one of the shape {shape} that shows the object"
        )
    return mask != 0


@dataclass(frozen=True)
class _Part:
    """The part of the rectified image a to match, in pixels around its axis."""

    first_px: tuple[float, float]
    size_px: tuple[int, int]

    @classmethod
    def around(cls, pair: Rectification, wanted: NDArray[np.bool_]) -> "_Part":
        rows, columns = np.nonzero(wanted)
        flat = pair.flat_of_a(np.column_stack([columns, rows]).astype(np.float64))
        low, high = (np.floor(np.nanmin(flat, axis=0)), np.ceil(np.nanmax(flat, axis=0)))
        low, high = low - _MARGIN_PX, high + _MARGIN_PX
        # A strongly rotated image may extend to infinity.
        most = 1.5 * max(pair.camera_a.size_px)
        low, high = np.clip(low, -most, most), np.clip(high, -most, most)
        return cls(
            (int(low[0]), int(low[1])), (int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1)
        )


def _range_px(
    pair: Rectification,
    part: _Part,
    grays: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    wanted: NDArray[np.bool_],
) -> tuple[int, int]:
    """Find the smallest and largest disparity of the wanted pixels, on small images."""
    most = _largest_px(pair, part)
    shrink = float(np.clip(min(part.size_px) / _COARSE_SIDE_PX, 1.0, _MOST_COARSE))
    cells = float(part.size_px[0]) * part.size_px[1] * most
    shrink = max(shrink, exact.power(cells / _MOST_COARSE_CELLS, 1.0 / 3.0))
    found, known = _coarse(pair, part, grays, most, shrink)
    size = found.shape[1], found.shape[0]
    inside = _warp_mask(pair, part, wanted, size, shrink) & known
    found = found * shrink
    values = found[inside & (found > 0.5)]
    if values.size < 8:
        raise TargetError(
            "the two images could not be matched where the object is: it has no texture, or the "
            "second camera does not see it, or the cameras' poses are wrong; model from masks alone"
        )
    return _widen(pair, part, values, whole=bool(wanted.all()))


def _coarse(
    pair: Rectification,
    part: _Part,
    grays: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    most: float,
    shrink: float,
) -> tuple[NDArray[np.floating], NDArray[np.bool_]]:
    """Match small images; return disparities in their pixels, and where both cameras see."""
    size = int(part.size_px[0] / shrink) + 1, int(part.size_px[1] / shrink) + 1
    count = int(most / shrink) + 1
    one, seen_a = pair.warp(grays[0], part.first_px, size, of_b=False, shrink=shrink)
    first_b = part.first_px[0] - round(count * shrink), part.first_px[1]
    size_b = size[0] + count, size[1]
    other, seen_b = pair.warp(grays[1], first_b, size_b, of_b=True, shrink=shrink)
    one = np.pad(one, ((0, 0), (count, 0)), "edge")
    found = coarse_disparity(one, other, count)[:, count:]
    columns = np.arange(size[0])[None, :] + count - found
    with np.errstate(invalid="ignore"):
        there = np.clip(np.nan_to_num(columns), 0, size_b[0] - 1).astype(np.intp)
    return found, seen_a & np.isfinite(found) & seen_b[np.arange(size[1])[:, None], there]


def _largest_px(pair: Rectification, part: _Part) -> float:
    """Return the largest disparity with which b may see the part; raise if it sees none of it."""
    corners = np.array(pair.camera_b.size_px) * np.array([[0, 0], [0, 1], [1, 0], [1, 1]]) - 0.5
    flat_b = pair.flat_of_b(corners.astype(np.float64))
    (left, above), (right, below) = np.nanmin(flat_b, axis=0), np.nanmax(flat_b, axis=0)
    most = min(
        part.first_px[0] + part.size_px[0] - float(left),
        _LARGEST_SHARE * max(pair.camera_a.size_px),
    )
    least = part.first_px[0] - float(right)
    bottom = part.first_px[1] + part.size_px[1]
    if most < 1.0 or least > most or above > bottom or below < part.first_px[1]:
        raise TargetError(
            "the second camera does not see what the first one shows here; give a pair of images "
            "that both show the object, and check the cameras' poses"
        )
    return most


def _widen(
    pair: Rectification, part: _Part, values: NDArray[np.float32], *, whole: bool
) -> tuple[int, int]:
    """Extend the range of disparities on both sides: an object is as deep as wide."""
    low, high = np.quantile(values, (0.01, 0.99) if whole else (0.1, 0.9))
    depth_share = 0.2 if whole else min(0.6, 0.75 * max(part.size_px) / pair.focal_px)
    return max(0, int(low / (1.0 + depth_share)) - 4), int(high * (1.0 + depth_share)) + 5


def _warp_mask(
    pair: Rectification,
    part: _Part,
    wanted: NDArray[np.bool_],
    size_px: tuple[int, int],
    shrink: float = 1.0,
) -> NDArray[np.bool_]:
    pixels = np.where(wanted, 255, 0).astype(np.uint8)
    return pair.warp(pixels, part.first_px, size_px, of_b=False, shrink=shrink)[0] > 127


def _match(
    pair: Rectification,
    part: _Part,
    grays: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    wanted: NDArray[np.bool_],
    range_px: tuple[int, int],
) -> tuple[Match, int]:
    """Match at full size; return disparities minus the smallest one, and the smallest one."""
    nearest, farthest = range_px
    count = farthest - nearest
    one, seen_a = pair.warp(grays[0], part.first_px, part.size_px, of_b=False)
    # Both parts get `count` more columns on the left: there, near points of a are found in b.
    first_b = part.first_px[0] - farthest, part.first_px[1]
    size_b = part.size_px[0] + count, part.size_px[1]
    other, seen_b = pair.warp(grays[1], first_b, size_b, of_b=True)
    one = np.pad(one, ((0, 0), (count, 0)), "edge")
    inside = _warp_mask(pair, part, wanted, part.size_px)
    found = match(one, other, count, np.pad(inside, ((0, 0), (count, 0))))
    disparity = found.disparity[:, count:].copy()
    columns = np.arange(part.size_px[0])[None, :] + count - np.nan_to_num(disparity)
    there = np.clip(np.rint(columns), 0, size_b[0] - 1).astype(np.intp)
    disparity[~(seen_a & seen_b[np.arange(part.size_px[1])[:, None], there])] = np.nan
    return Match(disparity, found.sigma_px[:, count:]), nearest


def _back(
    pair: Rectification, part: _Part, found: Match, shift: int, wanted: NDArray[np.bool_]
) -> StereoDepth:
    """Map disparities back to the pixels of image a, as depths along its own axis."""
    rows, columns = np.nonzero(wanted)
    pixels = np.column_stack([columns, rows]).astype(np.float64)
    place = np.nan_to_num(pair.flat_of_a(pixels) - np.array(part.first_px), nan=-_FAR_PX)
    place = np.clip(place, -_FAR_PX, _FAR_PX).astype(np.float32)

    smooth, sharp = _between(found.disparity, place), _nearest(found.disparity, place)
    # At a depth edge, the mean of both sides is on neither surface.
    disparity = np.where(np.abs(smooth - sharp) < 0.5, smooth, sharp) + shift
    slopes = (pixels - np.array(pair.camera_a.center_px)) / np.array(pair.camera_a.focal_px)
    rays = np.column_stack([slopes, np.ones(len(slopes))])
    rays_z = exact.product(rays, pair.rectified_from_a[2])
    with np.errstate(divide="ignore", invalid="ignore"):
        depths = pair.focal_px * pair.baseline / (disparity * rays_z)
        sigmas = depths / disparity * _nearest(found.sigma_px, place)
    known = np.isfinite(depths) & (disparity > 0.1)
    depth, sigma_m = (np.full(wanted.shape, np.nan, np.float32) for _ in range(2))
    depth[rows[known], columns[known]] = depths[known]
    sigma_m[rows[known], columns[known]] = sigmas[known]
    return StereoDepth(depth, sigma_m)


def _nearest(values: NDArray[np.float32], place: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the values (N,) of the pixels nearest to positions (N, 2) in an image, NaN outside."""
    return _at(values, np.rint(place).astype(np.intp))


def _between(values: NDArray[np.float32], place: NDArray[np.float32]) -> NDArray[np.float32]:
    """Interpolate linearly at positions (N, 2) in an image, (N,), NaN where a neighbour is unknown.

    Positions are rounded to 1/32 pixel, and each of the four terms is added with one rounding, as
    OpenCV does on processors that can; on others, OpenCV's bits differ.
    """
    steps = np.rint(place * np.float32(_STEPS)).astype(np.intp)
    corner, parts = steps // _STEPS, (steps % _STEPS).astype(np.float32) / np.float32(_STEPS)
    right, down = parts.T
    left, up = np.float32(1.0) - right, np.float32(1.0) - down
    found = np.zeros(len(place), np.float32)
    for by, share in (((1, 1), down * right), ((0, 1), down * left), ((1, 0), up * right)):
        found = (_at(values, corner + np.array(by)) * share.astype(np.float64) + found).astype("f4")
    return (_at(values, corner) * (up * left).astype(np.float64) + found).astype(np.float32)


def _at(values: NDArray[np.float32], pixels: NDArray[np.intp]) -> NDArray[np.float32]:
    height, width = values.shape
    columns, rows = pixels.T
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    found = np.full(len(pixels), np.nan, np.float32)
    found[inside] = values[rows[inside], columns[inside]]
    return found


def _gray(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    import cv2

    return np.asarray(cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_RGB2GRAY), np.uint8)


def _check(image: NDArray[np.uint8], camera: Camera, name: str) -> None:
    width, height = camera.size_px
    if image.shape != (height, width, 3) or image.dtype != np.uint8:
        raise ImageError(
            f"image {name} has the shape {image.shape} and the type {image.dtype}, its camera "
            f"needs ({height}, {width}, 3) uint8 in RGB order"
        )
