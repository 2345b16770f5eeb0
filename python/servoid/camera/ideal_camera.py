"""Chooses the pinhole camera that replaces a lens: its direction, focal length and size."""

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Lens, Pose
from servoid.errors import CameraError
from servoid.pose import exact
from servoid.words import digits

MAX_SPAN_DEG = 120.0
"""The widest object that a pinhole camera is aimed at, and the widest image along an axis."""

_MAX_TANGENT = exact.tan(np.radians(MAX_SPAN_DEG / 2.0))
_MAX_GROWTH = 2.0  # Of the longer side: an image of four times the area costs four times as much.
_LEAST_PX = 64.0  # The least bound for a side, however small the lens's image.
_MARGIN = 0.25  # Of the object's size, on each side: tracking needs its background, too.
_MARGIN_PX = 8.0
_LEAST_LEFT_PX = 16.0  # or an eighth of the lens's own side, if that is less
_RIM_PX = 2.0  # The spacing of the samples along the edges of the lens's image.
_GRID = 65

Flat = NDArray[np.float64]  # (N, 2): where rays meet the plane z = 1.


def camera_along_the_axis(lens: Lens) -> Camera:
    """Return the camera along the lens's axis that covers the field of view, within limits."""
    rays = _seen(lens, _rim_and_grid(lens.size_px))
    if len(rays) == 0:
        raise CameraError(
            f"{lens!r} sees nothing inside its image: all of it is beyond the lens's limit of "
            f"{np.degrees(lens.limit):.1f} degrees off the axis; check the calibration"
        )
    # Rays beside or behind the lens are cut off in any case.
    flat = rays[:, :2] / np.maximum(rays[:, 2:], 1e-3)
    flat = np.clip(flat, -_MAX_TANGENT, _MAX_TANGENT)
    focal_px = np.array(lens.focal_px)
    first_px, last_px = flat.min(axis=0) * focal_px, flat.max(axis=0) * focal_px
    most_px = _most_px(lens)
    middle_px = np.clip(_middle(flat, lens) * focal_px, first_px, last_px)
    first_px = np.floor(np.maximum(first_px, middle_px - most_px / 2.0 + 1.0))
    last_px = np.ceil(np.minimum(last_px, middle_px + most_px / 2.0 - 1.0))
    _check_left(lens, last_px - first_px + 1.0)
    return _camera(first_px, last_px, focal_px)


def _check_left(lens: Lens, sides_px: NDArray[np.float64]) -> None:
    """Check that undistortion leaves an image."""
    if (sides_px < np.minimum(np.array(lens.size_px) / 8.0, _LEAST_LEFT_PX)).any():
        (fx, fy), (cx, cy) = lens.focal_px, lens.center_px
        raise CameraError(
            f"the calibration leaves no image: without its distortion the image of "
            f"{lens.size_px[0]}x{lens.size_px[1]} pixels would have "
            f"{sides_px[0]:.0f}x{sides_px[1]:.0f}; check focal_px ({digits(fx)}, {digits(fy)}), "
            f"center_px ({digits(cx)}, {digits(cy)}) and distortion"
        )


def camera_towards(lens: Lens, object_px: NDArray[np.float64]) -> tuple[Camera, Pose]:
    """Return a camera that looks at the object's centre, and its rotation as `lens_from_camera`."""
    rays = _seen(lens, object_px)
    if len(rays) == 0:
        raise CameraError(
            f"the lens sees none of the object's {len(object_px)} pixels: they lie beyond its "
            f"limit of {np.degrees(lens.limit):.1f} degrees off the axis; check the mask and the "
            "calibration"
        )
    axis = _middle_of_cone(rays)
    cosine = np.clip(exact.product(rays, axis).min(), -1.0, 1.0)
    span = 2.0 * np.degrees(exact.arccos(cosine))
    if span > MAX_SPAN_DEG:
        raise CameraError(
            f"the object spans {span:.0f} degrees in the lens's image; at most "
            f"{MAX_SPAN_DEG:.0f} degrees fit a pinhole camera; step back, or mark a smaller part"
        )
    lens_from_camera = _turn_to(axis)
    rays = lens_from_camera.inverse().transform(rays)
    flat = rays[:, :2] / rays[:, 2:]
    low, high = flat.min(axis=0), flat.max(axis=0)
    focal = _resolution(lens, lens_from_camera.transform(rays[[rays[:, 2].argmax()]])[0])
    margin = _MARGIN * (high - low) + _MARGIN_PX / focal
    # Use a lower resolution where the image would grow too large.
    focal = min(focal, (_most_px(lens) - 3.0) / float((high - low + 2.0 * margin).max()))
    first_px, last_px = np.floor((low - margin) * focal), np.ceil((high + margin) * focal)
    return _camera(first_px, last_px, np.array([focal, focal])), lens_from_camera


