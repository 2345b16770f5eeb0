"""Finds the object that a target means in its image."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from servoid.brief import brief
from servoid.camera import WHOLE_BITS, gaussian, grey_note, grey_share, read_image, read_mask
from servoid.config import exists, missing
from servoid.errors import DoubtError, ImageError, MaskError, ServoidError, TargetError, located
from servoid.segment.answers import CLEAR, HAND_PX, STEADY, Answers
from servoid.segment.boxes import Corners, grow_from_box, larger, pixels_in
from servoid.segment.clicks import grow_from_click
from servoid.segment.doubts import (
    Depth,
    cut_sides,
    far_sides,
    is_thin,
    parted_by_depth,
    thickness_left,
)
from servoid.segment.hue import hue_planes, match_image
from servoid.segment.segment import Image, Mask, check_image
from servoid.segment.target import (
    IMAGE_SUFFIXES,
    BackgroundTarget,
    BoxTarget,
    ClickTarget,
    HueTarget,
    MaskTarget,
    Target,
)
from servoid.words import joined, measured

_LEAST_CHANGE = 10.0  # grey levels; noise of cameras and compression is smaller
_DEEPEST_SHADOW = 0.45
_BRIGHTEST = 1.15


@dataclass(frozen=True, eq=False)
class Found:
    """The object that a target means in its image, and any doubt about it.

    `mask` is (H, W) uint8, 255 on the object. `doubt` is the reason why another object may be
    meant, None if there is none; `answers` are then the masks from which the user must choose, the
    first being `mask`. `notes` are messages for the user in any case.
    """

    mask: Mask
    answers: tuple[Mask, ...]
    doubt: str | None = None
    notes: tuple[str, ...] = ()

    __repr__ = brief


def find_object(
    target: Target,
    image: Image,
    depth: Depth | None = None,
    *,
    trusted: bool = False,
    bits: int = WHOLE_BITS,
) -> Mask:
    """Find the object that a target means in an image: the mask, (H, W) uint8, 255 on the object.

    Args:
        target: a mask, a box, a click, a hue window or an image of the empty background; the caller
            chooses the view that it is meant for.
        image: (H, W, 3) uint8, RGB.
        depth: a depth image in the same pixels, if there is one; NaN or 0 where it is unknown.
        trusted: use the most likely mask, even if another object may be meant.
        bits: how many of 16 bits the values of a 16-bit image of the background have, which are
            those of the image.

    Raises:
        DoubtError: another object may be meant: the target moved by 3 px finds another one, several
            are equally likely, or the mask has a gap in depth.
        TargetError: the target lies outside the image, or finds nothing or everything.
        MaskError: the file of a mask cannot be read or has another size than the image.
        ImageError: the same for the image of a background.

    """
    found = find_with_doubts(target, image, depth, bits=bits)
    return found.mask if trusted else undoubted(found, target, image)


def undoubted(found: Found, target: Target, image: Image) -> Mask:
    """Return the mask that was found for a target in an image, if there is no doubt about it.

    Raises:
        DoubtError: there is.

    """
    if found.doubt is None:
        return found.mask
    message = f"the target '{target}': {found.doubt}; {_DOUBT_REMEDIES[type(target)]}"
    raise DoubtError(message, image, found.answers)


def find_with_doubts(
    target: Target, image: Image, depth: Depth | None = None, *, bits: int = WHOLE_BITS
) -> Found:
    """Find the object that a target means in an image, and report any doubt about it.

    Arguments and errors are those of `find_object`, except that a doubt raises no error: it is in
    the result, for `undoubted` or the caller to judge.
    """
    check_image(image)
    with located(f"the target '{target}'"):
        if depth is not None and depth.metres.shape != image.shape[:2]:
            raise TargetError(
                f"the depth image has the shape {depth.metres.shape}, the image "
                f"{image.shape[:2]}; give depth in the pixels of the image"
            )
        found = _find(target, image, depth, bits)
        if not found.mask.any():
            raise TargetError(_nothing_found(target, image))
        if found.mask.all():
            raise TargetError(
                "the mask covers the whole image; some of the background must be visible, "
                f"so {_NOT_FOUND_REMEDIES[type(target)]}"
            )
    parting = None if depth is None else parted_by_depth(found.mask, depth)
    if parting is None:
        return found
    doubt = parting.words if found.doubt is None else f"{found.doubt}; and {parting.words}"
    return replace(found, doubt=doubt, answers=(*found.answers, parting.near, parting.far))


_NOT_FOUND_REMEDIES: dict[type, str] = {
    MaskTarget: "draw a mask that is zero on the background",
    BoxTarget: "draw the box around the object, a little larger than it, or give a mask",
    ClickTarget: "click on the middle of the object, or draw a box around it",
    HueTarget: "choose a narrower hue window",
    BackgroundTarget: "take the background image with the same camera, pose and exposure",
}

_DOUBT_REMEDIES: dict[type, str] = {
    MaskTarget: "draw a mask that covers the object and nothing else",
    BoxTarget: "draw a box that nearly touches the object on all four sides; if this one does, the "
    "object's colours are also around it: give a mask, or mark the object in another view",
    ClickTarget: "draw a box around the object, or give a mask",
    HueTarget: "choose a narrower hue window, or give a mask",
    BackgroundTarget: "give a mask, or a box around the object",
}


def _find(target: Target, image: Image, depth: Depth | None, bits: int) -> Found:
    size_px = image.shape[1], image.shape[0]
    match target:
        case MaskTarget(path=path):
            _check_there(path, MaskError, "an image that is zero on all but the object")
            note = grey_note(grey_share(path))
            notes = () if note is None else (note,)
            return replace(_drawn(read_mask(path, size_px)), notes=notes)
        case BackgroundTarget(path=path):
            _check_there(path, ImageError, "an image of the scene without the object")
            return _alone(changed_part(image, read_image(path, size_px, bits=bits)))
        case HueTarget():
            return _alone(hue_part(image, target))
        case BoxTarget():
            return _in_box(image, target, depth)
        case ClickTarget():
            return _at_click(image, target)


def _check_there(path: Path, error: type[ServoidError], wanted: str) -> None:
    if not exists(path):
        raise missing(path, error, wanted, IMAGE_SUFFIXES)


def _alone(mask: Mask) -> Found:
    return Found(mask, (mask,))


def _drawn(mask: Mask) -> Found:
    if not mask.any() or not is_thin(mask):
        return _alone(mask)
    return Found(
        mask,
        (mask,),
        f"the mask is a line, not an area: it keeps {100.0 * thickness_left(mask):.0f} % of its "
        f"pixels if its border is moved by {HAND_PX:.0f} px, and at least half is needed",
    )


def _in_box(image: Image, target: BoxTarget, depth: Depth | None) -> Found:
    box = target.corners
    _check_box(pixels_in(box, image.shape))
    answers = grow_from_box(image, box, depth)
    mask = answers.sharp(image)
    mask[pixels_in(larger(box), image.shape) == 0] = 0
    found, beyond = _found(image, mask, answers, "a box moved"), _beyond(box, image)
    if found.doubt is not None and beyond:
        # Wrong numbers of the box are the likelier reason, so an error reports them first.
        found, beyond = replace(found, doubt=f"{'; '.join(beyond)}; and {found.doubt}"), ()
    around = (*_far_away(mask, box), *_cut_off(mask, box)) if mask.any() else ()
    return replace(found, notes=(*beyond, *around))


def _at_click(image: Image, target: ClickTarget) -> Found:
    height, width = image.shape[:2]
    if not (-0.5 <= target.u < width - 0.5 and -0.5 <= target.v < height - 0.5):
        raise TargetError(
            f"the click lies outside the image, which has u from 0 to {width - 1} and v from 0 to "
            f"{height - 1}"
        )
    answers = grow_from_click(image, target.u, target.v)
    return _found(image, answers.sharp(image), answers, "a click moved")


def _found(image: Image, mask: Mask, answers: Answers, moved: str) -> Found:
    doubt, clearness = None, _floor(answers.clearness)
    if answers.steadiness < STEADY:
        doubt = (
            f"{moved} by {HAND_PX:.0f} px finds another object: its mask overlaps the most common "
            f"one by {_floor(answers.steadiness)} (intersection over union), and {STEADY} is needed"
        )
    elif answers.clearness < CLEAR:
        doubt = (
            "several objects match it about equally well: their masks overlap the most common "
            f"one by {clearness} on average (intersection over union), and {CLEAR} is needed"
        )
    return Found(mask, (mask, *answers.shown(image.shape)[1:]), doubt)


def _floor(share: float) -> str:
    """Format a share with two digits, rounded down so that too small a value looks too small."""
    return f"{int(100.0 * share) / 100.0:.2f}"


def _beyond(box: Corners, image: Image) -> tuple[str, ...]:
    """Report that a box extends beyond its image by more than a hand's error."""
    height, width = image.shape[:2]
    over = {
        "left": -box[0],
        "top": -box[1],
        "right": box[2] - (width - 1.0),
        "bottom": box[3] - (height - 1.0),
    }
    sides = [f"its {side} by {measured(px)} px" for side, px in over.items() if px > HAND_PX]
    if not sides:
        return ()
    return (
        f"the box extends beyond the image at {joined(sides)}: u is from 0 to {width - 1} "
        f"and v from 0 to {height - 1}; check the numbers, and that the image was not resized",
    )


