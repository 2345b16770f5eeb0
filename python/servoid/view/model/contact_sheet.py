"""Draws the contact sheet: the image of each view, with the ellipsoids' outlines over it."""

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.model import GOOD_IOU, ModelResult
from servoid.shape import Body
from servoid.view.page import INK, QUIET_INK, WARNING_INK, Page, Text
from servoid.view.scores import ScoredView, score_words, scored_views

MOST_VIEWS = 24

_PAGE_WIDTH_PX = 1640
_MARGIN_PX = 20
_GAP_PX = 16
_CAPTION_PX = 36
_TITLE_PX = 62
_NO_IMAGE = (110, 110, 110)
_POOR, _WORST = (0xC6, 0x2F, 0x2F), (0x50, 0x50, 0x50)  # the worst view of a good body is no alarm
_SUBPIXEL_BITS = 4


def draw_contact_sheet(result: ModelResult) -> bytes:
    """Draw at most `MOST_VIEWS` views, the worst among them, and return the PNG file's bytes."""
    scored = scored_views(result)
    worst = min(scored, key=lambda one: one.iou)
    shown = choose_views(scored, worst)
    columns = min(len(shown), max(2, int(np.ceil(np.sqrt(len(shown))))))
    tile_width = (_PAGE_WIDTH_PX - 2 * _MARGIN_PX - (columns - 1) * _GAP_PX) // columns
    tile_width = min(tile_width, 700)
    tile_size = (tile_width, round(tile_width * 0.75))
    rows = -(-len(shown) // columns)
    pitch = tile_size[1] + _CAPTION_PX + _GAP_PX
    page = Page(_PAGE_WIDTH_PX, _TITLE_PX + rows * pitch + _MARGIN_PX)
    title = score_words(scored, len(result.body))
    page.texts.append(Text(_MARGIN_PX, 40, title, size_px=26))
    if len(shown) < len(scored):
        note = f"{len(shown)} of {len(scored)} views"
        right = _PAGE_WIDTH_PX - _MARGIN_PX
        page.texts.append(Text(right, 40, note, size_px=22, color=QUIET_INK, align="right"))
    for place, one in enumerate(shown):
        row, column = divmod(place, columns)
        corner = (_MARGIN_PX + column * (tile_size[0] + _GAP_PX), _TITLE_PX + row * pitch)
        _put_view(page, corner, result.body, one, tile_size, is_worst=one is worst)
    return page.png()


def choose_views(scored: list[ScoredView], worst: ScoredView) -> list[ScoredView]:
    """Return at most `MOST_VIEWS` evenly spaced views; the worst replaces the one nearest to it."""
    if len(scored) <= MOST_VIEWS:
        return scored
    chosen = np.linspace(0, len(scored) - 1, MOST_VIEWS).round().astype(int)
    worst_at = scored.index(worst)
    chosen[np.abs(chosen - worst_at).argmin()] = worst_at
    return [scored[index] for index in chosen]


def outline_colors(count: int) -> list[tuple[int, int, int]]:
    """Return a bright colour (RGB) for each of `count` outlines, neighbours far apart in hue."""
    hues = np.asarray((24.0 + 137.508 * np.arange(count)) % 360.0, np.float64)
    lightness = np.where(np.arange(count) % 2 == 0, 0.80, 0.70)
    lch = np.stack([100 * lightness, *_chroma(hues)], axis=1).astype(np.float32)
    rgb = cv2.cvtColor(lch[None], cv2.COLOR_Lab2RGB)[0]
    levels = np.rint(255 * np.clip(rgb, 0, 1)).astype(int)
    return [(int(red), int(green), int(blue)) for red, green, blue in levels]


def _chroma(hues_deg: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    angles = np.radians(hues_deg)
    return 78.0 * np.cos(angles), 78.0 * np.sin(angles)


def outline_points(
    center_px: NDArray[np.float64], covariance: NDArray[np.float64], count: int = 160
) -> NDArray[np.float64]:
    """Return points (count, 2) around the ellipse (x - c)ᵀ covariance⁻¹ (x - c) = 1, in pixels."""
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)])
    variances, axes = np.linalg.eigh(covariance)
    reach = axes * np.sqrt(np.maximum(variances, 0.0))
    return center_px + (reach @ circle).T


