"""Finds the object that a target means in its image."""

import numpy as np

from servoid.errors import TargetError, located
from servoid.observe.growth import grow_from_box, grow_from_click
from servoid.observe.hue import hue_planes, match_image
from servoid.observe.images import read_image, read_mask
from servoid.observe.segment import Image, Mask, check_image
from servoid.observe.smoothing import gaussian
from servoid.observe.target import (
    BackgroundTarget,
    BoxTarget,
    ClickTarget,
    HueTarget,
    MaskTarget,
    Target,
)

_LEAST_CHANGE = 10.0  # grey levels; cameras and compression change less by themselves
_DEEPEST_SHADOW = 0.45
_BRIGHTEST = 1.15


def find_object(target: Target, image: Image) -> Mask:
    """Find the object that a target means in an image: the mask, (H, W) uint8, 255 on the object.

    Args:
        target: a mask, a box, a click, a hue window or a picture of the empty background; which
            view it is meant for is the caller's business.
        image: (H, W, 3) uint8, RGB.

    Raises:
        TargetError: the target lies outside the image, or finds nothing or everything.
        MaskError: the file of a mask cannot be read or has another size than the image.
        ImageError: the same for the picture of a background.

    """
    check_image(image)
    with located(f"the target '{target}'"):
        mask = _find(target, image)
        if not mask.any():
            raise TargetError(_nothing_found(target, image))
        if mask.all():
            raise TargetError(
                "the whole image was taken for the object; some of the background must be seen, "
                f"so {_REMEDIES[type(target)]}"
            )
    return mask


_REMEDIES: dict[type, str] = {
    MaskTarget: "draw a mask that is zero on the background",
    BoxTarget: "draw the box around the object, a little larger than it, or give a mask",
    ClickTarget: "click on the middle of the object, or draw a box around it",
    HueTarget: "choose a narrower hue window",
    BackgroundTarget: "take the picture of the empty place with the same camera, pose and exposure",
}


def _find(target: Target, image: Image) -> Mask:
    size_px = image.shape[1], image.shape[0]
    match target:
        case MaskTarget(path=path):
            return read_mask(path, size_px)
        case BackgroundTarget(path=path):
            return changed_part(image, read_image(path, size_px))
        case HueTarget():
            return hue_part(image, target)
        case BoxTarget():
            return grow_from_box(image, _box_mask(target, size_px))
        case ClickTarget(u=u, v=v):
            if not (-0.5 <= u < size_px[0] - 0.5 and -0.5 <= v < size_px[1] - 0.5):
                raise TargetError(
                    f"the click lies outside the image, which has u from 0 to {size_px[0] - 1} "
                    f"and v from 0 to {size_px[1] - 1}"
                )
            return grow_from_click(image, u, v)


def _box_mask(box: BoxTarget, size_px: tuple[int, int]) -> Mask:
    width, height = size_px
    columns = np.arange(width)
    rows = np.arange(height)
    inside = ((rows >= box.v0 - 0.5) & (rows <= box.v1 + 0.5))[:, None] & (
        (columns >= box.u0 - 0.5) & (columns <= box.u1 + 0.5)
    )
    if not inside.any():
        raise TargetError(
            f"the box lies outside the image, which has u from 0 to {width - 1} and v from 0 to "
            f"{height - 1}"
        )
    if inside.all():
        raise TargetError(
            "the box covers the whole image, so nothing shows the background; draw it closer "
            "around the object, or give a mask"
        )
    return np.where(inside, 255, 0).astype(np.uint8)


def hue_part(image: Image, window: HueTarget) -> Mask:
    """Find the largest connected part whose hues lie in a window; its holes are closed."""
    import cv2

    limits = (window.low_deg, window.high_deg, window.least_saturation, window.least_value)
    mask = largest_part(match_image(image, *limits))
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return np.asarray(cv2.drawContours(mask, outlines, -1, (255,), cv2.FILLED), np.uint8)


def changed_part(image: Image, background: Image) -> Mask:
    """Find the largest connected part of an image that is new against an empty background.

    A pixel has changed if no brightness of the background's colour explains it, from a soft shadow
    to a little more light, by several times the noise of both pictures.
    """
    import cv2

    now, empty = (gaussian(one.astype(np.float32), 1.0) for one in (image, background))
    change = now - empty
    fine = change - np.asarray(cv2.medianBlur(change, 5))
    noise = 1.4826 * float(np.median(np.abs(fine)))
    power = np.maximum((empty * empty).sum(axis=2), 1.0)
    light = np.clip((now * empty).sum(axis=2) / power, _DEEPEST_SHADOW, _BRIGHTEST)
    left_over = np.sqrt(np.square(now - light[..., None] * empty).sum(axis=2))
    chosen = np.where(left_over > max(_LEAST_CHANGE, 8.0 * noise), 255, 0).astype(np.uint8)
    across = 2 * round(max(image.shape) / 400) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (across, across))
    joined = cv2.morphologyEx(chosen, cv2.MORPH_CLOSE, disc)
    return largest_part(np.asarray(joined, np.uint8))


def largest_part(mask: Mask) -> Mask:
    """Keep the largest connected part of a mask; of an empty one, nothing."""
    import cv2

    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    if count < 2:
        return np.zeros_like(mask)
    largest = 1 + int(np.argmax(np.asarray(stats)[1:, cv2.CC_STAT_AREA]))
    return np.where(np.asarray(labels) == largest, 255, 0).astype(np.uint8)


def _nothing_found(target: Target, image: Image) -> str:
    message = f"no object was found; {_REMEDIES[type(target)]}"
    if not isinstance(target, HueTarget):
        return message
    height, width = image.shape[:2]
    middle = image[height // 3 : height - height // 3, width // 3 : width - width // 3]
    hue_deg, saturation, value = hue_planes(middle)
    strong = (saturation >= target.least_saturation) & (value >= target.least_value)
    if not strong.any():
        return (
            "no pixel has such a hue, and the middle of the image is too grey or too dark to have "
            "any; give a box or a mask"
        )
    counts = np.bincount((hue_deg[strong] // 20.0).astype(np.intp) % 18, minlength=18)
    common = [index for index in np.argsort(-counts, kind="stable")[:2] if counts[index]]
    found = " and ".join(f"{20 * index}..{20 * index + 20}" for index in common)
    return f"no pixel has such a hue; hues in the middle of the image are mostly {found}"
