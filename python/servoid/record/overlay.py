"""Draws one step of tracking: the images side by side, the objects over them, a line of text."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera
from servoid.record.lettering import fill, width_px, write
from servoid.record.outline import Color, draw_axes, draw_outline, draw_points
from servoid.source import Instant
from servoid.track import Followed, Tracked, TrackStep
from servoid.words import hundredths

STATUS_COLORS: dict[str, Color] = {
    "tracking": (64, 200, 96),
    "searching": (245, 175, 40),
    "lost": (225, 60, 55),
}

_WIDEST_PX = 1920
_ROW_PX = 28
_DARK = (24, 24, 26)
_TROUGH = (70, 70, 74)
_INK = (235, 235, 235)
_QUIET = (160, 160, 165)
_SIZE = 0.45
_BAR_PX = 120


class Overlay:
    """Draws steps of one capture in one size in pixels, which is even as videos require."""

    def __init__(self, cameras: Sequence[Camera], names: Sequence[str], objects: int) -> None:
        self._cameras = tuple(cameras)
        self._names = tuple(names)
        wide = sum(camera.size_px[0] for camera in self._cameras)
        high = max(camera.size_px[1] for camera in self._cameras)
        self._scale = min(1.0, _WIDEST_PX / wide)
        self._tiles = [
            (max(1, round(self._scale * size[0])), max(1, round(self._scale * size[1])))
            for size in (camera.size_px for camera in self._cameras)
        ]
        width = max(320, sum(tile[0] for tile in self._tiles))
        self._images_px = max(1, round(self._scale * high))
        height = self._images_px + _ROW_PX * objects
        self.size_px: tuple[int, int] = (width + width % 2, height + height % 2)

    def draw(self, step: TrackStep) -> NDArray[np.uint8]:
        """Return a step as an image (H, W, 3) uint8 RGB of `size_px`."""
        page = np.full((self.size_px[1], self.size_px[0], 3), _DARK, dtype=np.uint8)
        left = 0
        for place, (width, height) in enumerate(self._tiles):
            tile = self._draw_camera(step, place)
            if self._scale < 1.0:
                tile = cv2.resize(tile, (width, height), interpolation=cv2.INTER_AREA)
            page[:height, left : left + width] = tile
            write(page, (left + 8, 18), self._names[place], _INK, shadow=True)
            left += width
        for row, (one, tracked) in enumerate(zip(step.objects, step.tracked, strict=True)):
            self._draw_row(page, row, (one, tracked), step.instant)
        return page

    def _draw_camera(self, step: TrackStep, place: int) -> NDArray[np.uint8]:
        """Draw one camera's image with all objects; a camera without an image is grey."""
        camera, instant = self._cameras[place], step.instant
        width, height = camera.size_px
        given = instant.images[place]
        if given is None or given.shape[:2] != (height, width):
            image = np.full((height, width, 3), _TROUGH, dtype=np.uint8)
            write(image, (width // 2 - 36, height // 2), "no image", _INK)
        else:
            image = given.copy() if given.ndim == 3 else np.dstack([given] * 3)
        sight = (camera, instant.world_from_camera[place])
        for one, tracked in zip(step.objects, step.tracked, strict=True):
            pose = tracked.estimate.world_from_object
            body = one.body_at(pose)
            if tracked.is_tracked:
                draw_points(image, one.surface, pose, sight)
            draw_outline(image, body, sight, _color(tracked))
            if tracked.is_tracked:
                draw_axes(image, body, sight)
        return image

    def _draw_row(
        self,
        page: NDArray[np.uint8],
        row: int,
        shown: tuple[Followed, Tracked],
        instant: Instant,
    ) -> None:
        """Draw the state of one object: a bar of its confidence, its state, the time.

        A high confidence alone is no trust, so the state comes first and the number has its name.
        """
        one, tracked = shown
        top = self._images_px + row * _ROW_PX
        confidence = float(np.clip(np.nan_to_num(tracked.estimate.confidence), 0.0, 1.0))
        bar = (8, top + 9, _BAR_PX, 10)
        fill(page, bar, _TROUGH)
        fill(page, (*bar[:2], round(_BAR_PX * confidence), bar[3]), _color(tracked))
        end = write(page, (_BAR_PX + 18, top + 19), self._words(one, tracked, confidence), _INK)
        note = f"{hundredths(instant.time_s)} s"
        room = self.size_px[0] - end - 16
        width = width_px(note, _SIZE)
        if width <= room:
            write(page, (self.size_px[0] - width - 8, top + 19), note, _QUIET)

    def _words(self, one: Followed, tracked: Tracked, confidence: float) -> str:
        """Return the state, the confidence and the name of an object, shorter in small images."""
        share = f"{100.0 * confidence:.0f} %"
        name = "" if one.name == "object" else f"  {one.name}"
        words = f"{tracked.words}  confidence {share}{name}"
        room = self.size_px[0] - _BAR_PX - 26
        return words if width_px(words, _SIZE) <= room else f"{tracked.words}  {share}{name}"


def _color(tracked: Tracked) -> Color:
    return STATUS_COLORS.get(tracked.estimate.status, STATUS_COLORS["lost"])
