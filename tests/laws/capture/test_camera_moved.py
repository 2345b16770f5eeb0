"""A camera that is moved during a recording contradicts the calibration at its end."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from servoid.capture import Capture, PosedImage, capture_of, doubt_calibration, open_capture
from servoid.pose import Pose
from servoid.sim import Scenario, write_moving_sample
from servoid.track import track_capture

COUNT = 12
Image = NDArray[np.uint8]


@pytest.fixture(scope="module")
def still(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    folder = tmp_path_factory.mktemp("still") / "pair"
    write_moving_sample(folder, Scenario(count=COUNT, size="small"))
    return open_capture(folder)


def turned(image: Image, degrees: float, focal_px: float) -> Image:
    """Return what a camera sees once it has turned about its vertical axis."""
    height, width = image.shape[:2]
    matrix = np.array(
        [[focal_px, 0.0, (width - 1) / 2], [0.0, focal_px, (height - 1) / 2], [0.0, 0.0, 1.0]]
    )
    turn = Pose.exp([0.0, 0.0, 0.0, 0.0, np.radians(degrees), 0.0]).matrix()[:3, :3]
    change = matrix @ turn @ np.linalg.inv(matrix)
    moved = cv2.warpPerspective(image, change, (width, height), borderMode=cv2.BORDER_REFLECT)
    return np.asarray(moved, np.uint8)


def loosened(capture: Capture, degrees: float) -> Capture:
    """Let the right camera turn slowly, by an angle at the end."""
    views = {(view.camera_name, view.index): view for view in capture.all_views()}
    observations = []
    for index in range(COUNT):
        seen = []
        for name in ("left", "right"):
            view = views[name, index]
            by = degrees * index / (COUNT - 1) if name == "right" else 0.0
            image = turned(view.image(), by, view.camera.focal_px[0])
            mask = view.mask() if view.has_mask else None
            seen.append(
                PosedImage(
                    camera=view.camera,
                    world_from_camera=view.world_from_camera,
                    image=image,
                    mask=mask,
                )
            )
        observations.append(seen)
    return capture_of(observations, rate_hz=30.0)


@pytest.mark.parametrize("degrees", [-2.5, 2.5])
def test_a_camera_that_turns_slowly_is_told(degrees: float, still: Capture) -> None:
    assert doubt_calibration(loosened(still, 0.0)) is None
    doubt = doubt_calibration(loosened(still, degrees))
    assert doubt is not None and doubt.startswith("a camera was moved meanwhile")


def test_a_track_in_python_is_compared_with_calibration_and_rig_too(still: Capture) -> None:
    [right] = track_capture(still)
    assert (right.calibration_doubt, right.rig_doubt) == (None, None)
    assert right.verdict == "good"
    [wrong] = track_capture(loosened(still, 2.5))
    assert wrong.calibration_doubt is not None and wrong.verdict != "good"
    assert "the calibration is in doubt" in wrong.reasons


def test_a_track_in_python_of_a_rig_with_inverted_poses_is_not_good(tmp_path: Path) -> None:
    write_moving_sample(tmp_path / "hand", Scenario(count=25, size="small", hand=True))
    capture = open_capture(tmp_path / "hand")
    poses = tuple(pose.inverse() for pose in capture.world_from_rig)
    [wrong] = track_capture(replace(capture, world_from_rig=poses))
    assert wrong.rig_doubt is not None and "invert them" in wrong.rig_doubt
    assert wrong.verdict != "good"