def _far_away(mask: Mask, box: Corners) -> tuple[str, ...]:
    sides = far_sides(mask, box)
    if not sides:
        return ()
    return (
        f"the object that was found does not reach the {joined(sides)} of its box; if a part of "
        "it is missing, draw the box closer around it",
    )


def _cut_off(mask: Mask, box: Corners) -> tuple[str, ...]:
    sides = cut_sides(mask, box)
    if not sides:
        return ()
    return (
        f"the object that was found reaches beyond the {joined(sides)} of its box, and may have "
        "been cut off there; draw the box around the whole object",
    )


def _check_box(inside: Mask) -> None:
    height, width = inside.shape
    if not inside.any():
        raise TargetError(
            f"the box lies outside the image, which has u from 0 to {width - 1} and v from 0 to "
            f"{height - 1}"
        )
    if inside.all():
        raise TargetError(
            "the box covers the whole image, so no background is visible; draw it closer "
            "around the object, or give a mask"
        )


def hue_part(image: Image, window: HueTarget) -> Mask:
    """Find the largest connected component whose hues are in a window; its holes are filled."""
    import cv2

    limits = (window.low_deg, window.high_deg, window.least_saturation, window.least_value)
    mask = largest_part(match_image(image, *limits))
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return np.asarray(cv2.drawContours(mask, outlines, -1, (255,), cv2.FILLED), np.uint8)


