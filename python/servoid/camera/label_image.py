"""Finds the values of an image of labels that was given as a mask, one value for each object."""

import numpy as np
from numpy.typing import NDArray

_LEAST_INSIDE = 9  # pixels whose eight neighbours have their value
_LEAST_SHARE = 0.2  # of a value's pixels; those of a smoothed border have hardly any inside
_SOLID = 0.8  # share of the mask's pixels with a label's value; less is a photograph or a blur
_MOST_LABEL = 100  # labels are counted from 1, and masks mostly have 1 or 255


def labels_in(pixels: NDArray[np.generic]) -> tuple[int, ...]:
    """Return the values, besides zero, that areas of a mask have, if there are several; else ().

    `pixels`: (H, W), of an integer type. Values between that of the background and that of the
    object, as on a smoothed or compressed border, cover no area and are not returned. Values above
    those by which objects are counted may be the steps of a soft border, and colours those of an
    object that was cut out of its photograph: for such there is no answer, ().
    """
    import cv2

    if pixels.dtype.kind not in "ui" or pixels.ndim != 2 or pixels.max(initial=0) > _MOST_LABEL:
        return ()
    values = pixels.astype(np.uint8)
    counts = np.bincount(values.ravel(), minlength=_MOST_LABEL + 1)
    if int((counts[1:] != 0).sum()) < 2:
        return ()
    kernel = np.ones((3, 3), np.uint8)
    flat = np.asarray(cv2.dilate(values, kernel)) == np.asarray(cv2.erode(values, kernel))
    insides = np.bincount(values[flat], minlength=_MOST_LABEL + 1)
    is_area = (insides >= _LEAST_INSIDE) & (insides >= _LEAST_SHARE * counts)
    is_area[0] = False
    if int(is_area.sum()) < 2 or counts[is_area].sum() < _SOLID * counts[1:].sum():
        return ()
    return tuple(np.flatnonzero(is_area).tolist())
