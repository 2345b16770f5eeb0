"""Finds the object in views without masks, alternating between colours and a growing body."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, ModelInput, ModelSettings, View, fit_body, initial_body
from servoid.capture import CaptureView
from servoid.errors import ModelError, TargetError
from servoid.model.depth_gating import gate_by_depth
from servoid.model.range_samples import RangeSamples
from servoid.model.running import in_parallel
from servoid.segment import grow_mask

_ROUGH_ELLIPSOIDS = 4
# For each round, as shares of the silhouette's size: the depth inside it at which the object is
# certain, and the distance to which the object may extend beyond it.
_INSIDE = (0.25, 0.10)
_BEYOND = (0.30, 0.15)
_ELLIPSOIDS = 6  # of the bodies between the rounds
_POINT_PX = 5  # range samples nearer to each other than this leave no gap
_LOOKED_AT = 3  # one pixel of so many, in a row and in a column, tells whether there are colours
_LEAST_OVERLAP = 0.5  # of a mask with the body from which it was grown

Mask = NDArray[np.uint8]


def propagate_masks(
    marked: Sequence[CaptureView],
    others: Sequence[CaptureView],
    samples: RangeSamples,
    *,
    seed: int | None = None,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[CaptureView]:
    """Make masks for views without one, from views that have masks.

    The colours of object and background are learned in the marked views. A rough body that agrees
    with them in all views predicts the silhouette in each; where some cameras see no colours, grey
    levels are compared instead. GrabCut finds a mask near it, excluding pixels at another depth
    where the depth is known. A better body is fitted to all masks, and the steps are repeated.
    Views in which mask and body disagree are omitted. `progress` is called with the share done.

    Raises:
        ModelError: the object's position is undetermined: too few views, or all in one line.
        TargetError: the object is found in none of the other views.
        CaptureError, ImageError: an image or a depth image cannot be used.

    """
    report = progress or (lambda _: None)
    images = in_parallel(CaptureView.image, others)
    report(0.1)
    natives = [view.view() for view in marked]
    compared = _in_one_kind([*(view.image() for view in marked), *images])
    try:
        body = initial_body(
            natives,
            compared[: len(marked)],
            [
                (view.camera, view.world_from_camera, image)
                for view, image in zip(others, compared[len(marked) :], strict=True)
            ],
            ModelSettings(max_ellipsoids=_ROUGH_ELLIPSOIDS, delta=0.0, seed=seed, threads=threads),
            points=samples.points,
            directions=samples.directions,
        )
    except ModelError as error:
        if len(marked) > 1 or len(samples):
            raise
        raise ModelError(_not_seen(marked[0], others, str(error))) from error
    pictures = _pictures(body, marked, others, images, samples)
    found: list[CaptureView] = []
    rounds = len(_INSIDE)
    for turn in range(rounds):
        report((turn + 1) / (rounds + 1))
        found = _masked(body, pictures, samples, turn)
        if not found:
            raise TargetError(
                "the object was found in none of the views without a mask: its colours there are "
                "those of the background, or the poses are wrong; mark it in more views"
            )
        if turn + 1 < rounds:
            views = [*natives, *(view.view() for view in found)]
            body = _body(views, samples, _ELLIPSOIDS, seed, threads)
    return found


def _not_seen(marked: CaptureView, others: Sequence[CaptureView], error: str) -> str:
    where = others[0].name if len(others) == 1 else f"the {len(others)} other views"
    return (
        f"the object that is marked in {marked.name} was not found in {where}, and may be outside "
        "of the image there: mark an object that several cameras see, or mark it in another view "
        f"as well; or else, {error}"
    )


def _in_one_kind(images: Sequence[NDArray[np.uint8]]) -> list[NDArray[np.uint8]]:
    """Return images (H, W, 3), in grey levels if some, but not all, show no colours."""
    import cv2

    some = (image[::_LOOKED_AT, ::_LOOKED_AT] for image in images)
    are_grey = [bool((pixels == pixels[..., :1]).all()) for pixels in some]
    if all(are_grey) or not any(are_grey):
        return list(images)
    levels = (cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in images)
    return [np.asarray(cv2.cvtColor(one, cv2.COLOR_GRAY2RGB), np.uint8) for one in levels]


@dataclass(frozen=True)
class _Picture:
    """A view without a mask, its image, and (H, W) bool where the depth is not the object's."""

    view: CaptureView
    image: NDArray[np.uint8]
    away: NDArray[np.bool_]


