"""Finds the values of an image of labels that was given as a mask, one value for each object."""

import numpy as np
from numpy.typing import NDArray

Value = tuple[int, ...]
"""A grey value, or a colour as (red, green, blue)."""

_LEAST_INSIDE = 9  # pixels whose eight neighbours have their value
_LEAST_SHARE = 0.2  # of a value's pixels; those of a smoothed border have hardly any inside
_SOLID = 0.8  # share of the mask's pixels with a label's value; less is a photograph or a blur
_DISTINCT = 32  # a compressed or smoothed border has more values than this
_NEAR = 16  # the part of the largest brightness by which compression changes others
_BITS = 21  # of a channel in the code of a colour


def labels_in(pixels: NDArray[np.generic]) -> tuple[Value, ...]:
    """Return the values that areas of a mask have, if there are several besides zero; else ().

    `pixels`: (H, W) or (H, W, 3) in BGR order, of an integer type. Values between that of the
    background and that of the object, as on a smoothed or compressed border, cover no area and are
    not returned.
    """
    import cv2

    if pixels.dtype.kind not in "ui":
        return ()
    codes = _codes(pixels)
    object_px = codes != 0
    if np.array_equal(object_px, codes == codes.max(initial=0)):
        return ()
    values, at, counts = np.unique(codes, return_inverse=True, return_counts=True)
    places = at.reshape(codes.shape).astype(np.float32)
    kernel = np.ones((3, 3), np.uint8)
    flat = np.asarray(cv2.dilate(places, kernel)) == np.asarray(cv2.erode(places, kernel))
    insides = np.bincount(at.reshape(codes.shape)[flat], minlength=len(values))
    is_area = (insides >= _LEAST_INSIDE) & (insides >= _LEAST_SHARE * counts)
    is_object = is_area & (values != 0)
    if not 1 < int(is_object.sum()) <= _DISTINCT:
        return ()
    if int(counts[is_object].sum()) < _SOLID * int(object_px.sum()):
        return ()
    areas = [_value(int(code), pixels.ndim) for code in values[is_area]]
    least = 1 if len(values) <= _DISTINCT else max(1, int(pixels.max()) // _NEAR)
    labels = _apart(areas, least)
    return labels if sum(any(one) for one in labels) > 1 else ()


def _codes(pixels: NDArray[np.generic]) -> NDArray[np.int64]:
    """Return one number for each grey value or colour, zero for black."""
    wide = pixels.astype(np.int64)
    if pixels.ndim == 2:
        return wide
    return wide[..., 0] | wide[..., 1] << _BITS | wide[..., 2] << 2 * _BITS


def _value(code: int, dimensions: int) -> Value:
    if dimensions == 2:
        return (code,)
    blue, green, red = (code >> shift & (1 << _BITS) - 1 for shift in (0, _BITS, 2 * _BITS))
    return (red,) if red == green == blue else (red, green, blue)


def _apart(values: list[Value], least: int) -> tuple[Value, ...]:
    """Return values without those that compression may have made of the ones before."""
    kept: list[Value] = []
    for value in values:
        if all(_difference(value, other) >= least for other in kept):
            kept.append(value)
    return tuple(kept)


def _difference(one: Value, other: Value) -> int:
    first, second = (value * 3 if len(value) == 1 else value for value in (one, other))
    return max(abs(a - b) for a, b in zip(first, second, strict=True))
