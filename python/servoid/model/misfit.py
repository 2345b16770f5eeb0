"""Finds contradictions between a modelled body, its masks and its views."""

from collections.abc import Collection, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, View
from servoid.camera import Undistortion, principal_point_note, square_note
from servoid.capture import CaptureView
from servoid.config import (
    FAR_M,
    MODELLED_AWAY_M,
    MODELLED_SIZE_M,
    SENSED_AWAY_M,
    SENSED_SIZE_M,
)
from servoid.model.verdict import GOOD_IOU, LEAST_IOU
from servoid.pose import exact
from servoid.words import counted, measured

ALL_AROUND = "the mask holds the border of the image all around, so that no outline is in it"
_WIDE_M = 1.0  # between cameras
_NEAREST_M = 0.01
OFF_SCALE = (
    f"the object is measured more than {FAR_M:g} m away, or more than {MODELLED_AWAY_M[1]:g} m by "
    f"cameras more than {_WIDE_M:g} m apart, or less than {_NEAREST_M:g} m away: that is not in "
    "metres"
)

_SMALL_UNITS = "in millimetres or centimetres"
_LEAST_OF_ONE = 0.3  # an intersection over union below which a view contradicts the body
_LEAST_OF_ALL = 0.7  # their mean, below which the body is not the object
_TIMES, _BESIDE = 3.0, 0.1  # the misfit of the median, and this more, contradict the body as well
_LEAST_COMPARED = 5  # views, below which a median is no measure
# Of a view that a target marked, below the median of the others: where boxes are whole it is up to
# 0.07, where they cut off a fifth of the object 0.12 to 0.16.
_LESS_OF_TARGET = 0.1
_LEAST_OVERLAP = 0.8  # of each view, from which on silhouettes do not explain a low fitness
_LEAST_FITNESS = 0.75  # eight recorded pairs reach 0.87; with another mask or depth, 0.62
_LEAST_COARSE = 0.6  # of a right body that lacks ellipsoids; one ellipsoid for a box reaches 0.71
_CURE = "check poses, calibration and masks, and do not use the body until then"
# Share of an image beyond which a mask that touches three borders holds background.
_ALL_BORDERS, _WIDE = 4, 0.25
_AROUND = 0.95  # of the pixels at its border: an object that is cut off leaves more of them


def misfit_notes(kind: str, names: Sequence[str], ious: NDArray[np.float64]) -> list[str]:
    """Report which views a body does not fit; empty if it fits all.

    `kind` is used or unused, `names` are the views' names, `ious` (V,) float64 their overlap with
    the body.
    """
    if not len(ious):
        return []
    worst, mean = int(np.argmin(ious)), float(ious.mean())
    notes = []
    if mean < _LEAST_OF_ALL:
        notes.append(
            f"the body does not fit the {kind} views: its silhouettes overlap their masks by "
            f"{mean:.2f} on average (intersection over union), a good body reaches about 0.9; "
            f"{_CURE}"
        )
    limit = _LEAST_OF_ONE
    if len(ious) >= _LEAST_COMPARED:
        limit = max(limit, 1.0 - _TIMES * (1.0 - float(np.median(ious))) - _BESIDE)
    bad = int((ious < limit).sum())
    if bad:
        what = f"view {names[worst]}" if len(ious) == 1 else f"{bad} of {len(ious)} {kind} views"
        notes.append(
            f"the body does not fit {what}: in {names[worst]} its silhouette overlaps the "
            f"mask by {ious[worst]:.2f} (intersection over union); {_CURE}"
        )
    return notes


