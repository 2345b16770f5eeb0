"""Draws the growth of a body: from six sides after each change, with its previous outline."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Pose
from servoid.track import BodyChange, History, LearnedSurface, placed
from servoid.view.axes import DISTINCT
from servoid.view.body_picture import solids_in_world
from servoid.view.page import QUIET_INK, Page, Text
from servoid.view.solid_picture import Solids, Viewpoint, axes_toward, covered, render
from servoid.words import counted

MOST_SHOWN = 5  # changes, besides the start
UP, FRONT, RIGHT = np.eye(3)[[1, 2, 0]]
NAMED_SIDES = {
    "front": FRONT,
    "right": RIGHT,
    "back": -FRONT,
    "left": -RIGHT,
    "top": UP,
    "bottom": -UP,
}
"""The sides of an object by their names: unit vectors in the frame of its sides."""

_TILE_PX, _GAP_PX, _MARGIN_PX, _TITLE_PX = 180, 8, 16, 34
_FILLED = 0.74  # of a tile, by the longest side of the largest body
_RISE_DEG = 9.0
_BEFORE = (0xD5, 0x5E, 0x00)
_LIGHT = np.array([0.35, 0.80, 0.48])

Vector = NDArray[np.float64]
Turn = NDArray[np.float64]
Colors = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class _Row:
    title: str
    thumbnail: Colors | None
    before: Solids | None
    after: Solids


def draw_growth(history: History, sides_from_object: Turn) -> bytes:
    """Draw the body at the start and at most `MOST_SHOWN` changes; return the PNG file's bytes.

    `sides_from_object` (3, 3) maps the object's frame to that of its sides.
    """
    rows = _rows(history, sides_from_object)
    columns = 1 + len(NAMED_SIDES)
    pitch, height = _TILE_PX + _GAP_PX, _TILE_PX + _TITLE_PX
    page = Page(2 * _MARGIN_PX + columns * pitch - _GAP_PX, _MARGIN_PX + height * len(rows) + 8)
    spans = np.array([[row.after.extent(axis) for axis in np.eye(3)] for row in rows])
    low, high = spans[:, :, 0].min(axis=0), spans[:, :, 1].max(axis=0)
    metres_per_px = float((high - low).max()) / (_FILLED * _TILE_PX)
    for place, row in enumerate(rows):
        top = _MARGIN_PX // 2 + place * height
        page.texts.append(Text(_MARGIN_PX, top + 24, row.title, 17))
        corner = (_MARGIN_PX, top + _TITLE_PX)
        page.put(_seen(row.thumbnail), *corner)
        for column, (name, toward) in enumerate(NAMED_SIDES.items(), start=1):
            left = _MARGIN_PX + column * pitch
            seen = _viewpoint(toward, (low + high) / 2.0, metres_per_px)
            page.put(_tile(row, seen), left, corner[1])
            page.texts.append(Text(left + 8, corner[1] + 20, name, 14, QUIET_INK))
    return page.png()


def solids_of(body: Body, surface: LearnedSurface, sides_from_object: Turn) -> Solids:
    """Return a body's ellipsoids in the frame of its sides, in the colours of its surface."""
    pose = np.eye(4)
    pose[:3, :3] = sides_from_object
    return solids_in_world(placed(body, Pose(pose)), surface_colors(body, surface))


def surface_colors(body: Body, surface: LearnedSurface) -> Colors:
    """Return each ellipsoid's colour (K, 3) uint8 RGB: the median of its surface points.

    A point belongs to the ellipsoid whose surface is nearest, as a share of the ellipsoid's size.
    An ellipsoid without points gets a colour that differs from its neighbours'.
    """
    known = [[int(one[at : at + 2], 16) for at in (1, 3, 5)] for one in DISTINCT]
    colors = np.array([known[place % len(known)] for place in range(len(body))], dtype=np.uint8)
    if not len(surface.points):
        return colors
    still = solids_in_world(placed(body, Pose.identity()), colors)
    offsets = surface.points[:, None] - still.centers[None]
    sizes = np.einsum("nki,kij,nkj->nk", offsets, np.linalg.inv(still.shapes), offsets)
    owner = np.abs(np.log(np.maximum(sizes, 1e-12))).argmin(axis=1)
    for index in np.unique(owner):
        colors[index] = np.median(surface.colors[owner == index], axis=0).astype(np.uint8)
    return colors


def chosen(changes: Sequence[BodyChange]) -> list[BodyChange]:
    """Return at most `MOST_SHOWN` evenly spaced changes, including the first and the last."""
    places = np.linspace(0, len(changes) - 1, min(MOST_SHOWN, len(changes))).round().astype(int)
    return [changes[place] for place in places]


def _rows(history: History, sides_from_object: Turn) -> list[_Row]:
    first = solids_of(history.initial, history.surface, sides_from_object)
    begun = counted(len(history.initial), "ellipsoid")
    rows = [_Row(f"at the start: {begun}", history.thumbnail, None, first)]
    for change in chosen(history.changes):
        before, after = (
            solids_of(body, history.surface, sides_from_object)
            for body in (change.before, change.after)
        )
        was = f"{len(change.before)} → " if len(change.before) != len(change.after) else ""
        now = was + counted(len(change.after), "ellipsoid")
        title = f"{change.time_s:.2f} s, observation {change.index}: {now}"
        rows.append(_Row(title, change.thumbnail, before, after))
    return rows


def _viewpoint(toward: Vector, middle: Vector, metres_per_px: float) -> Viewpoint:
    """Return the viewpoint from a side, raised a little if it is horizontal."""
    rise = np.radians(_RISE_DEG)
    if abs(toward @ UP) > 0.5:
        axes = axes_toward(-toward, -np.sign(toward @ UP) * FRONT)
    else:
        axes = axes_toward(-(np.cos(rise) * toward + np.sin(rise) * UP), UP)
    return Viewpoint(axes, middle, metres_per_px, (_TILE_PX, _TILE_PX))


def _tile(row: _Row, seen: Viewpoint) -> Colors:
    """Return a body from one side, with its previous outline."""
    # From below, the body is drawn upside down: its shadow would lie in front of it otherwise.
    up = -UP if seen.axes[2] @ UP > 0.5 else UP
    light = _LIGHT * np.array([1.0, up @ UP, 1.0])
    picture = render(row.after, seen, up, light / np.linalg.norm(light))
    if row.before is not None:
        inside = covered(row.before, seen).astype(np.uint8)
        contours, _ = cv2.findContours(inside, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(picture, contours, -1, _BEFORE, 1, cv2.LINE_AA)
    return picture


def _seen(thumbnail: Colors | None) -> Colors:
    size = (_TILE_PX, _TILE_PX)
    if thumbnail is None:
        return np.full((*size, 3), 225, np.uint8)
    return np.asarray(cv2.resize(thumbnail, size, interpolation=cv2.INTER_AREA), np.uint8)
