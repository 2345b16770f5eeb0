"""The estimates of a scan: the camera, its poses, and their uncertainty."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens, Pose
from servoid.brief import brief


@dataclass(frozen=True, eq=False)
class Solution:
    """The poses of one camera at the images that have one, in a world of unknown scale.

    `points` are (P, 3) float64, scene points in that world; `widest_rad` (P,) is the largest angle
    between two rays to each. `marks_px[i]` are (N, 2) float64, the pixels in which image i sees the
    points with the indices `seen[i]` (N,). `error_px` (V,) is the RMS reprojection error of each
    image. `focal_std_px` is the standard deviation of the focal length, derived from the
    reprojection errors. `zoomed_px` are the focal lengths of the first and the second half of the
    images, if they differ as those of one zoom do not. `groups` are the names of images that are
    connected with each other, but not with those that have poses.
    """

    names: tuple[str, ...]
    lens: Lens
    world_from_camera: tuple[Pose, ...]
    points: NDArray[np.float64]
    widest_rad: NDArray[np.float64]
    seen: tuple[NDArray[np.int64], ...]
    marks_px: tuple[NDArray[np.float64], ...]
    error_px: NDArray[np.float64]
    focal_std_px: float
    center_is_found: bool
    missing: tuple[str, ...]
    groups: tuple[tuple[str, ...], ...] = ()
    zoomed_px: tuple[float, float] | None = None

    __repr__ = brief

    @cached_property
    def places(self) -> NDArray[np.float64]:
        """Return the positions of the camera, (V, 3)."""
        return np.array([pose.translation for pose in self.world_from_camera])

    @property
    def focal_px(self) -> float:
        """Return the focal length, which is the same in both directions."""
        return self.lens.focal_px[0]

    @property
    def rms_px(self) -> float:
        """Return the RMS reprojection error over all images."""
        counts = np.array([len(one) for one in self.seen], np.float64)
        return float(np.sqrt((counts * self.error_px**2).sum() / counts.sum()))

    @property
    def parallax_rad(self) -> float:
        """Return the median over points of the largest angle between rays."""
        return float(np.median(self.widest_rad))

    @cached_property
    def distance(self) -> float:
        """Return the median distance of points from the cameras that see them, along z."""
        return float(
            np.median(
                np.concatenate(
                    [
                        pose.inverse().transform(self.points[seen])[:, 2]
                        for pose, seen in zip(self.world_from_camera, self.seen, strict=True)
                    ]
                )
            )
        )

    def index(self, name: str) -> int | None:
        """Return the index of an image among those with poses, or None."""
        return self.names.index(name) if name in self.names else None

    def scaled(self, by: float) -> "Solution":
        """Return the solution with all lengths multiplied, in the first image's frame."""
        first_from_world = self.world_from_camera[0].inverse()
        poses = tuple(first_from_world @ pose for pose in self.world_from_camera)
        scaled = tuple(
            Pose.from_parts(by * np.asarray(pose.translation), pose.quaternion) for pose in poses
        )
        points = by * first_from_world.transform(self.points)
        return replace(self, world_from_camera=scaled, points=points)
