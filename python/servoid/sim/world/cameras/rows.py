"""Rolling shutters: bands of an image's rows, each exposed at its own time."""

from dataclasses import dataclass

from servoid._native import Lens

_BAND_PX = 16  # rows that are rendered with a common exposure


@dataclass(frozen=True)
class Band:
    """Rows of an image from `top` to before `bottom`, read out after a `share` of the read-out."""

    top: int
    bottom: int
    share: float


def bands(height: int, readout_s: float) -> tuple[Band, ...]:
    """Return the bands of an image, top first; a single one for a global shutter."""
    if readout_s == 0.0:
        return (Band(0, height, 0.0),)
    tops = range(0, height, _BAND_PX)
    last = max(height - 1, 1)
    return tuple(
        Band(top, bottom, 0.5 * (top + bottom - 1) / last)
        for top, bottom in ((top, min(top + _BAND_PX, height)) for top in tops)
    )


def lens_of(lens: Lens, band: Band) -> Lens:
    """Return the lens that sees only a band."""
    width, height = lens.size_px
    if (band.top, band.bottom) == (0, height):
        return lens
    return Lens(
        model=lens.model,
        size_px=(width, band.bottom - band.top),
        focal_px=lens.focal_px,
        center_px=(lens.center_px[0], lens.center_px[1] - band.top),
        distortion=lens.distortion,
    )
