"""Draws the picture of the body: its ellipsoids from four sides, and the camera poses."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.model import ModelResult
from servoid.shape import Body
from servoid.view.page import INK, Page, Text
from servoid.view.scores import UNUSED_COLOR, USED_COLOR, ScoredView, scored_views
from servoid.view.solid_picture import Solids, Viewpoint, axes_toward, render

_SMALL_PX = 376
_GAP_PX = 16
_LARGE_PX = 2 * _SMALL_PX + _GAP_PX
_MARGIN_PX = 20
_FILLED = 0.80  # of a panel, by the body
FROM_AHEAD = np.array([1e3, 0.0, 0.0])
TURN_DEG, RISE_DEG = 38.0, 27.0
"""The viewpoint of the three-quarter view, relative to the side."""

Vector = NDArray[np.float64]

_RAYS = ((0, 1), (0, 2), (0, 3), (0, 4))


def draw_body(result: ModelResult) -> bytes:
    """Draw the body in its colours and the cameras around it; return the PNG file's bytes.

    Without cameras it is drawn from below in their place.
    """
    solids = solids_in_world(result.body, result.colors)
    scored = scored_views(result)
    up = mean_up(scored)
    eye = scored[0].view.world_from_camera.matrix()[:3, 3] if scored else FROM_AHEAD
    side, front = side_and_front(solids, up, eye)
    viewpoints = {
        "three-quarter": _viewpoint(solids, up, side, front, turn_deg=TURN_DEG, rise_deg=RISE_DEG),
        "side": _viewpoint(solids, up, side, front, turn_deg=0.0, rise_deg=9.0),
        "front": _viewpoint(solids, up, side, front, turn_deg=90.0, rise_deg=9.0),
        "top": _viewpoint(solids, up, side, front, turn_deg=0.0, rise_deg=89.9),
    }
    scale = max(seen.metres_per_px for name, seen in viewpoints.items() if name != "three-quarter")
    column = _MARGIN_PX + _LARGE_PX + _GAP_PX
    pitch = _SMALL_PX + _GAP_PX
    corners = {
        "three-quarter": (_MARGIN_PX, _MARGIN_PX),
        "side": (column, _MARGIN_PX),
        "front": (column + pitch, _MARGIN_PX),
        "top": (column, _MARGIN_PX + pitch),
    }
    page = Page(column + pitch + _SMALL_PX + _MARGIN_PX, _LARGE_PX + 2 * _MARGIN_PX)
    light = _unit(0.95 * up + 0.32 * side + 0.50 * front)
    for name, seen in viewpoints.items():
        if name == "three-quarter":
            sized = seen.finer(_LARGE_PX / _SMALL_PX)
        else:
            sized = Viewpoint(seen.axes, seen.middle, scale, seen.size_px)
        left, top = corners[name]
        page.put(render(solids, sized, up, light), left, top)
        page.texts.append(Text(left + 14, top + 30, name, size_px=19))
        if name == "three-quarter":
            start = left + 14, top + _LARGE_PX - 18
            _put_scale(page, sized.metres_per_px, start, is_metric=result.is_metric)
    corner = (column + pitch, _MARGIN_PX + pitch)
    if scored:
        _put_cameras(page, corner, solids, scored, up, viewpoints["three-quarter"].axes)
    else:
        below = _viewpoint(solids, up, side, front, turn_deg=0.0, rise_deg=-89.9)
        sized = Viewpoint(below.axes, below.middle, scale, below.size_px)
        page.put(render(solids, sized, up, light), *corner)
        page.texts.append(Text(corner[0] + 14, corner[1] + 30, "below", size_px=19))
    return page.png()


def solids_in_world(body: Body, colors: NDArray[np.uint8]) -> Solids:
    """Return a body's ellipsoids in the world, coloured by `colors` (K, 3) uint8 RGB."""
    pose = body.world_from_object.matrix()
    w, x, y, z = np.asarray(body.rotations, float).T
    turns = np.empty((len(body), 3, 3))
    turns[:, 0] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], 1)
    turns[:, 1] = np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], 1)
    turns[:, 2] = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], 1)
    turns = pose[:3, :3] @ turns
    centers = np.asarray(body.centers) @ pose[:3, :3].T + pose[:3, 3]
    return Solids(centers, turns, np.asarray(body.radii), np.asarray(colors))


def mean_up(scored: list[ScoredView]) -> Vector:
    """Return the unit direction in the world that is up in the images on average."""
    if not scored:
        return np.array([0.0, 0.0, 1.0])
    ups = -np.array([one.view.world_from_camera.matrix()[:3, 1] for one in scored])
    mean = ups.mean(axis=0)
    # If half of the cameras are upside down, the directions cancel.
    return _unit(mean if np.linalg.norm(mean) > 0.1 else ups[0])