def _pictures(
    body: Body,
    marked: Sequence[CaptureView],
    others: Sequence[CaptureView],
    images: Sequence[NDArray[np.uint8]],
    samples: RangeSamples,
) -> list[_Picture]:
    """Gate by depth once, in a region around the first body that later bodies do not leave."""
    twins = {view.index: view for view in marked}

    def picture(pair: tuple[CaptureView, NDArray[np.uint8]]) -> _Picture:
        view, image = pair
        region = _around(body.silhouette(view.camera, view.world_from_camera), sum(_BEYOND))
        twin = twins.get(view.index)
        return _Picture(view, image, gate_by_depth(view, image, twin, samples, region))

    return in_parallel(picture, zip(others, images, strict=True))


def _around(silhouette: Mask, share: float) -> Mask:
    """Dilate a silhouette by a share of its size."""
    import cv2

    if not silhouette.any():
        return silhouette
    beyond = cv2.distanceTransform(255 - silhouette, cv2.DIST_L2, 3)
    near = np.asarray(beyond) <= share * _size_px(silhouette)
    return np.where(near, 255, 0).astype(np.uint8)


def _size_px(silhouette: Mask) -> float:
    return float(np.sqrt(np.count_nonzero(silhouette)))


def _masked(
    body: Body, pictures: Sequence[_Picture], samples: RangeSamples, turn: int
) -> list[CaptureView]:
    def grow(picture: _Picture) -> CaptureView | None:
        mask = _grown(picture, body, samples, turn)
        return None if mask is None else picture.view.with_mask(mask)

    grown = in_parallel(grow, pictures)
    return [view for view in grown if view is not None]


def _seen(samples: RangeSamples, view: CaptureView) -> Mask:
    """Draw the pixels in which a view sees the range samples."""
    import cv2

    width, height = view.camera.size_px
    drawn = np.zeros((height, width), dtype=np.uint8)
    points = view.world_from_camera.inverse().transform(samples.points)
    pixels = np.rint(view.camera.project(points)) if len(points) else np.empty((0, 2))
    inside = ((pixels >= 0) & (pixels < (width, height))).all(axis=1)
    columns, rows = pixels[inside].astype(np.int64).T
    drawn[rows, columns] = 255
    kernel = np.ones((_POINT_PX, _POINT_PX), dtype=np.uint8)
    return np.asarray(cv2.morphologyEx(drawn, cv2.MORPH_CLOSE, kernel), dtype=np.uint8)


def _grown(picture: _Picture, body: Body, samples: RangeSamples, turn: int) -> Mask | None:
    """Grow a mask from a body's silhouette; None where image and silhouette disagree."""
    import cv2

    view = picture.view
    silhouette = body.silhouette(view.camera, view.world_from_camera)
    if not silhouette.any() or silhouette.all():
        return None
    depth = cv2.distanceTransform(silhouette, cv2.DIST_L2, 3)
    certain = np.where(depth > _INSIDE[turn] * _size_px(silhouette), 255, 0).astype(np.uint8)
    possible = _around(silhouette, _BEYOND[turn])
    if possible.all():
        return None
    certain, possible, likely = (
        np.where(picture.away, 0, mask).astype(np.uint8) for mask in (certain, possible, silhouette)
    )
    certain |= _seen(samples, view)
    if not (certain | possible).any():
        return None
    mask = grow_mask(picture.image, certain, possible, likely=likely)
    both = np.count_nonzero((mask != 0) & (silhouette != 0))
    either = np.count_nonzero((mask != 0) | (silhouette != 0))
    return mask if both >= _LEAST_OVERLAP * either and not mask.all() else None


def _body(
    views: Sequence[View], samples: RangeSamples, count: int, seed: int | None, threads: int | None
) -> Body:
    given = ModelInput(views=views, points=samples.points, directions=samples.directions)
    settings = ModelSettings(max_ellipsoids=count, seed=seed, threads=threads, quick=True)
    return fit_body(given, settings)[-1].body
