"""Notices principal points and focal lengths that belong to images of another size."""

from servoid._native import Camera, Lens
from servoid.words import digits

# Of the width and height: so far from the middle, and on the diagonal, it is of images of another
# size, but at the origin it may be in another unit.
_ASIDE, _ON_DIAGONAL, _AT_ORIGIN = 0.13, 0.05, 0.1
_SQUARE = 0.06  # by which width and height of pixels differ at most; of real cameras, by 0.005
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


def square_note(what: str, camera: Camera | Lens) -> str | None:
    """Report a camera whose focal lengths are those of pixels that are not square."""
    across, down = camera.focal_px
    if abs(across - down) <= _SQUARE * max(across, down):
        return None
    return (
        f"the focal lengths of {what}, {digits(round(across, 1))} px across and "
        f"{digits(round(down, 1))} px down, are those of pixels that are not square, as of images "
        "that were stretched: calibrate for these images, or scale focal lengths and principal "
        "point by what their width and height were scaled by; if that was done, this may be right"
    )


def principal_point_note(what: str, camera: Camera | Lens) -> str | None:
    """Report a principal point that is outside of the image, or far from its middle."""
    return outside_note(what, camera) or off_center_note(what, camera)


def wrong_size(what: str, camera: Camera | Lens) -> str | None:
    """Return that a calibration is surely that of other images, from the place of its middle.

    Images that are cut out of larger ones have it anywhere, but hardly on their diagonal.
    """
    sides = zip(camera.center_px, camera.size_px, strict=True)
    shares = [(center + 0.5) / size for center, size in sides]
    aside = min(abs(share - 0.5) for share in shares)
    is_on_diagonal = max(shares) - min(shares) <= _ON_DIAGONAL * max(shares)
    if aside < _ASIDE or min(shares) < _AT_ORIGIN or not is_on_diagonal:
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
