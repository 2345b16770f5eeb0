"""Range samples of a surface, from depth images, stereo pairs and point clouds."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from servoid.brief import brief
from servoid.camera import Camera
from servoid.capture import CaptureView
from servoid.errors import MeshError
from servoid.pose import Pose, exact
from servoid.stereo import stereo_depth
from servoid.words import counted

_MOST_POINTS = 6000
_LARGEST_ERROR = 0.008  # as a share of the measured depth
_BORDER_PX = 2  # depth at the outline mixes object and background
_HAIR = 1e-6  # length of a direction from a normal, which shows the side but no free distance


@dataclass(frozen=True, eq=False)
class RangeSamples:
    """Points of the object's surface, and the directions in which they were seen.

    `points` is (N, 3) float64, in the world, in metres. `directions` is (N, 3) float64, from the
    camera to the point: over its length, space is free. Where only the side is known, the
    directions are short.
    """

    points: NDArray[np.float64]
    directions: NDArray[np.float64]

    __repr__ = brief

    def __len__(self) -> int:
        return len(self.points)


NO_RANGE_SAMPLES = RangeSamples(np.empty((0, 3)), np.empty((0, 3)))


def join_range_samples(parts: Iterable[RangeSamples]) -> RangeSamples:
    """Join range samples, thinned evenly where there are more than modelling can use."""
    all_parts = [NO_RANGE_SAMPLES, *parts]
    points = np.concatenate([part.points for part in all_parts])
    directions = np.concatenate([part.directions for part in all_parts])
    step = -(-len(points) // _MOST_POINTS) or 1
    return RangeSamples(
        np.ascontiguousarray(points[::step]), np.ascontiguousarray(directions[::step])
    )


def range_samples_of_depth(
    depth: NDArray[np.float32],
    mask: NDArray[np.uint8],
    camera: Camera,
    world_from_camera: Pose,
) -> RangeSamples:
    """Convert the depth, (H, W) float32 in metres along z, inside a mask to range samples.

    Pixels at the mask's border and without depth (NaN) are left out.
    """
    import cv2

    kernel = np.ones((2 * _BORDER_PX + 1,) * 2, dtype=np.uint8)
    inside = cv2.erode(mask, kernel, borderType=cv2.BORDER_CONSTANT, borderValue=0) != 0
    rows, columns = np.nonzero(inside & np.isfinite(depth) & (depth > 0.0))
    focal, center = np.array(camera.focal_px), np.array(camera.center_px)
    rays = np.ones((len(rows), 3))
    rays[:, :2] = (np.stack([columns, rows], axis=1) - center) / focal
    points = world_from_camera.transform(rays * depth[rows, columns, None].astype(np.float64))
    return RangeSamples(points, points - np.array(world_from_camera.translation))


def range_samples_of_views(views: Sequence[CaptureView]) -> list[RangeSamples]:
    """Read the range samples in the depth images of views with masks.

    Raises:
        CaptureError, ImageError, MaskError: a file cannot be used.

    """
    found = []
    for view in views:
        depth = view.depth()
        if depth is not None:
            found.append(
                range_samples_of_depth(depth, view.mask(), view.camera, view.world_from_camera)
            )
    return found


def depth_of_pair(
    view: CaptureView, other: CaptureView, mask: NDArray[np.uint8] | None = None
) -> NDArray[np.float32]:
    """Measure depth inside a mask by stereo: (H, W), metres along z, NaN where unknown.

    The mask, (H, W) uint8, is by default the view's own.

    Raises:
        CameraError, TargetError: the two cannot be matched.

    """
    here_from_there = view.world_from_camera.inverse() @ other.world_from_camera
    measured = stereo_depth(
        view.image(),
        other.image(),
        view.camera,
        other.camera,
        here_from_there,
        mask_a=view.mask() if mask is None else mask,
    )
    # Without texture the match is a guess; its expected error is then large.
    sure = measured.sigma_m <= _LARGEST_ERROR * measured.depth
    return np.where(sure, measured.depth, np.float32(np.nan)).astype(np.float32)


def range_samples_of_cloud(
    points: ArrayLike,
    normals: ArrayLike | None,
    viewpoint: ArrayLike | None,
) -> RangeSamples:
    """Convert a point cloud, (N, 3) each, in metres, to range samples.

    The points were seen from `viewpoint`, (3,), or without one against their normals. Points with
    NaN, as of pixels without depth, are left out.

    Raises:
        MeshError: there are neither normals nor a viewpoint, an array has the wrong shape, or no
            point is finite.

    """
    places = _rows("points", points)
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(places).all(axis=1))
    if len(places) and not finite.any():
        raise MeshError(f"none of the {len(places)} points is finite; give points in metres")
    if viewpoint is not None:
        [eye] = _rows("the view point", [viewpoint])
        if not np.isfinite(eye).all():
            raise MeshError("the view point is not finite; give X, Y and Z in metres")
        finite &= exact.lengths(np.where(finite[:, None], places - eye, 0.0)) > 0.0
        return join_range_samples([RangeSamples(places[finite], places[finite] - eye)])
    if normals is None:
        raise MeshError(
            "the cloud has no normals, so the outside of its surface is unknown; give "
            "the position from which it was seen with --viewpoint X,Y,Z, or save it with normals"
        )
    outward = _rows("normals", normals)
    if outward.shape != places.shape:
        points = counted(len(places), "point has", "points have")
        raise MeshError(f"{points} {counted(len(outward), 'normal')}; give one for each")
    known: NDArray[np.bool_] = finite & np.asarray(np.isfinite(outward).all(axis=1))
    known &= exact.lengths(np.where(known[:, None], outward, 0.0)) > 0.0
    if len(places) and not known.any():
        raise MeshError("no point has a normal; give the view point, or a cloud with normals")
    return join_range_samples([RangeSamples(places[known], -_HAIR * outward[known])])


def _rows(what: str, given: ArrayLike | list[ArrayLike]) -> NDArray[np.float64]:
    """Convert to rows of three numbers."""
    try:
        numbers = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise MeshError(
            f"{what} must be rows of three numbers, but contain other values"
        ) from error
    if numbers.ndim != 2 or numbers.shape[1] != 3:
        raise MeshError(f"{what} must be rows of three numbers, but have shape {numbers.shape}")
    return numbers
