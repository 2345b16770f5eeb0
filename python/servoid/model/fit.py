"""Models a body from views, from a capture with targets, from a mesh or from a point cloud."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from servoid._native import (
    Body,
    Mesh,
    ModelInput,
    ModelSettings,
    PaperSettings,
    View,
    ellipsoid_colors,
    fit_body,
    silhouette_ious,
)
from servoid.brief import brief
from servoid.capture import CaptureView, shrunk, views_of
from servoid.errors import MaskError, MeshError, ModelError
from servoid.model.border_agreement import border_notes
from servoid.model.contradicting_views import contradicting_views
from servoid.model.misfit import center_notes, scale_note, swapped_note
from servoid.model.misplaced import Fitted, convention_note, misplaced_notes
from servoid.model.neighbours import stray_note
from servoid.model.range_samples import NO_RANGE_SAMPLES, RangeSamples
from servoid.model.result import Coverage, ModelResult
from servoid.model.running import Progress, ProgressCallback, in_parallel, run_core
from servoid.pose import exact
from servoid.shape import body_size_note
from servoid.words import digits

PLAIN_COLOR = (150, 150, 150)
_MOST_CHOSEN = 12


@dataclass(frozen=True, kw_only=True)
class Request:
    """How to model a body; None takes the core's default.

    With neither `max_ellipsoids` nor `delta`, held-out evidence selects the count of ellipsoids.
    The weights scale each kind of evidence. With `trust_targets`, an ambiguous target is used
    anyway, and a note of the result reports it. With `trust_calibration`, the images of a capture
    are not compared with its calibration and its poses.
    """

    max_ellipsoids: int | None = None
    delta: float | None = None
    seed: int | None = None
    threads: int | None = None
    silhouette_weight: float | None = None
    volume_weight: float | None = None
    depth_weight: float | None = None
    trust_targets: bool = False
    trust_calibration: bool = False
    progress: ProgressCallback | None = None

    __repr__ = brief

    def settings(self) -> ModelSettings:
        """Return the settings in the core's form."""
        free = self.max_ellipsoids is None and self.delta is None
        return ModelSettings(
            max_ellipsoids=_MOST_CHOSEN if free else self.max_ellipsoids,
            delta=self.delta,
            held_out=free,
            seed=self.seed,
            threads=self.threads,
        )

    def paper_settings(self) -> PaperSettings:
        """Return the settings of the paper's own method in the core's form."""
        return PaperSettings(
            max_ellipsoids=self.max_ellipsoids,
            delta=self.delta,
            seed=self.seed,
            threads=self.threads,
        )

    def given(
        self,
        *,
        views: Sequence[View] = (),
        mesh: Mesh | None = None,
        range_samples: RangeSamples = NO_RANGE_SAMPLES,
    ) -> ModelInput:
        """Combine the evidence with the weight of each kind."""
        return ModelInput(
            views=views,
            mesh=mesh,
            points=range_samples.points,
            directions=range_samples.directions,
            silhouette_weight=self.silhouette_weight,
            volume_weight=self.volume_weight,
            depth_weight=self.depth_weight,
        )


