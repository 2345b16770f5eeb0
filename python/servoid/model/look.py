"""Models the object of a capture from whatever masks, targets and depth it has."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from servoid._native import ellipsoid_colors, silhouette_ious
from servoid.capture import Capture, CaptureView, check_measurable, doubt_for_model
from servoid.errors import CameraError, ModelError, TargetError
from servoid.model.contradicting_views import contradicting_views
from servoid.model.depth_agreement import (
    TWO_SURFACES,
    Parted,
    check_depth_agrees,
    parted_by_stereo,
    parted_notes,
    with_twins,
)
from servoid.model.depth_registration import NOT_REGISTERED, misregistered
from servoid.model.fit import Request, divide, fit_views
from servoid.model.marking import Marked, mark
from servoid.model.mask_propagation import propagate_masks
from servoid.model.misfit import (
    ALL_AROUND,
    OFF_SCALE,
    are_all_around,
    center_notes,
    is_off_scale,
    scale_note,
    swapped_note,
    target_misfit_note,
)
from servoid.model.missing_depth import missing_depth
from servoid.model.one_view import fit_one_view
from servoid.model.paper import fit_paper_views
from servoid.model.range_samples import (
    NO_RANGE_SAMPLES,
    RangeSamples,
    depth_of_pair,
    join_range_samples,
    range_samples_of_depth,
    range_samples_of_views,
)
from servoid.model.result import Coverage, ModelResult
from servoid.model.running import Progress, in_parallel, part_of
from servoid.pose import exact
from servoid.segment import HueTarget, Target, hue_window
from servoid.words import were

_ONE_SIDE_DEG = 90.0
_FINDING = 0.3  # share of the time in which the object is found in other views, where it must be
NO_METRES = (
    "lengths are not in metres: the capture's scale is unknown; give the metres of one unit of a "
    "COLMAP model or a transforms.json (--unit, or unit_m in Python), or a scan a length, a board "
    "or a baseline"
)
"""The note on a capture without a scale."""


def fit_capture(
    capture: Capture,
    request: Request | None = None,
    *,
    targets: Sequence[Target] = (),
    observations: slice | None = None,
    views: slice = slice(None),
    distance_m: float | None = None,
) -> ModelResult:
    """Model the object of a capture.

    Masks in the capture, or `targets`, mark the object in some views. Where only one view has a
    mask, or targets mark the object, the masks are propagated to the other views by colours and a
    growing body. Depth images are used where there are any. If all views look from one side, depth
    is measured from stereo pairs.

    `observations` selects instants (default: all; of a recording, the one with the target). `views`
    selects the views to model from; the others validate the body. `distance_m` is the distance of
    the object, which a single image without depth cannot determine.

    Raises:
        DoubtError: a target is ambiguous, and the request does not trust it.
        TargetError: nothing marks the object, or it is not found.
        ModelError: too few views, views that have no common point, or a setting out of range.
        CameraError: also if the images of a stereo pair are exchanged.
        CaptureError: also if depth images contradict a stereo pair.
        CaptureError, ImageError, MaskError: a file cannot be used.

    """
    start = time.perf_counter()
    request = request or Request()
    request.settings()  # refused before any file is read
    wrong = _contradiction(capture, request)
    marked = mark(capture, targets, observations, trusted=request.trust_targets)
    notes = list(marked.notes)
    doubts = list(marked.doubts)
    if request.trust_calibration:  # otherwise these were among what was compared
        doubts += center_notes([*marked.views, *marked.others])
    if not capture.metric:
        notes.append(NO_METRES)
    known = list(marked.views)
    # Those of targets were compared with depth images when the object was found.
    parted: list[Parted] = []
    if not marked.from_targets and not request.trust_targets:
        parted = parted_notes(known)
    off = misregistered(known)
    doubts.extend([] if off is None else [off.words])
    samples = join_range_samples(range_samples_of_views(known))
    if len(samples):
        check_depth_agrees(with_twins(known, [*known, *marked.others]))
    elif _from_one_side([*known, *marked.others]):
        samples, found = _measured(marked, notes)
        if not request.trust_targets:
            parted = found
    doubts.extend(one.words for one in parted)
    alone = len(known) + len(marked.others) == 1 and not len(samples)
    if alone or distance_m is not None:
        alone_of = _one_instant(capture, known[0]) if observations is None else ""
        why = missing_depth(capture, known[0]) if distance_m is None else None
        said = [*([] if why is None else [why]), *capture.notes]
        distance_m = _distance(distance_m, alone, said, alone_of)
        result = fit_one_view(known[0], distance_m, request)
        scale = scale_note(result.body, result.native_used, is_given=True)
        noted = _noted(result, targets, notes, [wrong, *doubts, scale], is_metric=capture.metric)
        is_all_around = _are_given_all_around(marked, result)
        return replace(noted, wrong_by=ALL_AROUND if is_all_around else None)
    if marked.others and (len(known) < 2 or marked.from_targets):
        finding = replace(request, progress=part_of(request.progress, 0.0, _FINDING))
        known = _with_spread(marked, samples, finding, notes)
        request = replace(request, progress=part_of(request.progress, _FINDING, 1.0))
    used, unused = divide(known, views)
    if len(used) == 1 and not len(samples):
        raise ModelError(
            f"{used[0].name} is the only view that was chosen to model from: one image cannot "
            "distinguish a small near object from a large far one; choose more views, or use this "
            "one alone and give the distance of the object: "
            f"--observations {used[0].index}:{used[0].index + 1} --distance 0.6"
        )
    try:
        result = fit_views(
            used, unused, samples, request, everywhere=capture.all_views(), start=start
        )
    except ModelError as error:
        # Why there is only one view to model from is noted.
        if len(used) > 1:
            raise
        raise ModelError("; ".join([str(error), *doubts, *notes])) from error
    place = result.body, result.native_used
    has_sensor = any(view.has_depth for view in known)
    baseline_m = 0.0 if has_sensor else _baseline_m(marked)
    scale = scale_note(*place, has_sensor=has_sensor) if capture.metric else None
    reasons = {
        ALL_AROUND: _are_given_all_around(marked, result),
        NOT_REGISTERED: off is not None and off.is_sure,
        TWO_SURFACES: 2 * sum(one.is_sure for one in parted) > len(marked.views),
        OFF_SCALE: capture.metric and len(samples) > 0 and is_off_scale(*place, baseline_m),
    }
    wrong_by = next((reason for reason, holds in reasons.items() if holds), None)
    is_checked = marked.from_targets and not request.trust_targets
    misfit = _target_misfit(marked, result) if is_checked else None
    noted = _noted(
        result, targets, notes, [wrong, *doubts, misfit, scale], is_metric=capture.metric
    )
    return replace(noted, wrong_by=wrong_by)


def _target_misfit(marked: Marked, result: ModelResult) -> str | None:
    views = (*result.used_views, *result.unused_views)
    ious = np.concatenate([result.iou_used, result.iou_unused])
    return target_misfit_note([v.name for v in views], ious, {v.name for v in marked.views})


def _contradiction(capture: Capture, request: Request) -> str | None:
    """Return what images have against their calibration and their poses, None if nothing.

    It is sought before the views are read, because both together would not fit into memory.
    """
    return None if request.trust_calibration else doubt_for_model(capture)


def _are_given_all_around(marked: Marked, result: ModelResult) -> bool:
    """Return whether most masks that were given hold the border of their image all around."""
    names = {view.name for view in marked.views}
    used = zip(result.used_views, result.native_used, strict=True)
    given = [(view, native.mask) for view, native in used if view.name in names]
    return are_all_around([mask for _, mask in given], [view for view, _ in given])


def _noted(
    result: ModelResult,
    targets: Sequence[Target],
    notes: Sequence[str],
    doubts: Sequence[str | None],
    *,
    is_metric: bool,
) -> ModelResult:
    """Return the result with notes and doubts that were known before it."""
    named = tuple(map(str, targets))
    noted = replace(result, targets=named, notes=(*notes, *result.notes), is_metric=is_metric)
    return noted.doubted(doubts)


def mark_everywhere(
    capture: Capture,
    request: Request | None = None,
    *,
    targets: Sequence[Target] = (),
    observations: slice | None = None,
) -> list[CaptureView]:
    """Make masks for all views in which the object can be found, from those that have some.

    Raises:
        As for `fit_capture`; views in which the object is not found are omitted.

    """
    request = request or Request()
    marked = mark(capture, targets, observations, trusted=request.trust_targets)
    return find_everywhere(marked, request)


def find_everywhere(marked: Marked, request: Request) -> list[CaptureView]:
    """Return the marked views, and the others with the masks in which the object is found."""
    if not marked.others:
        return list(marked.views)
    samples = join_range_samples(range_samples_of_views(marked.views))
    if not len(samples):
        samples, _ = _measured(marked, [])
    try:
        return _with_spread(marked, samples, request, [])
    except (ModelError, TargetError):
        return list(marked.views)


def fit_capture_by_paper(
    capture: Capture,
    request: Request | None = None,
    *,
    targets: Sequence[Target] = (),
    observations: slice | None = None,
    views: slice = slice(None),
) -> ModelResult:
    """Model the object of a capture by the paper's own method: hue, points and a plain GA.

    The hue window is that of a `HueTarget`; without one, it is found in the first marked view.

    Raises:
        As for `fit_capture`.

    """
    start = time.perf_counter()
    request = request or Request()
    settings = request.paper_settings()  # refused before any file is read
    wrong = _contradiction(capture, request)
    marked = mark(capture, targets, observations, trusted=request.trust_targets)
    hues = [target for target in targets if isinstance(target, HueTarget)]
    first = marked.views[0]
    window = (
        (hues[0].low_deg, hues[0].high_deg) if hues else hue_window(first.image(), first.mask())
    )
    chosen, _ = divide([*marked.views, *marked.others], views)
    images = in_parallel(CaptureView.image, chosen)
    steps = fit_paper_views(
        images,
        [view.camera for view in chosen],
        [view.world_from_camera for view in chosen],
        window,
        settings=settings,
        progress=request.progress,
    )
    used = [view for view in chosen if view.has_mask]
    natives = in_parallel(CaptureView.view, used)
    body = steps[-1].body
    result = ModelResult(
        body=body,
        colors=ellipsoid_colors(body, natives, in_parallel(CaptureView.image, used)),
        steps=tuple(steps),
        settings=settings,
        method="paper",
        used_views=tuple(used),
        iou_used=silhouette_ious(body, natives),
        native_used=tuple(natives),
        coverage=Coverage.of(body, natives, NO_RANGE_SAMPLES),
        notes=(f"hue window {window[0]:.0f} to {window[1]:.0f} degrees",),
        seconds=time.perf_counter() - start,
    )
    scale = scale_note(body, natives) if capture.metric else None
    swapped = swapped_note([view.mask for view in natives], used)
    notes = [*marked.notes, *(() if capture.metric else (NO_METRES,))]
    contradiction = contradicting_views(used)
    apart = contradiction and contradiction.words
    centers = center_notes(used) if request.trust_calibration else []
    doubts = [wrong, *marked.doubts, *centers, swapped, apart, scale]
    return _noted(result, targets, notes, doubts, is_metric=capture.metric)


def _one_instant(capture: Capture, view: CaptureView) -> str:
    """Say why only one view of a recording was used; empty if all of a capture are."""
    if not capture.is_recording or len(capture) < 2:
        return ""
    return (
        " The capture is a recording (it has a rate, rate_hz), in which the object may move: only "
        f"{view.name} was used, one of {len(capture)} instants. If the object was at rest, use all "
        f"of them with --observations 0:{len(capture)}, or remove rate_hz from capture.toml. "
        "Otherwise,"
    )


def _distance(
    distance_m: float | None, alone: bool, notes: Sequence[str], why_alone: str = ""
) -> float:
    """Return the distance if it is needed and given; what is noted of depth may say why it is."""
    if distance_m is None:
        of_depth = "".join(f"; {note}" for note in notes if "depth" in note)
        raise ModelError(
            "modelling needs at least two views from different places, but 1 was "
            f"{'used.' if why_alone else 'given:'}{why_alone} a single image does not determine "
            "how far the object is; give its distance in metres, such as --distance 0.6 "
            f"(distance_m=0.6 in Python){of_depth}"
        )
    if not alone:
        raise ModelError(
            "a distance applies to a single image without depth only; here several images or a "
            "depth image determine it; leave the distance out"
        )
    return distance_m


def _baseline_m(marked: Marked) -> float:
    """Return how far two views of one instant are apart, by which depth is measured."""
    pairs = with_twins(marked.views, [*marked.views, *marked.others])
    eyes = ((one.world_from_camera, other.world_from_camera) for one, other in pairs)
    apart = (np.subtract(one.translation, other.translation) for one, other in eyes)
    return max((exact.norm(way) for way in apart), default=0.0)


def _from_one_side(views: Sequence[CaptureView]) -> bool:
    """Return whether all cameras look in about the same direction."""
    axes = np.array([view.world_from_camera.matrix()[:3, 2] for view in views])
    return bool(exact.product(axes, axes.T).min() > exact.cos(np.radians(_ONE_SIDE_DEG)))


def _measured(marked: Marked, notes: list[str]) -> tuple[RangeSamples, list[Parted]]:
    """Measure the depth in each marked view that has another view of the same instant.

    Return it with reports of masks that cover two surfaces.
    """
    parts: list[RangeSamples] = []
    parted: list[Parted] = []
    for view, twin in with_twins(marked.views, [*marked.views, *marked.others]):
        check_measurable(view, twin)
        try:
            depth = depth_of_pair(view, twin)
            note = parted_by_stereo(view, twin, depth)
        except (CameraError, TargetError) as error:
            notes.append(f"no depth from {view.name} and {twin.name}: {error}")
            continue
        place = view.camera, view.world_from_camera
        parts.append(range_samples_of_depth(depth, view.mask(), *place))
        parted.extend([] if note is None else [note])
    return join_range_samples(parts), parted


def _with_spread(
    marked: Marked, samples: RangeSamples, request: Request, notes: list[str]
) -> list[CaptureView]:
    """Propagate masks to the other views, and list all views in their order."""
    report = request.progress

    def show(share: float) -> None:
        if report is not None:
            report(Progress(0, 0.0, share, "finding the object in the other views"))

    try:
        found = propagate_masks(
            marked.views,
            marked.others,
            samples,
            seed=request.seed,
            threads=request.threads,
            progress=show,
        )
    except (ModelError, TargetError) as error:
        if not len(samples):
            raise
        # One view with depth is enough.
        notes.append(f"only views with a mask were used: {error}")
        found = []
    missed = len(marked.others) - len(found)
    if missed and found:
        notes.append(
            f"{missed} of {len(marked.others)} views without a mask {were(missed)} left out: "
            "the object was not found there"
        )
    by_name = {view.name: view for view in (*marked.views, *found)}
    order = sorted((*marked.views, *marked.others), key=lambda view: (view.camera_name, view.index))
    return [by_name[view.name] for view in order if view.name in by_name]
