"""Counts the pages of an image file, of which only the first is read."""

from pathlib import Path

_PAGED = (".tif", ".tiff", ".gif", ".webp")


def count_pages(path: Path) -> int:
    """Return how many images a file contains; 1 if its format has no pages or it is damaged."""
    import cv2

    if path.suffix.lower() not in _PAGED or not path.is_file():
        return 1
    try:
        return max(1, cv2.imcount(str(path), cv2.IMREAD_UNCHANGED))
    except cv2.error:
        return 1  # reported where the image is needed