def _put_view(
    page: Page,
    corner: tuple[int, int],
    body: Body,
    one: ScoredView,
    tile_size: tuple[int, int],
    *,
    is_worst: bool,
) -> None:
    """Draw one view and its caption on the page."""
    tile = draw_view(body, one, tile_size)
    if is_worst:
        marked = _POOR if one.iou < GOOD_IOU else _WORST
        cv2.rectangle(tile, (1, 1), (tile_size[0] - 2, tile_size[1] - 2), marked, 3)
        cv2.rectangle(tile, (0, 0), (132, 30), marked, -1)
        tag = Text(corner[0] + 10, corner[1] + 22, "worst view", 18, "white", bold=True)
        page.texts.append(tag)
    page.put(tile, *corner)
    base = corner[1] + tile_size[1] + 25
    right = corner[0] + tile_size[0]
    size = min(20.0, 20.0 * tile_size[0] / 290)
    words = f"{one.view.name}, {one.use}"
    iou = f"IoU {one.iou:.3f}"
    color = WARNING_INK if one.iou < GOOD_IOU else INK
    page.texts.append(Text(corner[0], base, _shorten(words), size, INK))
    page.texts.append(Text(right, base, iou, size, color, "right", bold=is_worst))


def _shorten(words: str) -> str:
    """Return a caption that fits under a tile; it keeps the end, which identifies the image."""
    return words if len(words) <= 22 else "…" + words[-21:]


def draw_view(body: Body, one: ScoredView, tile_size: tuple[int, int]) -> NDArray[np.uint8]:
    """Return a view (H, W, 3) RGB, cropped around the object, with its mask and outlines."""
    view = one.view
    image, mask = view.image(), view.mask()
    found = body.outlines(view.camera, view.world_from_camera)
    outlines = [None if one is None else outline_points(*one) for one in found]
    tile_from_image = _cut(mask, [points for points in outlines if points is not None], tile_size)
    scale = tile_from_image[0, 0]
    if scale < 0.7:
        image = cv2.GaussianBlur(image, (0, 0), 0.35 / scale)  # avoids aliasing
    way = {"M": tile_from_image, "dsize": tile_size}
    tile = cv2.warpAffine(image, **way, flags=cv2.INTER_CUBIC, borderValue=_NO_IMAGE)
    inside = np.asarray(cv2.warpAffine(mask, **way, flags=cv2.INTER_LINEAR), np.uint8)
    tile = _dim(np.asarray(tile, np.uint8), inside)
    contours, _ = cv2.findContours(inside // 128, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(tile, contours, -1, (255, 255, 255), 1, cv2.LINE_AA)
    for points, color in zip(outlines, outline_colors(len(body)), strict=True):
        if points is not None:
            placed = points @ tile_from_image[:, :2].T + tile_from_image[:, 2]
            fixed = np.rint(placed * (1 << _SUBPIXEL_BITS)).astype(np.int32)
            cv2.polylines(tile, [fixed], True, color, 2, cv2.LINE_AA, _SUBPIXEL_BITS)
    return np.asarray(tile, np.uint8)


def _dim(tile: NDArray[np.uint8], inside: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the tile with everything but the object darkened and nearly grey."""
    grey = cv2.cvtColor(tile, cv2.COLOR_RGB2GRAY)[:, :, None].astype(np.float32)
    dark = 0.24 * grey + 0.10 * tile.astype(np.float32) + 6.0
    share = inside[:, :, None].astype(np.float32) / 255.0
    return np.clip(share * tile + (1.0 - share) * dark, 0, 255).astype(np.uint8)


def _cut(
    mask: NDArray[np.uint8], outlines: list[NDArray[np.float64]], tile_size: tuple[int, int]
) -> NDArray[np.float64]:
    """Return `tile_from_image` (2, 3), which shows the mask and its outlines with a margin."""
    height, width = mask.shape
    left, top, mask_width, mask_height = cv2.boundingRect(mask)
    corners = np.array([[left, top], [left + mask_width - 1, top + mask_height - 1]], float)
    # An outline may extend far beyond the image; only the part inside counts.
    points = np.concatenate([corners, *outlines]).clip([0, 0], [width - 1, height - 1])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.07 * (high - low).max() + 2.0
    window = np.maximum(high - low + 2.0 * margin, 8.0)
    scale = float(np.min((np.array(tile_size) - 1) / window))
    moved = (np.array(tile_size) - 1) / 2.0 - scale * (low + high) / 2.0
    return np.array([[scale, 0.0, moved[0]], [0.0, scale, moved[1]]])
