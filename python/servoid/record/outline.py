"""Draws a body over an image: its outline, its axes and its surface points."""

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Camera, Pose

Color = tuple[int, int, int]

_SUBPIXEL_BITS = 4
_FINER = 4  # the union is computed on a canvas with this many times more pixels per side
_REACH_PX = 4096.0  # an outline that passes beside the camera may be huge
_DARK = (20, 20, 20)
_AXES = ((235, 70, 60), (70, 200, 80), (70, 130, 255))  # x red, y green, z blue
_LEAST_DEPTH = 1e-3
_MOST_POINTS = 400
_DOT_RADIUS = round(0.7 * (1 << _SUBPIXEL_BITS))


def draw_outline(
    image: NDArray[np.uint8], body: Body, sight: tuple[Camera, Pose], color: Color
) -> None:
    """Draw the outline of a body into an image (H, W, 3) uint8, and faint ones of its ellipsoids.

    `sight` is a pinhole camera and its world_from_camera.
    """
    height, width = image.shape[:2]
    found = [one for one in body.outlines(*sight) if one is not None]
    ellipses = [_ellipse_points(*one) for one in found]
    if not ellipses:
        return
    thick = max(1, round(width / 400))
    faint = image.copy()
    for points in ellipses:
        cv2.polylines(faint, [_fixed(points)], True, color, 1, cv2.LINE_AA, _SUBPIXEL_BITS)
    cv2.addWeighted(faint, 0.4, image, 0.6, 0.0, dst=image)
    contours = [_fixed(contour) for contour in _union(ellipses, (width, height))]
    for ink, wide in ((_DARK, thick + 2), (color, thick)):
        cv2.polylines(image, contours, True, ink, wide, cv2.LINE_AA, _SUBPIXEL_BITS)


def draw_axes(image: NDArray[np.uint8], body: Body, sight: tuple[Camera, Pose]) -> None:
    """Draw the axes of the object's frame, red, green and blue, as long as half the object."""
    length = 0.6 * float((np.linalg.norm(body.centers, axis=1) + body.radii.max(axis=1)).max())
    ends = np.vstack([np.zeros(3), length * np.eye(3)])
    pixels = project(body.world_from_object.transform(ends), sight)
    if not np.isfinite(pixels).all() or np.abs(pixels).max() > _REACH_PX:
        return
    fixed = _fixed(pixels)
    thick = max(1, round(image.shape[1] / 400))
    for ink_of, wide in ((lambda _: _DARK, thick + 2), (lambda axis: _AXES[axis], thick)):
        for axis in range(3):
            start, end = fixed[0].tolist(), fixed[axis + 1].tolist()
            cv2.line(image, start, end, ink_of(axis), wide, cv2.LINE_AA, _SUBPIXEL_BITS)


def draw_points(
    image: NDArray[np.uint8],
    surface: tuple[NDArray[np.float64], NDArray[np.float64]],
    world_from_object: Pose,
    sight: tuple[Camera, Pose],
) -> None:
    """Draw the surface points that face the camera as small dots.

    `surface`: points and outward normals in the object's frame, (N, 3) float64 each.
    """
    points, normals = surface
    if not len(points):
        return
    every = -(-len(points) // _MOST_POINTS)
    points_in_world = world_from_object.transform(np.ascontiguousarray(points[::every]))
    turn = world_from_object.matrix()[:3, :3]
    towards = np.array(sight[1].translation) - points_in_world
    facing = np.einsum("ij,ij->i", normals[::every] @ turn.T, towards) > 0.0
    pixels = project(points_in_world[facing], sight)
    height, width = image.shape[:2]
    inside = ((pixels >= 0.0) & (pixels <= (width - 1, height - 1))).all(axis=1)
    for center in _fixed(pixels[inside]).tolist():
        cv2.circle(image, center, _DOT_RADIUS, (255, 255, 255), -1, cv2.LINE_AA, _SUBPIXEL_BITS)


def project(
    points_in_world: NDArray[np.float64], sight: tuple[Camera, Pose]
) -> NDArray[np.float64]:
    """Project points (N, 3) into a camera, (N, 2) pixels; NaN behind the camera."""
    camera, world_from_camera = sight
    points = world_from_camera.inverse().transform(np.ascontiguousarray(points_in_world))
    ahead = points[:, 2] > _LEAST_DEPTH
    pixels = np.full((len(points), 2), np.nan)
    if ahead.any():
        pixels[ahead] = camera.project(np.ascontiguousarray(points[ahead]))
    return pixels


def _ellipse_points(
    center_px: NDArray[np.float64], covariance: NDArray[np.float64], count: int = 120
) -> NDArray[np.float64]:
    """Return points (count, 2) around the ellipse (x - c)ᵀ covariance⁻¹ (x - c) = 1, in pixels."""
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    variances, axes = np.linalg.eigh(covariance)
    reach = axes * np.sqrt(np.maximum(variances, 0.0))
    points = center_px + (reach @ np.stack([np.cos(angles), np.sin(angles)])).T
    return points.clip(-_REACH_PX, _REACH_PX)


def _union(
    ellipses: list[NDArray[np.float64]], size_px: tuple[int, int]
) -> list[NDArray[np.float64]]:
    """Return the contours, (N, 2) each, of the union of the ellipses in an image."""
    everything = np.concatenate(ellipses)
    # A little larger than the image, so that its border is not drawn as an outline.
    low = np.floor(everything.min(axis=0)).clip(-8, np.array(size_px) + 8) - 2.0
    high = np.ceil(everything.max(axis=0)).clip(-8, np.array(size_px) + 8) + 2.0
    width, height = (np.maximum(high - low, 1.0) * _FINER).astype(int).tolist()
    canvas = np.zeros((height, width), dtype=np.uint8)
    for points in ellipses:
        cv2.fillPoly(canvas, [_fixed((points - low) * _FINER)], 255, cv2.LINE_8, _SUBPIXEL_BITS)
    contours, _ = cv2.findContours(canvas, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    return [contour.reshape(-1, 2) / _FINER + low for contour in contours]


def _fixed(points: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return pixels as OpenCV's fixed-point numbers."""
    return np.rint(points * (1 << _SUBPIXEL_BITS)).astype(np.int32)
