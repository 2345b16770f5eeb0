"""Models a body from views: load, fit, colour, judge."""

import os
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from servoid._native import (
    Body,
    Given,
    ModelSettings,
    View,
    ellipsoid_colors,
    fit_body,
    silhouette_ious,
)
from servoid.errors import ModelError
from servoid.model.result import ModelResult
from servoid.model.running import Progress, run_core
from servoid.observe import CaptureView

LoadedT = TypeVar("LoadedT")


def fit(
    capture_views: Sequence[CaptureView],
    /,
    *,
    max_ellipsoids: int | None = None,
    delta: float | None = None,
    views: slice = slice(None),
    seed: int | None = None,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> ModelResult:
    """Model a body from the views that the slice `views` selects; the rest only judge it.

    Settings that are None take the core's defaults. With `delta` 0 the count goes up to
    `max_ellipsoids`; otherwise it stops where one more raises the fitness by less than `delta`.
    `progress` is called on the caller's thread after each ellipsoid; an exception that it raises
    ends the modelling and comes out here, and so does Ctrl-C.

    Raises:
        ModelError: no view is selected, the views see no common point, or a setting is out of
            range.
        ImageError, MaskError: a file of a view cannot be used.

    """
    start = time.perf_counter()
    settings = ModelSettings(max_ellipsoids=max_ellipsoids, delta=delta, seed=seed, threads=threads)
    used, unused = _divide(capture_views, views)
    # Files are read first, so that a damaged one is found before the long work.
    native_used, native_unused = _load(used, CaptureView.view), _load(unused, CaptureView.view)
    images = _load(used, CaptureView.image)
    given = Given(views=native_used)
    steps = run_core(lambda report: fit_body(given, settings, report), progress)
    body = steps[-1].body
    return ModelResult(
        body=body,
        colors=ellipsoid_colors(body, native_used, images),
        steps=tuple(steps),
        settings=settings,
        used_views=tuple(used),
        unused_views=tuple(unused),
        iou_used=_judge(body, native_used),
        iou_unused=_judge(body, native_unused),
        seconds=time.perf_counter() - start,
        native_used=tuple(native_used),
        native_unused=tuple(native_unused),
    )


def _divide(
    capture_views: Sequence[CaptureView], chosen: slice
) -> tuple[list[CaptureView], list[CaptureView]]:
    used = set(range(len(capture_views))[chosen])
    if not used:
        have = len(capture_views)
        raise ModelError(
            "no usable view: the capture has no mask; give at least one image a mask"
            if have == 0
            else f"no usable view: views {_write_slice(chosen)} selects none of the {have} views; "
            f"choose among 0 to {have - 1}"
        )
    return (
        [view for index, view in enumerate(capture_views) if index in used],
        [view for index, view in enumerate(capture_views) if index not in used],
    )


def _write_slice(chosen: slice) -> str:
    """Write a slice as people type it: `0:16:2`."""
    return ":".join(
        "" if part is None else str(part) for part in (chosen.start, chosen.stop, chosen.step)
    )


def _load(views: Iterable[CaptureView], read: Callable[[CaptureView], LoadedT]) -> list[LoadedT]:
    # Decoding lets go of Python's lock: two threads halve the time on two cores.
    with ThreadPoolExecutor(max_workers=min(8, os.cpu_count() or 1)) as pool:
        return list(pool.map(read, views))


def _judge(body: Body, views: Sequence[View]) -> NDArray[np.float64]:
    return silhouette_ious(body, views) if views else np.empty(0)
