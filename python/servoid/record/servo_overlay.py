"""Draws one observation of a servo run: the eyes' images with the estimate, and the arm."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Camera
from servoid.brief import brief
from servoid.record.lettering import Box, fill, width_px, write, write_into
from servoid.record.outline import Color, draw_axes, draw_outline
from servoid.record.overlay import STATUS_COLORS
from servoid.servo import ORDINARY, Command, LimitingKind, TargetEstimate
from servoid.shape import placed
from servoid.source import Instant
from servoid.words import hundredths

_WIDTH_PX = 1280
_BAND_PX = 80
_EDGE_PX = 16
_COLUMN_PX = 400  # where the second column of text begins
_CLOCK_PX = 120
_BAR = (160, 14)
_SIZE = 0.6
_STRIP_PX = 3
_ROW_PX = (_BAND_PX - _STRIP_PX) // 2
_DARK = (24, 24, 26)
_TROUGH = (70, 70, 74)
_INK = (235, 235, 235)
_MIDDLE = (255, 222, 70)
_QUIET = (165, 165, 170)
_HELD = (245, 175, 40)
_CROSS = (5, 15)  # pixels from the centre at which an arm of the cross begins and ends


@dataclass(frozen=True, eq=False)
class ServoScene:
    """The contents of one picture.

    `estimate` is None while nothing is tracked, and `body` while nothing is modelled; `overview` is
    an image (H, W, 3) uint8 RGB of the arm, and `line` describes what the arm does.
    """

    instant: Instant
    estimate: TargetEstimate | None
    command: Command | None
    line: str
    body: Body | None = None
    overview: NDArray[np.uint8] | None = None

    __repr__ = brief


class ServoOverlay:
    """Draws the observations of a run in one size in pixels, which is even for videos."""

    def __init__(
        self,
        cameras: Sequence[Camera],
        names: Sequence[str],
        overview_px: tuple[int, int] | None = None,
    ) -> None:
        """Lay out the eyes' images, and beside them room for pictures of `overview_px`."""
        self._names = tuple(names)
        self._overview, self._eyes = _layout([camera.size_px for camera in cameras], overview_px)
        self._cameras = [_resized(*one) for one in zip(cameras, self._eyes, strict=True)]
        boxes = self._eyes if self._overview is None else [*self._eyes, self._overview]
        self._images_px = max(top + height for _, top, _, height in boxes)
        height = self._images_px + _BAND_PX
        self.size_px: tuple[int, int] = (_WIDTH_PX, height + height % 2)
        self._empty = np.full((self.size_px[1], _WIDTH_PX, 3), _DARK, dtype=np.uint8)
        self._last: NDArray[np.uint8] | None = None

    @property
    def overview_px(self) -> tuple[int, int] | None:
        """Return the size of overviews in the picture, at which they need no scaling."""
        return None if self._overview is None else self._overview[2:]

    def draw(self, scene: ServoScene) -> NDArray[np.uint8]:
        """Return a scene as an image (H, W, 3) uint8 RGB of `size_px`.

        A scene without an overview shows the last one.
        """
        page = self._empty.copy()
        if self._overview is not None:
            if scene.overview is not None:
                self._last = _scaled(scene.overview, self._overview[2:])
            if self._last is not None:
                _put(page, self._overview, self._last)
        for place, box in enumerate(self._eyes):
            _put(page, box, self._draw_eye(scene, place))
            cv2.rectangle(page, box, _DARK, 1)
            name = self._names[place] if place < len(self._names) else ""
            if scene.instant.images[place] is None:
                name = f"{name}: no image"
            write(page, (box[0] + 10, box[1] + 22), name, _INK, size=0.55, shadow=True)
        self._draw_band(page, scene)
        return page

    def _draw_eye(self, scene: ServoScene, place: int) -> NDArray[np.uint8]:
        """Draw an eye's image, the body at its estimated pose, and a cross at the centre."""
        camera, given = self._cameras[place], scene.instant.images[place]
        width, height = camera.size_px
        if given is None:
            image = np.full((height, width, 3), _TROUGH, dtype=np.uint8)
        else:
            image = _scaled(given, (width, height))
        estimate = scene.estimate
        if scene.body is not None and estimate is not None and _is_finite(estimate):
            body = placed(scene.body, estimate.world_from_object)
            sight = (camera, scene.instant.world_from_camera[place])
            draw_outline(image, body, sight, _status_color(estimate))
            if estimate.located:
                draw_axes(image, body, sight)
        _draw_cross(image, camera.center_px)
        return image

    def _draw_band(self, page: NDArray[np.uint8], scene: ServoScene) -> None:
        """Write confidence, status, stage, time, estimated error, and what holds the hand."""
        color = _TROUGH if scene.estimate is None else _status_color(scene.estimate)
        fill(page, (0, self._images_px, _WIDTH_PX, _STRIP_PX), color)
        first = self._images_px + _STRIP_PX
        second = first + _ROW_PX
        share, status = _trust(scene.estimate)
        bar = (_EDGE_PX, first + (_ROW_PX - _BAR[1]) // 2, *_BAR)
        fill(page, bar, _TROUGH)
        fill(page, (*bar[:2], round(share * _BAR[0]), _BAR[1]), color)
        beside = _EDGE_PX + _BAR[0] + _EDGE_PX
        room = _WIDTH_PX - _COLUMN_PX - _EDGE_PX
        clock = f"{hundredths(scene.instant.time_s)} s"
        write(
            page, (_WIDTH_PX - _EDGE_PX - width_px(clock, 0.6), first + 26), clock, _QUIET, size=0.6
        )
        error = _error_words(scene.command)
        for left, top, width, (words, ink) in (
            (beside, first, _COLUMN_PX - beside - _EDGE_PX, (status, _INK)),
            (_COLUMN_PX, first, room - _CLOCK_PX - _EDGE_PX, (scene.line, _INK)),
            (_EDGE_PX, second, _COLUMN_PX - 2 * _EDGE_PX, (error, _INK)),
            (_COLUMN_PX, second, room, _hold_words(scene.command)),
        ):
            write_into(page, (left, top, width, _ROW_PX), words, ink, size=_SIZE)


def _layout(
    eyes_px: Sequence[tuple[int, int]], overview_px: tuple[int, int] | None
) -> tuple[Box | None, list[Box]]:
    """Return the positions of the overview and of the eyes' images: on its right, or in a row."""
    if overview_px is None:
        shapes = [width / height for width, height in eyes_px]
        high = _WIDTH_PX / sum(shapes)
        lefts = np.rint(high * np.cumsum([0.0, *shapes])).astype(int).tolist()
        row = [(left, 0, right - left, round(high)) for left, right in pairwise(lefts)]
        return None, row
    shapes = [height / width for width, height in eyes_px]
    high = _WIDTH_PX / (overview_px[0] / overview_px[1] + 1.0 / sum(shapes))
    wide = round(high / sum(shapes))
    tops = np.rint(wide * np.cumsum([0.0, *shapes])).astype(int).tolist()
    column = [(_WIDTH_PX - wide, top, wide, end - top) for top, end in pairwise(tops)]
    return (0, 0, _WIDTH_PX - wide, tops[-1]), column


def _resized(camera: Camera, box: Box) -> Camera:
    """Return the camera of an image that is scaled to a box."""
    size_px = box[2:]
    across, down = (new / old for new, old in zip(size_px, camera.size_px, strict=True))
    focal, center = camera.focal_px, camera.center_px
    return Camera(
        size_px=size_px,
        focal_px=(across * focal[0], down * focal[1]),
        center_px=(across * (center[0] + 0.5) - 0.5, down * (center[1] + 0.5) - 0.5),
    )


def _scaled(image: NDArray[np.uint8], size_px: tuple[int, int]) -> NDArray[np.uint8]:
    """Return an image, grey or RGB, as a new RGB image of a size."""
    color = image if image.ndim == 3 else np.dstack([image] * 3)
    if color.shape[1::-1] == size_px:
        return color.copy()
    smaller = size_px[0] < color.shape[1]
    way = cv2.INTER_AREA if smaller else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(color, size_px, interpolation=way), np.uint8)


