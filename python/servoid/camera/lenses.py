"""Makes lenses from the numbers that a file gives."""

from collections.abc import Sequence

from servoid._native import Lens
from servoid.errors import CameraError, located

# Larger numbers do not reach the core, which says how large an image may be.
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
    """Make a lens; `place` says in messages where its numbers stand.

    Raises:
        CameraError: there is no such model, or no such lens.

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
