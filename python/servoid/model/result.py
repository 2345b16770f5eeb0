"""What modelling returns."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, ModelSettings, Step, View, __version__, silhouette_ious
from servoid.observe import CaptureView
from servoid.shape import MadeBy, save_body


@dataclass(frozen=True, eq=False)
class IouByCount:
    """How well the body of each count of ellipsoids fits the silhouettes.

    `counts` is (S,) int64; `used` and `unused` are (S,) float64, the mean over the views, NaN
    where there is no view.
    """

    counts: NDArray[np.int64]
    used: NDArray[np.float64]
    unused: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ModelResult:
    """A body modelled from views, and how good it is.

    `colors` is (K, 3) uint8 RGB, one an ellipsoid; `steps` has what was reached with each count,
    the last being the body itself; `iou_used` and `iou_unused` are float64, the silhouette IoU in
    each of `used_views` and `unused_views`; `native_used` and `native_unused` are the same views as
    the core sees them; `seconds` is the time that the whole call took.
    """

    body: Body
    colors: NDArray[np.uint8]
    steps: tuple[Step, ...]
    settings: ModelSettings
    used_views: tuple[CaptureView, ...]
    unused_views: tuple[CaptureView, ...]
    iou_used: NDArray[np.float64]
    iou_unused: NDArray[np.float64]
    seconds: float
    native_used: tuple[View, ...]
    native_unused: tuple[View, ...]

    @property
    def fitness(self) -> float:
        """Return the fitness F of the body, at most 1."""
        return self.steps[-1].fitness

    @cached_property
    def iou_by_count(self) -> IouByCount:
        """Return the mean silhouette IoU after each step; computed when first asked for."""
        return IouByCount(
            counts=np.array([step.count for step in self.steps], dtype=np.int64),
            used=_mean_ious(self.steps, self.native_used),
            unused=_mean_ious(self.steps, self.native_unused),
        )

    def save(self, path: str | Path) -> None:
        """Write the body, its colours and how it was made to a JSON file.

        The same views, settings and seed give the same bytes, on any number of threads.

        Raises:
            OutputError: the file cannot be written.

        """
        made_by = MadeBy(
            servoid=__version__,
            seed=self.settings.seed,
            max_ellipsoids=self.settings.max_ellipsoids,
            delta=self.settings.delta,
            views=tuple(view.name for view in self.used_views),
        )
        save_body(path, self.body, self.colors, fitness=self.fitness, made_by=made_by)


def _mean_ious(steps: tuple[Step, ...], views: tuple[View, ...]) -> NDArray[np.float64]:
    if not views:
        return np.full(len(steps), np.nan)
    return np.array([np.mean(silhouette_ious(step.body, views)) for step in steps])
