"""A scan says if its zoom was changed, and counts points that no lens could show."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from drawn import Drawn
from rooms_to_scan import FOCAL_PX, LENS, Room, around, draw, write_photos

from servoid.scan import Request, Scan, scan
from servoid.scan.mapping import _error_px

WALK = around(10, 60.0)
ZOOM = 1.15


def zoomed(image: np.ndarray) -> np.ndarray:
    """Return an image that was taken with a longer focal length."""
    u, v = LENS.center_px
    change = np.array([[ZOOM, 0.0, (1.0 - ZOOM) * u], [0.0, ZOOM, (1.0 - ZOOM) * v]])
    height, width = image.shape[:2]
    return np.asarray(cv2.warpAffine(image, change, (width, height), flags=cv2.INTER_CUBIC))


def scanned(tmp_path: Path, drawn: Drawn, zoomed_from: int) -> Scan:
    """Scan photographs of a room, of which the last were zoomed."""
    photos = drawn(
        tmp_path / "room", "room", "walk", lambda new: write_photos(new, draw(Room(), WALK))
    )
    for path in sorted(photos.glob("*.jpg"))[zoomed_from:]:
        image = cv2.imread(str(path))
        assert image is not None
        assert cv2.imwrite(str(path), zoomed(image), [cv2.IMWRITE_JPEG_QUALITY, 97])
    return scan(photos, tmp_path / "scan", Request(threads=1))


@pytest.mark.extended
def test_a_zoom_that_was_changed_in_the_middle_is_told_with_both_focal_lengths(
    tmp_path: Path, drawn: Drawn
) -> None:
    found = scanned(tmp_path, drawn, 5)
    assert found.solution.zoomed_px is not None
    first_px, second_px = found.solution.zoomed_px
    assert first_px == pytest.approx(FOCAL_PX, rel=0.03)
    assert second_px == pytest.approx(ZOOM * FOCAL_PX, rel=0.03)
    assert any("the zoom or the focus was changed" in doubt for doubt in found.doubts)


@pytest.mark.extended
def test_one_zoom_is_not_taken_for_two(tmp_path: Path, drawn: Drawn) -> None:
    found = scanned(tmp_path, drawn, len(WALK))
    assert found.solution.zoomed_px is None


def test_points_that_no_lens_shows_where_they_were_seen_count_unless_they_are_very_few() -> None:
    off = np.full((200, 2), 0.3)
    usual = float(np.hypot(0.3, 0.3))
    assert _error_px(off, 800.0) == pytest.approx(usual)
    off[0] = np.nan
    assert _error_px(off, 800.0) == pytest.approx(usual)
    off[:10] = np.nan
    assert _error_px(off, 800.0) > 100.0
    assert _error_px(np.empty((0, 2)), 800.0) == 0.0