def target_misfit_note(
    names: Sequence[str], ious: NDArray[np.float64], marked: Collection[str]
) -> str | None:
    """Report a view in which a target marked less, or more, than the body shows there; else None.

    `names` are the views' names, `ious` (V,) float64 their overlap with the body, and `marked` the
    names of those with a target: in the others the object was found by what these show.
    """
    is_marked = np.array([name in marked for name in names], np.bool_)
    if not is_marked.any() or (~is_marked).sum() < _LEAST_COMPARED:
        return None
    worst = int(np.argmin(np.where(is_marked, ious, np.inf)))
    others = float(np.median(ious[~is_marked]))
    if ious[worst] > others - _LESS_OF_TARGET:
        return None
    return (
        f"what the target marks in {names[worst]} is not all that the other views show: the body's "
        f"silhouette overlaps the mask there by {ious[worst]:.2f} (intersection over union), and "
        f"those of the others by {others:.2f}; check that the box, or the mask, holds the whole "
        "object and nothing else"
    )


def depth_misfit_note(ious: NDArray[np.float64], fitness: float, *, is_coarse: bool) -> str | None:
    """Report measured depth that a body does not fit, although it fits all views; else None.

    `ious` (V,) float64 is the overlap of each view with the body, `fitness` that with all input;
    `is_coarse` says that it has as many ellipsoids as were allowed, and may lack some.
    """
    least = _LEAST_COARSE if is_coarse else _LEAST_FITNESS
    if not len(ious) or ious.min() < _LEAST_OVERLAP or fitness >= least:
        return None
    return (
        f"the measured depth contradicts the body: its silhouettes overlap the masks by "
        f"{ious.min():.2f} and more, but with the depth it fits the input by F = {fitness:.2f} "
        "only, where right bodies reach 0.87: the mask holds other things as well, or the depth "
        "is not that of the object; look at the mask and the depth image"
    )


def shape_misfit_note(fitness: float, *, is_cloud: bool, is_coarse: bool) -> str | None:
    """Report a mesh or a cloud that a body does not fit; else None.

    `is_coarse` says that it has as many ellipsoids as were allowed, and may lack some.
    """
    if fitness >= LEAST_IOU:
        return None
    what = "cloud" if is_cloud else "mesh"
    odd = "points that are not of the object, " if is_cloud else "a hollow, "
    more = "It may need more ellipsoids; else the " if is_coarse else "The "
    return (
        f"the body does not fit the {what}: F is {fitness:.2f} only, where good bodies reach "
        f"{GOOD_IOU:g}. {more}{what} may have {odd}thin walls, a floor or several objects: keep "
        "one object alone, and model thin or hollow parts by themselves"
    )


def swapped_note(
    masks: Sequence[NDArray[np.uint8]], views: Sequence[CaptureView] = ()
) -> str | None:
    """Report masks that look inverted, or hold background, if most touch all borders, or three.

    Each is (H, W) uint8. Those that touch three cover a good part of their image, too. `views` are
    those of the masks, if their lenses may distort: an image of them is rectified, and ends within.
    """
    around = _around(masks, views)
    touched = [
        _ALL_BORDERS if is_all else _touched_borders(mask)
        for mask, is_all in zip(masks, around, strict=True)
    ]
    count = sum(borders == _ALL_BORDERS for borders in touched)
    if 2 * count > len(masks):
        return (
            f"{counted(count, 'mask')} of {len(masks)} {'touches' if count == 1 else 'touch'} all "
            "four borders of the image: are black and white swapped? Non-zero pixels are the object"
        )
    wide = [
        float(np.count_nonzero(mask)) / mask.size
        for mask, borders in zip(masks, touched, strict=True)
        if borders >= _ALL_BORDERS - 1
    ]
    count = sum(share > _WIDE for share in wide)
    if 2 * count <= len(masks):
        return None
    return (
        f"{counted(count, 'mask')} of {len(masks)} {'touches' if count == 1 else 'touch'} three "
        f"borders of the image or more, and {'covers' if count == 1 else 'cover'} up to "
        f"{100.0 * max(wide):.0f} % of it: does it hold background? Mark the object alone, and see "
        "that it is wholly in the image"
    )


