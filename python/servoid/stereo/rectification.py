"""Rectifies a pair of images so that a point lies on the same row of both, for any rig."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Pose
from servoid.errors import CameraError
from servoid.pose import exact

_MOST_FORWARD = 0.8  # of the baseline along the line of sight; above, images have no disparity


@dataclass(frozen=True)
class Rectification:
    """A frame for both cameras: x along the baseline from a to b, z in their common direction.

    `rectified_from_a` and `rectified_from_b` are rotations, (3, 3). `focal_px` is the focal length
    of the rectified images, `baseline` the distance of the cameras in metres.
    """

    camera_a: Camera
    camera_b: Camera
    rectified_from_a: NDArray[np.float64]
    rectified_from_b: NDArray[np.float64]
    focal_px: float
    baseline: float

    @classmethod
    def of(cls, camera_a: Camera, camera_b: Camera, a_from_b: Pose) -> "Rectification":
        """Compute the frame of a pair.

        Raises:
            CameraError: the cameras coincide, are one behind the other, or look in different
                directions.

        """
        matrix = a_from_b.matrix()
        turn, offset = matrix[:3, :3], matrix[:3, 3]
        baseline = exact.norm(offset)
        if baseline < 1e-9:
            raise CameraError(
                "the two cameras are at the same position, so there is no parallax; "
                "correct rig_from_camera, or give two cameras apart from each other"
            )
        across = offset / baseline
        sight = np.array([0.0, 0.0, 1.0]) + turn[:, 2]
        if exact.norm(sight) < 0.5 or turn[2, 2] < 0.0:
            apart = np.degrees(exact.arccos(np.clip(turn[2, 2], -1.0, 1.0)))
            raise CameraError(
                f"the two cameras look {apart:.0f} degrees apart and have no common field of view; "
                "give two that look at the same scene"
            )
        sight /= exact.norm(sight)
        if abs(exact.dot(across, sight)) > _MOST_FORWARD:
            raise CameraError(
                "one camera is behind the other: their baseline is along the line of sight, "
                "where images have no disparity; give two cameras side by side or above each other"
            )
        sight -= exact.dot(across, sight) * across
        sight /= exact.norm(sight)
        rectified_from_a = np.stack([across, np.cross(sight, across), sight])
        return cls(
            camera_a=camera_a,
            camera_b=camera_b,
            rectified_from_a=rectified_from_a,
            rectified_from_b=exact.product(rectified_from_a, turn),
            focal_px=float(np.mean(camera_a.focal_px)),
            baseline=baseline,
        )

    def flat_of_a(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map pixels of a, (N, 2), to pixels of the rectified image around its axis, (N, 2)."""
        return self._flat(self.rectified_from_a, self.camera_a, pixels)

    def flat_of_b(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map pixels of b, (N, 2), to pixels of the rectified image around its axis, (N, 2)."""
        return self._flat(self.rectified_from_b, self.camera_b, pixels)

    def _flat(
        self, turn: NDArray[np.float64], camera: Camera, pixels: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        slopes = (pixels - np.array(camera.center_px)) / np.array(camera.focal_px)
        rays = exact.product(np.column_stack([slopes, np.ones(len(slopes))]), turn.T)
        with np.errstate(divide="ignore", invalid="ignore"):
            flat = self.focal_px * rays[:, :2] / rays[:, 2:]
        flat[rays[:, 2] <= 1e-3] = np.nan
        return flat

    def warp(
        self,
        image: NDArray[np.uint8],
        first_px: tuple[float, float],
        size_px: tuple[int, int],
        *,
        of_b: bool,
        shrink: float = 1.0,
    ) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
        """Render a part of a rectified image, and return where the camera has real pixels.

        The part begins at `first_px` and is `size_px` large, in pixels that are `shrink` times
        those of the rectified image.
        """
        import cv2

        camera, turn = (
            (self.camera_b, self.rectified_from_b)
            if of_b
            else (self.camera_a, self.rectified_from_a)
        )
        flat_from_part = np.array(
            [[shrink, 0.0, first_px[0]], [0.0, shrink, first_px[1]], [0.0, 0.0, self.focal_px]]
        )
        (focal_u, focal_v), (center_u, center_v) = camera.focal_px, camera.center_px
        matrix = np.array([[focal_u, 0.0, center_u], [0.0, focal_v, center_v], [0.0, 0.0, 1.0]])
        image_from_part = exact.product(matrix, turn.T, flat_from_part)
        if shrink > 1.5:
            image = np.asarray(cv2.GaussianBlur(image, (0, 0), 0.45 * shrink), np.uint8)
        flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
        part = cv2.warpPerspective(image, image_from_part, size_px, flags=flags)
        seen = np.full(image.shape[:2], 255, np.uint8)
        seen = cv2.warpPerspective(
            seen, image_from_part, size_px, flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
        )
        return np.asarray(part, np.uint8), np.asarray(seen) > 0