def fit(
    capture_views: Sequence[CaptureView] | Sequence[View],
    /,
    *,
    images: Sequence[NDArray[np.uint8]] | None = None,
    max_ellipsoids: int | None = None,
    delta: float | None = None,
    views: slice = slice(None),
    seed: int | None = None,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> ModelResult:
    """Model a body from the views that the slice `views` selects; the rest only validate it.

    All views have masks. They are views of a capture, or each is a `View` made of arrays. For
    these, `images`, (H, W, 3) uint8 RGB, one per view, give the ellipsoids their colours; without
    images, all ellipsoids are grey.

    With `delta` 0, the count of ellipsoids grows to `max_ellipsoids`. With another `delta`, it
    stops where one more ellipsoid raises the fitness by less. With neither, held-out views select
    it.

    `progress` is called on the caller's thread after each ellipsoid. An exception that it raises,
    or Ctrl-C, stops the modelling and propagates to the caller.

    Raises:
        ModelError: no view is selected, the views have no common point, or a setting is out of
            range.
        ImageError, MaskError: a file of a view cannot be used, or images do not fit the views.

    """
    if not isinstance(views, slice):
        raise ModelError(f"views must be a slice, such as slice(0, None, 2), but is {views!r:.60}")
    request = Request(
        max_ellipsoids=max_ellipsoids, delta=delta, seed=seed, threads=threads, progress=progress
    )
    request.settings()  # refused before any file is read
    small, note = shrunk(_of_capture(capture_views, images))
    used, unused = divide(small, views)
    result = fit_views(used, unused, NO_RANGE_SAMPLES, request)
    are_arrays = not any(isinstance(one, CaptureView) for one in capture_views)
    scale = scale_note(result.body, result.native_used) if are_arrays else None
    borders = border_notes([*used, *unused])
    result = result.doubted([*center_notes([*used, *unused]), scale, *borders])
    result = replace(result, is_metric=all(view.is_metric for view in used))
    return result if note is None else replace(result, notes=(*result.notes, note))


def fit_views(
    used: Sequence[CaptureView],
    unused: Sequence[CaptureView],
    samples: RangeSamples,
    request: Request,
    *,
    everywhere: Sequence[CaptureView] = (),
    start: float | None = None,
) -> ModelResult:
    """Model a body from used views and range samples; the unused views validate it.

    `everywhere` are further views whose pose is known; `start` is the time when the work began,
    from `time.perf_counter`.

    Raises:
        ModelError, ImageError, MaskError: as for `fit`.

    """
    start = time.perf_counter() if start is None else start
    settings = request.settings()
    if request.progress is not None:
        request.progress(Progress(0, 0.0, 0.0, stage="reading images"))
    # Read files first, so that a damaged one is reported before the long computation.
    native = in_parallel(CaptureView.view, [*used, *unused])
    native_used, native_unused = native[: len(used)], native[len(used) :]
    swapped = swapped_note([view.mask for view in native], [*used, *unused])
    seen = all(view.has_image for view in used)
    images = in_parallel(CaptureView.image, used) if seen else []
    given = request.given(views=native_used, range_samples=samples)
    try:
        steps = run_core(lambda report: fit_body(given, settings, report), request.progress)
    except ModelError as error:
        convention = convention_note(used, native_used, settings)
        if convention is None:
            raise
        raise ModelError(f"{error}; {convention}") from error
    body = steps[-1].body
    iou_used = _judge(body, native_used)
    fitted = Fitted(
        body,
        steps[-1].fitness,
        settings,
        used,
        native_used,
        iou_used,
        is_checked=bool(unused or len(samples)),
    )
    misplaced = _misplaced(fitted, unused, everywhere, request.progress)
    doubts = (*(() if swapped is None else (swapped,)), *misplaced)
    return ModelResult(
        body=body,
        colors=ellipsoid_colors(body, native_used, images) if seen else _plain(body),
        steps=tuple(steps),
        settings=settings,
        used_views=tuple(used),
        unused_views=tuple(unused),
        iou_used=iou_used,
        iou_unused=_judge(body, native_unused),
        seconds=time.perf_counter() - start,
        native_used=tuple(native_used),
        native_unused=tuple(native_unused),
        range_samples=samples,
        coverage=Coverage.of(body, native_used, samples),
        notes=doubts,
        doubts=doubts,
    )


def _misplaced(
    fitted: Fitted,
    unused: Sequence[CaptureView],
    everywhere: Sequence[CaptureView],
    progress: ProgressCallback | None,
) -> list[str]:
    """Report poses that images or masks contradict."""
    seen = [*fitted.views, *unused]
    contradiction = contradicting_views(seen)
    if contradiction is not None and contradiction.is_apart:
        return [contradiction.words]
    notes = misplaced_notes(fitted, [*seen, *everywhere], progress)
    return notes if notes or contradiction is None else [contradiction.words]


def fit_mesh(
    vertices: ArrayLike,
    faces: ArrayLike,
    request: Request | None = None,
    *,
    notes: Sequence[str] = (),
) -> ModelResult:
    """Model a body from a closed mesh: from its volume and its silhouettes together.

    `vertices` is (V, 3), in metres; `faces` is (F, 3) integers, counter-clockwise from outside.

    Raises:
        BodyError: the mesh is not closed, or its volume is zero.
        MeshError: the mesh is so thin that no silhouette shows it.
        ModelError: a setting is out of range.

    """
    request = request or Request()
    given = request.given(mesh=Mesh(vertices=vertices, faces=faces))
    try:
        return fit_shape(given, NO_RANGE_SAMPLES, request, notes)
    except MaskError as error:  # no silhouette from any side shows it
        corners = np.asarray(vertices, np.float64)
        sides = " x ".join(map(digits, np.sort(_sides(corners))[::-1]))
        stray = stray_note(corners, "vertex", "vertices")
        raise MeshError(
            f"the mesh is too thin to be modelled: it is {sides} m large; "
            "ellipsoids need a solid: give it thickness, or model its parts separately"
            if stray is None
            else f"the mesh cannot be modelled: it is {sides} m large, but {stray}; remove what is "
            "apart in a mesh editor"
        ) from error


def _sides(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lengths of a mesh along its principal axes, (3,) float64 in metres."""
    offsets = vertices - vertices.mean(axis=0)
    _, axes = exact.eigh(exact.product(offsets.T, offsets))
    return np.ptp(exact.product(offsets, axes), axis=0)


def fit_shape(
    given: ModelInput, samples: RangeSamples, request: Request, notes: Sequence[str]
) -> ModelResult:
    """Model a body from a mesh or a cloud alone, without the views of a capture.

    Raises:
        MaskError: no silhouette of the mesh covers a pixel.
        ModelError: as for `fit`.

    """
    start = time.perf_counter()
    settings = request.settings()
    steps = run_core(lambda report: fit_body(given, settings, report), request.progress)
    body = steps[-1].body
    result = ModelResult(
        body=body,
        colors=_plain(body),
        steps=tuple(steps),
        settings=settings,
        seconds=time.perf_counter() - start,
        range_samples=samples,
        coverage=Coverage.of(body, [], samples) if len(samples) else None,
        notes=tuple(notes),
    )
    return result.doubted([body_size_note(body)])


def _plain(body: Body) -> NDArray[np.uint8]:
    return np.tile(np.array(PLAIN_COLOR, dtype=np.uint8), (len(body), 1))


def _of_capture(
    views: Sequence[CaptureView] | Sequence[View], images: Sequence[NDArray[np.uint8]] | None
) -> Sequence[CaptureView]:
    """Return views of a capture; convert views of arrays, with their images."""
    if not isinstance(views, Sequence):
        raise ModelError(
            f"views must be a list of views, but are of type {type(views).__name__}; a capture is "
            "modelled by servoid.model.fit_capture(capture), or by the list capture.views()"
        )
    of_files = [view for view in views if isinstance(view, CaptureView)]
    of_arrays = [view for view in views if isinstance(view, View)]
    if of_arrays and len(of_arrays) == len(views):
        return views_of(of_arrays, images)
    if len(of_files) == len(views) and images is None:
        return of_files
    if len(of_files) == len(views):
        raise ModelError("views of a capture have their own images; leave images out")
    other = next((one for one in views if not isinstance(one, CaptureView | View)), views[0])
    raise ModelError(
        f"views must all be of a capture, or all be made of arrays, as View(camera=, "
        f"world_from_camera=, mask=), but one is of type {type(other).__name__}"
    )


def divide(
    capture_views: Sequence[CaptureView], chosen: slice
) -> tuple[list[CaptureView], list[CaptureView]]:
    """Split views into those that a slice selects and the rest.

    Raises:
        ModelError: the slice selects none.

    """
    used = set(range(len(capture_views))[chosen])
    if not used:
        have = len(capture_views)
        raise ModelError(
            "no usable view: none was given, or none has a mask; give at least one image a mask"
            if have == 0
            else f"no usable view: views {_write_slice(chosen)} selects none of the {have} views; "
            f"choose among 0 to {have - 1}"
        )
    return (
        [view for index, view in enumerate(capture_views) if index in used],
        [view for index, view in enumerate(capture_views) if index not in used],
    )


def _write_slice(chosen: slice) -> str:
    """Format a slice as it is typed: `0:16:2`, or `100:`."""
    parts = [chosen.start, chosen.stop] + ([] if chosen.step is None else [chosen.step])
    return ":".join("" if part is None else str(part) for part in parts)


def _judge(body: Body, views: Sequence[View]) -> NDArray[np.float64]:
    return silhouette_ious(body, views) if views else np.empty(0)