def side_and_front(solids: Solids, up: Vector, first_camera: Vector) -> tuple[Vector, Vector]:
    """Return two orthogonal horizontal unit directions, both on the first camera's side.

    From the first one, the body has its longest projection.
    """
    right = _unit(np.cross(up, np.eye(3)[np.abs(up).argmin()]))
    ahead = np.cross(up, right)
    angles = np.radians(np.arange(0, 180, 3))
    levels = np.cos(angles)[:, None] * right + np.sin(angles)[:, None] * ahead
    extents = np.array([solids.extent(level) for level in levels])
    front: Vector = levels[int(np.argmax(extents[:, 1] - extents[:, 0]))]
    side = np.cross(front, up)
    toward_camera = first_camera - solids.centers.mean(axis=0)
    return side * _sign(side @ toward_camera), front * _sign(front @ toward_camera)


def _sign(value: float) -> float:
    return 1.0 if value >= 0.0 else -1.0


def _viewpoint(
    solids: Solids, up: Vector, side: Vector, front: Vector, *, turn_deg: float, rise_deg: float
) -> Viewpoint:
    """Return the viewpoint of a small panel from `side`, turned to `front` and raised."""
    turn, rise = np.radians([turn_deg, rise_deg])
    level = np.cos(turn) * side + np.sin(turn) * front
    axes = axes_toward(-(np.cos(rise) * level + np.sin(rise) * up), up)
    spans = np.array([solids.extent(axis) for axis in axes])
    middle = axes.T @ spans.mean(axis=1)
    extent = float((spans[:2, 1] - spans[:2, 0]).max())
    return Viewpoint(axes, middle, extent / (_FILLED * _SMALL_PX), (_SMALL_PX, _SMALL_PX))


def _put_scale(
    page: Page, metres_per_px: float, start: tuple[int, int], *, is_metric: bool
) -> None:
    """Draw a scale bar of a round length, about a fifth of the large panel long."""
    x_px, y_px = start
    longest = 0.22 * _LARGE_PX * metres_per_px
    ten = 10.0 ** np.floor(np.log10(longest))
    length = max(step * ten for step in (1.0, 2.0, 5.0) if step * ten <= longest)
    end = x_px + round(length / metres_per_px)
    cv2.line(page.pixels, (x_px, y_px), (end, y_px), (34, 34, 34), 3)
    words = f"{1000 * length:g} mm" if is_metric else f"{length:g} of an unknown unit"
    page.texts.append(Text(end + 12, y_px + 6, words, size_px=18))


def _put_cameras(
    page: Page,
    corner: tuple[int, int],
    solids: Solids,
    scored: list[ScoredView],
    up: Vector,
    axes: NDArray[np.float64],
) -> None:
    """Draw the panel of the camera poses and their viewing directions."""
    poses = [one.view.world_from_camera.matrix() for one in scored]
    everything = np.concatenate([solids.centers, np.stack([pose[:3, 3] for pose in poses])])
    spans = everything @ axes.T
    low, high = spans.min(axis=0), spans.max(axis=0)
    reach = float(max((high - low)[:2].max(), 1e-9))
    size = (_SMALL_PX, _SMALL_PX)
    seen = Viewpoint(axes, axes.T @ ((low + high) / 2.0), reach / (0.72 * _SMALL_PX), size)
    picture = render(solids, seen, up, up)
    for one, pose in sorted(
        zip(scored, poses, strict=True), key=lambda pair: -pair[1][:3, 3] @ axes[2]
    ):
        lines = seen.project(frustum(one, pose, 0.085 * reach))
        color = USED_COLOR if one.used else UNUSED_COLOR
        # Cameras differ by shape as well as colour: an unused camera has no rays.
        for start, end in (*(_RAYS if one.used else ()), (1, 2), (2, 3), (3, 4), (4, 1)):
            ends = np.rint(16 * lines[[start, end]]).astype(np.int32)
            cv2.polylines(picture, [ends], False, color, 1, cv2.LINE_AA, 4)
    page.put(picture, *corner)
    x, y = corner[0] + 14, corner[1] + 30
    page.texts.append(Text(x, y, "cameras", size_px=19, color=INK))
    place = corner[0] + _SMALL_PX - 14
    for kind, color, used in (("unused", UNUSED_COLOR, False), ("used", USED_COLOR, True)):
        if any(one.used is used for one in scored):
            ink = "#{:02x}{:02x}{:02x}".format(*color)
            page.texts.append(Text(place, y, kind, 19, ink, "right", bold=True))
            place -= 86


def frustum(one: ScoredView, pose: NDArray[np.float64], length: float) -> NDArray[np.float64]:
    """Return a camera's centre and the corners of its image (5, 3), `length` metres ahead."""
    camera = one.view.camera
    size, focal, center = (
        np.array(pair, float) for pair in (camera.size_px, camera.focal_px, camera.center_px)
    )
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * (size - 1)
    rays = np.concatenate([(corners - center) / focal, np.ones((4, 1))], axis=1) * length
    return np.concatenate([np.zeros((1, 3)), rays]) @ pose[:3, :3].T + pose[:3, 3]


def _unit(vector: NDArray[Any]) -> Vector:
    return np.asarray(vector / np.linalg.norm(vector), np.float64)
