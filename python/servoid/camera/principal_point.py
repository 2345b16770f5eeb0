"""Notices principal points that belong to images of another size."""

from servoid._native import Camera, Lens
from servoid.words import digits

_AT_CORNER, _ON_DIAGONAL = 0.9, 0.05  # of the width and height: surely of larger images
_FAR_OFF = 0.12  # of the width or height: real ones are within 0.05 of the middle


def outside_note(what: str, camera: Camera | Lens) -> str | None:
    """Report a camera whose principal point is not in its image; `what` is `camera left`."""
    if _off_middle(camera) <= 0.5:
        return None
    return (
        f"the principal point of {what}, {_place(camera)} px, is "
        f"outside of its image of {_size(camera)} pixels: is the calibration that of "
        "larger images, or are width and height exchanged? Calibrate for these images"
    )


def off_center_note(what: str, camera: Camera | Lens) -> str | None:
    """Report a camera whose principal point is in its image, but far from the middle."""
    if not _FAR_OFF < _off_middle(camera) <= 0.5:
        return None
    return (
        f"the principal point of {what}, {_place(camera)} px, is far from the middle of its image "
        f"of {_size(camera)} pixels: if the calibration is that of images of another size, scale "
        "focal lengths and principal point to these; if the images are cut out of larger ones, "
        "this may be right"
    )


def principal_point_note(what: str, camera: Camera | Lens) -> str | None:
    """Report a principal point that is outside of the image, or far from its middle."""
    return outside_note(what, camera) or off_center_note(what, camera)


def wrong_size(what: str, camera: Camera | Lens) -> str | None:
    """Return that a calibration is surely that of larger images, from the place of its middle.

    Images that are cut out of larger ones have it anywhere, but hardly on their diagonal, and at
    its end.
    """
    sides = zip(camera.center_px, camera.size_px, strict=True)
    shares = [(center + 0.5) / size for center, size in sides]
    if min(shares) < _AT_CORNER or max(shares) - min(shares) > _ON_DIAGONAL * max(shares):
        return None
    return (
        f"the calibration of {what} is that of images {2.0 * max(shares):.2g} times as "
        f"large: its principal point is {_place(camera)} px in images of {_size(camera)} pixels"
    )


def _off_middle(camera: Camera | Lens) -> float:
    """Return how far the principal point is from the middle, as a share of the width or height."""
    sides = zip(camera.center_px, camera.size_px, strict=True)
    return max(abs((center + 0.5) / size - 0.5) for center, size in sides)


def _place(camera: Camera | Lens) -> str:
    u, v = camera.center_px
    return f"({digits(u)}, {digits(v)})"


def _size(camera: Camera | Lens) -> str:
    width, height = camera.size_px
    return f"{width}x{height}"
