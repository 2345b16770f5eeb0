"""Recognises images of 8, 10 or 12 bits that are stored in 16, and narrows them to 8 bits."""

import numpy as np
from numpy.typing import NDArray

from servoid.errors import ImageError

WHOLE_BITS = 16
_PLACED_LOW = (8, 10, 12)  # bits that cameras store in the lower ones of 16


def likely_bits(largest: int) -> int:
    """Return how many bits the values of 16-bit images have, of which `largest` is the largest.

    With a largest value of 4095 or less their upper bytes are nearly black, whatever they show.
    """
    return next((bits for bits in _PLACED_LOW if largest < 1 << bits), WHOLE_BITS)


def narrowed(
    pixels: NDArray[np.uint16], bits: int = WHOLE_BITS, place: str = "the image"
) -> NDArray[np.uint8]:
    """Return the upper 8 of so many bits.

    Raises:
        ImageError: a value has more bits; `place` begins the message.

    """
    largest = int(pixels.max(initial=0))
    if largest >= 1 << bits:
        raise ImageError(
            f"{place} has the value {largest}, but its camera's images are taken as of {bits} bits "
            f"of 16, as no value of those that were looked at exceeds {(1 << bits) - 1}; store all "
            "of them in 8 bits"
        )
    return (pixels >> (bits - 8)).astype(np.uint8)


def dark_words(largest: int) -> str:
    """Say what a largest value probably means that leaves 16-bit images nearly black."""
    bits = likely_bits(largest)
    return (
        f"no value exceeds {largest} of 65535, as of a camera with {bits} bits: the image is "
        f"nearly black; multiply its values by {1 << (WHOLE_BITS - bits)}, or store it in 8 bits"
    )
