"""Makes lenses: from the parameters in a file, or without distortion from a camera."""

from collections.abc import Sequence

from servoid._native import Camera, Lens
from servoid.errors import CameraError, located

# The core cannot receive larger numbers; it checks the maximum size of an image itself.
_LARGEST_SIDE_PX = 2**31 - 1


def make_lens(
    place: str,
    *,
    model: str,
    size_px: tuple[int, int],
    focal_px: tuple[float, float],
    center_px: tuple[float, float],
    distortion: Sequence[float] = (),
) -> Lens:
    """Make a lens; messages name the source of its parameters by `place`.

    Raises:
        CameraError: the model is unknown, or the parameters describe no lens.

    """
    if min(size_px) < 1 or max(size_px) > _LARGEST_SIDE_PX:
        raise CameraError(f"{place}: size_px must be two positive numbers, not {size_px}")
    with located(place):
        return Lens(
            model=model,
            size_px=size_px,
            focal_px=focal_px,
            center_px=center_px,
            distortion=tuple(distortion),
        )


def pinhole_lens(camera: Camera) -> Lens:
    """Return the lens without distortion whose image is that of a pinhole camera."""
    return Lens(
        model="pinhole",
        size_px=camera.size_px,
        focal_px=camera.focal_px,
        center_px=camera.center_px,
    )
