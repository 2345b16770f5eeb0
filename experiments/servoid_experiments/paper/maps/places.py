"""The assumed positions of the object at which each fitness is evaluated."""

from collections.abc import Iterator

import numpy as np

from servoid.pose.exact import Floats
from servoid_experiments.paper.maps.case import MapTrial

_PROFILE_STEP = 0.0005
_CREST_STEP, _CREST_ASIDE = 0.001, 0.003
_PEAK_REACH, _PEAK_STEP, _PEAK_ASIDE = 0.015, 0.0005, 0.001


class Places:
    """Assumed positions of the object in the hand's frame, as rows (N, 3)."""

    def __init__(self, trial: MapTrial) -> None:
        self.truth = np.array(trial.place)
        middle = np.array(trial.middle)
        self.axes = [np.linspace(m - trial.half, m + trial.half, trial.count) for m in middle]
        count = 2 * round(trial.half / _PROFILE_STEP) + 1
        self.steps = [np.linspace(m - trial.half, m + trial.half, count) for m in middle]
        self.lines = list(self._lines())
        self.crest_depths = self.steps[2][:: round(_CREST_STEP / _PROFILE_STEP)]
        self.crest = self._around(self.crest_depths, _CREST_ASIDE, _CREST_STEP)
        steps = round(_PEAK_REACH / _PEAK_STEP)
        self.peak_depths = self.truth[2] + _PEAK_STEP * np.arange(-steps, steps + 1)
        self.peak = self._around(self.peak_depths, _PEAK_ASIDE, _PEAK_STEP)

    def box(self) -> Floats:
        """Return the whole box, x slowest and z fastest."""
        grid = np.meshgrid(*self.axes, indexing="ij")
        return np.stack(grid, axis=-1).reshape(-1, 3)

    def _lines(self) -> Iterator[Floats]:
        for axis, steps in enumerate(self.steps):
            line = np.tile(self.truth, (len(steps), 1))
            line[:, axis] = steps
            yield line

    def _around(self, depths: Floats, aside: float, step: float) -> Floats:
        """Return positions around the line of sight through the truth, depth by depth."""
        count = round(aside / step)
        off = step * np.arange(-count, count + 1)
        beside = np.stack([*np.meshgrid(off, off, indexing="ij"), np.zeros((len(off),) * 2)], -1)
        sight = depths[:, None] * (self.truth / self.truth[2])
        return (sight[:, None] + beside.reshape(1, -1, 3)).reshape(-1, 3)
