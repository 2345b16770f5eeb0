"""Declares the result of tracking: an estimate for each observation, and their statistics."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Estimate, Pose
from servoid.brief import brief, said
from servoid.pose import exact
from servoid.words import by_kind, counted

# The minimum share of tracked observations for each word.
_VERDICTS = (("good", 0.95), ("rough", 0.7), ("poor", 0.0))
_LEAST_JUDGED = 5  # observations after the first, where the object was shown
# Of the observations in which an object is tracked: depth images that do not show it. Of ten drawn
# courses with right depth, none does; of late or drifting depth, 40 to 75 %.
_REJECTED, _LEAST_REJECTED = 0.2, 3
_REJECTS = "the depth image does not show the object where it is"
_STATE_WORDS = {"located": "searching, located"}
_NOWHERE = (
    "no image after the first confirms a pose: the views may differ too much from one to the next, "
    "the object may be another one or not in view, or the first pose is wrong; then give the right "
    "one with --start, or mark the object in the first observation with --target or a mask"
)


@dataclass(frozen=True, eq=False)
class Tracked:
    """One estimate, and its computing time.

    `index` counts the capture's observations; `seconds` is the computing time of the tracker,
    without reading the images; `notices` describe problems of the observation.
    """

    index: int
    estimate: Estimate
    seconds: float
    notices: tuple[str, ...] = ()

    __repr__ = brief

    @property
    def is_tracked(self) -> bool:
        """Return whether the images confirm the pose."""
        return self.estimate.status == "tracking"

    @property
    def state(self) -> str:
        """Return tracking, located, searching or lost.

        A located object is searched for, but its position is confirmed.
        """
        status = self.estimate.status
        return "located" if status == "searching" and self.estimate.located else status

    @property
    def words(self) -> str:
        """Return the state as the page and the video say it."""
        return _STATE_WORDS.get(self.state, self.state)

    @property
    def evolved(self) -> bool:
        """Return whether the body changed since the previous observation."""
        return self.estimate.evolved


@dataclass(frozen=True)
class Gap:
    """A gap in which the object was not tracked: first and last time, and number of estimates."""

    first_s: float
    last_s: float
    count: int


@dataclass(frozen=True, eq=False)
class TrackResult:
    """The track of one object.

    `smoothed` are the poses, world_from_object, after all later corrections. The first estimate is
    the start, which is slower than a step and excluded from all figures of speed. `body` is the
    evolved body at the end, at the newest pose; `appearance` is its appearance, for
    `Tracker.recall`; `notes` are sentences for the user; `starting_s` is the time from the first
    image to the first estimate, modelling included; `overlap` is the intersection over union of the
    body's outline and the masks of the first observation, their mean, None without masks. `doubts`
    are those of the notes that doubt the mask, the body or the pose of the start;
    `calibration_doubt` says how images contradict the cameras, by `capture.doubt_calibration`, or
    that one was moved, by `capture.doubt_moved`, and `rig_doubt` how they contradict the poses of
    the rig, by `capture.doubt_rig_poses`, or that all of it was moved, and `step_doubt` by how much
    one camera is behind another, or that depth images do not change, by `capture.doubt_step`.
    `edit_doubt` says that images were shifted or enlarged after they were taken, by
    `capture.doubt_edited`. `gone` says from when on a camera gave nothing, and `wrong_by` what
    makes all poses surely wrong from the first on.
    `is_metric` is False if the body's lengths are in an unknown unit.
    """

    name: str
    tracked: Sequence[Tracked]
    body: Body
    colors: NDArray[np.uint8] | None = None
    appearance: bytes | None = None
    notes: tuple[str, ...] = ()
    starting_s: float = 0.0
    smoothed: Sequence[Pose] = ()
    overlap: float | None = None
    doubts: tuple[str, ...] = ()
    calibration_doubt: str | None = None
    rig_doubt: str | None = None
    step_doubt: str | None = None
    wrong_by: str | None = None
    is_metric: bool = True
    edit_doubt: str | None = None
    gone: str | None = None

    def __repr__(self) -> str:
        return said(
            TrackResult,
            self.name,
            f"{self.tracked_count} of {counted(len(self), 'observation')} tracked",
            counted(len(self.body), "ellipsoid"),
            self.verdict,
        )

    def __len__(self) -> int:
        return len(self.tracked)

    def unconfirmed(self, since: int = 0) -> "TrackResult":
        """Return the track with no pose confirmed from the observation `since` on.

        Its poses in the world are surely wrong there.
        """
        told = [
            replace(one, estimate=one.estimate.in_doubt(located=False))
            if one.index >= since
            else one
            for one in self.tracked
        ]
        return replace(self, tracked=told)

    @property
    def estimates(self) -> list[Estimate]:
        """Return the estimates in the order of the observations."""
        return [one.estimate for one in self.tracked]

    @property
    def tracked_count(self) -> int:
        """Return the number of observations in which the images confirm the pose."""
        return sum(one.is_tracked for one in self.tracked)

    @property
    def tracked_share(self) -> float:
        """Return the share of observations in which the images confirm the pose, 0 to 1."""
        return self.tracked_count / len(self.tracked)

    @property
    def verdict(self) -> str:
        """Return whether the tracking is good, rough, poor or unknown, as its report begins."""
        # Good poses may be those of another object, or wrong by a wrong scale.
        is_doubted = self.doubts or self.capture_doubts
        allowed = _VERDICTS[1:] if is_doubted else _VERDICTS
        word = next(word for word, least in allowed if self.tracked_share >= least)
        return "unknown" if word == _VERDICTS[0][0] and self._is_short else word

    @property
    def capture_doubts(self) -> tuple[str, ...]:
        """Return what the images have against the cameras, their poses and their times."""
        return tuple(doubt for doubt, _ in self._capture_doubts)

    @property
    def depth_doubt(self) -> str | None:
        """Return that many depth images do not show the object where it is tracked, else None."""
        followed = [one for one in self.tracked[1:] if one.is_tracked]
        count = sum(any(_REJECTS in notice for notice in one.notices) for one in followed)
        if count < max(_LEAST_REJECTED, _REJECTED * len(followed)):
            return None
        return (
            f"in {count} of {counted(len(followed), 'observation')} in which the object is "
            "tracked, a depth image does not show it where it is, and is not used: depth images "
            "may be late or of another time, of another camera, or in a unit that is wrong or "
            "drifts; record each with its image, check their unit, or leave the depth out"
        )

    @property
    def notices_on_all(self) -> list[str]:
        """Return what puts all poses in doubt, as notices that go with each of them in files."""
        first = ["what was found at first is in doubt"] if self.doubts else []
        return [*first, *self.capture_notices]

    @property
    def capture_notices(self) -> list[str]:
        """Return what the images contradict of the capture: the cameras, the rig or the times."""
        return [words for _, words in self._capture_doubts]

    @property
    def _capture_doubts(self) -> list[tuple[str, str]]:
        """Return each doubt with the notice that goes with all poses."""
        kinds = (
            (self.calibration_doubt, "the calibration is in doubt"),
            (self.rig_doubt, "the poses of the rig are in doubt"),
            (self.step_doubt, "the cameras are out of step"),
            (self.edit_doubt, "the images were changed after they were taken"),
            (self.depth_doubt, "the depth images are in doubt"),
        )
        return [(doubt, words) for doubt, words in kinds if doubt is not None]

    @property
    def reasons(self) -> list[str]:
        """Return what speaks against the tracking: doubts, and observations not tracked."""
        away = len(self) - self.tracked_count
        reasons = self.notices_on_all
        if away:
            reasons.append(f"not tracked in {away} of {counted(len(self), 'observation')}")
        if self.verdict == "unknown":
            after = counted(len(self) - 1, "observation")
            reasons.append(f"only {after} after the first; {_LEAST_JUDGED} show how good it is")
        return reasons

    @property
    def _is_short(self) -> bool:
        return len(self) <= _LEAST_JUDGED

    def ball_at(self, index: int) -> tuple[NDArray[np.float64], float] | None:
        """Return a ball around the object in an observation: its centre in the world, its radius.

        It is where the estimate has the object, also while it is searched for; None if the
        observation was not followed.
        """
        found = next((one.estimate for one in self.tracked if one.index == index), None)
        if found is None:
            return None
        reach = exact.lengths(self.body.centers) + self.body.radii.max(axis=1)
        return np.array(found.world_from_object.translation), float(reach.max())

    @property
    def nowhere(self) -> str | None:
        """Return what to do if no image after the first confirms a pose; None if one does.

        None as well where a doubt says what to do: that of the calibration, of the poses of the
        rig, of the images, or a sure one.
        """
        doubts = (self.calibration_doubt, self.rig_doubt, self.edit_doubt, self.wrong_by)
        is_told = any(one is not None for one in doubts)
        return _NOWHERE if self.tracked_count <= 1 < len(self) and not is_told else None

    @property
    def gaps(self) -> list[Gap]:
        """List the gaps in which the object was searched for or lost."""
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
        """Return the tracker's computing time of each step, (N - 1,) float64, without the start."""
        return np.array([one.seconds for one in self.tracked[1:]], dtype=np.float64)

    @property
    def rate_hz(self) -> float:
        """Return the observations per second that the tracker can process; NaN without steps."""
        spent = self.step_seconds
        return float(1.0 / spent.mean()) if spent.size else float("nan")

    def step_percentile(self, percent: float) -> float:
        """Return a percentile of the step times, in seconds."""
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
        """Return the mean number of hypotheses scored per step; NaN without steps."""
        steps = self.tracked[1:]
        return float(np.mean([one.estimate.evaluations for one in steps])) if steps else np.nan

    @property
    def evolutions(self) -> int:
        """Return how many times the body changed."""
        return sum(one.evolved for one in self.tracked)

    @property
    def notices(self) -> list[tuple[str, int]]:
        """Count the notices, most frequent first; those that differ only in numbers are one kind.

        A whole video may be dark: that gives one line, with the range of each number, not one for
        each image.
        """
        said = ((notice, one) for one in self.tracked for notice in one.notices)
        return [(words, len(group)) for words, group in by_kind(said)]