def _put(page: NDArray[np.uint8], box: Box, image: NDArray[np.uint8]) -> None:
    left, top, width, height = box
    page[top : top + height, left : left + width] = image


def _is_finite(estimate: TargetEstimate) -> bool:
    return bool(np.isfinite(estimate.world_from_object.matrix()).all())


def _draw_cross(image: NDArray[np.uint8], center_px: tuple[float, float]) -> None:
    """Mark the image centre, where a fixating eye has its target."""
    u, v = round(center_px[0]), round(center_px[1])
    near, far = _CROSS
    for ink, wide in ((_DARK, 3), (_MIDDLE, 1)):
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            ends = (u + near * x, v + near * y), (u + far * x, v + far * y)
            cv2.line(image, *ends, ink, wide, cv2.LINE_AA)


def _trust(estimate: TargetEstimate | None) -> tuple[float, str]:
    """Return the confidence, 0 to 1, and a text on the tracker's status."""
    if estimate is None:
        return 0.0, "no target yet"
    share = float(np.clip(np.nan_to_num(estimate.confidence), 0.0, 1.0))
    return share, f"{100.0 * share:.0f} %, {estimate.status}"


def _error_words(command: Command | None) -> str:
    """Describe the estimated error of the hand from its goal."""
    if command is None or command.hand_from_goal is None:
        return "the hand is held" if command is not None and command.holding else "no goal yet"
    goal = command.hand_from_goal
    scalar, *vector = goal.quaternion
    turn = 2.0 * np.arctan2(np.linalg.norm(vector), abs(scalar))
    distance = 1000.0 * np.linalg.norm(goal.translation)
    return f"estimated error {distance:.1f} mm, {np.degrees(turn):.1f} deg"


def _hold_words(command: Command | None) -> tuple[str, Color]:
    """Describe what holds the hand or limits it, and return the colour of the text."""
    if command is None:
        return "", _QUIET
    if command.holding:
        return f"held: {'; '.join(sorted(one.value for one in command.holding))}", _HELD
    said = [f"{kind.value}: {words}" for kind in LimitingKind if (words := _of_kind(command, kind))]
    if said:
        return "; ".join(said), _HELD
    speed = 1000.0 * float(np.linalg.norm(command.twist[:3]))
    return f"hand moves at {speed:.0f} mm/s", _QUIET


def _of_kind(command: Command, kind: LimitingKind) -> str:
    found = [one.value for one in command.limiting - ORDINARY if LimitingKind.of(one) is kind]
    return "; ".join(sorted(found))


def _status_color(estimate: TargetEstimate) -> Color:
    return STATUS_COLORS.get(estimate.status, STATUS_COLORS["lost"])
