"""Images of a camera that was turned."""

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.pose import Pose


def turned(
    image: NDArray[np.uint8], degrees: float, focal_px: float, border: int = cv2.BORDER_REPLICATE
) -> NDArray[np.uint8]:
    """Return what a camera sees once it has turned about its vertical axis."""
    height, width = image.shape[:2]
    matrix = np.array(
        [[focal_px, 0.0, (width - 1) / 2], [0.0, focal_px, (height - 1) / 2], [0.0, 0.0, 1.0]]
    )
    turn = Pose.exp([0.0, 0.0, 0.0, 0.0, np.radians(degrees), 0.0]).matrix()[:3, :3]
    change = matrix @ turn @ np.linalg.inv(matrix)
    moved = cv2.warpPerspective(image, change, (width, height), borderMode=border)
    return np.asarray(moved, np.uint8)