def changed_part(image: Image, background: Image) -> Mask:
    """Find the largest connected component of an image that differs from an empty background.

    A pixel has changed if no brightness of the background's colour explains it, from a soft shadow
    to slightly more light, by several times the noise of both images.
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
    """Keep the largest connected component of a mask; an empty mask stays empty."""
    import cv2

    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    if count < 2:
        return np.zeros_like(mask)
    largest = 1 + int(np.argmax(np.asarray(stats)[1:, cv2.CC_STAT_AREA]))
    return np.where(np.asarray(labels) == largest, 255, 0).astype(np.uint8)


def _nothing_found(target: Target, image: Image) -> str:
    message = f"no object was found; {_NOT_FOUND_REMEDIES[type(target)]}"
    if not isinstance(target, HueTarget):
        return message
    height, width = image.shape[:2]
    middle = image[height // 3 : height - height // 3, width // 3 : width - width // 3]
    hue_deg, saturation, value = hue_planes(middle)
    strong = (saturation >= target.least_saturation) & (value >= target.least_value)
    if not strong.any():
        return (
            "no pixel has such a hue, and the centre of the image is too grey or too dark to have "
            "any; give a box or a mask"
        )
    counts = np.bincount((hue_deg[strong] // 20.0).astype(np.intp) % 18, minlength=18)
    common = [index for index in np.argsort(-counts, kind="stable")[:2] if counts[index]]
    found = " and ".join(f"{20 * index}..{20 * index + 20}" for index in common)
    return f"no pixel has such a hue; hues in the centre of the image are mostly {found}"
