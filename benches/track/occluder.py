"""Track while something occludes a third of the object, and measure what the tracker reports.

In images 60 to 100 of the research recordings, a grey, textured board as high as the object and a
third as wide passes over it in both images, drawn at the object's true pose. Then servoid's own
moving sample, with a ruler that passes before the toy. One row for the images in which a tenth of
the object or more is hidden, and one for the others; errors are those of all poses, including those
that the tracker does not trust. Missing recordings are skipped.
"""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from sequences import SCORER, STEREO, Recording, Table, recordings
from servoid.camera import Camera
from servoid.exchange import open_any
from servoid.pose import Pose
from servoid.shape import Body
from servoid.sim import MovingScene, Scenario, write_moving_sample
from servoid.track import TrackResult
from servoid.track.follower import Evolver, Images, make_tracker

FIRST, LAST = 60, 100
WIDTH_SHARE, LEAST_HIDDEN = 1.0 / 3.0, 0.1
SCENE_IMAGES = 60


class Covered:
    """A tracker before whose cameras a board passes; `hidden` is the covered share, by image."""

    def __init__(self, recording: Recording) -> None:
        self.hidden = [0.0]
        self._recording = recording
        self._texture = board()

    def make(self, cameras: Sequence[Camera], body: Body, options: dict[str, Any]) -> "Covered":
        """Create the tracker; replaces the default maker."""
        self._cameras, self._tracker = cameras, make_tracker(cameras, body, options)
        self.start = self._tracker.start
        return self

    def step(self, time_s: float, world_from_camera: Sequence[Pose], images: Images) -> Any:
        """Pass images with the board to the tracker."""
        index = len(self.hidden)
        share = (index - FIRST) / (LAST - FIRST)
        self.hidden.append(0.0)
        if 0.0 <= share <= 1.0:
            world_from_mesh = world_from_camera[0] @ self._recording.left_from_mesh(index)
            cameras = zip(self._cameras, world_from_camera, images, strict=True)
            images = [
                image
                if image is None
                else self._cover(camera, pose.inverse() @ world_from_mesh, image, share)
                for camera, pose, image in cameras
            ]
        return self._tracker.step(time_s, world_from_camera, images)

    def begin_evolving(self) -> bool:
        """Let the body evolve beside the tracking."""
        return isinstance(self._tracker, Evolver) and self._tracker.begin_evolving()

    def _cover(
        self, camera: Camera, camera_from_mesh: Pose, image: NDArray[np.uint8], share: float
    ) -> NDArray[np.uint8]:
        pixels = camera.project(camera_from_mesh.transform(self._recording.vertices))
        (left, top), (right, bottom) = pixels.min(axis=0), pixels.max(axis=0)
        width = WIDTH_SHARE * (right - left)
        start = left - width + share * (right - left + width)
        rows = slice(max(round(top), 0), max(round(bottom), 0))
        columns = slice(max(round(start), 0), max(round(start + width), 0))
        covered = image.copy()
        target = covered[rows, columns]
        piece = self._texture[: target.shape[0], : target.shape[1]]
        target[:] = piece if target.ndim == 2 else piece[..., None]
        seen = min(start + width, right) - max(start, left)
        self.hidden[-1] = max(self.hidden[-1], float(seen / (right - left)))
        return covered


def board() -> NDArray[np.uint8]:
    """Draw a grey board with a texture, (480, 640)."""
    noise = np.random.default_rng(0).normal(size=(480, 640))
    rough = [scale * cv2.GaussianBlur(noise, (0, 0), scale) for scale in (1.0, 3.0, 8.0)]
    return np.clip(110.0 + 30.0 * np.sum(rough, axis=0), 0.0, 255.0).astype(np.uint8)


def report(table: Table, recording: Recording, result: TrackResult, hidden: list[float]) -> None:
    """Print a row for the observations in which the object is visible, and one for the others."""
    for name, is_hidden in (("free", False), ("hidden", True)):
        shares = list(enumerate(hidden))[1:]
        chosen = [index for index, share in shares if (share >= LEAST_HIDDEN) == is_hidden]
        estimates = [result.tracked[index].estimate for index in chosen]
        confidences = [one.confidence for one in estimates]
        score = recording.score(result, only=chosen, trusting=True)
        table.row(
            *(recording.name, name, len(chosen), 100.0 * max(hidden[index] for index in chosen)),
            *(sum(one.status == status for one in estimates) for status in ("searching", "lost")),
            *(score.add, score.add_95, float(np.median(confidences)), min(confidences)),
        )


def measure_sample(table: Table) -> None:
    """Print the rows of the sample that servoid draws."""
    small = Scenario(count=SCENE_IMAGES, occluder=True, one_camera=True, size="small")
    scene = MovingScene(small)
    hidden = [scene.look(index).hidden for index in range(SCENE_IMAGES)]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "sample"
        write_moving_sample(folder, Scenario(count=SCENE_IMAGES, occluder=True))
        recording = Recording("sample", folder, open_any(folder))
        report(table, recording, recording.track(), hidden)


def main() -> None:
    """Print one table."""
    table = Table(
        *("sequence    ", "object", "images", "most hidden %", "searching", "lost"),
        *("ADD median", "p95 mm", "confidence median", "least"),
    )
    for recording in recordings(STEREO):
        covered = Covered(recording)
        report(table, recording, recording.track(maker=covered.make), covered.hidden)
    if SCORER.is_file():
        measure_sample(table)


if __name__ == "__main__":
    main()
