"""The assumed positions of the object at which each fitness is evaluated, and widths of peaks."""

from collections.abc import Iterator

import numpy as np

from servoid.pose.exact import Floats
from servoid_experiments.paper.maps.case import MapTrial

_PROFILE_STEP = 0.0005
_CREST_STEP, _CREST_ASIDE = 0.001, 0.003
_PEAK_REACH, _PEAK_STEP, _PEAK_ASIDE = 0.015, 0.0005, 0.001
_SHARE = 0.9  # of a peak


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


def width_at_share(
    places: Floats, values: Floats, floor: float = 0.0, share: float = _SHARE
) -> float | None:
    """Return the length over which values (N,) stay above a share of their peak, in metres.

    The share is counted from `floor`; between positions (N,) the values are interpolated linearly.
    None if the peak is not above the floor, or if the values are still above the share at an end.
    """
    top = int(np.argmax(values))
    least = floor + share * (values[top] - floor)
    if not values[top] > floor:
        return None
    ends = []
    for step in (-1, 1):
        at = top
        while 0 <= at < len(values) and values[at] >= least:
            at += step
        if not 0 <= at < len(values):
            return None
        inner = at - step
        part = (values[inner] - least) / (values[inner] - values[at])
        ends.append(places[inner] + part * (places[at] - places[inner]))
    return float(ends[1] - ends[0])


def peak_of(places: Floats, values: Floats) -> float:
    """Return where the values (N,) over even positions (N,) are highest.

    It is the mean of the positions within 1 % of the peak, so that noise at one hardly moves it.
    """
    best = float(values.max())
    high = values >= best - 0.01 * abs(best)
    top = int(np.argmax(values))
    first, last = top, top
    while first > 0 and high[first - 1]:
        first -= 1
    while last < len(values) - 1 and high[last + 1]:
        last += 1
    return float(0.5 * (places[first] + places[last]))
