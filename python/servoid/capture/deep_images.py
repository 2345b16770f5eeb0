"""Finds out how many bits the values of a capture's 16-bit images have."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from servoid.camera import WHOLE_BITS, Picture, likely_bits
from servoid.capture.capture import Capture, CaptureCamera
from servoid.errors import ImageError
from servoid.words import joined

_ANY = 65535  # a largest value that tells nothing
_READ = 5  # images of a camera, evenly chosen


def with_bits(capture: Capture) -> Capture:
    """Return a capture whose 16-bit images of 8, 10 or 12 bits are read as such, with a note.

    A few images of each camera are read if the first one has 16 bits. The number of bits is the
    same for all images of all such cameras, so that their brightness is, too.
    """
    largest = {camera.name: _largest_value(camera.pictures) for camera in capture.cameras}
    dark = {name: value for name, value in largest.items() if likely_bits(value) < WHOLE_BITS}
    if not dark:
        return capture
    bits = max(map(likely_bits, dark.values()))
    cameras = [_read_with(one, bits) if one.name in dark else one for one in capture.cameras]
    note = (
        f"the images of camera{'' if len(dark) == 1 else 's'} "
        f"{joined([repr(name) for name in dark])} have 16 bits, but no value of those that were "
        f"read exceeds {max(dark.values())} of 65535: all are taken as {bits}-bit values; if they "
        "are not, store them in 8 bits"
    )
    return replace(capture, cameras=tuple(cameras), notes=(*capture.notes, note))


def _read_with(camera: CaptureCamera, bits: int) -> CaptureCamera:
    pictures = [None if one is None else replace(one, bits=bits) for one in camera.pictures]
    return replace(camera, pictures=tuple(pictures))


def _largest_value(pictures: Sequence[Picture | None]) -> int:
    """Return the largest value of a few images; 65535 if one has no 16 bits, or all are black."""
    there = [one for one in pictures if one is not None and one.is_there and not one.is_in_memory]
    largest = 0
    for place in np.linspace(0, len(there) - 1, min(_READ, len(there)), dtype=int):
        try:
            found = there[place].largest_value()
        except ImageError:
            continue  # reported where the image is needed
        if found is None:
            return _ANY
        largest = max(largest, found)
    return largest or _ANY