def are_all_around(masks: Sequence[NDArray[np.uint8]], views: Sequence[CaptureView] = ()) -> bool:
    """Return whether most masks, (H, W) uint8 each, hold the border of their image all around.

    Such masks are inverted, or no masks, as a photograph is none: what they hold ends nowhere.
    `views` are as for `swapped_note`.
    """
    return 2 * sum(_around(masks, views)) > len(masks)


def _around(masks: Sequence[NDArray[np.uint8]], views: Sequence[CaptureView]) -> list[bool]:
    """Return of each mask whether it holds the border of what its lens shows all around."""
    rims: dict[int, NDArray[np.bool_] | None] = {}
    found = []
    for index, mask in enumerate(masks):
        rim = None
        if views:
            ideal = views[index].ideal
            if id(ideal) not in rims:
                rims[id(ideal)] = _rim(ideal.maps())
            rim = rims[id(ideal)]
        if rim is None:
            border = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])
        else:
            border = mask[rim]
        found.append(len(border) > 0 and float(np.mean(border != 0)) > _AROUND)
    return found


def _rim(maps: Undistortion) -> NDArray[np.bool_] | None:
    """Return the pixels of the ideal image at the border of the lens's; None if it is the same."""
    if maps.map_px is None:
        return None
    import cv2

    width, height = maps.lens.size_px
    seen = maps.mask(np.full((height, width), 255, np.uint8))
    inner = cv2.erode(
        seen, np.ones((3, 3), np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=0
    )
    return (seen != 0) & (np.asarray(inner) == 0)


def scale_note(
    body: Body, views: Sequence[View], *, has_sensor: bool = False, is_given: bool = False
) -> str | None:
    """Report an object of a size, or at a distance, that can hardly be in metres.

    `has_sensor` says that a depth camera measured it, which sees a few metres far, and `is_given`
    that the user gave its distance.
    """
    away, size = _away(body, views), 2.0 * float(body.radii.max())
    (nearest, farthest), (least, most) = MODELLED_AWAY_M, MODELLED_SIZE_M
    if has_sensor:
        farthest, most = SENSED_AWAY_M, SENSED_SIZE_M
    if away > farthest or size > most:
        why = "in millimetres, centimetres or inches" if has_sensor else _SMALL_UNITS
    elif away < nearest or size < least:
        why = "too small by 1000, as of metres that are read as millimetres"
    else:
        return None
    if is_given:
        return (
            f"the object is {measured(away)} m away as was given, and so it is up to "
            f"{measured(size)} m large: is that distance right? It is in metres"
        )
    return (
        f"the object is {measured(away)} m away and up to {measured(size)} m large: are poses or "
        f"depths {why}, or the cameras' distance from each other? They are in metres "
        "everywhere; a capture.toml gives the unit of its depth images as depth_scale_m"
    )


def is_off_scale(body: Body, views: Sequence[View], baseline_m: float) -> bool:
    """Return whether an object is nearer or farther away than what cameras on a rig can measure.

    `baseline_m` is how far the cameras of an instant are apart, 0 if that did not measure it.
    """
    away = _away(body, views)
    is_far = away > FAR_M or (away > MODELLED_AWAY_M[1] and baseline_m > _WIDE_M)
    return is_far or away < _NEAREST_M


def _away(body: Body, views: Sequence[View]) -> float:
    ways = [
        exact.norm(np.subtract(body.world_from_object.translation, eye))
        for eye in (view.world_from_camera.translation for view in views)
    ]
    return min(ways, default=1.0)


def center_notes(views: Iterable[CaptureView]) -> list[str]:
    """Report cameras of arrays whose K is probably that of images of another size.

    Those of files are checked with the whole calibration of their capture.
    """
    lenses = dict.fromkeys(view.lens for view in views if view.picture.is_in_memory)
    rules = (principal_point_note, square_note)
    notes = (rule("a camera", lens) for lens in lenses for rule in rules)
    return [note for note in notes if note is not None]


def _touched_borders(mask: NDArray[np.uint8]) -> int:
    return sum(bool(border.any()) for border in (mask[0], mask[-1], mask[:, 0], mask[:, -1]))