def sees(camera: Camera, lens: Lens, object_px: NDArray[np.float64]) -> bool:
    """Return whether the camera's image contains every object pixel that the lens can see."""
    pixels = camera.project(_seen(lens, object_px))
    inside = (pixels >= -0.5) & (pixels <= np.array(camera.size_px) - 0.5)
    return len(pixels) > 0 and bool(inside.all())


def _seen(lens: Lens, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    rays = lens.rays(pixels)
    return rays[~np.isnan(rays[:, 0])]


def _rim_and_grid(size_px: tuple[int, int]) -> NDArray[np.float64]:
    """Return pixels, (N, 2), along the edges of an image and on a grid over it."""
    rim = [np.linspace(-0.5, side - 0.5, max(_GRID, int(side / _RIM_PX) + 1)) for side in size_px]
    u, v = (np.linspace(-0.5, side - 0.5, _GRID) for side in size_px)
    parts = (np.meshgrid(rim[0], v[[0, -1]]), np.meshgrid(u[[0, -1]], rim[1]), np.meshgrid(u, v))
    return np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in parts])


def _middle(flat: Flat, lens: Lens) -> NDArray[np.float64]:
    """Return the image centre on the plane z = 1, or the middle of the visible part if unseen."""
    ray = lens.rays(np.array([lens.size_px], dtype=np.float64) / 2.0 - 0.5)[0]
    return ray[:2] / ray[2] if ray[2] > 1e-3 else (flat.min(axis=0) + flat.max(axis=0)) / 2.0


def _most_px(lens: Lens) -> float:
    return min(max(_MAX_GROWTH * max(lens.size_px), _LEAST_PX), float(Camera.MAX_SIDE_PX))


def _camera(first_px: NDArray[np.float64], last_px: NDArray[np.float64], focal: Flat) -> Camera:
    """Make the camera whose image spans two corners, given in pixels from the axis."""
    width, height = (int(side) for side in last_px - first_px + 1.0)
    return Camera(
        size_px=(width, height),
        focal_px=(float(focal[0]), float(focal[1])),
        center_px=(float(0.0 - first_px[0]), float(0.0 - first_px[1])),
    )


def _middle_of_cone(rays: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the axis of a narrow cone around directions, (N, 3) of length 1.

    Stereographic projection from the opposite point maps circles on the sphere to circles on the
    plane. The smallest circle around all projected directions bounds a cone, the narrowest one once
    the projection is centred on it.
    """
    import cv2

    axis = rays.mean(axis=0)
    if exact.norm(axis) < 1e-6:
        axis = rays[0]
    for _ in range(3):
        turn = _turn_to(axis / exact.norm(axis))
        local = turn.inverse().transform(rays)
        plane = local[:, :2] / np.maximum(1.0 + local[:, 2:], 1e-6)
        (x, y), radius = cv2.minEnclosingCircle(plane.astype(np.float32))
        off = exact.hypot(x, y)
        # The angles of the cone's two edges in the plane through its axis.
        angle = exact.arctan(off + radius) + exact.arctan(off - radius)
        across = np.array([x, y]) * (exact.sin(angle) / off if off > 0.0 else 0.0)
        axis = turn.transform(np.array([[across[0], across[1], exact.cos(angle)]]))[0]
    return axis


def _turn_to(axis: NDArray[np.float64]) -> Pose:
    """Return the shortest rotation that takes the z axis to `axis`, of length 1."""
    across = np.array([-axis[1], axis[0], 0.0])
    sine = exact.norm(across)
    if sine < 1e-12:
        return Pose.identity()
    turn = across / sine * exact.arctan2(sine, axis[2])
    return Pose.exp([0.0, 0.0, 0.0, float(turn[0]), float(turn[1]), 0.0])


def _resolution(lens: Lens, ray: NDArray[np.float64]) -> float:
    """Return the lens's resolution around a ray in pixels per radian, the mean over directions."""
    step = 1e-4
    turn = _turn_to(ray)
    corners = np.array([[step, 0.0, 1.0], [-step, 0.0, 1.0], [0.0, step, 1.0], [0.0, -step, 1.0]])
    pixels = lens.project(turn.transform(corners))
    (a, b), (c, d) = (pixels[0] - pixels[1]) / (2.0 * step), (pixels[2] - pixels[3]) / (2.0 * step)
    resolution = float(np.sqrt(abs(a * d - b * c)))
    # At the limit of the lens, a step to the side may be beyond it.
    return resolution if resolution > 1.0 else float(np.mean(lens.focal_px))
