"""The result of modelling."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid._native import (
    Body,
    ModelSettings,
    PaperSettings,
    Step,
    View,
    __version__,
    silhouette_ious,
    surface_coverage,
)
from servoid.brief import brief, said
from servoid.capture import CaptureView
from servoid.model.misfit import depth_misfit_note, misfit_notes, shape_misfit_note
from servoid.model.range_samples import NO_RANGE_SAMPLES, RangeSamples
from servoid.model.verdict import ModelVerdict, rate_body
from servoid.shape import MadeBy, SeenEntry, save_body
from servoid.words import are, counted, hundredths

_NOTEWORTHY = 0.8  # below this share a note reports the unseen surface
_HIDDEN = 0.5  # below this share an ellipsoid counts as a guess


@dataclass(frozen=True, eq=False)
class IouByCount:
    """How well the best body of each count of ellipsoids fits the silhouettes.

    `counts` is (S,) int64. `used` and `unused` are (S,) float64, the mean IoU over the views, NaN
    where there is no view.
    """

    counts: NDArray[np.int64]
    used: NDArray[np.float64]
    unused: NDArray[np.float64]

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class Coverage:
    """The share of a body's surface that was seen, 0 to 1.

    `by_ellipsoid` is (K,) float64. `unseen_toward` is a unit vector in the object's frame towards
    the unseen side; None if all was seen or the unseen parts are on all sides.
    """

    by_ellipsoid: NDArray[np.float64]
    share: float
    unseen_toward: tuple[float, float, float] | None

    __repr__ = brief

    @classmethod
    def of(cls, body: Body, views: Sequence[View], samples: RangeSamples) -> "Coverage":
        """Compute what views and range samples show of a body."""
        shares, share, toward = surface_coverage(
            body, views, points=samples.points, directions=samples.directions
        )
        return cls(shares, share, None if toward is None else (toward[0], toward[1], toward[2]))

    def note(self) -> str | None:
        """Report in a sentence what was not seen; None if it is little."""
        if self.share >= _NOTEWORTHY:
            return None
        where = "parts of it on all sides are a guess"
        if self.unseen_toward is not None:
            toward = ", ".join(map(hundredths, self.unseen_toward))
            where = f"the side towards ({toward}) in the object's frame is a guess"
        guessed = int((self.by_ellipsoid < _HIDDEN).sum())
        return f"{100.0 * (1.0 - self.share):.0f} % of the surface was never seen: {where}" + (
            f", and so {are(guessed)} {guessed} of the ellipsoids" if guessed else ""
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class ModelResult:
    """A modelled body and its quality.

    `colors` is (K, 3) uint8 RGB, one per ellipsoid. `steps` has the result for each count, the last
    being the body itself. `iou_used` and `iou_unused` are float64, the silhouette IoU in each of
    `used_views` and `unused_views`; `native_used` and `native_unused` are the same views in the
    core's form. `range_samples` are the measured points, and `outline` that of a cloud that was
    seen from one viewpoint, as a view. `coverage` is what was seen of the surface, None where all
    of it is known. `notes` are messages for the user, and `doubts` those of them that say why the
    body may be wrong although its input fits it: what a target found, masks, poses, units, normals
    or the calibration. `targets` is how the object was marked. `seconds` is the duration of the
    whole call. `is_metric` is False if lengths are in an unknown unit, that of the capture.
    `wrong_by` is what makes the body, and all poses that are tracked with it, surely wrong.
    """

    body: Body
    colors: NDArray[np.uint8]
    steps: tuple[Step, ...]
    settings: ModelSettings | PaperSettings
    seconds: float
    method: str = "region"
    used_views: tuple[CaptureView, ...] = ()
    unused_views: tuple[CaptureView, ...] = ()
    iou_used: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    iou_unused: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    native_used: tuple[View, ...] = ()
    native_unused: tuple[View, ...] = ()
    range_samples: RangeSamples = NO_RANGE_SAMPLES
    outline: View | None = None
    coverage: Coverage | None = None
    targets: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    is_metric: bool = True
    wrong_by: str | None = None

    def __repr__(self) -> str:
        views = (len(self.used_views), len(self.unused_views))
        return said(
            ModelResult,
            counted(len(self.body), "ellipsoid"),
            f"fitness {self.fitness:.4f}",
            f"{views[0]} of {counted(sum(views), 'view')} used" if any(views) else None,
            counted(len(self.range_samples), "range sample") if len(self.range_samples) else None,
            self.verdict.word,
        )

    @property
    def fitness(self) -> float:
        """Return the fitness F of the body, at most 1."""
        return self.steps[-1].fitness

    @property
    def verdict(self) -> ModelVerdict:
        """Return whether the body is good, as its report begins."""
        views = (*self.used_views, *self.unused_views)
        ious = (*self.iou_used.tolist(), *self.iou_unused.tolist())
        named = [(view.name, iou) for view, iou in zip(views, ious, strict=True)]
        return rate_body(named, self.fitness, self.all_doubts)

    @cached_property
    def iou_by_count(self) -> IouByCount:
        """Return the mean silhouette IoU after each step; computed on first access."""
        return IouByCount(
            counts=np.array([step.count for step in self.steps], dtype=np.int64),
            used=_mean_ious(self.steps, self.native_used),
            unused=_mean_ious(self.steps, self.native_unused),
        )

    @cached_property
    def all_doubts(self) -> tuple[str, ...]:
        """Return all reasons why the body may be wrong, including views that it does not fit."""
        return (*self.doubts, *self._misfits())

    @property
    def all_notes(self) -> tuple[str, ...]:
        """Return all messages for the user, including those on poor fit and unseen surface."""
        unseen = None if self.coverage is None else self.coverage.note()
        return (*self.notes, *self._misfits(), *([] if unseen is None else [unseen]))

    def _misfits(self) -> list[str]:
        parts = (
            ("used", self.used_views, self.iou_used),
            ("unused", self.unused_views, self.iou_unused),
        )
        notes = [
            note
            for kind, views, ious in parts
            for note in misfit_notes(kind, [view.name for view in views], ious)
        ]
        is_coarse = len(self.body) >= self.settings.max_ellipsoids
        if not (self.used_views or self.unused_views):
            is_cloud = len(self.range_samples) > 0
            shape = shape_misfit_note(self.fitness, is_cloud=is_cloud, is_coarse=is_coarse)
            notes += [] if shape is None else [shape]
        elif len(self.range_samples):
            ious = np.concatenate([self.iou_used, self.iou_unused])
            depth = depth_misfit_note(ious, self.fitness, is_coarse=is_coarse)
            notes += [] if depth is None else [depth]
        return notes

    def doubted(self, doubts: Iterable[str | None]) -> "ModelResult":
        """Return the result with these doubts before its own; None is none."""
        told = tuple(doubt for doubt in doubts if doubt is not None)
        return replace(self, notes=(*told, *self.notes), doubts=(*told, *self.doubts))

    def save(self, path: str | Path, appearance: bytes | None = None) -> None:
        """Write the body, its colours and how it was made to a JSON file.

        `appearance` is the object's appearance, from `track.learn_appearance`. The same views,
        settings and seed give the same bytes, on any number of threads.

        Raises:
            OutputError: the file cannot be written.

        """
        made_by = MadeBy(
            servoid=__version__,
            seed=self.settings.seed,
            max_ellipsoids=self.settings.max_ellipsoids,
            delta=self.settings.delta,
            views=tuple(view.name for view in self.used_views),
            method=self.method,
            targets=self.targets,
            seen_points=len(self.range_samples),
        )
        seen = None
        if self.coverage is not None:
            seen = SeenEntry(
                share=self.coverage.share,
                unseen_toward=self.coverage.unseen_toward,
                by_ellipsoid=tuple(self.coverage.by_ellipsoid.tolist()),
            )
        save_body(
            path,
            self.body,
            self.colors,
            fitness=self.fitness,
            made_by=made_by,
            seen=seen,
            appearance=appearance,
            is_metric=self.is_metric,
        )


def _mean_ious(steps: tuple[Step, ...], views: tuple[View, ...]) -> NDArray[np.float64]:
    if not views:
        return np.full(len(steps), np.nan)
    return np.array([np.mean(silhouette_ious(step.body, views)) for step in steps])
