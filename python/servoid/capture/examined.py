"""Examines a few image files of a capture for what would otherwise be read in silence."""

from dataclasses import replace
from pathlib import Path

from servoid.camera import count_pages
from servoid.capture.capture import Capture
from servoid.capture.deep_images import with_bits


def examined(capture: Capture) -> Capture:
    """Return a capture with the bits of its 16-bit images, and notes on these and on pages.

    The first image of each camera is read, and a few more if that has 16 bits.
    """
    capture = with_bits(capture)
    for camera in capture.cameras:
        first = next((one for one in camera.pictures if one is not None and one.is_there), None)
        pages = 1 if first is None or first.is_in_memory else count_pages(first.path)
        if first is not None and pages > 1:
            note = _note(first.path, pages, camera.name)
            return replace(capture, notes=(*capture.notes, note))
    return capture


def _note(path: Path, pages: int, name: str) -> str:
    return (
        f"{path}, an image of camera '{name}', has {pages} pages, and so may others: of each image "
        "the first page is used; write each page that is needed into a file of its own"
    )
