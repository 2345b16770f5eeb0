"""Writes a video of a servo run, one picture per observation, whole or not at all."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Camera
from servoid.errors import OutputError
from servoid.record.servo_overlay import ServoOverlay, ServoScene
from servoid.record.video_file import check_video, image_video
from servoid.servo import Command, TargetEstimate
from servoid.source import Instant


class ServoVideo:
    """Writes an MP4 file, which is complete when the `with` block of the video ends.

    If the block raises, nothing is left behind. `count` is the number of pictures so far.
    """

    def __init__(
        self,
        path: str | Path,
        cameras: Sequence[Camera],
        names: Sequence[str],
        rate_hz: float,
        *,
        overview_px: tuple[int, int] | None = None,
    ) -> None:
        """Prepare a video with `rate_hz` pictures per second.

        With `overview_px`, pictures of the arm of that size are shown beside the eyes' images.

        Raises:
            OutputError: the path does not end in .mp4, or nothing can be written there.

        """
        self._path, self._rate_hz = Path(path), rate_hz
        check_video(self._path)
        self._overlay = ServoOverlay(cameras, names, overview_px)
        self._stack = ExitStack()
        self._write: Callable[[NDArray[np.uint8]], None] | None = None
        self.count: int = 0

    @property
    def size_px(self) -> tuple[int, int]:
        """Return width and height of the video."""
        return self._overlay.size_px

    @property
    def overview_px(self) -> tuple[int, int] | None:
        """Return the size of overviews in the video, at which they need no scaling."""
        return self._overlay.overview_px

    def __enter__(self) -> "ServoVideo":
        writing = image_video(self._path, self.size_px, self._rate_hz)
        self._write = self._stack.enter_context(writing)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._write = None
        self._stack.__exit__(kind, error, trace)

    def add(
        self,
        instant: Instant,
        estimate: TargetEstimate | None,
        command: Command | None,
        overview: NDArray[np.uint8] | None,
        line: str,
        *,
        body: Body | None = None,
    ) -> None:
        """Add a picture of an observation.

        `overview` is an image (H, W, 3) uint8 RGB; without one the last is shown again. `line`
        describes what the arm does, and `body` is drawn at the pose of `estimate`.

        Raises:
            OutputError: the video's `with` block has not begun or is over.

        """
        if self._write is None:
            raise OutputError(f"cannot add to {self._path}: add inside the video's with block")
        self._write(
            self._overlay.draw(ServoScene(instant, estimate, command, line, body, overview))
        )
        self.count += 1
