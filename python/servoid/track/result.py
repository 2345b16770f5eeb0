"""What tracking returns: an estimate for each observation, and what they amount to."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Estimate, Pose

_NUMBER = re.compile(r"\d+(\.\d+)?")


@dataclass(frozen=True, eq=False)
class Tracked:
    """One estimate, and what it cost.

    `index` counts the capture's observations; `seconds` is the time that the tracker took, without
    reading the images; `notices` say what was wrong with the observation.
    """

    index: int
    estimate: Estimate
    seconds: float
    notices: tuple[str, ...] = ()

    @property
    def is_tracked(self) -> bool:
        """Say if the images confirm the pose."""
        return self.estimate.status == "tracking"

    @property
    def evolved(self) -> bool:
        """Say if the body changed since the observation before."""
        return self.estimate.evolved


@dataclass(frozen=True)
class Gap:
    """A stretch in which the object was not tracked: its first and last time, and how many."""

    first_s: float
    last_s: float
    count: int


@dataclass(frozen=True, eq=False)
class TrackResult:
    """The track of one object.

    `smoothed` are the poses, world_from_object, after all corrections that were found later.
    The first estimate is the start, which is slower than a step, and which no figure of speed
    counts. `body` is the body at the end, as far as it evolved, at the newest pose;
    `appearance` is what it looks like, as `Tracker.recall` takes it; `notes` are sentences that
    a user should read; `starting_s` is the time from the first image to the first estimate,
    modelling included.
    """

    name: str
    tracked: Sequence[Tracked]
    body: Body
    colors: NDArray[np.uint8] | None = None
    appearance: bytes | None = None
    notes: tuple[str, ...] = ()
    starting_s: float = 0.0
    smoothed: Sequence[Pose] = ()

    def __len__(self) -> int:
        return len(self.tracked)

    @property
    def estimates(self) -> list[Estimate]:
        """Return the estimates in the order of the observations."""
        return [one.estimate for one in self.tracked]

    @property
    def tracked_count(self) -> int:
        """Return in how many observations the images confirm the pose."""
        return sum(one.is_tracked for one in self.tracked)

    @property
    def tracked_share(self) -> float:
        """Return in which share of the observations the images confirm the pose, 0 to 1."""
        return self.tracked_count / len(self.tracked)

    @property
    def gaps(self) -> list[Gap]:
        """List the stretches in which the object was searched or lost."""
        gaps: list[Gap] = []
        before = True
        for one in self.tracked:
            if not one.is_tracked:
                now, first, count = one.estimate.time_s, one.estimate.time_s, 1
                if not before:
                    last = gaps.pop()
                    first, count = last.first_s, last.count + 1
                gaps.append(Gap(first, now, count))
            before = one.is_tracked
        return gaps

    @cached_property
    def step_seconds(self) -> NDArray[np.float64]:
        """Return the tracker's own time of each step, (N - 1,) float64, the start left out."""
        return np.array([one.seconds for one in self.tracked[1:]], dtype=np.float64)

    @property
    def rate_hz(self) -> float:
        """Return how many images a second the tracker keeps up with; NaN without any step."""
        spent = self.step_seconds
        return float(1.0 / spent.mean()) if spent.size else float("nan")

    def step_percentile(self, percent: float) -> float:
        """Return the time, in seconds, that so many per cent of the steps stay below."""
        spent = self.step_seconds
        return float(np.percentile(spent, percent)) if spent.size else float("nan")

    @property
    def stage_seconds(self) -> dict[str, float]:
        """Return the mean time of each stage of a step, in seconds, in the order of the stages."""
        steps = self.tracked[1:]
        stages = {stage: 0.0 for one in steps for stage in one.estimate.seconds}
        for one in steps:
            for stage, seconds in one.estimate.seconds.items():
                stages[stage] += seconds / len(steps)
        return stages

    @property
    def evaluations(self) -> float:
        """Return how many hypotheses a step scored on average; NaN without any step."""
        steps = self.tracked[1:]
        return float(np.mean([one.estimate.evaluations for one in steps])) if steps else np.nan

    @property
    def evolutions(self) -> int:
        """Return how many times the body changed."""
        return sum(one.evolved for one in self.tracked)

    @property
    def notices(self) -> list[tuple[str, int]]:
        """Count the notices, the most frequent first; of those that differ by numbers, the first.

        A whole video may be dark: one line says so, not one for each image.
        """
        counts: Counter[str] = Counter()
        examples: dict[str, str] = {}
        for notice in (notice for one in self.tracked for notice in one.notices):
            kind = _NUMBER.sub("0", notice)
            examples.setdefault(kind, notice)
            counts[kind] += 1
        return [(examples[kind], count) for kind, count in counts.most_common()]
